"""Places of one mesh on another: the nearest shell of the same part, or the nearest grid."""

from dataclasses import dataclass

import numpy as np

from chladni.errors import ModelError
from chladni.geometry.nearest import ShellSurface
from chladni.geometry.sampling import nearest_points
from chladni.model.assembly import Assembly


@dataclass(frozen=True, eq=False)
class Spots:
    """Places and directions where a structure is measured, driven or attached."""

    labels: tuple[str, ...]
    grids: np.ndarray  # (k,) int: of the deck, 0 where the place is not a grid
    points: np.ndarray  # (k, 3) [m]
    directions: np.ndarray  # (k, 3) unit vectors
    parts: tuple[str, ...]  # the part of each place

    def __len__(self) -> int:
        return len(self.labels)

    def only(self, chosen: np.ndarray) -> "Spots":
        """The chosen places."""
        pick = [int(k) for k in chosen]
        return Spots(
            tuple(self.labels[k] for k in pick),
            self.grids[pick],
            self.points[pick],
            self.directions[pick],
            tuple(self.parts[k] for k in pick),
        )


@dataclass(frozen=True, eq=False)
class MeshTransfer:
    """Motion of places as a weighted mean of points: rows (k, 3) int, weights (k, 3)."""

    rows: np.ndarray
    weights: np.ndarray


def mesh_transfer(assembly: Assembly, spots: Spots) -> MeshTransfer:
    """The spots as weighted means of points of this mesh."""
    rows = np.zeros((len(spots), 3), dtype=np.int64)
    weights = np.zeros((len(spots), 3))
    for name in dict.fromkeys(spots.parts):
        mine = np.array([p == name for p in spots.parts])
        p = assembly.part(name)
        if (assembly.shells.part == p).any():
            closest = ShellSurface.of(assembly, name).closest_points(spots.points[mine])
            rows[mine], weights[mine] = closest.nodes, closest.weight
        else:
            rows[mine] = nearest_rows(assembly, p, spots.points[mine])[:, None]
            weights[mine] = [1.0, 0.0, 0.0]
    return MeshTransfer(rows, weights)


def still_there(article: Assembly, whole: Assembly, spots: Spots) -> MeshTransfer:
    """The spots on an article, at the same points as before an effect was hidden in it.

    A hidden effect may make new parts out of a sheet.  A sensor on such a part is not on the
    nearest shell of the remaining sheet.

    Raises
    ------
    ModelError
        If the points have changed, so that no spot can be found again.
    """
    n = len(whole.points)
    if len(article.points) < n or not np.array_equal(article.points[:n], whole.points):
        raise ModelError("what is hidden in an article has moved its points")
    return mesh_transfer(whole, spots)


def rows_of_part(assembly: Assembly, p: int) -> np.ndarray:
    """Rows of the points of a part's shells or beams."""
    shells = assembly.shells.nodes[assembly.shells.part == p]
    beams = assembly.beams.nodes[assembly.beams.part == p]
    return np.unique(np.concatenate([shells.ravel(), beams.ravel()]))


def nearest_rows(assembly: Assembly, p: int, points: np.ndarray) -> np.ndarray:
    """Row of the part's point nearest to each place (k,)."""
    rows = rows_of_part(assembly, p)
    return np.asarray(rows[nearest_points(assembly.points[rows], points)])
