"""How far the reduced model is from the structure it stands for, and the basis that mends it.

At x the modes q = Φφ leave r = K(x) q - λ M(x) q on the full operators.  One inverse iteration with
the factor of the nominal P = K + σM turns r into what the basis lacks, z = P⁻¹ r; Rayleigh-Ritz on
Φ and all z together lowers every frequency towards, never below, the true one.  The fall is the
error estimate: never more than the error, and where K(x) - λM(x) lies between a and b times P on
what the basis lacks no less than about 4ab/(a+b)² of it (Kantorovich's inequality; Horn and Johnson
2013, Matrix Analysis, 7.4.12).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from ..dynamics.reduction import beyond
from ..effects.effect import Effect, FieldChange, MatrixTerm
from .effect_dofs import own_part, own_positions
from .field_factors import mass_log, stiffness_log
from .reduced_model import Reduced, State, evaluate, log_fields, slices
from .reduced_problem import ReducedProblem
from .rising import UnrisenModes, applied

LIMIT = 5e-4  # relative frequency error of a basis that still serves
RIGID = 0.02  # of the highest frequency of interest: below it a mode counts as rigid


@dataclass(frozen=True, eq=False)
class Accuracy:
    """Frequencies of the reduced model and what is wrong with them.

    Attributes
    ----------
    frequency : (k,) Hz    flexible modes up to the highest frequency of interest
    error : (k,)           estimated relative error of each, f / f_true - 1 >= 0
    missing : (n, k)       what the basis lacks of them
    """

    frequency: np.ndarray
    error: np.ndarray
    missing: np.ndarray

    @property
    def worst(self) -> float:
        """Largest estimated relative frequency error; 0 where there is no mode."""
        return float(self.error.max(initial=0.0))

    def serves(self, limit: float = LIMIT) -> bool:
        """Whether the basis still serves; else it is to be renewed."""
        return self.worst <= limit

    def renewed(self, model: Reduced) -> Reduced:
        """The model over a basis that holds what was missing."""
        return model.extended(self.missing)


def accuracy(
    reduced: ReducedProblem, model: Reduced, effects: Sequence[Effect], x: np.ndarray, f_max: float
) -> Accuracy:
    """Error of the reduced model's frequencies at x.

    Costs one solve with the nominal factor and two products with the element matrices.

    Parameters
    ----------
    reduced : the structure and the factor of its K + σM
    model : its reduced model, over whatever basis
    f_max : highest frequency of interest [Hz]
    """
    state = evaluate(model, effects, x, gradient=False)
    f = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
    at = np.flatnonzero((f > RIGID * f_max) & (f <= f_max))
    Kq, Mq = products(model, effects, x, _modes(model, state)[:, at])
    n = len(reduced.structure.system.dofs)  # what effects bring, and clamps, lack nothing
    missing = np.asarray(reduced.factor.solve((Kq - state.lam[at] * Mq)[:n]))
    better = _improved(model, effects, x, state, missing)[at]
    return Accuracy(f[at], np.maximum(np.sqrt(state.lam[at] / better) - 1, 0.0), missing)


def _improved(
    model: Reduced, effects: Sequence[Effect], x: np.ndarray, state: State, missing: np.ndarray
) -> np.ndarray:
    """λ of Rayleigh-Ritz on the basis and what it lacks, in increasing order."""
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
    """Modes at all dofs of the structure, below them those that effects bring (n + n_own, m)."""
    return np.concatenate([model.vectors.combined(state.phi), state.own])


def products(
    model: Reduced, effects: Sequence[Effect], x: np.ndarray, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """K(x) q and M(x) q (n + n_own, k) on the full operators, never assembled."""
    system, groups = model.groups.structure.system, model.groups
    n = model.vectors.shape[0]
    n_own, u = len(q) - n, q[:n]
    K, M = system.elastic @ u, system.M @ u
    logs = {k: v[groups.group, None, None] for k, v in log_fields(model, effects, x)[0].items()}
    change: np.ndarray | float = 0.0
    for name, pair in model.pieces():
        change = change + sum(
            np.expm1(stiffness_log(logs, name, power)) * A
            for A, power in zip(pair, (1, 3), strict=True)
        )
    K = K + _spread(model, np.asarray(change), u)
    M = M + _spread(model, np.expm1(mass_log(logs)) * groups.mass, u)
    K, M = (np.pad(A, ((0, n_own), (0, 0))) for A in (K, M))
    frame = _without_rise(model, effects, x)
    for (effect, at), first in zip(slices(effects), own_positions(effects), strict=True):
        for term in effect.terms(x[at]):
            rows = model.wide(term.rows, term.strained)
            beside = sp.csr_array((rows.shape[0], n - rows.shape[1]))
            own = sp.csr_array(own_part(term, first, n_own))
            b = sp.hstack([rows, beside, own], format="csr")
            added = b.T @ (term.coefficient[:, None] * (b @ q))
            K, M = (K + added, M) if term.matrix == "K" else (K, M + added)
        for part in effect.matrices(x[at]):
            m = part.operator.shape[0]
            strained = applied(part, u[:m], frame, system.M)
            added = np.pad(part.coefficient * strained, ((0, len(q) - m), (0, 0)))
            K, M = (K + added, M) if part.matrix == "K" else (K, M + added)
    return K, M


@dataclass(frozen=True, eq=False)
class _Level(Effect):
    """An effect whose stiffness does not rise."""

    of: Effect = field(default_factory=Effect)

    def fields(self, x: np.ndarray) -> tuple[FieldChange, ...]:
        """As of the effect."""
        return self.of.fields(x)

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The same without their rise."""
        return tuple(replace(part, rise=None) for part in self.of.matrices(x))


def _without_rise(model: Reduced, effects: Sequence[Effect], x: np.ndarray) -> UnrisenModes:
    """The modes in which stiffness that rises is multiplied; none where nothing rises."""
    rising = {
        id(e) for e, at in slices(effects) if any(m.rise is not None for m in e.matrices(x[at]))
    }
    if not rising:
        return UnrisenModes(np.zeros(0), np.zeros((model.vectors.shape[0], 0)))
    level = [_Level(e.parameters, of=e) if id(e) in rising else e for e in effects]
    state = evaluate(model, level, x, gradient=False)
    return UnrisenModes(state.lam, model.vectors.combined(state.phi))


def _spread(model: Reduced, matrices: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Σ_e Tᵀ A_e T q of the shells' matrices (m, 24, 24)."""
    T, nodes = model.groups.structure.T, model.groups.nodes
    dofs = (6 * nodes[:, :, None] + np.arange(6)).reshape(len(nodes), 24)
    force = matrices @ (T @ q)[dofs]
    gather = sp.csr_array(
        (np.ones(dofs.size), (dofs.ravel(), np.arange(dofs.size))), shape=(T.shape[0], dofs.size)
    )
    return T.T @ (gather @ force.reshape(dofs.size, q.shape[1]))
