"""Ranking of shaker places by the response of the weakest mode, and rattle.

The condition number of a place is that of Echaniz Granado (2015), section 4.1.1 and table 2. It
compares modes, so it is low next to a clamp too, where no mode moves. A force F brings the mode
that is driven least to F σ_min. Where the mode that is driven most fills the range S of the
channels first, it comes to S / κ, κ = σ_max/σ_min. Which of the two limits a test is not known
before it, so their geometric mean counts: √(σ_min/κ).
"""

from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from chladni.dynamics.frf import Quantity
from chladni.errors import ShapeError

from .gramians import condition, controllability_gramian, hankel_values, observability_gramian

STILL = 1e-12  # of the largest driving-point residue: rounding in a clamp


@dataclass(frozen=True, eq=False)
class Shaking:
    """Gramians of all actuator candidates and of the sensors; they add up over actuators.

    Attributes
    ----------
    each : (n, 2r, 2r)     controllability gramian of every candidate alone
    observed : (2r, 2r)    observability gramian of the sensors
    """

    each: np.ndarray
    observed: np.ndarray

    def condition(self, actuators: np.ndarray) -> float:
        """Ratio σ_max/σ_min of the Hankel values with all these actuators at work."""
        W = self.each[np.asarray(actuators, dtype=np.int64)].sum(axis=0)
        return float(condition(hankel_values(W, self.observed)))

    def conditions(self) -> np.ndarray:
        """Ratio σ_max/σ_min of every candidate alone (n,)."""
        return condition(hankel_values(self.each, self.observed))

    def weakest(self) -> np.ndarray:
        """Hankel value σ_min of the mode that every candidate alone drives least (n,)."""
        return np.asarray(hankel_values(self.each, self.observed)[..., -1])

    def effort(self, W: np.ndarray, even: bool = False) -> np.ndarray:
        """κ/σ_min of gramians W (..., 2r, 2r) of actuators; with ``even`` κ, whatever the force."""
        values = hankel_values(W, self.observed)
        kappa, least = condition(values), values[..., -1]
        out = np.full(kappa.shape, np.inf)
        return np.divide(kappa, 1.0 if even else least, out=out, where=np.isfinite(kappa))


def shaking(
    frequency: np.ndarray,
    damping: np.ndarray | float,
    phi_sensors: np.ndarray,
    phi_candidates: np.ndarray,
    quantity: Quantity = "receptance",
) -> Shaking:
    """Gramians of sensors (m, r) and of every actuator candidate (n, r)."""
    zeta = np.broadcast_to(np.asarray(damping, dtype=float), np.shape(frequency))
    each = np.stack([controllability_gramian(frequency, zeta, b[None]) for b in phi_candidates])
    return Shaking(each, observability_gramian(frequency, zeta, phi_sensors, quantity))


def best_actuators(
    shaker: Shaking, count: int, allowed: np.ndarray | None = None, *, exhaustive: int = 2000,
    even: bool = False,
) -> np.ndarray:  # fmt: skip
    """The ``count`` allowed actuators that drive the weakest mode best (sorted positions).

    With ``even`` they have the lowest joint condition number, however little they move.

    All combinations are tried where they are at most ``exhaustive``.  Otherwise actuators are added
    one by one and then exchanged one for one.

    Raises
    ------
    ShapeError
        If there are fewer allowed candidates than ``count``.
    """
    n = len(shaker.each)
    among = np.flatnonzero(np.ones(n, bool) if allowed is None else allowed)
    if not 1 <= count <= len(among):
        raise ShapeError(
            f"{count} actuators were requested, but {len(among)} candidates are allowed"
        )
    if comb(len(among), count) <= exhaustive:
        sets = [np.array(s) for s in combinations(among, count)]
        return sets[int(np.argmin([shaker.effort(shaker.each[s].sum(axis=0), even) for s in sets]))]
    found = np.zeros(0, dtype=np.int64)
    for _ in range(count):
        found = _joined(shaker, found, np.setdiff1d(among, found), even)
    return np.sort(_exchanged(shaker, found, among, even))


def _joined(shaker: Shaking, found: np.ndarray, others: np.ndarray, even: bool) -> np.ndarray:
    """The actuators plus the other candidate that lowers the effort most."""
    W = shaker.each[found].sum(axis=0) + shaker.each[others]
    return np.r_[found, others[int(np.argmin(shaker.effort(W, even)))]]


