"""Scan of all places at once, by exact low-rank re-analysis with linear marginalisation.

The structure with a dynamic stiffness D(s) at b has the receptance G_of - G_ob (1/D + G_bb)⁻¹ G_bf.
D is a spring k, a mass m s² or a mass on a spring, m s² ω²/(ω² + s²).  G_bb includes the residual
flexibility beyond the basis.  Calibration parameters, scatter and the errors of the model's form
are marginalised: C = I + W Wᵀ with W the slopes times the prior standard deviations (Woodbury).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..dynamics.modal_sum import modal_sum
from ..effects.effect import Effect, FieldChange, Parameter
from ..effects.effect_context import ElementGrids
from ..reduced.matrix_slopes import MatrixSlopes
from ..reduced.reduced_model import Reduced, State, evaluate
from .likelihood import Data, Responses
from .map_fit import MassMeasurement, unknowns


@dataclass(frozen=True, eq=False)
class Baseline:
    """A state of the base effects, linearised to score small changes.

    ``Z`` (k, n) is such that rᵀ C⁻¹ r = |r|² - |Z r|², with the row of the weighing.
    """

    effects: tuple[Effect, ...]
    x: np.ndarray
    state: State
    residual: np.ndarray
    Z: np.ndarray
    mass_measurement: MassMeasurement | None

    def score(self, residuals: np.ndarray) -> np.ndarray:
        """rᵀ C⁻¹ r of every column (n, m) -> (m,)."""
        return (residuals**2).sum(axis=0) - ((self.Z @ residuals) ** 2).sum(axis=0)

    def with_mass(self, r: np.ndarray, added: np.ndarray | float) -> np.ndarray:
        """The data's residuals (n_data, m) with the row of the weighing below them."""
        if self.mass_measurement is None:
            return r
        row = (self.state.weight + added - self.mass_measurement.mass) / self.mass_measurement.sd
        return np.concatenate([r, np.broadcast_to(row, (1, r.shape[1]))])


def baseline(
    model: Reduced,
    effects: Sequence[Effect],
    data: Data,
    mass_measurement: MassMeasurement | None,
    x: np.ndarray,
) -> Baseline:
    """Linearise the base effects at x."""
    state = evaluate(model, effects, x)
    r, J = data.scaled(state, True)
    shapes = np.zeros((len(r), 0))
    if isinstance(data, Responses) and (error := data.error) is not None:
        shapes = error.U * (error.delta * np.sqrt(error.s))
    if mass_measurement is not None:
        r = np.append(r, (state.weight - mass_measurement.mass) / mass_measurement.sd)
        J = np.concatenate([J, state.dweight[None] / mass_measurement.sd])
        shapes = np.concatenate([shapes, np.zeros((1, shapes.shape[1]))])
    W = np.concatenate([J * np.array([p.sd for p in unknowns(effects)]), shapes], axis=1)
    L = np.linalg.cholesky(np.eye(W.shape[1]) + W.T @ W)
    Z = np.linalg.solve(L, W.T)
    return Baseline(tuple(effects), x, state, r, Z, mass_measurement)


