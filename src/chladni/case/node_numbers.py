"""Numbers of a recording's nodes: those of the deck's grids, or of channels.

Numbers that coincide prove nothing: decks and recordings both begin at 1. Coordinates decide where
the recording has them. Without them, labels that count 1, 2, 3, ... number channels, and other
labels number grids. Node 0 of a recording says that it does not know the place.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ..geometry.nearest import ShellSurface
from ..model.assembly import Assembly

OFF = 0.02  # of the structure's size: a node farther from the grid of its number is another one
SCALES = {"m": 1.0, "mm": 1e-3, "inch": 0.0254, "cm": 0.01, "units 1000 times as large": 1e3}
ENOUGH, _LOOKED = 3, 200  # least nodes for a scale or a count, most that are used
NO_NODE = "0"


def size_of(made: Assembly) -> float:
    """Diagonal of the box about the structure [m]."""
    return float(np.linalg.norm(np.ptp(made.points, axis=0)))


def scaled(made: Assembly, nodes: Mapping[int, np.ndarray]) -> tuple[str, dict[int, np.ndarray]]:
    """Unit in which nodes lie on the deck, and the nodes in metres.

    Metres unless another unit is far better: at the grids, else the largest on its surface.
    """
    if len(nodes) < ENOUGH:
        return "m", dict(nodes)
    places, size = np.array(list(nodes.values())), size_of(made)
    off = {unit: _off(made, places * factor, size) for unit, factor in SCALES.items()}
    unit = min(off, key=lambda unit: off[unit])
    if off[unit] >= OFF and len((surface := ShellSurface.whole(made)).nodes):  # coarse meshes
        on = {u: _off_surface(surface, places * SCALES[u], size) for u in off if off[u] < np.inf}
        off["m"] = min(off["m"], on.get("m", np.inf))
        unit = max((u for u in on if on[u] < OFF), key=lambda u: SCALES[u], default="m")
    elif off[unit] >= OFF:
        unit = "m"
    unit = unit if off["m"] > 5 * OFF else "m"
    return unit, {n: SCALES[unit] * x for n, x in nodes.items()}


def _off(made: Assembly, places: np.ndarray, size: float) -> float:
    """Median distance from the nearest grid over the structure's size; a mere dot is far off."""
    if _dot(places, size):
        return np.inf
    away = [float(np.linalg.norm(made.points - x, axis=1).min()) for x in places[:_LOOKED]]
    return float(np.median(away)) / size


def _off_surface(surface: ShellSurface, places: np.ndarray, size: float) -> float:
    """Median distance from the surface over the structure's size."""
    return float(np.median(surface.closest_points(places[:_LOOKED]).distance)) / size


def _dot(places: np.ndarray, size: float) -> bool:
    return float(np.linalg.norm(np.ptp(places, axis=0))) < OFF * size


def on_structure(made: Assembly, nodes: Mapping[int, np.ndarray]) -> bool:
    """True if nodes [m] are places on the structure; several at one point are not."""
    places, size = np.array(list(nodes.values())), size_of(made)
    if not len(places) or (len(places) > 1 and _dot(places, size)):
        return False
    away = [float(np.linalg.norm(made.points - x, axis=1).min()) for x in places[:_LOOKED]]
    return float(np.median(away)) <= 5 * OFF * size


def numbers_agree(made: Assembly, nodes: Mapping[int, np.ndarray]) -> bool:
    """True if nodes [m] lie where the grids of their numbers do, or no grid has these numbers."""
    known = set(made.ids.tolist())
    ids = [n for n in nodes if n in known]
    if not ids:
        return True
    places = np.array([nodes[n] for n in ids])
    away = np.linalg.norm(made.points[made.rows(ids)] - places, axis=1)
    return bool(np.median(away) <= OFF * size_of(made))


def off_its_grid(made: Assembly, node: int, nodes: Mapping[int, np.ndarray]) -> bool:
    """True if a node [m] lies elsewhere than the grid of its number."""
    row = np.flatnonzero(made.ids == node)
    if node not in nodes or not len(row):
        return False
    return float(np.linalg.norm(made.points[row[0]] - nodes[node])) > OFF * size_of(made)


def number_channels(
    outputs: Sequence[str], inputs: Sequence[str], ids: Iterable[int] = (), least: int = 1
) -> bool:
    """True if the labels of a recording number channels: their nodes are 1, 2, 3, ... to the last.

    A recording has one scheme of numbers. Both its ends together show it, else the end of more
    nodes: a single sensor at 1 proves nothing where a hammer roves over 5, 9 and 20. Nodes that
    are all grids of the deck, and all grids of the deck, are grids.

    Parameters
    ----------
    ids : of the deck's grids
    least : number of nodes from which they count

    >>> number_channels(["2:+Z", "3:+Z"], ["1:+Z"]), number_channels(["2:+Z", "4:+Z"], ["2:+Z"])
    (True, False)
    >>> number_channels(["1:+Z"], ["5:+Z", "9:+Z"]), number_channels(["1:+Z", "2:+Z"], ["9:+Z"])
    (False, True)
    >>> number_channels(["1:+Z", "2:+Z"], ["1:+Z"], ids=[1, 2])
    False
    """
    ends = [_nodes(outputs), _nodes(inputs)]
    both, more = ends[0] | ends[1], max(ends, key=len)
    if both == {str(id) for id in ids}:
        return False
    return _count(both, least) or _count(more, max(least, 2))


def _nodes(labels: Iterable[str]) -> set[str]:
    """Nodes of labels, without those that name no place."""
    return {label.partition(":")[0].strip() for label in labels} - {"base", NO_NODE}


def _count(nodes: set[str], least: int) -> bool:
    return len(nodes) >= least and nodes == {str(k + 1) for k in range(len(nodes))}
