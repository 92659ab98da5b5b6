"""The contract of effects, first part: one effect over a reduced model.

A rule returns the number that it measured, in words. It raises :class:`BrokenRule` where the
effect breaks it: one sentence with the number and the remedy.
"""

import copy
import json
import pickle
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from chladni.effects.effect import ChannelChange, Effect, MatrixTerm, of
from chladni.errors import AccuracyError, ModelError, named
from chladni.reduced.gyroscopic import whirling
from chladni.reduced.reduced_model import Reduced, State, evaluate

EXACT = 1e-5  # of a slope: largest deviation from the difference of fourth order
STEP = 1e-3  # of x in these differences
IDLE = 1e-6, 1e-9  # relative: largest change of λ and of the weight at the nominal values
ACTS = 1e-4  # relative: least change of a λ where the effect acts
ACTS_ON_CHANNELS = 0.01  # least change of log10 H where an effect of the test acts
REACH, DRAWS = 3.0, 20  # standard deviations of the prior, and draws, where K and M stay positive
SYMMETRIC = 1e-9  # of an operator: largest |A - Aᵀ| over the largest |A|


class BrokenRule(AccuracyError):
    """An effect breaks a rule of the contract; the sentence says which number and the remedy."""


@dataclass(frozen=True, eq=False)
class ActingEffect:
    """An effect on a reduced model."""

    effect: Effect
    x: np.ndarray  # (n_p,) at which it acts
    idle: np.ndarray  # (n_p,) at which it does nothing
    model: Reduced  # over a basis that can represent it near x
    flexible: slice  # positions of the eigenvalues that are compared

    def state(self, x: np.ndarray, gradient: bool = False) -> State:
        """The model with the effect at x."""
        return evaluate(self.model, [self.effect], x, gradient)

    def lam(self, x: np.ndarray) -> np.ndarray:
        """Eigenvalues ω² of the flexible modes with the effect at x [rad²/s²]."""
        return eigenvalues(self.state(x))[self.flexible]

    @property
    def without(self) -> State:
        """The model without the effect."""
        return evaluate(self.model, [], np.zeros(0), False)


def eigenvalues(state: State) -> np.ndarray:
    """ω² (m,) [rad²/s²], with spinning parts those of the whirling structure."""
    if state.spin is None:
        return state.lam
    rows = state.spin.rows
    return whirling(state.lam, rows.T @ state.spin.matrix @ rows)[0] ** 2


def slopes_of_eigenvalues(state: State) -> np.ndarray:
    """∂(ω²)/∂x (n_p, m); of whirling modes ψ 2ω² ψ*(i dG)ψ / ψ*(2ω - iG)ψ by spinning parts."""
    assert state.dK is not None
    assert state.dM is not None
    if state.spin is None:
        return np.asarray(state.dK.along(state.vectors) - state.lam * state.dM.along(state.vectors))
    rows, out = state.spin.rows, np.zeros((state.dK.count, len(state.lam)))
    omega, psi = whirling(state.lam, rows.T @ state.spin.matrix @ rows)
    seen = rows @ psi
    turned = (seen.conj() * (state.spin.matrix @ seen)).sum(axis=0)
    size = 2 * omega * (np.abs(psi) ** 2).sum(axis=0) + turned.imag
    for p, (L, R) in state.spin.slopes.items():
        own = ((L @ psi).conj() * (R @ psi)).sum(axis=0)
        out[p] = -2 * omega**2 * own.imag / np.where(size, size, 1.0)
    return out


def exact_slopes(acting: ActingEffect) -> str:
    """∂λ/∂x, ∂m/∂x and ∂log10 H/∂x equal differences of fourth order."""
    x, state = acting.x, acting.state(acting.x, gradient=True)
    slopes = slopes_of_eigenvalues(state)[:, acting.flexible]
    rounding = 30 * np.finfo(float).eps * float(state.lam.max())
    worst, heavier = 0.0, _weight_slopes(acting)
    for k, parameter in enumerate(acting.effect.parameters):
        due, noise = _difference(acting.lam, x, k, rounding)
        scale = np.abs(due).max() + 1e-3 * state.lam[acting.flexible][0]
        off = _deviation(slopes[k], due, scale + noise / EXACT)
        worst = max(worst, off)
        if off > EXACT:
            r = int(np.argmax(np.abs(slopes[k] - due)))
            raise BrokenRule(
                f"the gradient of terms(x) by {parameter.name} is wrong: ω² of mode {r + 1} has "
                f"the slope {slopes[k][r]:.5g} by it and {due[r]:.5g} by differences; correct the "
                f"derivatives of the coefficients by x[{k}]"
            )
        scale = np.abs(heavier).max() + 1e-6 * state.weight
        off = _deviation(state.dweight[k], heavier[k], scale)
        worst = max(worst, off)
        if off > EXACT:
            raise BrokenRule(
                f"the gradient of weight(x) by {parameter.name} is wrong: {state.dweight[k]:.5g} "
                f"kg by it and {heavier[k]:.5g} kg by differences; correct Weight.gradient[{k}]"
            )
    _exact_channels(acting)
    return f"largest deviation {worst:.1e} of {EXACT:.0e}"


