"""Fits and tests that a decision reads, each made once and when it is read."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import cast

import numpy as np

from ..decision.decide import decide
from ..decision.hypotheses import EffectSet, Explanation, Hypotheses, Left
from ..decision.reasons import ALONE, BEYOND, Decision
from ..errors import ModelError
from ..inference.adequacy import FitTest
from ..inference.held_out_evidence import held_out_evidence
from ..inference.hypothesis_fit import HypothesisFit
from ..inference.least_data import CONTRADICTED
from ..inference.likelihood import Responses
from ..inference.local_damping_test import damping_test_along_effect
from ..inference.pole_data import Poles
from ..inference.rows_of_fits import hypothesis_of
from ..inference.written_hypothesis import as_written
from .basis_refinement import Refinement
from .diagnosis import Diagnosis, Tested, hypotheses_of
from .question import Prepared
from .search_round import on_common_basis, taken
from .several import Several
from .verdict_models import scores_of

NAMED = ("missing physics", "calibration only", "nothing missing")  # by one explanation
MOST_OPEN = 3  # effects whose further measurements are forecast

Refine = Callable[[HypothesisFit], Refinement]


@dataclass(eq=False)
class Trial:
    """A diagnosis before its held-out data are evaluated, and how a fit of it is repeated.

    Attributes
    ----------
    refine : fits a hypothesis again on a reduced model that is accurate enough for it
    spare : the last rival that was fitted again; it keeps its model, 10 to 300 MB on a tailgate,
        until the next one is
    """

    prepared: Prepared
    found: Diagnosis
    refine: Refine
    spare: "Evaluated | None" = None


@dataclass(eq=False)
class Evaluated(Tested):
    """A fitted hypothesis with all numbers that a decision reads.

    Attributes
    ----------
    rival : whether it is behind the leader, and has lost the model of its own
    note, distrust : of the refinement that made its fit
    lost : why it could not be fitted again
    after : test of the damping it leaves along the change of a leader
    forgotten : whether its model is gone
    """

    trial: Trial = field(kw_only=True)
    rival: bool = False
    note: str = ""
    distrust: tuple[str, ...] = ()
    lost: str = ""
    after: FitTest | None = None
    forgotten: bool = False

    @cached_property
    def news(self) -> float:
        """Gain over calibration on the held-out data, in 2 ln predictive density."""
        prepared, null = self.trial.prepared, self.trial.found.null
        return held_out_evidence(prepared.problem, prepared.unseen.choosing, null, self.fit)

    @cached_property
    def written(self) -> HypothesisFit:
        """The hypothesis in the form of a deck."""
        return as_written(self.fit, self.problem.mass_measurement)

    @cached_property
    def halved(self) -> HypothesisFit:
        """The hypothesis in the form of a deck with every shell halved."""
        return as_written(self.fit, self.problem.mass_measurement, halved=True)

    @cached_property
    def left(self) -> Left:
        """Q of the calibrated deck and of its own, on the fitted and on the choosing data.

        Both have the mesh that the data prefer: an effect may be smaller than the error of a mesh.
        """
        prepared, found = self.trial.prepared, self.trial.found
        decks = (found.halved[0], self.halved) if found.halved else (found.plain, self.written)
        stages = [(deck, deck.fit.state) for deck in decks]
        choosing = prepared.held.choosing
        return Left(*((a, b) for a, b in scores_of(prepared, self.fit, stages, choosing)))

    @cached_property
    def refined(self) -> Explanation:
        """The hypothesis fitted again on an accurate model; a rival first gets its own basis."""
        trial = self.trial
        try:
            made = trial.refine(self._on_its_own_basis() if self.rival else self.fit)
        except ModelError as error:
            self.lost = str(error)
            return replace(hypothesis_of(self.fit, self), fitted=False)
        if self.rival and trial.spare is not None:
            trial.spare.forget_model()
        again = Evaluated(
            self.problem, made.hypothesis, trial=trial, note=made.note, distrust=made.distrust
        )
        trial.spare = again if self.rival else trial.spare
        return hypothesis_of(made.hypothesis, again)

    @property
    def whole(self) -> HypothesisFit:
        """The fit with a model of its own."""
        return self._on_its_own_basis() if self.rival or self.forgotten else self.fit

    def _on_its_own_basis(self) -> HypothesisFit:
        """The fit again, from its result: a diagnosis keeps only its leader's model."""
        null, problem, effect = self.trial.found.null.data, self.problem, self.fit.effect
        assert isinstance(null, (Responses, Poles))
        problem = replace(problem, data=null.rebased(problem.reduced.model))
        base = taken(problem, self.fit, ("calibration", "nuisance"))
        return problem.fitted_with(effect, self.fit.fit.of(effect), base)

    def p_after(self, leader: Explanation) -> float:
        """P of the test that the damping it leaves follows the change by a leader."""
        damping, test, lead = self.problem.damping, self.chances.test, leader.numbers
        if test is None or damping is None or not isinstance(lead, Evaluated):
            return 1.0
        left = damping.beyond(self.fit.fit.state)
        self.after = damping_test_along_effect(test, lead.fit, left)
        return self.after.p

    def forget_model(self) -> None:
        """Keep the fit, not the vectors that were added to the basis for it."""
        self.fit = on_common_basis(self.problem, self.fit)
        for form in ("written", "halved"):
            vars(self).pop(form, None)
        self.forgotten = True


