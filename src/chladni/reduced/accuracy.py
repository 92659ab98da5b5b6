"""Error of the reduced model's frequencies, and the vectors that its basis lacks.

At x the modes q = Φφ leave the residual r = K(x) q - λ M(x) q on the full operators.  One inverse
iteration with the factor of the nominal P = K + σM gives z = P⁻¹ r, the missing vectors.
Rayleigh-Ritz on Φ and all z together lowers every frequency towards the true one, never below it.
The fall is the error estimate.  It never exceeds the error.  Let K(x) - λM(x) lie between a and b
times P on the missing vectors: then the estimate is at least about 4ab/(a+b)² of the error
(Kantorovich's inequality; Horn and Johnson 2013, Matrix Analysis, 7.4.12).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from ..dynamics.reduction import beyond
from ..effects.effect import Effect, PointTerm, of
from .effect_dofs import acting_at, own_part, own_positions
from .field_factors import log_fields, mass_log, multiplied, stiffness_log
from .frequency_dependent_stiffness import applied
from .modal_factors import ModalFactors, modal_factors
from .reduced_model import Reduced, State, evaluate
from .reduced_problem import ReducedProblem

LIMIT = 5e-4  # largest relative frequency error that is accepted of a basis
RIGID = 0.02  # of the highest frequency of interest: below it a mode counts as rigid


@dataclass(frozen=True, eq=False)
class Accuracy:
    """Frequencies of the reduced model and their estimated errors."""

    frequency: np.ndarray  # (k,) [Hz] of flexible modes up to the highest frequency of interest
    error: np.ndarray  # (k,) estimated relative error of each, f / f_true - 1 >= 0
    missing: np.ndarray  # (n, k) the part of each mode that the basis lacks

    @property
    def worst(self) -> float:
        """Largest estimated relative frequency error; 0 where there is no mode."""
        return float(self.error.max(initial=0.0))

    def serves(self, limit: float = LIMIT) -> bool:
        """True where the basis is accurate enough; otherwise it must be refined."""
        return self.worst <= limit

    def refined(self, model: Reduced) -> Reduced:
        """The model over a basis that also holds the missing vectors."""
        return model.extended(self.missing)


def accuracy(
    reduced: ReducedProblem, model: Reduced, effects: Sequence[Effect], x: np.ndarray, f_max: float
) -> Accuracy:
    """Error of the reduced model's frequencies at x.

    It costs one solve with the nominal factor and two products with the element matrices.

    Parameters
    ----------
    reduced : the structure and the factor of its K + σM
    model : its reduced model, over any basis
    f_max : highest frequency of interest [Hz]
    """
    state = evaluate(model, effects, x, gradient=False)
    f = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
    at = np.flatnonzero((f > RIGID * f_max) & (f <= f_max))
    Kq, Mq = products(model, effects, x, _modes(model, state)[:, at])
    n = len(reduced.structure.system.dofs)  # dofs of effects and clamps are in the model exactly
    missing = np.asarray(reduced.factor.solve((Kq - state.lam[at] * Mq)[:n]))
    better = _improved(model, effects, x, state, missing)[at]
    return Accuracy(f[at], np.maximum(np.sqrt(state.lam[at] / better) - 1, 0.0), missing)


def _improved(
    model: Reduced, effects: Sequence[Effect], x: np.ndarray, state: State, missing: np.ndarray
) -> np.ndarray:
    """λ of Rayleigh-Ritz on the basis and the missing vectors, in increasing order."""
    M = model.groups.structure.system.M
    missing = np.pad(missing, ((0, M.shape[0] - len(missing)), (0, 0)))
    Z = np.pad(beyond(M, model.vectors.blocks, missing), ((0, len(state.own)), (0, 0)))
    if not Z.shape[1]:
        return state.lam
    modes = _modes(model, state)
    KZ, MZ = products(model, effects, x, Z)
    K, B = np.diag(state.lam), np.eye(len(state.lam))
    K, B = (
        np.block([[own, modes.T @ AZ], [(modes.T @ AZ).T, Z.T @ AZ]])
        for own, AZ in ((K, KZ), (B, MZ))
    )
    return sl.eigh((K + K.T) / 2, (B + B.T) / 2, eigvals_only=True)


def _modes(model: Reduced, state: State) -> np.ndarray:
    """Modes (n + n_own, m) at all dofs of the structure, then at the dofs that effects add."""
    return np.concatenate([model.vectors.combined(state.phi), state.own])


def products(
    model: Reduced, effects: Sequence[Effect], x: np.ndarray, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """K(x) q and M(x) q (n + n_own, k) on the full operators, which are never assembled."""
    system, groups = model.groups.structure.system, model.groups
    n = model.vectors.shape[0]
    n_own, u = len(q) - n, q[:n]
    acting = acting_at(effects, x)
    v, factors = u, [(each, *_coordinates(model, each)) for each in modal_factors(acting)]
    for each, modes, rows in reversed(factors):
        v = v + modes @ (each.W @ (rows @ v))
    K, M = system.elastic @ v, system.M @ u
    split = "" not in model.linear
    fields, slopes = log_fields(acting, groups, len(x), split)
    logs = {k: f[groups.group, None, None] for k, f in fields.items()}
    change: np.ndarray | float = 0.0
    for name, pair in model.pieces():
        change = change + sum(
            np.expm1(stiffness_log(logs, name, power)) * A
            for A, power in zip(pair, (1, 3), strict=True)
        )
    K = K + _spread(model, np.asarray(change), v)
    M = M + _spread(model, np.expm1(mass_log(logs)) * groups.mass, u)
    shares = [share.term for share in multiplied(acting, groups, fields, slopes, split)]
    strained = model.deformed(v)
    for part in shares:
        m = part.operator.shape[0]
        if part.matrix == "M":
            M[:m] += part.coefficient * (part.operator @ u[:m])
        elif part.rise is None:
            K += model.load(part.coefficient * (part.operator @ strained[:m]))
    for each, modes, rows in factors:
        K = K + rows.T @ (each.W.T @ (modes.T @ K))
    if rising := [part for part in shares if part.rise is not None]:
        lost = evaluate(model, effects, x, gradient=False).dissipated
        assert lost is not None
        lam, phi = lost.unrisen
        frame = model.vectors.combined(phi[: len(phi) - n_own])
    for part in rising:
        m = part.operator.shape[0]
        K[:m] += part.coefficient * applied(part, u[:m], lam, frame, system.M)
    K, M = (np.pad(A, ((0, n_own), (0, 0))) for A in (K, M))
    for (_, _, terms), first in zip(acting, own_positions(effects), strict=True):
        for term in of(PointTerm, terms):
            idle = sp.csr_array((term.rows.shape[0], n - term.rows.shape[1]))
            own = sp.csr_array(own_part(term, first, n_own))
            b = sp.hstack([term.rows, idle, own], format="csr")
            added = b.T @ (term.coefficient[:, None] * (b @ q))
            K, M = (K + added, M) if term.matrix == "K" else (K, M + added)
    return K, M


def _coordinates(model: Reduced, factors: ModalFactors) -> tuple[np.ndarray, sp.csr_array]:
    """Modes Φ (n, k), and the rows (k, n) of the coordinates of all dofs in them."""
    rows = model.wide(factors.rows, True)
    idle = sp.csr_array((rows.shape[0], model.vectors.shape[0] - rows.shape[1]))
    modes = model.vectors.combined(model.modes_of(factors.rows))
    return modes, sp.csr_array(sp.hstack([rows, idle]))


def _spread(model: Reduced, matrices: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Σ_e Tᵀ A_e T q of the shells' matrices (m, 24, 24)."""
    T, dofs = model.groups.structure.T, model.groups.dofs
    force = matrices @ (T @ q)[dofs]
    gather = sp.csr_array(
        (np.ones(dofs.size), (dofs.ravel(), np.arange(dofs.size))), shape=(T.shape[0], dofs.size)
    )
    return T.T @ (gather @ force.reshape(dofs.size, q.shape[1]))