def _weight_slopes(acting: ActingEffect) -> np.ndarray:
    """∂m/∂x by differences (n_p,) [kg]."""

    def weight(x: np.ndarray) -> np.ndarray:
        return np.array([acting.state(x).weight])

    return np.array([_difference(weight, acting.x, k, 0.0)[0][0] for k in range(len(acting.x))])


def _exact_channels(acting: ActingEffect) -> None:
    """The gradient of the channels' log10 H, to 1e-9."""
    for change in of(ChannelChange, acting.effect.terms(acting.x)):

        def levels(y: np.ndarray) -> np.ndarray:
            return of(ChannelChange, acting.effect.terms(y))[0].value

        for k, parameter in enumerate(acting.effect.parameters):
            due, _ = _difference(levels, acting.x, k, 0.0)
            off = float(np.abs(change.gradient[:, k] - due).max())
            if off > 1e-9:
                raise BrokenRule(
                    f"the gradient of ChannelChange by {parameter.name} is off by {off:.2g}; "
                    f"correct its column {k}"
                )


def _deviation(found: np.ndarray | float, due: np.ndarray | float, scale: float) -> float:
    """Largest |found - due| / (|due| + scale)."""
    return float(np.max(np.abs(found - due) / (np.abs(due) + scale)))


def _difference(
    f: Callable[[np.ndarray], np.ndarray], x: np.ndarray, k: int, rounding: float
) -> tuple[np.ndarray, float]:
    """∂f/∂x_k to fourth order, and what the rounding of f leaves of it."""
    e = STEP * np.eye(len(x))[k]
    due = (8 * (f(x + e) - f(x - e)) - (f(x + 2 * e) - f(x - 2 * e))) / (12 * STEP)
    return due, 1.5 * rounding / STEP


def idle_at_nominal(acting: ActingEffect) -> str:
    """λ, m and the channels are those without the effect where its parameters are nominal."""
    idle, without = acting.state(acting.idle), acting.without
    at = acting.flexible
    n_own = len(idle.lam) - len(without.lam)
    moved = float(np.abs(eigenvalues(idle)[at] / without.lam[at] - 1).max())
    if moved > IDLE[0]:
        raise BrokenRule(
            f"at the nominal values {_values(acting.effect, acting.idle)} the effect moves ω² by "
            f"{moved:.2g} (at most {IDLE[0]:g} is nothing); its terms must vanish there, or "
            "Parameter.nominal must be where they do"
        )
    heavier = float(abs(idle.weight / without.weight - 1))
    if heavier > IDLE[1]:
        raise BrokenRule(
            f"at the nominal values the effect weighs {idle.weight - without.weight:.3g} kg; "
            "weight(x) must vanish there"
        )
    if idle.offset is not None and float(np.abs(idle.offset).max()) > 1e-12:
        raise BrokenRule(
            f"at the nominal values the channels change by {np.abs(idle.offset).max():.2g} "
            "decades; ChannelChange must vanish there"
        )
    return f"ω² moves by {moved:.1e}" + (f", {n_own} dofs of its own" if n_own else "")


def acts(acting: ActingEffect, least: float = ACTS) -> str:
    """Where the effect acts it moves λ or the channels, and not both."""
    at, state, without = acting.flexible, acting.state(acting.x), acting.without
    moved = float(np.abs(eigenvalues(state)[at] / without.lam[at] - 1).max())
    offset = 0.0 if state.offset is None else float(np.abs(state.offset).max())
    by_modes, by_channels = moved > least, offset > ACTS_ON_CHANNELS
    if by_modes and by_channels:
        raise BrokenRule(
            f"the effect moves ω² by {moved:.2g} and the channels by {offset:.2g} decades; make "
            "two effects of it, because one is of the structure and one of the test"
        )
    if not (by_modes or by_channels):
        raise BrokenRule(
            f"at {_values(acting.effect, acting.x)} no ω² moves by more than {moved:.1e} (at "
            f"least {least:g} is due); raise Parameter.scale or its starts"
        )
    return f"channels move by {offset:.2g} decades" if by_channels else f"ω² moves by {moved:.2g}"