def point_scores(
    base: Baseline, model: Reduced, data: Responses, places: ElementGrids, matrix: str,
    strengths: np.ndarray, residual_flexibility: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Score of one mass or spring of each strength at each place (n_places, n_strengths).

    Strengths are in kg or N/m, the flexibility (n_places,) of places beyond the basis in m/N.
    """
    residuals = reanalysis(base, model, data, places, residual_flexibility, matrix == "M")
    out = np.empty((len(places), len(strengths)))
    for k, c in enumerate(strengths):
        D, added = (c * data.s**2, c) if matrix == "M" else (c + 0 * data.s, 0.0)
        out[:, k] = base.score(residuals(D, added))
    return out


def oscillator_scores(
    base: Baseline, model: Reduced, data: Responses, places: ElementGrids, mass: float,
    hertz: np.ndarray, residual_flexibility: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Best mass on a spring at each place, and the score with it (n_places, n_hertz).

    The responses are taken as linear in the mass along the secant from none to ``mass`` [kg]. The
    frequencies ``hertz`` are those of the mass on its spring with a fixed base.
    """
    residuals = reanalysis(base, model, data, places, residual_flexibility, True)
    amount, score = np.empty((2, len(places), len(hertz)))
    for k, omega2 in enumerate((2 * np.pi * hertz) ** 2):
        D = mass * data.s**2 * omega2 / (omega2 + data.s**2)
        secant = residuals(D, mass) - base.residual[:, None]
        amount[:, k], score[:, k] = direction_scores(base, secant)
    return mass * amount, score


def reanalysis(
    base: Baseline, model: Reduced, data: Responses, places: ElementGrids,
    residual_flexibility: np.ndarray, massive: bool,
) -> Callable[[np.ndarray, float], np.ndarray]:  # fmt: skip
    """Residuals (n, n_places) with a dynamic stiffness D (n_f,) and so much mass [kg] at a place.

    A ``massive`` addition is also loaded by base motion; a spring only by the structure's motion.
    """
    phi_o, phi_i, d = data.modal(base.state)
    phi_b = model.rows(places.rows) @ base.state.phi
    H = data.receptance(base.state, phi_o, phi_i, d)
    G_ob = base.state.between(data.s, d, phi_o, phi_b).transpose(2, 0, 1)
    G_bi = base.state.between(data.s, d, phi_b, phi_i).transpose(1, 0, 2)
    G_bb = (phi_b**2) @ d.T + residual_flexibility[:, None]
    if massive and model.base is not None:
        moved_with_base = model.base.motion.moved_with_base(places.rows)
        G_bi = G_bi + moved_with_base[:, None] / (data.s**2)[:, None]

    def residuals(D: np.ndarray, added: float) -> np.ndarray:
        share = D / (1 + D * G_bb)
        change = G_ob[..., None] * (share[:, :, None, None] * G_bi[:, :, None, :])
        delta = data.deviation(base.state, H[None] - change)
        return base.with_mass(data.stacked(delta / data.std()), added)

    return residuals


@dataclass(frozen=True, eq=False)
class _Probe(Effect):
    """A field such as t, E or rho, with one parameter for every group."""

    field: str = "t"

    def terms(self, x: np.ndarray) -> tuple[FieldChange, ...]:
        """The logarithm of the field in each group is one parameter."""
        return (FieldChange(self.field, x, np.eye(len(x))),)


def field_slopes(base: Baseline, model: Reduced, data: Data, field: str) -> np.ndarray:
    """∂r/∂ln t, E or rho of every group, including the row of the weighing (n, n_groups)."""
    groups = range(len(model.groups.undivided))
    unknown = tuple(Parameter(str(g), "-", 0.0, 1.0, kind="linear") for g in groups)
    return effect_slopes(base, model, data, _Probe(unknown, field=field))


def effect_slopes(base: Baseline, model: Reduced, data: Data, effect: Effect) -> np.ndarray:
    """∂r/∂x of an effect at its nominal values, including the row of the weighing (n, n_p)."""
    nominal = np.array([p.nominal for p in effect.parameters])
    state = evaluate(model, [*base.effects, effect], np.concatenate([base.x, nominal]))
    J = data.scaled_slopes(state)
    if base.mass_measurement is not None:
        J = np.concatenate([J, state.dweight[None] / base.mass_measurement.sd])
    return J[:, len(base.x) :]


AT_ONCE = 64  # number of changes whose slopes are in memory at a time


def bending_slopes(
    base: Baseline, model: Reduced, data: Data, sets: Sequence[np.ndarray]
) -> np.ndarray:
    """∂r/∂a of a·B added to K, with B the bending stiffness of each set of shells (n, n_sets)."""
    groups, dofs, r = model.groups, model.groups.dofs, model.vectors.shape[1]
    # stiffness changes no load of a base, and no shapes except those of the modes
    still = replace(base.state.without_slopes(), doffset=None, ddrive=None, dmoved={})
    out = [np.zeros((len(base.residual), 0))]
    for k in range(0, len(sets), AT_ONCE):
        chunk = sets[k : k + AT_ONCE]

        def bent(
            z: np.ndarray, forces: np.ndarray, first: int, chunk: Sequence[np.ndarray] = chunk
        ) -> None:
            for force, shells in zip(forces, chunk, strict=True):
                V = model.vectors.seen(groups.structure.T[dofs[shells].ravel()])
                own = groups.cubic[shells] @ (V @ z[:r]).reshape(len(shells), dofs.shape[1], -1)
                force[:r] += V.T @ own.reshape(len(V), -1)

        dK, dM = MatrixSlopes(len(chunk), [(len(chunk) - 1, bent)]), MatrixSlopes(len(chunk))
        J = data.scaled_slopes(replace(still, dK=dK, dM=dM))
        rest = len(base.residual) - len(J)  # the row of the weighing does not change
        out.append(np.concatenate([J, np.zeros((rest, len(chunk)))]))
    return np.concatenate(out, axis=1)


def spin_scores(
    base: Baseline, model: Reduced, data: Responses, rows: sp.csr_array, sd: float
) -> tuple[np.ndarray, np.ndarray]:
    """Angular momentum of a spinning part at each place (k, 3), and the score with it (k,).

    The responses are linear in it about none, its prior is N(0, sd²) along each axis:
    dH = -s G_oβ S G_βi with S = -[h]×.

    ``rows`` (3k, n) are the rotations of each place about the axes of the basic frame.
    """
    (phi_o, phi_i, d), state, s = data.modal(base.state), base.state, data.s
    per_line = -sd * s ** (1 + data.power)
    unit = data.model(state) * np.log(10) * data.std() / per_line[:, None, None]
    r, Zr = base.residual, base.Z @ base.residual
    amounts, gains = [np.zeros((0, 3))], [np.zeros(0)]
    for first in range(0, rows.shape[0], 3 * AT_ONCE):
        beta = model.rows(rows[first : first + 3 * AT_ONCE], keep=False) @ state.phi
        k = len(beta) // 3
        G_o = state.between(s, d, phi_o, beta).reshape(len(s), -1, k, 3).transpose(2, 3, 0, 1)
        G_i = state.between(s, d, beta, phi_i).reshape(len(s), k, 3, -1).transpose(1, 2, 0, 3)
        # a S b is h · (a x b), so entry c of the product is that of spin about the axis c
        dH = np.cross(G_o[..., None], G_i[..., None, :], axis=1).reshape(-1, *unit.shape)
        c = data.stacked(dH / unit)
        c = np.pad(c, ((0, len(r) - len(c)), (0, 0)))  # the weighing does not change
        each, Z = (v.reshape(-1, k, 3).swapaxes(0, 1) for v in (c, base.Z @ c))
        A = np.eye(3) + each.swapaxes(1, 2) @ each - Z.swapaxes(1, 2) @ Z
        b = (r @ each - Zr @ Z)[..., None]
        step = np.linalg.solve(A, b)
        amounts.append(-sd * step[..., 0])
        gains.append((b * step).sum(axis=(1, 2)))
    return np.concatenate(amounts), base.score(r[:, None])[0] - np.concatenate(gains)


def dashpot_scores(
    base: Baseline, model: Reduced, data: Responses, places: ElementGrids
) -> np.ndarray:
    """Score of a dashpot c ≥ 0 across each place (k,), linear in c.

    Equalised responses show only how it couples different modes: dH = -s φ_o D C D φ_i with
    C = c bᵀb off its diagonal.
    """
    (phi_o, phi_i, d), state, s = data.modal(base.state), base.state, data.s
    unit = data.model(state) * np.log(10) * data.std() / -(s[:, None, None] ** (1 + data.power))
    beta, out = model.rows(places.rows, keep=False) @ state.phi, [np.zeros(0)]
    for first in range(0, len(beta), AT_ONCE):
        b = beta[first : first + AT_ONCE]
        G_o, G_i = state.between(s, d, phi_o, b), state.between(s, d, b, phi_i)
        own = np.stack([modal_sum(phi_o * each**2, d**2, phi_i) for each in b])
        dH = G_o.transpose(2, 0, 1)[..., None] * G_i.transpose(1, 0, 2)[:, :, None] - own
        c = data.stacked(dH / unit)
        c = np.pad(c, ((0, len(base.residual) - len(c)), (0, 0)))
        amount, score = direction_scores(base, c)
        out.append(np.where(amount > 0, score, np.inf))
    return np.concatenate(out)


def direction_scores(base: Baseline, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best amount a of each column c, and its score min_a (r + a c)ᵀ C⁻¹ (r + a c)."""
    Zc, Zr = base.Z @ columns, base.Z @ base.residual
    cc = (columns**2).sum(axis=0) - (Zc**2).sum(axis=0)
    cr = columns.T @ base.residual - Zc.T @ Zr
    amount = -cr / np.maximum(cc, 1e-12)
    return amount, base.score(base.residual[:, None])[0] - cr**2 / np.maximum(cc, 1e-12)
