"""Clearance between sheets, and the relative motion of the two sides in each mode.

A facet lies up to h² κ/8 inside the curved sheet that it approximates. The uncertainty of a
clearance is the sum of this value for both sides. A pair closer than its uncertainty counts as
touching.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np

from ..model.assembly import Assembly, Average, RigidBody
from .cells import point_means
from .curvature import part_curvature
from .nearest import ShellSurface
from .thickness_mapping import shell_area


@dataclass(frozen=True, eq=False)
class Gaps:
    """Places of one part that face another part."""

    parts: tuple[str, str]
    rows: np.ndarray  # (k,) int; rows of points on the first part
    opposite: np.ndarray  # (k, 3) int; rows of the opposite triangle
    weight: np.ndarray  # (k, 3) of these
    normal: np.ndarray  # (k, 3) unit, from the first part to the second
    clearance: np.ndarray  # (k,) distance less half of both thicknesses [m]
    uncertainty: np.ndarray  # (k,) h² κ/8 of both sides [m]
    free: np.ndarray  # (k,) bool; farther than ``away`` from any joint

    @property
    def touching(self) -> np.ndarray:
        """(k,) bool, True where the clearance is within its uncertainty."""
        return self.clearance <= self.uncertainty

    def relative_motion(self, shapes: np.ndarray) -> np.ndarray:
        """Opening δ_r = n·(Σ w u_b - u_a) of each place in each shape: (k, r).

        Parameters
        ----------
        shapes : (n_points, 3, r)   translations of all points of the assembly
        """
        other = np.einsum("kc,kcir->kir", self.weight, shapes[self.opposite])
        return np.einsum("ki,kir->kr", self.normal, other - shapes[self.rows])

    def first_contact(
        self,
        shapes: np.ndarray,
        frequency: np.ndarray,
        damping: np.ndarray | float,
        drive: np.ndarray,
    ) -> np.ndarray:
        """Force at resonance that closes each place, F = c 2ζω² / (|φ_f| |δ|): (k, r) [N].

        Parameters
        ----------
        shapes : (n_points, 3, r)   mass-normalised [1/√kg]
        frequency, damping : (r,)   [Hz], [-]
        drive : (r,)                motion of the shapes at the exciter [1/√kg]
        """
        omega = 2 * np.pi * np.asarray(frequency)
        per_force = np.abs(self.relative_motion(shapes) * drive) / (2 * damping * omega**2)
        gap = np.maximum(self.clearance, 0.0)[:, None]
        return gap / np.maximum(per_force, 1e-30)


@dataclass(frozen=True, eq=False)
class _Sheets:
    """Data shared by all pairs of parts: thickness and facet error at points, places of joints."""

    thickness: np.ndarray
    error: np.ndarray
    joints: np.ndarray


def _sheets(assembly: Assembly) -> _Sheets:
    nodes, n = assembly.shells.nodes, len(assembly.points)
    bodies = {tie.independent for tie in assembly.rigid if isinstance(tie, RigidBody)}
    means = {tie.reference for tie in assembly.rigid if isinstance(tie, Average)}
    facet = shell_area(assembly)[:, None] * part_curvature(assembly) / 8
    return _Sheets(
        point_means(nodes, assembly.shells.thickness, n),
        point_means(nodes, facet, n),
        assembly.points[np.array(sorted(bodies | means), dtype=int)],
    )


def gaps(
    assembly: Assembly, first: str, second: str, *, within: float = 0.010, away: float = 0.018
) -> Gaps:
    """All points of one part within a distance of another."""
    return _gaps(assembly, _sheets(assembly), (first, second), within, away)


def _gaps(
    assembly: Assembly, sheets: _Sheets, names: tuple[str, str], within: float, away: float
) -> Gaps:
    from scipy.spatial import cKDTree

    a, b = (ShellSurface.of(assembly, name) for name in names)
    rows = np.unique(a.nodes)
    rows = rows[_in_box(assembly.points[rows], assembly.points[np.unique(b.nodes)], within)]
    rows = rows if len(rows) else a.nodes[0, :1]
    closest_points = b.closest_points(assembly.points[rows])
    near = closest_points.distance <= within
    rows, opposite, weight = rows[near], closest_points.nodes[near], closest_points.weight[near]
    across = closest_points.place[near] - assembly.points[rows]
    away_from = np.einsum("ki,ki->k", across, closest_points.normal[near]) < 0
    t, error = (
        v[rows] + (v[opposite] * weight).sum(axis=1) for v in (sheets.thickness, sheets.error)
    )
    shared = assembly.points[np.intersect1d(a.nodes, b.nodes)]  # a fold connects two parts
    joints = np.concatenate([sheets.joints, shared])
    free = np.ones(len(rows), bool)
    if len(joints):
        free = cKDTree(joints).query(assembly.points[rows])[0] > away
    return Gaps(
        names,
        rows,
        opposite,
        weight,
        closest_points.normal[near] * np.where(away_from, -1.0, 1.0)[:, None],
        closest_points.distance[near] - t / 2,
        error,
        free,
    )


def _in_box(points: np.ndarray, other: np.ndarray, margin: float) -> np.ndarray:
    low, high = other.min(axis=0) - margin, other.max(axis=0) + margin
    return np.all((points >= low) & (points <= high), axis=1)


@dataclass(frozen=True)
class PairClearance:
    """The smallest clearance of two parts."""

    parts: tuple[str, str]
    least: float  # clearance at the nearest place [m]
    least_free: float  # the same away from joints; inf if there is no such place [m]
    uncertainty: float  # at that place [m]
    close: int  # number of places away from joints with less than half a millimetre
    touching: bool  # True if any place away from joints is within its uncertainty
    place: tuple[float, float, float]  # (3,) the nearest place away from joints [m]


def all_gaps(
    assembly: Assembly, *, within: float = 0.010, away: float = 0.018, both_ways: bool = False
) -> tuple[Gaps, ...]:
    """Places of all pairs of parts within a distance of each other, from one part or from both."""
    names = [assembly.parts[p].name for p in np.unique(assembly.shells.part)]
    sheets = _sheets(assembly)
    pairs = permutations(names, 2) if both_ways else combinations(names, 2)
    found = (_gaps(assembly, sheets, pair, within, away) for pair in pairs)
    return tuple(g for g in found if len(g.rows))


def nearest(assembly: Assembly, gaps: Sequence[Gaps]) -> np.ndarray:
    """Least clearance of each point (n,) [m]; nan without a near sheet, or close to a joint."""
    least = np.full(len(assembly.points), np.inf)
    for g in gaps:
        np.minimum.at(least, g.rows[g.free], g.clearance[g.free])
    return np.where(np.isfinite(least), least, np.nan)


def summary(assembly: Assembly, g: Gaps) -> PairClearance:
    """Summarise the places of one pair."""
    free = np.flatnonzero(g.free)
    if not len(free):
        free_least, at = float("inf"), int(g.clearance.argmin())
    else:
        at = int(free[g.clearance[free].argmin()])
        free_least = float(g.clearance[at])
    x, y, z = assembly.points[g.rows[at]].tolist()
    return PairClearance(
        g.parts,
        float(g.clearance.min()),
        free_least,
        float(g.uncertainty[at]),
        int((g.clearance[free] < 0.5e-3).sum()),
        bool(g.touching[free].any()),
        (x, y, z),
    )