def symmetric_operators(acting: ActingEffect) -> str:
    """A = Aᵀ for every operator."""
    worst = 0.0
    for k, term in enumerate(of(MatrixTerm, acting.effect.terms(acting.x))):
        off = sp.csr_array(term.operator - term.operator.T)
        largest = float(np.abs(term.operator.data).max(initial=0.0))
        share = float(np.abs(off.data).max(initial=0.0)) / max(largest, 1e-300)
        worst = max(worst, share)
        if share > SYMMETRIC:
            raise BrokenRule(
                f"the operator of MatrixTerm {k + 1} (to {term.matrix}) is not symmetric: "
                f"|A - Aᵀ| reaches {share:.2g} of |A|; a conservative effect has a symmetric one"
            )
    return f"largest |A - Aᵀ| {worst:.1e} of |A|"


def positive_matrices(acting: ActingEffect) -> str:
    """K ≥ 0 and M > 0 within three standard deviations of the prior."""
    rng = np.random.default_rng(3)
    parameters = acting.effect.parameters
    mean, sd = (np.array([getattr(p, q) for p in parameters]) for q in ("mean", "sd"))
    lowest = 0.0
    for _ in range(DRAWS):
        x = mean + sd * rng.uniform(-REACH, REACH, len(sd))
        try:
            lam = acting.state(x).lam  # raises where M is not positive
        except (ModelError, np.linalg.LinAlgError) as error:
            raise BrokenRule(
                f"at {_values(acting.effect, x)}, within the prior, the matrices are not positive "
                f"({error}); correct the unit (SI) or the sd of the prior, or keep coefficients "
                "above -1"
            ) from error
        share = float(lam[0] / lam[acting.flexible][0])
        lowest = min(lowest, share)
        if share <= -1e-6:
            raise BrokenRule(
                f"at {_values(acting.effect, x)}, within the prior, the lowest ω² is "
                f"{lam[0]:.3g} rad²/s²: K is not positive; correct the unit (SI) or the sd of the "
                "prior, or keep coefficients above -1"
            )
    return f"lowest ω² {lowest:.1e} of the first flexible one"


def idle_in_remade_structure(acting: ActingEffect) -> str:
    """A strong effect does nothing in the structure that contains it (``in_structure``)."""
    if not acting.effect.traits.remakes_structure:
        return "not of this kind"
    again = replace(acting, effect=replace(acting.effect, in_structure=acting.x))
    at = acting.flexible
    moved = float(np.abs(again.lam(acting.x) / acting.without.lam[at] - 1).max())
    if moved > 1e-12:
        raise BrokenRule(
            f"with in_structure = x the effect still moves ω² by {moved:.2g}; its terms must "
            "be those of x relative to in_structure"
        )
    return f"ω² moves by {moved:.1e}"


def survives_pickling(acting: ActingEffect) -> str:
    """Processes hand effects to one another: a copy does the same at the same place."""
    try:
        pickle.dumps(acting.effect)
        again = copy.deepcopy(acting.effect)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise BrokenRule(
            f"the effect cannot be pickled ({error}); keep functions and classes at the top level "
            "of the module"
        ) from error
    one, two = acting.lam(acting.x), replace(acting, effect=again).lam(acting.x)
    same = np.allclose(two, one, rtol=1e-12, atol=0)
    if not same or again.location(acting.x) != acting.effect.location(acting.x):
        raise BrokenRule(
            "a copy of the effect acts in another way; keep its data in fields of the dataclass"
        )
    return "a copy does the same"


def reports_in_json(acting: ActingEffect) -> str:
    """Estimates and places are finite plain data, and every value lies within its interval."""
    effect, sd = acting.effect, np.full(len(acting.x), 0.1)
    rows = effect.reported(acting.x, sd)
    said = (*rows, effect.location(acting.x), effect.where())
    try:
        json.dumps([vars(one) for one in said], allow_nan=False)
    except (TypeError, ValueError) as error:
        raise BrokenRule(
            f"reported(x, sd) or location(x) holds what JSON does not ({error}); use float, int, "
            "str and tuples of them, all finite"
        ) from error
    for row in rows:
        if row.low is None or row.high is None or not row.low <= row.value <= row.high:
            raise BrokenRule(
                f"the estimate of {row.name} is {row.value:.4g} with the interval {row.low} to "
                f"{row.high}; the value must lie within it"
            )
    return named(f"{row.name} = {row.value:.3g} {row.unit}" for row in rows)


def _values(effect: Effect, x: np.ndarray) -> str:
    """Parameters at x in words: ``a = 0.003 m``."""
    values = zip(effect.parameters, x, strict=True)
    return named(f"{p.name} = {p.value(float(v)):.3g} {p.unit}" for p, v in values)
