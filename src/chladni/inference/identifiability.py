"""Identifiability of calibration parameters, from slopes at the nominal state, before any fit.

J are the slopes of the whitened data by the parameters θ and the nuisances ν, each in standard
deviations of its prior.  The information of the data on θ with the nuisances free is F = J_θᵀ J_θ -
J_θᵀ J_ν (J_νᵀ J_ν + I)⁻¹ J_νᵀ J_θ (Walter and Pronzato 1997, Identification of Parametric Models,
ch. 4 and 6).  With priors the covariance is (F + I)⁻¹.  A parameter is known to the data where this
variance is at most half of the prior's: the data then tell more than the prior.  Parameters that
trade off share one combination.  They are frozen one at a time, the least known first, until the
data know the rest.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..effects.calibration_parameters import REASONS
from ..effects.effect import Effect
from ..effects.joint_stiffness import FAR
from ..effects.user_parameters import UserParameter
from ..reduced.effect_dofs import slices
from ..reduced.reduced_model import State, evaluate
from .calibration_result import Identifiability, ParameterKnowledge, ValueAndSpread
from .hypothesis_fit import UpdatingProblem
from .likelihood import Responses
from .map_fit import MassMeasurement, unknowns
from .pole_data import Poles

HALF = 0.5  # of the prior's variance: the data know less than the prior of what keeps more
PARTNER = 0.1  # of the information on a parameter: partners of a trade-off carry at least so much
WEIGHED = 0.003  # sd of ln mass of a workshop's scales, where nothing was weighed
DECADES = 0.3  # prior sd of ln: parameters as uncertain as that are looked at along their range
ALONG = (-2.0, -1.0, 1.0, 2.0)  # prior sd from the mean at which they are looked at
TIED = 1e-6  # shares of variance as near as that are equal: then the later parameter is frozen
PAIRED = 0.1  # spread of ln f within which poles are paired at the nominal state


@dataclass(frozen=True, eq=False)
class Information:
    """Fisher information (p, p) on parameters in prior standard deviations.

    ``data`` is that of the fitted data, ``weighing`` (p,) the slope of the mass over its standard
    deviation. Where nothing was weighed, ``weighing`` is that of a workshop's scales and is not
    counted (``weighed`` is False).
    """

    data: np.ndarray
    weighing: np.ndarray
    weighed: bool

    def total(self, weighed: bool | None = None) -> np.ndarray:
        """The information with or without the weighing; by default as it was measured."""
        on = self.weighed if weighed is None else weighed
        return self.data + (np.outer(self.weighing, self.weighing) if on else 0.0)

    def left(self, free: np.ndarray, weighed: bool | None = None) -> np.ndarray:
        """Share of each free parameter's prior variance that the data leave (len(free),)."""
        F = self.total(weighed)[np.ix_(free, free)]
        return np.asarray(np.diag(np.linalg.inv(F + np.eye(len(F)))))

    def frozen(self, at: Sequence[np.ndarray], weighed: bool | None = None) -> list[int]:
        """Positions in ``at`` of effects that the data do not know, in the order of freezing.

        ``at`` are the positions of the parameters of each effect, which is frozen as a whole.
        """
        kept, out = list(range(len(at))), []
        while kept:
            left = self.left(np.concatenate([at[k] for k in kept]), weighed)
            ends = np.cumsum([len(at[k]) for k in kept])
            least = [v.min() for v in np.split(left, ends[:-1])]
            worst = int(np.flatnonzero(np.array(least) > max(least) - TIED)[-1])
            if least[worst] <= HALF:
                break
            out.append(kept.pop(worst))
        return out


def information(problem: UpdatingProblem, x: np.ndarray) -> Information:
    """Information on the calibration parameters at base parameters x, all nuisances free."""
    state = evaluate(problem.reduced.model, problem.base, x)
    sd = np.array([p.sd for p in unknowns(problem.base)])
    own = calibration_positions(problem.base)
    rest = np.setdiff1d(np.arange(len(sd)), own)
    J = _slopes(problem.data, state) * sd
    A, B = J[:, own], J[:, rest]
    mixed = np.linalg.solve(B.T @ B + np.eye(len(rest)), B.T @ A)
    mass = problem.mass_measurement or MassMeasurement(state.weight, WEIGHED * state.weight)
    weighing = state.dweight[own] * sd[own] / mass.sd
    return Information(A.T @ A - (A.T @ B) @ mixed, weighing, problem.mass_measurement is not None)


