"""Footprints of joints on a refined mesh, whose shells are half as large.

Spiders (RBE2) and weighted means (RBE3) attach a screw, a weld or a bead to whole shells of the
mesh. The mesh sets the width of this footprint, not the nugget or the head of the screw. The local
compliance of the sheet depends on it. Halving the shells under the welds of a box changes its
frequencies by 1 to 7 %, splitting all other shells by 0.2 to 2 %. A bar or a bush from grid to grid
has no other footprint than the shells at its ends.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..model.added_points import next_id, with_points
from ..model.assembly import Assembly, Average, Equation, RigidBody
from .beam_lines import fastener_bars
from .cells import components, edges_of
from .refine import parents
from .sampling import farthest_point_sample

FEWEST = 3  # grids of a footprint; fewer hold a point, not an area

Rigid = RigidBody | Average | Equation


def on_smaller_shells(coarse: Assembly, fine: Assembly) -> tuple[Rigid, ...]:
    """The rigid elements of a refined structure, with footprints of joints half as wide.

    A joint on the grids of one shell moves to the quarter of it nearest to the attached point. A
    joint on several shells moves to the grids nearest to the middle between its grids and their
    centre; the rim of a hole is unchanged. A joint on fewer than three grids of shells remains the
    same object.

    Parameters
    ----------
    coarse : Assembly   of the deck
    fine : Assembly     ``refined(coarse)``
    """
    shrunk = _Footprints(coarse, fine)
    taken = {row for body in coarse.rigid for row in _held(body)}
    out: list[Rigid] = []
    for body in coarse.rigid:
        smaller = shrunk.of(body)
        new = set(_held(smaller)) - set(_held(body))
        out.append(body if new & taken else smaller)
        taken |= set(_held(out[-1]))
    return tuple(out)


def on_whole_shells(coarse: Assembly, fine: Assembly) -> Assembly:
    """The refined structure with fasteners from grid to grid on footprints as wide as in the deck.

    A load on a grid acts on the coarse shells round it by their shape functions. These are 1 there,
    1/2 in the middles of sides and 1/4 in those of shells. They are the weights of a mean (RBE3)
    that holds the end of the fastener.

    Parameters
    ----------
    coarse : Assembly   of the deck
    fine : Assembly     ``refined(coarse)``; it is returned where there is no such fastener
    """
    bars = np.concatenate([np.zeros(0, int), *fastener_bars(coarse)])
    cells = fine.shells.nodes
    ends = np.concatenate([fine.beams.nodes[bars].ravel(), fine.bushes.nodes.ravel()])
    grids = np.intersect1d(ends, cells)
    if not len(grids):
        return fine
    held, added = with_points(fine, fine.points[grids])
    moved = np.arange(len(held.points))
    moved[grids] = added
    means, name = [], next_id(fine)
    for k, (grid, end) in enumerate(zip(grids.tolist(), added.tolist(), strict=True)):
        shell, corner = np.nonzero(cells == grid)
        weight = {grid: 1.0}
        for cell, at in zip(cells[shell], corner, strict=True):
            for step in (1, 2, 3):
                row = int(cell[(at + step) % 4])
                opposite = step == 2 and len(set(cell.tolist())) == 4
                weight.setdefault(row, 0.25 if opposite else 0.5)
        terms = tuple((row, (1, 2, 3), w) for row, w in weight.items())
        means.append(Average(name + k, end, (1, 2, 3, 4, 5, 6), terms))
    beams = fine.beams.nodes.copy()
    beams[bars] = moved[beams[bars]]
    bushes = np.where(fine.bushes.nodes < 0, fine.bushes.nodes, moved[fine.bushes.nodes])
    return replace(
        held, rigid=(*fine.rigid, *means), beams=replace(fine.beams, nodes=beams),
        bushes=replace(fine.bushes, nodes=bushes),
    )  # fmt: skip


def regions_of_joints(
    assembly: Assembly, bodies: Sequence[int], most: int
) -> list[tuple[np.ndarray, int]]:
    """Rigid elements (rows of ``assembly.rigid``) of each region, and its number of joints.

    Elements connected by bars, bushes, springs or solids are one joint. There are at most ``most``
    regions, centred on joints that lie far from each other.
    """
    hung = np.array([_hung_on(assembly.rigid[k]) for k in bodies], dtype=int)
    pairs = [assembly.beams.nodes, assembly.bushes.nodes, assembly.springs.nodes]
    edges = np.concatenate([*pairs, *(edges_of(s.nodes) for s in assembly.solids)])
    piece = components(edges[(edges >= 0).all(axis=1)], len(assembly.points))
    joint = np.unique(piece[hung], return_inverse=True)[1]
    middle = np.array(
        [assembly.points[hung[joint == j]].mean(axis=0) for j in range(joint.max() + 1)]
    )
    seeds = farthest_point_sample(middle, most)
    region = np.linalg.norm(middle[:, None] - middle[seeds], axis=2).round(9).argmin(axis=1)
    rows = np.asarray(bodies)
    return [(rows[region[joint] == k], int((region == k).sum())) for k in range(len(seeds))]


def _hung_on(body: Rigid) -> int:
    """Row of the point attached by a spider or a mean, or of the dependent point of an equation."""
    if isinstance(body, Equation):
        return body.nodes[0]
    return body.independent if isinstance(body, RigidBody) else body.reference


def _held(body: Rigid) -> tuple[int, ...]:
    """Rows with dependent dofs."""
    return body.dependent if isinstance(body, RigidBody) else ()


class _Footprints:
    """Shells round every grid, and their quarters on the refined mesh."""

    def __init__(self, coarse: Assembly, fine: Assembly) -> None:
        """Index both meshes."""
        self.points, self.cells, self.pieces = fine.points, coarse.shells.nodes, fine.shells.nodes
        order = np.argsort(self.cells, axis=None, kind="stable")
        self._shell = order // 4
        self._first = np.searchsorted(self.cells.ravel()[order], np.arange(len(coarse.points) + 1))
        by_parent = np.argsort(parents(coarse.shells), kind="stable")
        self._piece = by_parent.reshape(len(self.cells), 4)  # every shell has four

    def of(self, body: Rigid) -> Rigid:
        """A rigid element with half its footprint."""
        if isinstance(body, RigidBody) and self._is_area(body.dependent, body.independent):
            if len(set(body.components)) == 1:
                rows = self._smaller(body.dependent, body.independent)
                return replace(body, dependent=rows, components=body.components[:1] * len(rows))
        if isinstance(body, Average) and not body.moved:
            rows = tuple(row for row, _, _ in body.terms)
            if self._is_area(rows, body.reference) and len({c for _, c, _ in body.terms}) == 1:
                weight = float(np.mean([w for _, _, w in body.terms]))
                new = self._smaller(rows, self._hung(body))
                terms = tuple((row, body.terms[0][1], weight) for row in new)
                return replace(body, terms=terms)
        return body

    def _hung(self, body: Average) -> np.ndarray:
        """Place (3,) attached to a mean: by its weights, or its reference if they are equal."""
        weight = np.array([w for _, _, w in body.terms])
        if np.ptp(weight) <= 1e-9 * np.abs(weight).max():
            return np.asarray(self.points[body.reference])
        at = self.points[[row for row, _, _ in body.terms]]
        return weight @ at / weight.sum()

    def _is_area(self, rows: Sequence[int], other: int) -> bool:
        on_shells = [self._first[r + 1] > self._first[r] for r in rows]
        return len(set(rows)) >= FEWEST and all(on_shells) and other not in rows

    def _smaller(self, rows: Sequence[int], hung: int | np.ndarray) -> tuple[int, ...]:
        from scipy.spatial import cKDTree

        place = self.points[hung] if isinstance(hung, int | np.integer) else hung
        ranges = [self._shell[self._first[r] : self._first[r + 1]] for r in rows]
        near = np.unique(np.concatenate(ranges))  # shells with any of the grids
        whole = near[np.array([set(rows) <= set(self.cells[s].tolist()) for s in near], bool)]
        if len(whole):
            pieces = self._piece[whole[0]]
            middle = self.points[self.pieces[pieces]].mean(axis=1)
            away = np.linalg.norm(middle - place, axis=1)
            chosen = self.pieces[pieces[np.round(away / away.max(), 6).argmin()]]
            return tuple(dict.fromkeys(chosen.tolist()))
        if not any(set(self.cells[s].tolist()) <= set(rows) for s in near):
            return tuple(rows)  # the rim of a hole
        grids = np.unique(self.pieces[self._piece[near]])
        at = self.points[list(rows)]
        aim = (at + at.mean(axis=0)) / 2
        found = np.unique(grids[cKDTree(self.points[grids]).query(aim)[1]])
        return tuple(found.tolist()) if len(found) >= FEWEST else tuple(rows)
