"""The problem of a diagnosis, and the fit of one hypothesis."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from ..effects.effect import Effect
from ..effects.effect_context import EffectContext, Setup
from ..effects.estimate import Remarks
from ..effects.family import Family
from ..effects.registry import catalogue
from ..errors import ModelError
from ..reduced.local_effect import LocalEffect
from ..reduced.reduced_model import Reduced, State, evaluate
from ..reduced.reduced_problem import ReducedProblem
from .complex_modes import ModeCoupling
from .damping_scatter import ModalDamping
from .discrepancy import MEDIAN
from .likelihood import Data, Responses
from .linear_model import LinearModel
from .map_fit import Fit, MassMeasurement, constants, fit, prior_residuals
from .own_optimum import Base, LocalOptimum, distinct, own_optimum
from .pole_data import SCALE, SCALE_SD, Poles

FAILED = (ModelError, np.linalg.LinAlgError)  # of a fit: its hypothesis is lost, and no other
ROUGH = 8  # steps of a fit that only has to show whether a hypothesis is in the running


NEARLY = 6.0  # in -2 ln evidence: an optimum so much worse still has a share of 5 %


@dataclass(frozen=True, eq=False)
class HypothesisFit:
    """One hypothesis after its fit: the effect, the fit and the model used for it.

    ``found_before`` are effects found earlier; the hypothesis is all of them together.
    ``optima`` are other optima of the family: other places, or another pairing of the same poles.
    The prior of a place is one over the number of places, so that the evidence of the family is the
    sum over its optima.
    """

    effect: Effect
    fit: Fit
    model: Reduced
    found_before: tuple[Effect, ...] = ()
    optima: tuple[LocalOptimum, ...] = ()

    @property
    def effects(self) -> tuple[Effect, ...]:
        """All effects of the hypothesis."""
        return (self.effect, *self.found_before)

    @property
    def name(self) -> str:
        """Their names in words."""
        return " and ".join(e.name for e in self.effects)

    @property
    def physics(self) -> bool:
        """True if it changes the model, and not only the test."""
        return any(e.kind != "test" for e in self.effects)

    @property
    def verdict(self) -> str:
        """The public verdict if it is named."""
        return "missing physics" if self.physics else "measurement fault"

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of its effects, if every effect is one of channels."""
        every = [e.channels for e in self.effects]
        return tuple(c for each in every for c in each) if all(every) else ()

    @property
    def remarks(self) -> Remarks:
        """Simpler effects to which it reduces, and why its values are impossible."""
        return self.effect.remarks(self.fit.of(self.effect), self.fit.sd(self.effect))

    @property
    def own(self) -> LocalOptimum:
        """The optimum of the fit."""
        x, sd = self.fit.of(self.effect), self.fit.sd(self.effect)
        return LocalOptimum(self.effect, self.fit.neg2_log_evidence, x, sd)

    @property
    def nearly(self) -> tuple[LocalOptimum, ...]:
        """Other optima that are nearly as probable."""
        most = self.fit.neg2_log_evidence + NEARLY
        return tuple(v for v in self.optima if v.neg2_log_evidence < most)

    def among(self, other: "HypothesisFit") -> "HypothesisFit":
        """Keep the optima of another fit of the same family, each once."""
        return self.knowing((other.own, *other.optima))

    def knowing(self, optima: Sequence[LocalOptimum]) -> "HypothesisFit":
        """Keep other optima of the same family, each once."""
        return replace(
            self, optima=tuple(distinct(optima=(*self.optima, *optima), kept=[self.own]))
        )

    def refitted(self, fit: Fit) -> "HypothesisFit":
        """A copy with another fit; the other optima keep their distance in evidence."""
        shift = fit.neg2_log_evidence - self.fit.neg2_log_evidence
        optima = (replace(v, neg2_log_evidence=v.neg2_log_evidence + shift) for v in self.optima)
        return replace(self, fit=fit, optima=tuple(optima))

    @property
    def data(self) -> Data:
        """The fitted data."""
        return self.fit.data

    @property
    def neg2_log_evidence(self) -> float:
        """-2 ln evidence of the family, summed over its optima."""
        each = [self.fit.neg2_log_evidence, *(v.neg2_log_evidence for v in self.optima)]
        return float(-2 * logsumexp(-np.array(each) / 2))


