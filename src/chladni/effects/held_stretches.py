"""Clamps that give along their line or over their face: each held grid is on springs of its own.

The stiffness per length or area is one (Winkler 1867, Die Lehre von der Elasticitaet und
Festigkeit). Each grid takes the share of its length of the line, or of its area of the face. A line
moves in all directions that it holds and turns about itself. A face moves.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..fem.released import Clamp, Supports
from ..geometry.cells import edges_of
from ..geometry.facets import cell_areas, cell_normals, unit
from ..geometry.solid_faces import skin
from ..model.assembly import Assembly
from ..model.clamp_springs import with_springs_for_supports
from .estimate import in_mm

PATTERNS = 8  # motions along a line: those of the largest forces
FEWEST = 4  # grids of a stretch
STRETCHES = {"first half": (0.0, 0.5), "last half": (0.5, 1.0), "middle": (0.25, 0.75)}
LEAST_PULL = 1e-3  # of the largest direction, from which a direction gives
ALIKE = 0.9  # cosine between normals that belong to one face


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs of one kind under some grids, in shares of their sum along one direction.

    Attributes
    ----------
    moves : (k, m)      motion of each support when grid m moves, or turns about the line
    share : (m,)        of the springs; along one direction, or about the line, their sum is 1
    rows : (m,) int     points
    axes : (m, 3)       directions along or about which they act, unit length
    turning : about the line
    """

    moves: sp.csr_array
    share: np.ndarray
    rows: np.ndarray
    axes: np.ndarray
    turning: bool

    def pulled(self, force: np.ndarray) -> Self | None:
        """Springs along the directions in which modes pull; None if there are too few.

        A direction that no measured mode loads would take a stiffness that nothing determines.
        """
        if len(self.share) < FEWEST:
            return None
        loads = (self.moves.T @ force) ** 2 / self.share[:, None]
        toward = (self.axes**2).T @ loads.sum(axis=1)
        on = np.full(len(self.share), True)
        if not self.turning:
            on = self.axes**2 @ (toward > LEAST_PULL * toward.max()) > 0.5
        kept = self.moves[:, np.flatnonzero(on)]
        return replace(
            self, moves=kept, share=self.share[on], rows=self.rows[on], axes=self.axes[on]
        )

    def patterns(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Motions (k, p) with Σ share u² = 1 that follow forces of modes, and the pull (r,).

        Stiff springs let each mode move the grids by its forces over their shares. Soft springs let
        all grids move equally.

        Parameters
        ----------
        force : (k, r) of each mode on the supports, over ω
        """
        scale = 1 / np.sqrt(self.share)
        loads = scale[:, None] * (self.moves.T @ force)
        U = np.linalg.svd(loads, full_matrices=False)[0][:, :PATTERNS]
        alike = self.axes[:, np.abs(self.axes).max(axis=0) > 0.5] / scale[:, None]
        if self.turning:
            alike = 1 / scale[:, None]
        Q = np.linalg.qr(np.hstack([U, alike]))[0][:, : len(scale)]
        return self.moves @ (scale[:, None] * Q), (loads**2).sum(axis=0)


@dataclass(frozen=True, eq=False)
class HeldStretch:
    """A clamp, or a stretch of it, whose held grids are each on springs of their own.

    Attributes
    ----------
    springs : of the translations, then of the rotation about a line
    rigid : (k,)    springs that are as good as rigid [N/m, N m/rad]
    pull : (k, r)   f²/λ of each mode
    whole : it is all of the clamp
    """

    grids: np.ndarray
    centre: np.ndarray
    text: str
    springs: tuple[Springs, ...]
    rigid: np.ndarray
    pull: np.ndarray
    whole: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its stiffnesses, each the sum over all grids."""
        return tuple("K_rot" if s.turning else "K" for s in self.springs)

    def on_springs(self, assembly: Assembly, k: np.ndarray) -> Assembly:
        """The assembly with springs k (sums over all grids) in place of these supports."""
        for own, total, rigid in zip(self.springs, k, self.rigid, strict=True):
            assembly = with_springs_for_supports(
                assembly, own.rows, own.axes, total * own.share, own.turning, float(rigid)
            )
        return assembly


def stretches(
    assembly: Assembly, supports: Supports, clamp: Clamp, force: np.ndarray, stiff: np.ndarray
) -> Iterator[tuple[HeldStretch, list[np.ndarray]]]:
    """A clamp on springs of one stiffness per length or area: all of it, then stretches of it.

    With each come the motions (k, p) of the supports for each of its stiffnesses.

    Parameters
    ----------
    force : (k, r)   of each mode on the supports, over ω
    stiff : (2,)     springs of the whole clamp that are as good as rigid [N/m, N m/rad]
    """
    rows = assembly.rows(clamp.grids)
    faces = _faces(assembly, rows)
    size, tangent = _by_area(assembly, rows, faces), None
    if not size.any():
        size, tangent = _by_length(assembly, rows)
    on = np.flatnonzero(size > 0)
    if len(on) < FEWEST:
        return
    rows, size = rows[on], size[on]
    tangent = None if tangent is None else tangent[on]
    for text, mine in _chosen(assembly, rows, size, faces):
        here, share = rows[mine], size[mine] / size[mine].sum()
        every = [_translations(assembly, supports, here, share)]
        if tangent is not None:
            every.append(_rotations(assembly, supports, here, share, tangent[mine]))
        springs = [pulled for s in every if (pulled := s.pulled(force))]
        if springs:
            found = [s.patterns(force) for s in springs]
            rigid = np.array([stiff[int(s.turning)] for s in springs])
            centre = assembly.points[rows[mine]].mean(axis=0)
            grids = assembly.ids[rows[mine]]
            how = "over the face" if tangent is None else "along the line"
            said = (
                f"the {len(grids)} supports from grid {grids[0]} on near ({in_mm(centre)} mm)"
                f"{text}; each yields on its own {how}"
            )
            pull = np.array([p for _, p in found])
            made = HeldStretch(grids, centre, said, tuple(springs), rigid, pull, not text)
            yield made, [moves for moves, _ in found]


def _chosen(
    assembly: Assembly, rows: np.ndarray, size: np.ndarray, faces: np.ndarray
) -> Iterator[tuple[str, np.ndarray]]:
    """Text and mask (n,) of all grids, of the halves and the middle, of each of several faces."""
    yield "", np.ones(len(rows), bool)
    X = assembly.points[rows] - assembly.points[rows].mean(axis=0)
    along = X @ np.linalg.svd(X, full_matrices=False)[2][0]
    order = np.argsort(along, kind="stable")
    place = np.empty(len(rows))
    place[order] = (np.cumsum(size[order]) - size[order] / 2) / size.sum()
    for text, (first, last) in STRETCHES.items():
        mine = (place >= first) & (place <= last)
        if mine.sum() >= FEWEST:
            yield f", the {text} of their clamp", mine
    normal = cell_normals(assembly.points, faces)
    left = np.arange(len(faces))
    while len(left):
        same = normal[left] @ normal[left[0]] > ALIKE
        mine = np.isin(rows, faces[left[same]])
        if FEWEST <= mine.sum() < len(rows):
            yield f", the face towards ({', '.join(f'{v:.1f}' for v in normal[left[0]])})", mine
        left = left[~same]


def _faces(assembly: Assembly, rows: np.ndarray) -> np.ndarray:
    """Shells, and outer faces of solids, all of whose corners are held (m, 4)."""
    every = [assembly.shells.nodes, *(skin(s.nodes, s.part)[0] for s in assembly.solids if len(s))]
    return np.concatenate([f[np.isin(f, rows).all(axis=1)] for f in every]).astype(int)


def _by_area(assembly: Assembly, rows: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area of each row of points (n,) [m²]: a fourth of each face, a third of each triangle."""
    out = np.zeros(len(assembly.points))
    for face, area in zip(faces, cell_areas(assembly.points, faces), strict=True):
        corners = np.unique(face)
        out[corners] += area / len(corners)
    return out[rows]


def _by_length(assembly: Assembly, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length (n,) [m] of each row of points, half of each edge, and the tangent there (n, 3)."""
    edges = np.unique(edges_of(assembly.shells.nodes), axis=0)
    edges = edges[np.isin(edges, rows).all(axis=1)]
    d = np.diff(assembly.points[edges], axis=1)[:, 0]
    d *= np.sign(d[np.arange(len(d)), np.abs(d).argmax(axis=1)])[:, None]
    half, along = np.zeros(len(assembly.points)), np.zeros((len(assembly.points), 3))
    for end in edges.T:
        np.add.at(half, end, np.linalg.norm(d, axis=1) / 2)
        np.add.at(along, end, d)
    return half[rows], unit(along[rows])


def _translations(
    assembly: Assembly, supports: Supports, rows: np.ndarray, share: np.ndarray
) -> Springs:
    """Springs on the translations that the grids hold."""
    at, component = supports.dofs.T
    held = np.flatnonzero(np.isin(at, rows) & (component <= 3))
    of_row = np.zeros(len(assembly.points))
    of_row[rows] = share
    moves = sp.csr_array(
        (np.ones(len(held)), (held, np.arange(len(held)))), shape=(len(at), len(held))
    )
    axes = supports.directions(assembly)[held]
    return Springs(moves, of_row[at[held]], at[held], axes, False)


def _rotations(
    assembly: Assembly, supports: Supports, rows: np.ndarray, share: np.ndarray, about: np.ndarray
) -> Springs:
    """Springs on the rotation about axes (n, 3), for grids that hold all of it."""
    at, component = supports.dofs.T
    axes = supports.directions(assembly)
    turn = np.zeros((len(at), len(rows)))
    for k, row in enumerate(rows.tolist()):
        mine = np.flatnonzero((at == row) & (component > 3))
        turn[mine, k] = axes[mine] @ about[k]
    whole = np.linalg.norm(turn, axis=0) > 1 - 1e-6
    return Springs(sp.csr_array(turn[:, whole]), share[whole], rows[whole], about[whole], True)