def decided(prepared: Prepared, found: Diagnosis, refine: Refine) -> tuple[Hypotheses, Decision]:
    """Decide on a diagnosis with every fit and test that the decision reads.

    Parameters
    ----------
    refine : fits a hypothesis again on a reduced model that is accurate enough for it
    """
    trial = Trial(prepared, found, refine)

    def numbers(fit: HypothesisFit, rival: bool) -> Evaluated:
        known = found.chances.get(fit.name)
        return Evaluated(prepared.problem, fit, known, trial=trial, rival=rival)

    case = hypotheses_of(prepared.problem, found, numbers)
    sets = tuple(_effect_set(trial, s, numbers(s.hypothesis, False)) for s in found.sets)
    enough, contradicted = not prepared.too_little, prepared.numbers >= CONTRADICTED
    case = replace(case, sets=sets, enough=enough, contradicted=contradicted)
    return case, decide(case)


def _effect_set(trial: Trial, s: Several, own: Evaluated) -> EffectSet:
    problem, unseen = trial.prepared.problem, trial.prepared.unseen.choosing

    def news(k: int) -> float:
        return held_out_evidence(problem, unseen, s.without[k], s.own, s.about)

    made = replace(hypothesis_of(s.hypothesis, own), names=tuple(e.name for e in s.own.effects))
    return EffectSet(made, s.gains, s.due, s.ahead, s.alternatives, news)


def open_explanations(
    case: Hypotheses, decision: Decision, found: Diagnosis
) -> tuple[list[HypothesisFit], list[str], np.ndarray]:
    """Explanations that the data cannot separate, or the only one: fits, names, probabilities.

    The probabilities are even.  Empty where no explanation stands.
    Calibration with its errors of form stands for what the catalogue lacks as well.
    """
    listed = [h for h in decision.order if h.name in decision.one_of][:MOST_OPEN]
    names = [h.name for h in listed]
    if other := [name for name in (ALONE, BEYOND) if name in decision.one_of]:
        listed, names = [*listed, case.null], [*names, " or ".join(other)]
    if len(listed) < 2:
        if found.verdict not in NAMED or decision.one_of:
            return [], [], np.zeros(0)
        one = found.found or found.null
        return [one], [one.name], np.ones(1)
    fits = [cast(Evaluated, h.numbers).whole for h in listed]
    return fits, names, np.full(len(listed), 1 / len(listed))