@dataclass(frozen=True, eq=False)
class UpdatingProblem:
    """Data and model of a diagnosis."""

    reduced: ReducedProblem
    data: Data
    mass_measurement: MassMeasurement | None
    base: tuple[Effect, ...]  # calibration parameters and nuisances, free in every fit
    nuisance: tuple[Effect, ...]  # the nuisances alone
    setup: Setup
    labels: tuple[str, ...] = ()
    # damping, coupling: of the identified modes, if responses are compared
    damping: ModalDamping | None = None
    coupling: ModeCoupling | None = None
    # effects found earlier and now in the base, each with its parameters
    found: tuple[tuple[Effect, np.ndarray], ...] = ()
    families: tuple[Family, ...] = field(default_factory=catalogue)  # of effects that are tried

    @property
    def where(self) -> EffectContext:
        """The structure and its test, as effects see them."""
        reduced = self.reduced
        shapes = reduced.shapes
        return EffectContext(
            reduced.groups, reduced.grids, reduced.candidates, self.setup,
            reduced.frequency[: shapes.shape[1]], shapes,
        )  # fmt: skip

    def allowing_errors(self, state: State, delta: float = MEDIAN) -> "UpdatingProblem":
        """Return the problem with errors of the model's form, linearised about this state."""
        if not isinstance(self.data, Responses):
            return self
        return replace(self, data=self.data.allowing_errors(state, delta))

    def holding(self, found: Sequence[tuple[Effect, np.ndarray]]) -> "UpdatingProblem":
        """Return the problem with effects in its base, and their changes in its model.

        The odds of an earlier answer are those of single effects: next to these, others have none.
        """
        problem = replace(self, families=tuple(f.before or f for f in self.families))
        for effect, x in found:
            model = problem.reduced.model_for(effect, x)
            problem = replace(
                problem, reduced=replace(problem.reduced, model=model),
                data=problem.data.rebased(model), base=(*problem.without(effect), effect),
                found=(*problem.found, (effect, x)),
            )  # fmt: skip
        return problem

    def mean(self) -> np.ndarray:
        """Prior mean of the base parameters; found effects keep their fitted values."""
        return self.begun(self.base)

    def begun(self, effects: Sequence[Effect]) -> np.ndarray:
        """Starting values of these effects: fitted values if found, else the prior mean."""
        known = {id(e): x for e, x in self.found}
        each = [known.get(id(e), np.array([p.mean for p in e.parameters])) for e in effects]
        return np.concatenate([np.zeros(0), *each])

    def fitted_with(
        self, effect: Effect, start: np.ndarray, base: np.ndarray, max_steps: int = 30,
        model: Reduced | None = None,
    ) -> HypothesisFit:  # fmt: skip
        """Fit one effect together with the base, from these starts; over the basis for it."""
        model = self.reduced.model_for(effect, start) if model is None else model
        data = self.data.rebased(model)
        kept = self.without(effect)
        x0 = np.concatenate([base[self._positions(kept)], start])
        effects, mass = [*kept, effect], self.mass_measurement
        fit = fitted(model, effects, data, mass, x0, max_steps)
        return HypothesisFit(effect, fit, model, tuple(e for e, _ in self.found))

    def own_optimum(
        self, effect: Effect, start: np.ndarray, bases: Sequence[np.ndarray]
    ) -> HypothesisFit:
        """Optimise one effect from a start, the base linear about the best of some (n_base,).

        The model is that of the problem where the effect needs no basis of its own.
        """
        kept, model = self.without(effect), self.reduced.model
        inside = self._positions(kept)
        about = [self._about(tuple(kept), tuple(x[inside].tolist())) for x in bases]
        state, x = about[0].state, about[0].x
        assert state is not None
        local = LocalEffect.of(self.reduced, kept, effect, state, x, start)
        if local is None:
            model = self.reduced.model_for(effect, start)
        data, mass = self.data.rebased(model), self.mass_measurement
        found = own_optimum(model, kept, effect, data, mass, about, start, local)
        return HypothesisFit(effect, found, model, tuple(e for e, _ in self.found))

    def _positions(self, kept: Sequence[Effect]) -> np.ndarray:
        """Mask over the parameters of the base of some of its effects."""
        return np.array([e in kept for e in self.base for _ in e.parameters], dtype=bool)

    def _about(self, kept: tuple[Effect, ...], x: tuple[float, ...]) -> Base:
        """The responses of some base effects linear about x; computed once."""
        if (kept, x) not in self._linear:
            at = np.array(x)
            state = evaluate(self.reduced.model, kept, at)
            linear = LinearModel(
                self.data.error, self.data.scaled_slopes(state), np.zeros((0, len(x)))
            )
            self._linear[kept, x] = Base(linear, at, state.without_slopes())
        return self._linear[kept, x]

    @cached_property
    def _linear(self) -> dict[tuple[tuple[Effect, ...], tuple[float, ...]], Base]:
        return {}

    def about_itself(self, hypothesis: HypothesisFit, max_steps: int = 30) -> HypothesisFit:
        """Fit a hypothesis again with errors of the model's form about its own state.

        Comparisons of many hypotheses use the errors about the null's state. A strong effect
        changes the structure: a support turns rigid modes into flexible ones, with their errors.
        """
        data, found = hypothesis.data, hypothesis.fit
        if not isinstance(data, Responses) or data.error is None:
            return hypothesis
        data = data.allowing_errors(found.state, data.error.delta)
        mass = self.mass_measurement
        fit = fitted(hypothesis.model, found.effects, data, mass, found.x, max_steps)
        return hypothesis.refitted(fit)

    def without(self, effect: Effect) -> list[Effect]:
        """Return the base without the effects that this one replaces; found effects stay."""
        found = [e for e, _ in self.found]
        return [e for e in self.base if e in found or e.text not in effect.replaces]


