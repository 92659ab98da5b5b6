"""Structured pieces of sheet, joined where their points coincide."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from chladni.model.assembly import Assembly, Shells
from chladni.model.properties import Isotropic, Part, ShellSection

from ..plates import grid, merged


@dataclass(frozen=True, eq=False)
class Piece:
    """A meshed piece of one part: points (n, 3) [m] and cells (m, 4) of rows of them."""

    part: str
    points: np.ndarray
    cells: np.ndarray


def rectangle(
    part: str, corner: Sequence[float], u: np.ndarray, v: np.ndarray, axes: str = "xy"
) -> Piece:
    """A flat piece over the lines u and v [m] along two axes of the frame, from a corner."""
    flat, cells = grid(u, v)
    points = np.tile(np.asarray(corner, dtype=float), (len(flat), 1))
    for column, axis in zip(flat.T, axes, strict=False):
        points[:, "xyz".index(axis)] += column
    return Piece(part, points, cells)


def stops(places: Sequence[float], h: float) -> np.ndarray:
    """Mesh lines through all the places, steps of about h between them [m].

    >>> stops([0.0, 0.1, 0.15], 0.05)
    array([0.  , 0.05, 0.1 , 0.15])
    """
    steps = [np.linspace(a, b, max(1, round((b - a) / h)) + 1)[1:] for a, b in pairwise(places)]
    return np.concatenate([[places[0]], *steps])


def of_pieces(pieces: Sequence[Piece], gauges: Mapping[str, tuple[float, Isotropic]]) -> Assembly:
    """Shells of all pieces; a part for each gauge (thickness [m], material), in their order."""
    names = list(gauges)
    start = np.cumsum([0, *(len(p.points) for p in pieces)])
    cells = np.concatenate([p.cells + n for p, n in zip(pieces, start[:-1], strict=True)])
    points, nodes = merged(np.concatenate([p.points for p in pieces]), cells, 1e-6)
    used, flat = np.unique(nodes, return_inverse=True)
    points, nodes = points[used], flat.reshape(-1, 4)
    part = np.concatenate([np.full(len(p.cells), names.index(p.part)) for p in pieces])
    gauge = np.array([gauges[n][0] for n in names])[part]
    side = points[nodes[:, 1]] - points[nodes[:, 0]]
    parts = tuple(
        Part(k, n, ShellSection(t, m, m)) for k, (n, (t, m)) in enumerate(gauges.items(), start=1)
    )
    shells = Shells(
        np.arange(1, len(nodes) + 1),
        nodes,
        part,
        np.repeat(gauge[:, None], 4, axis=1),
        side / np.linalg.norm(side, axis=1, keepdims=True),
        np.zeros(len(nodes)),
    )
    return Assembly(np.arange(1, len(points) + 1), points, parts, shells)