def effective_number(problem: UpdatingProblem) -> float:
    """Effective number of calibration parameters, Σ (1 - σ² after / σ² before) (MacKay 1992).

    A parameter that its prior knows far better than the data takes nothing from them.
    """
    found = information(problem, problem.mean())
    return float(len(found.data) - found.left(np.arange(len(found.data))).sum())


def _slopes(data: Responses | Poles, state: State) -> np.ndarray:
    """Slopes of the whitened data; natural frequencies are paired in a wide window first."""
    if not isinstance(data, Poles):
        return data.residual(state, True)[1]
    wide = replace(data.all_paired(), scale=PAIRED)
    return data.scaled(state, True, wide.pairs(state))[1]


def calibration_positions(effects: Sequence[Effect]) -> np.ndarray:
    """Positions in x of the parameters of calibration parameters."""
    each = [np.arange(at.start, at.stop) for e, at in slices(effects) if e.kind == "calibration"]
    return np.concatenate([np.zeros(0, int), *each])


def identifiability(problem: UpdatingProblem) -> Identifiability:
    """Judge which calibration parameters the data can determine, before any fit.

    ``problem`` has its error of form about the nominal state. Parameters uncertain by more than
    ``DECADES`` are also looked at along their range: those that the data know anywhere are free.
    """
    mean, effects = problem.mean(), [e for e in problem.base if e.kind == "calibration"]
    at = [np.arange(own.start, own.stop) for _, own in slices(effects)]
    nominal = information(problem, mean)
    curves = dict(_curves(problem, mean))
    frozen = [k for k in nominal.frozen(at) if not _known_somewhere(curves, at[k])]
    settled = set(frozen) - set(nominal.frozen(at, True)) if not nominal.weighed else set()
    return _in_words(effects, at, nominal, frozen, settled, curves)


Curves = dict[int, tuple[ValueAndSpread, ...]]


def _known_somewhere(curves: Curves, at: np.ndarray) -> bool:
    return any(point.known for k in at for point in curves.get(int(k), ()))


def _curves(
    problem: UpdatingProblem, mean: np.ndarray
) -> Iterator[tuple[int, tuple[ValueAndSpread, ...]]]:
    """Information on each uncertain parameter along its range, all others at their mean."""
    every = unknowns(problem.base)
    for k, column in enumerate(calibration_positions(problem.base)):
        p = every[column]
        if p.kind != "log" or p.sd < DECADES:
            continue
        points = []
        for z in sorted((*ALONG, 0.0)):
            x = mean.copy()
            x[column] += z * p.sd
            F = float(information(problem, x).total()[k, k])
            points.append(
                ValueAndSpread(p.value(x[column]), _sd(p.sd, F), bool(1 / (1 + F) <= HALF))
            )
        yield k, tuple(points)


def _sd(prior: float, F: float) -> float | None:
    """Standard deviation from the data alone; None where they know nothing."""
    return float(prior / np.sqrt(F)) if F > 0 else None


def _in_words(
    effects: Sequence[Effect], at: Sequence[np.ndarray], told: Information, frozen: Sequence[int],
    settled: Collection[int], curves: Curves,
) -> Identifiability:  # fmt: skip
    """The table of all parameters, with the reason of each that is frozen.

    A weighing would settle the effects ``settled`` among these.
    """
    names = parameter_names(effects)
    every, plausible = unknowns(effects), [r for e in effects for r in _plausible(e)]
    prior = np.array([p.sd for p in every])
    F = told.total()
    held = np.array([k for f in frozen for k in at[f]], int)
    by_scales = {int(k) for f in settled for k in at[f]}
    free = np.setdiff1d(np.arange(len(names)), held)
    after = np.ones(len(names))
    after[free] = told.left(free) if len(free) else after[free]
    alone = _alone(F)
    rows = tuple(
        ParameterKnowledge(
            names[k], every[k].value(every[k].nominal), every[k].unit, float(prior[k]),
            _sd(prior[k], F[k, k]),
            None if alone[k] is None else float(prior[k] * alone[k]),
            float(prior[k] * np.sqrt(after[k])), bool(k in held),
            _why(k, names, prior, F) + (_BY_SCALES if k in by_scales else "")
            if k in held
            else _settled(k, told, held),
            *plausible[k], REASONS.get(every[k].name, ""), curves.get(k, ()),
        )
        for k in range(len(names))
    )  # fmt: skip
    C = np.linalg.inv(F + np.eye(len(F)))
    sd = np.sqrt(np.diag(C))
    C /= np.outer(sd, sd)
    return Identifiability(
        rows, tuple(map(tuple, C.tolist())), collinearity(F), tuple(_directions(F, names, prior)),
        told.weighed,
    )  # fmt: skip


