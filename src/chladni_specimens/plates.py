"""Small generated specimens: a plate with or without a hole, a folded panel, a box."""

import numpy as np

from chladni.model.assembly import Assembly, Shells, Solids
from chladni.model.properties import Isotropic, Material, Part, ShellSection, SolidSection

STEEL = Isotropic(E=210e9, nu=0.3, rho=7850.0)


def plate(
    length: float,
    width: float,
    nx: int,
    ny: int,
    t: float,
    material: Material = STEEL,
    hole: float | tuple[float, float, float] | None = None,
) -> Assembly:
    """A flat plate in z = 0 with its corner at the origin.

    Parameters
    ----------
    length, width : along x and y [m]
    nx, ny : elements along x and y
    t : thickness [m]
    hole : radius of a hole in the middle, or (x, y, radius) [m]
        Elements whose middle lies in the hole are left out.

    >>> len(plate(1.0, 0.5, 4, 2, 1e-3).shells)
    8
    """
    points, nodes = grid(np.linspace(0, length, nx + 1), np.linspace(0, width, ny + 1))
    if hole is not None:
        x, y, r = hole if isinstance(hole, tuple) else (length / 2, width / 2, hole)
        middle = points[nodes].mean(axis=1)
        nodes = nodes[np.hypot(middle[:, 0] - x, middle[:, 1] - y) >= r]
    return sheet(points, nodes, t, material)


def solid_plate(
    length: float, width: float, t: float, nx: int, ny: int, material: Isotropic = STEEL
) -> Assembly:
    """A flat plate of hexahedra, one of them through its thickness, between z = 0 and t.

    Parameters
    ----------
    length, width, t : along x, y and z [m]
    nx, ny : elements along x and y

    >>> len(solid_plate(1.0, 0.5, 0.1, 4, 2).solids[0])
    8
    """
    points, below = grid(np.linspace(0, length, nx + 1), np.linspace(0, width, ny + 1))
    nodes = np.hstack([below, below + len(points)])
    n, section = len(nodes), SolidSection(material)
    return Assembly(
        np.arange(2 * len(points)) + 1, np.concatenate([points, points + np.array([0.0, 0.0, t])]),
        (Part(1, "block", section),),
        solids=(Solids(np.arange(n) + 1, nodes, np.zeros(n, int)),),
    )  # fmt: skip


def folded_panel(
    length: float = 0.6,
    width: float = 0.3,
    depth: float = 0.03,
    rise: float = 0.01,
    h: float = 0.02,
    t: float = 1e-3,
    material: Material = STEEL,
) -> Assembly:
    """A panel that bulges by ``rise`` with its two long edges folded down by ``depth``.

    Two parts: "panel" (id 1) and "flanges" (id 2). Elements of the panel are slightly warped.

    Parameters
    ----------
    length, width, depth, rise : [m]
    h : wanted element size [m]
    """
    nx, ny, nz = (max(2, round(size / h)) for size in (length, width, depth))
    s = np.concatenate(
        [
            np.linspace(-depth, 0, nz + 1)[:-1],
            np.linspace(0, width, ny + 1),
            np.linspace(width, width + depth, nz + 1)[1:],
        ]
    )  # along the developed width
    points, nodes = grid(np.linspace(0, length, nx + 1), s)
    x, s = points[:, 0], points[:, 1]
    y = np.clip(s, 0, width)
    points = np.column_stack([x, y, bulge(x / length, y / width, rise) - np.abs(s - y)])
    middle = s[nodes].mean(axis=1)
    part = ((middle < 0) | (middle > width)).astype(np.int64)
    return sheet(points, nodes, t, material, part=part, names=("panel", "flanges"))


def bulge(x: np.ndarray, y: np.ndarray, rise: float) -> np.ndarray:
    """Height of the folded panel's sheet at shares x, y of its length and width [m]."""
    return np.asarray(4 * rise * y * (1 - y) * (1 - (2 * x - 1) ** 2 / 2))


def box(
    length: float = 0.3,
    width: float = 0.2,
    height: float = 0.1,
    h: float = 0.02,
    t: float = 1e-3,
    material: Material = STEEL,
) -> Assembly:
    """A closed box of six plates, one part per pair of walls: "x walls", "y walls", "z walls"."""
    size = (length, width, height)
    counts = [max(1, round(edge / h)) for edge in size]
    patches: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    part: list[np.ndarray] = []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        flat, cells = grid(
            np.linspace(0, size[a], counts[a] + 1), np.linspace(0, size[b], counts[b] + 1)
        )
        for place, outward in ((0.0, cells[:, ::-1]), (size[axis], cells)):
            wall = np.full((len(flat), 3), place)
            wall[:, a], wall[:, b] = flat[:, 0], flat[:, 1]
            faces.append(outward + sum(len(p) for p in patches))
            patches.append(wall)
            part.append(np.full(len(cells), axis))
    points, nodes = merged(np.concatenate(patches), np.concatenate(faces), 1e-6 * min(size))
    names = ("x walls", "y walls", "z walls")
    return sheet(points, nodes, t, material, part=np.concatenate(part), names=names)


def sheet(
    points: np.ndarray,
    nodes: np.ndarray,
    t: float | np.ndarray,
    material: Material = STEEL,
    part: np.ndarray | None = None,
    names: tuple[str, ...] = ("plate",),
    supports: np.ndarray | None = None,
) -> Assembly:
    """Shells of one material over given points; points without shells are dropped.

    Parameters
    ----------
    points : (n, 3)
    nodes : (m, 4) or (m, 3) int   rows of points
    t : thickness, one or (m,) or (m, 4) [m]
    part : (m,) int                position in ``names``
    supports : (k, 2) int          (row of points, component 1-6), rows before dropping
    """
    nodes = np.asarray(nodes, dtype=np.int64)
    if nodes.shape[1] == 3:
        nodes = nodes[:, [0, 1, 2, 2]]
    used, flat = np.unique(nodes, return_inverse=True)
    thickness = np.array(np.broadcast_to(np.asarray(t, float).T, nodes.shape[::-1]).T)
    supports = np.zeros((0, 2), np.int64) if supports is None else np.asarray(supports)
    held = supports[np.isin(supports[:, 0], used)]
    section = ShellSection(float(thickness.mean()), material, material)
    return Assembly(
        ids=np.arange(1, len(used) + 1),
        points=np.asarray(points, float)[used],
        parts=tuple(Part(k + 1, name, section) for k, name in enumerate(names)),
        shells=Shells(
            ids=np.arange(1, len(nodes) + 1),
            nodes=flat.reshape(nodes.shape),
            part=np.zeros(len(nodes), np.int64) if part is None else part,
            thickness=thickness,
            axis=np.asarray(points, float)[nodes[:, 1]] - np.asarray(points, float)[nodes[:, 0]],
            offset=np.zeros(len(nodes)),
        ),
        supports=np.column_stack([np.searchsorted(used, held[:, 0]), held[:, 1]]),
    )


def grid(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) in z = 0 over the lines u and v, and quadrilaterals (m, 4) facing +z."""
    at = np.arange(len(u) * len(v)).reshape(len(u), len(v))
    points = np.stack([*np.meshgrid(u, v, indexing="ij"), np.zeros(at.shape)], axis=-1)
    cells = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1)
    return points.reshape(-1, 3), cells.reshape(-1, 4)


def merged(points: np.ndarray, nodes: np.ndarray, within: float) -> tuple[np.ndarray, np.ndarray]:
    """Merge points that coincide within a distance; the cells keep their order."""
    key = np.round(points / within).astype(np.int64)
    _, first, back = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return points[first], back.reshape(-1)[nodes]