def _exchanged(shaker: Shaking, found: np.ndarray, among: np.ndarray, even: bool) -> np.ndarray:
    """The actuators after one-for-one swaps, until no swap lowers the effort."""

    def effort(actuators: np.ndarray) -> float:
        return float(shaker.effort(shaker.each[actuators].sum(axis=0), even))

    now, better = effort(found), True
    while better:
        better = False
        for k in range(len(found)):
            rest = np.delete(found, k)
            new = _joined(shaker, rest, np.setdiff1d(among, rest), even)
            if (after := effort(new)) < now * (1 - 1e-9):
                found, now, better = new, after, True
    return found


def driving_point_residue(frequency: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Residue φ_ir² / (2 ω_r) of each mode at each candidate as its own driving point (n, r).

    Its mean over the modes measures how well a place drives the structure.  Its minimum shows
    whether the place drives every mode.
    """
    return np.asarray(phi) ** 2 / (4 * np.pi * np.asarray(frequency))


def rattle_margin(
    frequency: np.ndarray,
    damping: np.ndarray | float,
    phi: np.ndarray,
    gap_shapes: np.ndarray,
    clearance: np.ndarray,
    force: float,
) -> np.ndarray:
    """Clearance over the greatest relative motion with each candidate driven; < 1 rattles (n,).

    At the resonance of mode r a force F at i closes gap g by |φ_ir ψ_gr| F / (2 ζ_r ω_r²).

    Parameters
    ----------
    phi : (n, r)            shapes at the actuator candidates [1/√kg]
    gap_shapes : (g, r)     relative motion of the two sides of each gap along its normal [1/√kg]
    clearance : (g,)        [m]
    force : amplitude [N]
    """
    omega = 2 * np.pi * np.asarray(frequency)
    peak = force / (2 * np.asarray(damping) * omega**2)
    closing = np.einsum("ir,gr,r->igr", np.abs(phi), np.abs(gap_shapes), peak).max(axis=2)
    with np.errstate(divide="ignore"):
        margin = np.where(closing > 0, np.asarray(clearance) / closing, np.inf)
    return margin.min(axis=1, initial=np.inf)


@dataclass(frozen=True, eq=False)
class ActuatorRanking:
    """Candidates for the shaker, best first; vetoed ones come last.

    Attributes
    ----------
    order : (n,) int
    condition : (n,)     Hankel condition number of each candidate (by candidate, not by rank)
    residue : (n,)       least over mean driving-point residue of its modes
    margin : (n,)        rattle margin, inf where no gap was given
    allowed : (n,) bool  accessible, free of rattle, and moved by a mode
    weakest : (n,)       Hankel value of the mode driven least, over the largest of all candidates
    """

    order: np.ndarray
    condition: np.ndarray
    residue: np.ndarray
    margin: np.ndarray
    allowed: np.ndarray
    weakest: np.ndarray


def ranked_actuators(
    shaker: Shaking,
    frequency: np.ndarray,
    phi: np.ndarray,
    *,
    margin: np.ndarray | None = None,
    access: np.ndarray | None = None,
) -> ActuatorRanking:
    """Rank candidates by the response of the weakest mode.

    No access, a margin < 1 and a place that no mode moves, as in a clamp, are vetoes.

    It is zero everywhere where no candidate drives all modes, for example where two modes share a
    frequency.  The driving-point residues of the modes stand for the Hankel values then.
    """
    n = len(phi)
    margin = np.full(n, np.inf) if margin is None else margin
    allowed = (np.ones(n, bool) if access is None else np.asarray(access, bool)) & (margin >= 1)
    residue, weakest = driving_point_residue(frequency, phi), shaker.weakest()
    allowed &= residue.max(axis=1) > STILL * residue.max()
    least = residue.min(axis=1) / np.maximum(residue.mean(axis=1), 1e-300)
    return ActuatorRanking(
        np.lexsort((-least * residue.min(axis=1), shaker.effort(shaker.each), ~allowed)),
        shaker.conditions(),
        least,
        margin,
        allowed,
        weakest / max(float(weakest.max()), 1e-300),
    )