def _plausible(effect: Effect) -> Iterator[tuple[float, float]]:
    """Values of each parameter beyond which it stands for something else."""
    for p in effect.parameters:
        low, high = (p.value(p.mean + z * FAR * p.sd) for z in (-1, 1))
        if isinstance(effect, UserParameter) and len(effect.parameters) == 1:
            low = max(low, p.value(effect.low)) if np.isfinite(effect.low) else low
            high = min(high, p.value(effect.high)) if np.isfinite(effect.high) else high
        yield low, high


def parameter_names(effects: Sequence[Effect]) -> list[str]:
    """Name of every parameter: the text of its effect; its own name before it among several."""
    return [
        e.text if len(e.parameters) == 1 else f"{p.name} of {e.text}"
        for e in effects
        for p in e.parameters
    ]


def _alone(F: np.ndarray) -> list[float | None]:
    """Standard deviation of each parameter from the data alone; None where it has no bound."""
    scale = np.sqrt(np.maximum(np.diag(F), 0.0))
    seen = np.flatnonzero(scale > 0)
    out: list[float | None] = [None] * len(F)
    if not len(seen):
        return out
    R = F[np.ix_(seen, seen)] / np.outer(scale[seen], scale[seen])
    w, V = np.linalg.eigh(R)
    null = w < len(w) * np.finfo(float).eps * 1e3
    for n, k in enumerate(seen):
        if not np.any(V[n, null] ** 2 > 1e-6):
            out[k] = float(np.sqrt((V[n, ~null] ** 2 / w[~null]).sum()) / scale[k])
    return out


def collinearity(F: np.ndarray) -> float | None:
    """Collinearity index 1/√λ_min of the normalised slopes; None where one of them is zero.

    Brun, Reichert and Künsch (2001), Water Resources Research 37, 1015-1030: above 10 to 15 the
    parameters cannot be estimated together.
    """
    scale = np.sqrt(np.maximum(np.diag(F), 0.0))
    if not len(F) or not scale.all():
        return None
    least = float(np.linalg.eigvalsh(F / np.outer(scale, scale))[0])
    return float(1 / np.sqrt(least)) if least > len(F) * np.finfo(float).eps else None


def _directions(
    F: np.ndarray, names: Sequence[str], prior: np.ndarray
) -> Iterator[tuple[tuple[str, float], ...]]:
    """Directions of which the data tell less than the priors, as changes in per cent.

    The largest change of each is 1 %; parameters that change less than a tenth of it are left out.
    """
    w, V = np.linalg.eigh(F)
    for z in V.T[w < 1]:
        step = z * prior
        step = step / step[np.argmax(np.abs(step))]
        yield tuple((names[k], float(step[k])) for k in np.argsort(-np.abs(step))
                    if abs(step[k]) > 0.1)  # fmt: skip


_BY_SCALES = "; weighing the article would settle it"


def _why(k: int, names: Sequence[str], prior: np.ndarray, F: np.ndarray) -> str:
    """Reason why a parameter is frozen, in one sentence."""
    if 1 / (1 + F[k, k]) > HALF:
        alone = _sd(prior[k], F[k, k])
        known = "not at all" if alone is None or alone > 1 else f"only to {100 * alone:.1f} %"
        return (
            f"with all others known, the data would determine {names[k]} {known}, its prior to "
            f"{100 * prior[k]:.1f} %"
        )
    others = np.setdiff1d(np.arange(len(F)), [k])
    answer = np.zeros(len(F))
    inner = F[np.ix_(others, others)] + np.eye(len(others))
    answer[others] = -np.linalg.solve(inner, F[others, k])
    share = np.abs(answer) * np.sqrt(np.diag(F) / F[k, k])
    partners = [j for j in np.argsort(-share) if share[j] > PARTNER]
    others_by = [f"{names[j]} by {answer[j] * prior[j] / prior[k]:+.2f} %" for j in partners]
    rest = " and ".join(others_by or ["many others by little"])
    return f"the data hardly change where {names[k]} changes by +1 % and {rest}"


def _settled(k: int, told: Information, held: np.ndarray) -> str:
    """Note where only the weighing determines a parameter."""
    free = np.setdiff1d(np.arange(len(told.data)), held)
    if not told.weighed or told.left(free, False)[list(free).index(k)] <= HALF:
        return ""
    return "the weighed mass settles it"