def fitted(
    model: Reduced, effects: Sequence[Effect], data: Data,
    mass_measurement: MassMeasurement | None, x: np.ndarray, max_steps: int = 30,
) -> Fit:  # fmt: skip
    """Fit a model; for poles, the irreducible spread is fitted too."""
    if isinstance(data, Poles):
        found = _fit_poles(model, effects, data, mass_measurement, x)
    elif isinstance(data, Responses) and data.error is not None:
        found = _fit_responses(model, effects, data, mass_measurement, x, max_steps)
    else:
        found = fit(model, effects, data, mass_measurement, x, max_steps=max_steps)
    return found.kept()


ROUNDS, CLOSE = 3, 0.15  # fits in turn with δ, until ln δ changes by no more


def _fit_responses(
    model: Reduced, effects: Sequence[Effect], data: Responses,
    mass_measurement: MassMeasurement | None, x: np.ndarray, max_steps: int,
) -> Fit:  # fmt: skip
    """Fit parameters and the size δ of the model's error in turn; evidence integrates δ out."""
    assert data.error is not None
    error, begun = data.error, None
    for _ in range(ROUNDS):
        found = fit(model, effects, data, mass_measurement, x, max_steps=max_steps, begun=begun)
        there = found.linear
        assert there is not None
        likely = there.model.learned(there.r, there.r0)
        change = abs(np.log(likely.delta / error.delta))
        error = error.with_delta(likely.delta)
        data = replace(data, error=error)
        S = likely.neg2_log_evidence + constants(effects)
        found = replace(found, neg2_log_evidence=S, data=data)
        if max_steps <= ROUGH or change < CLOSE:
            break
        x, begun = found.x, there.under(error)
    return found


SCALES = np.geomspace(0.003, 0.2, 25)


ALIKE = 1.0  # in -2 ln evidence: fits of one state on different scales
ROADS = ((0.08, 0.04, 0.02), (0.03, 0.015))  # scales on which the pairing settles


def _fit_poles(
    model: Reduced,
    effects: Sequence[Effect],
    data: Poles,
    mass_measurement: MassMeasurement | None,
    x: np.ndarray,
) -> Fit:
    """Alternate the fit with the most probable scale of the irreducible spread."""

    def at_scale(scale: float, x: np.ndarray, max_steps: int = 30) -> Fit:
        given = replace(data, scale=scale)
        return fit(model, effects, given, mass_measurement, x, max_steps=max_steps)

    def settled(x: np.ndarray) -> Fit:
        """Fit scale and parameters in turn until the scale is that of its own fit."""
        best, scale = None, 0.0
        for _ in range(6):
            before, state = scale, evaluate(model, effects, x, False)
            scale = min(SCALES, key=lambda s: neg2_log_mixture(replace(data, scale=s), state))
            if scale == before:
                break
            now = at_scale(scale, x)
            known = prior_residuals(effects, mass_measurement, now.x, now.state)
            S = over_scales(data, now.state, *known) + constants(effects)
            now = replace(now, neg2_log_evidence=S)
            if best is not None and S > best.neg2_log_evidence + ALIKE:
                break
            best, x = now, now.x
        return best if best is not None else now

    options = []
    for road in ROADS:
        there = x
        for scale in road:
            there = at_scale(scale, there, 8).x
        options.append(settled(there))
    return min(options, key=lambda f: f.neg2_log_evidence)


def over_scales(data: Poles, state: State, r0: np.ndarray, J0: np.ndarray) -> float:
    """-2 ln evidence of poles with the irreducible spread integrated out.

    Few poles determine that spread poorly. A model of several free numbers can make its most
    probable value very small; held there, it would reject deviations of a per cent.  Parameters
    are linear about their fit; ``r0``, ``J0`` are residual and slope of the other knowledge.
    """
    every = []
    for scale in SCALES:
        given = replace(data, scale=scale)
        r, J = given.scaled(state, True)
        widths = 2 * np.log(given.std()[data.use]).sum()
        S = LinearModel(None, J, J0).neg2_log_evidence(r, r0)
        every.append(S + widths + _scale_prior(scale))
    step = np.log(SCALES[1] / SCALES[0]) / (SCALE_SD * np.sqrt(np.pi))
    return float(-2 * (logsumexp(-np.array(every) / 2) + np.log(step)))


def neg2_log_mixture(data: Poles, state: State) -> float:
    """-2 ln p(poles | modes, best assignment, scale) p(scale), up to a constant."""
    r, _ = data.scaled(state, False)
    widths = 2 * np.log(data.std()[data.use]).sum()
    return float(r @ r + widths) + _scale_prior(data.scale, LEARNED_SD)


LEARNED_SD = 0.6  # of ln scale while pairs are sought: a narrow one would drop poles as spurious


def _scale_prior(scale: float, sd: float = SCALE_SD) -> float:
    return float((np.log(scale / SCALE) / sd) ** 2)
