"""Ranking of shaker places by condition number, driving-point residue and rattle.

The condition number is that of Echaniz Granado (2015), section 4.1.1 and table 2.
"""

from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from chladni.dynamics.frf import Quantity
from chladni.errors import ShapeError

from .gramians import condition, controllability_gramian, hankel_values, observability_gramian


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
    shaker: Shaking, count: int, allowed: np.ndarray | None = None, *, exhaustive: int = 2000
) -> np.ndarray:
    """The ``count`` allowed actuators of the lowest joint condition number (sorted positions).

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
        return sets[int(np.argmin([shaker.condition(s) for s in sets]))]
    found = np.zeros(0, dtype=np.int64)
    for _ in range(count):
        found = _joined(shaker, found, np.setdiff1d(among, found))
    return np.sort(_exchanged(shaker, found, among))


def _joined(shaker: Shaking, found: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The actuators plus the other candidate that lowers the condition number most."""
    W = shaker.each[found].sum(axis=0) + shaker.each[others]
    best = int(np.argmin(condition(hankel_values(W, shaker.observed))))
    return np.r_[found, others[best]]


def _exchanged(shaker: Shaking, found: np.ndarray, among: np.ndarray) -> np.ndarray:
    """The actuators after one-for-one swaps, until no swap lowers the condition number."""
    now, better = shaker.condition(found), True
    while better:
        better = False
        for k in range(len(found)):
            new = _joined(shaker, np.delete(found, k), np.setdiff1d(among, np.delete(found, k)))
            if (after := shaker.condition(new)) < now * (1 - 1e-9):
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
    allowed : (n,) bool  accessible, and free of rattle
    """

    order: np.ndarray
    condition: np.ndarray
    residue: np.ndarray
    margin: np.ndarray
    allowed: np.ndarray


def ranked_actuators(
    shaker: Shaking,
    frequency: np.ndarray,
    phi: np.ndarray,
    *,
    margin: np.ndarray | None = None,
    access: np.ndarray | None = None,
) -> ActuatorRanking:
    """Rank candidates by condition number; no access or a rattle margin below 1 is a veto.

    Every condition is infinite where no candidate drives all modes, for example where two modes
    share a frequency.  The least residue decides then.
    """
    n = len(phi)
    margin = np.full(n, np.inf) if margin is None else margin
    allowed = (np.ones(n, bool) if access is None else np.asarray(access, bool)) & (margin >= 1)
    kappa = shaker.conditions()
    residue = driving_point_residue(frequency, phi)
    least = residue.min(axis=1) / np.maximum(residue.mean(axis=1), 1e-300)
    return ActuatorRanking(
        np.lexsort((-least, kappa, ~allowed)),
        kappa,
        least,
        margin,
        allowed,
    )
