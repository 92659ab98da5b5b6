"""Hidden effects of articles by Kratos: geometry and states that our own elements do not make."""

from dataclasses import replace

import numpy as np

from chladni.effects.calibration_parameters import value
from chladni.errors import ModelError
from chladni.geometry.facets import point_normals
from chladni.model.added_points import with_points
from chladni.model.assembly import Assembly, Shells, appended
from chladni.model.ground_springs import with_ground_bushes

from .hidden import Hidden, Site
from .hidden_kinds import Kind, disc, sheet_of
from .kratos import Stretched

STRAIGHT = 0.9  # cosine between two edges of a line of the mesh, at least
EDGES = 4  # of a seam or a rib, at least


def seam(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A cut through a sheet along a line of the mesh: the points between its tips are doubled."""
    a, length = site.article, float(rng.uniform(0.1, 0.16)) * site.size * size
    line = _line(site, rng, length, _outline(a))
    inner, n = line[1:-1], point_normals(a.points, a.shells.nodes)
    grown, copies = with_points(a, a.points[inner])
    nodes, middle = a.shells.nodes.copy(), a.points[a.shells.nodes].mean(axis=1)
    for before, row, after, copy in zip(line, inner, line[2:], copies, strict=False):
        across = np.cross(n[row], a.points[after] - a.points[before])
        beyond = (middle - a.points[row]) @ across > 0
        nodes[(a.shells.nodes == row) & beyond[:, None]] = copy
    cut = replace(grown, shells=replace(grown.shells, nodes=nodes))
    truth = {"point_m": a.points[line].mean(axis=0).tolist(), "length_m": _length(a, line)}
    return Hidden(cut, truth)


def rib(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """An upright strip on a sheet along a line of the mesh, as thick as the sheet."""
    a = site.article
    length = float(rng.uniform(0.2, 0.35)) * site.size
    line = _line(site, rng, length, a.supports[:, 0])
    part = int(a.shells.part[(a.shells.nodes == line[0]).any(axis=1)][0])
    t = float(a.thickness()[a.shells.part == part].mean())
    height = float(rng.uniform(2.0, 3.0)) * t * size**0.5
    n = point_normals(a.points, a.shells.nodes)[line]
    grown, top = with_points(a, a.points[line] + height * n)
    nodes = np.column_stack([line[:-1], line[1:], top[1:], top[:-1]])
    new = replace(a.parts[part], id=1 + max(p.id for p in a.parts), name="rib")
    shells: Shells = appended(
        a.shells, ids=int(a.shells.ids.max()) + 1 + np.arange(len(nodes)), nodes=nodes,
        part=np.full(len(nodes), len(a.parts)), thickness=np.full((len(nodes), 4), t),
        axis=a.points[line[1:]] - a.points[line[:-1]],
    )  # fmt: skip
    made = replace(grown, parts=(*a.parts, new), shells=shells)
    truth = {
        "point_m": a.points[line].mean(axis=0).tolist(), "height_m": height,
        "ends_m": a.points[[line[0], line[-1]]].tolist(),
    }  # fmt: skip
    return Hidden(made, truth)


def _outline(a: Assembly) -> np.ndarray:
    """Rows of points at edges of one shell alone."""
    pairs, count = np.unique(np.sort(_edges(a.shells.nodes), axis=1), axis=0, return_counts=True)
    return np.unique(pairs[count == 1])


def _edges(cells: np.ndarray) -> np.ndarray:
    """Pairs (4 m, 2) of neighbours round every shell."""
    return np.concatenate([cells[:, [k, (k + 1) % 4]] for k in range(4)])


def _line(site: Site, rng: np.random.Generator, length: float, barred: np.ndarray) -> np.ndarray:
    """Rows of points along edges of one sheet, as straight as the mesh, from end to end."""
    a = site.article
    for _ in range(50):
        part = a.part(site.part(rng))
        cells = a.shells.nodes[a.shells.part == part]
        edges = np.concatenate([_edges(cells), _edges(cells)[:, ::-1]])
        row = int(rng.choice(np.setdiff1d(cells, barred)))
        aside = rng.choice(edges[edges[:, 0] == row, 1])
        one = _walk(a.points, edges, [row, int(aside)], length / 2)
        back = _walk(a.points, edges, [int(aside), row], length / 2 + _length(a, one[:2]))
        line = np.array([*one[:1:-1], *back])
        if len(line) > EDGES and not np.isin(line, barred).any():
            return line
    raise ModelError("the article has no room for a line of that length")


def _walk(points: np.ndarray, edges: np.ndarray, line: list[int], length: float) -> list[int]:
    """Go on along the straightest edge until the length is reached or the sheet ends."""
    walked = float(np.linalg.norm(points[line[1]] - points[line[0]]))
    while walked < length:
        ahead = np.unique(edges[edges[:, 0] == line[-1], 1])
        steps, last = points[ahead] - points[line[-1]], points[line[-1]] - points[line[-2]]
        cosine = steps @ last / np.linalg.norm(steps, axis=1) / np.linalg.norm(last)
        if cosine.max() < STRAIGHT:
            break
        line.append(int(ahead[cosine.argmax()]))
        walked += float(np.linalg.norm(steps[cosine.argmax()]))
    return line


def _length(a: Assembly, line: np.ndarray | list[int]) -> float:
    return float(np.linalg.norm(np.diff(a.points[line], axis=0), axis=1).sum())


def doubler(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A disc of a sheet that is thicker by 10 to 20 % at size 1."""
    mine, truth = disc(site, rng)
    thicker = 1 + float(rng.uniform(0.1, 0.2)) * size
    shells = site.article.shells
    thickness = np.where(mine[:, None], thicker, 1.0) * shells.thickness
    made = replace(site.article, shells=replace(shells, thickness=thickness))
    return Hidden(made, {**truth, "thicker": thicker})


def soft_clamp(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A clamp on springs along its line, or along half of it.

    A rotation spring of k [N m/rad per m] acts at every held point, and a translation spring k / l²
    with l of 1.5 to 10 mm.
    """
    a = site.article
    held = np.unique(a.supports[:, 0])
    if not len(held):
        raise ModelError("the article has no clamp")
    pairs = np.sort(_edges(a.shells.nodes), axis=1)
    pairs = np.unique(pairs[np.isin(pairs, held).all(axis=1)], axis=0)
    share = np.repeat(np.linalg.norm(a.points[pairs[:, 1]] - a.points[pairs[:, 0]], axis=1) / 2, 2)
    width = np.bincount(pairs.ravel(), share, len(a.points))[held]
    away = np.linalg.norm(a.points[held] - a.points[rng.choice(held)], axis=1)
    soft = away <= (np.inf if rng.integers(2) else np.median(away))
    t = float(a.thickness().mean())
    k = sheet_of(a, 0).E * t**3 / 12 / (0.02 * site.size) / size
    l2 = float(np.exp(rng.uniform(np.log(1.5e-3), np.log(10e-3)))) ** 2
    each = width[soft, None] * np.repeat([k / l2, k], 3)
    stay = a.supports[~np.isin(a.supports[:, 0], held[soft])]
    axes = np.tile(np.eye(3)[0], (int(soft.sum()), 1))
    made = with_ground_bushes(replace(a, supports=stay), held[soft], axes, each)
    truth = {
        "rotation N m/rad per m": k, "translation N/m per m": k / l2,
        "share of the line": float(soft.mean()), "point_m": a.points[held[soft]].mean(axis=0),
    }  # fmt: skip
    return Hidden(made, truth)


def stretched(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A flat sheet that its frame stretches or squeezes alike in all directions of its plane."""
    a = site.article
    part = a.parts[0]
    strain = float(rng.choice([-1, 1]) * rng.uniform(1e-5, 3e-5)) * size
    made = Stretched(**vars(a), moved=strain * (a.points - a.points.mean(axis=0)))
    m = sheet_of(a, 0)
    N = m.E * value(part, "t") / (1 - m.nu) * strain
    return Hidden(made, {"value": N, "N along": N, "N across": N, "part": part.name})


BY_KRATOS: dict[str, Kind] = {
    "seam": seam,
    "rib": rib,
    "doubler": doubler,
    "soft-clamp": soft_clamp,
    "stretched-sheet": stretched,
}
