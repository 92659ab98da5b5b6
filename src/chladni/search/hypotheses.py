"""Hypotheses of a diagnosis: the tests, scores and decks of each are made when they are read."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

from ..effects.effect import Effect
from ..errors import ModelError
from ..inference.adequacy import FitTest, of_poles
from ..inference.held_out_evidence import held_out_evidence
from ..inference.hypothesis_fit import HypothesisFit
from ..inference.implausible_values import strained
from ..inference.least_data import CONTRADICTED
from ..inference.likelihood import Responses
from ..inference.local_damping_test import damping_test_along_effect
from ..inference.pole_data import Poles
from ..inference.written_hypothesis import as_written, preferred_mesh
from .basis_refinement import refined
from .decision_rules import RULES
from .diagnosis import Diagnosis, FitChances, fit_test
from .question import Prepared
from .search_round import on_common_basis, taken
from .several import Several
from .written_scores import scores_of

ALONE = "calibration alone"


@dataclass(eq=False)
class Explanation:
    """One explanation; every test, score and deck of it is made once, and when it is read."""

    case: "Hypotheses"
    fit: HypothesisFit
    rival: bool = False  # whether it has lost the model of its own: the leader alone keeps it
    together: Several | None = None  # its members and what each gains, of several effects
    known: FitChances | None = None  # its test of fit, where it was made before
    # of the refinement that made its fit
    note: str = ""
    distrust: tuple[str, ...] = ()
    lost: str = ""  # why it could not be fitted again
    after: FitTest | None = None  # of the damping it leaves along the change of a leader

    @property
    def name(self) -> str:
        """Names of its effects in words."""
        return ALONE if type(self.fit.effect) is Effect else self.fit.name

    @cached_property
    def strained(self) -> bool:
        """True if the factor of a joint family exceeds the usual scatter of joints."""
        return bool(strained(self.fit.fit))

    @cached_property
    def chances(self) -> FitChances:
        """The test of fit, of a rival with the model of its own that it was fitted on."""
        return self.known or fit_test(self.case.prepared.problem, self.whole)

    @property
    def fits(self) -> bool:
        """True if the test of fit passes; False where the hypothesis cannot be fitted again."""
        try:
            return self.chances.fits
        except ModelError:
            return False

    @cached_property
    def news(self) -> float:
        """Gain over calibration on the held-out data, in 2 ln predictive density; 0 without any."""
        prepared, null = self.case.prepared, self.case.found.null
        return held_out_evidence(prepared.problem, prepared.unseen.choosing, null, self.fit)

    def news_of(self, member: int) -> float:
        """Gain of one of several effects on the held-out data, with the others in place."""
        prepared, s = self.case.prepared, self.together
        assert s is not None
        unseen, without = prepared.unseen.choosing, s.without[member]
        return held_out_evidence(prepared.problem, unseen, without, s.own, s.about)

    @cached_property
    def own(self) -> HypothesisFit:
        """The fit that tells values: errors of form and of sensors spread from its own state.

        They are largest at antiresonances. A strong effect moves these: where those of the null
        are, its data would be lost, and where its own are, they would count fully. The evidence
        stays that of the common errors, on which hypotheses are compared.
        """
        own = self.case.prepared.problem.about_itself(self.fit)
        same = replace(own.fit, neg2_log_evidence=self.fit.fit.neg2_log_evidence)
        return self.fit.refitted(same)

    @cached_property
    def written(self) -> HypothesisFit:
        """The hypothesis in the form of a deck."""
        return as_written(self.own, self.case.prepared.problem.mass_measurement)

    @cached_property
    def halved(self) -> tuple[HypothesisFit, ...]:
        """The calibrated deck and its own with every shell halved, if the data prefer that mesh.

        The hypothesis says which mesh they prefer: without a strong effect no mesh fits.
        """
        finer = preferred_mesh(self.own, self.written, self.case.prepared.problem.mass_measurement)
        calibrated = finer and self.case.plain_halved
        return (calibrated, finer) if finer and calibrated else ()

    @cached_property
    def Q(self) -> tuple[tuple[float, float], ...]:
        """Q of the calibrated deck and of its own, on the fitted and on the choosing data.

        Both have the mesh on which they are written. That is the mesh of the deck, unless its own
        is worse there and the data prefer the mesh that is twice as fine. An effect may be smaller
        than the error of a mesh.
        """
        given = self._scores((self.case.found.plain, self.written))
        return self._scores(self.halved) if self._is_worse(given) and self.halved else given

    def _scores(self, decks: tuple[HypothesisFit, ...]) -> tuple[tuple[float, float], ...]:
        prepared = self.case.prepared
        scores = scores_of(prepared, self.fit, decks, prepared.held.choosing)
        return tuple((calibrated, own) for calibrated, own in scores)

    def _is_worse(self, Q: tuple[tuple[float, float], ...]) -> bool:
        """A fault of a few channels is compared on the held-out data of these channels."""
        compared = Q if self.fit.physics else Q[1:]
        return any(with_it > calibrated for calibrated, with_it in compared)

    @property
    def worse(self) -> bool:
        """True if the deck with an effect has a larger Q than the calibrated deck.

        Physics must not worsen the fitted data either, and physics that no card holds has no deck
        to compare.
        """
        if self.fit.physics and not any(e.traits.writable for e in self.fit.effects):
            return False
        return self._is_worse(self.Q)

    @cached_property
    def refined(self) -> "Explanation":
        """The hypothesis fitted again on an accurate model; a rival first gets its own basis."""
        case = self.case
        try:
            fit, note, distrust = refined(case.prepared, self.whole)
        except ModelError as error:
            return Explanation(case, self.fit, together=self.together, lost=str(error))
        again = Explanation(case, fit, together=self.together, note=note, distrust=distrust)
        if self.rival:
            if case.spare is not None:
                case.spare.forget_model()
            case.spare = again
        return again

    @property
    def whole(self) -> HypothesisFit:
        """The fit with a model of its own: a diagnosis keeps only its leader's."""
        if not self.rival:
            return self.fit
        problem, null, effect = self.case.prepared.problem, self.case.found.null, self.fit.effect
        assert isinstance(null.data, (Responses, Poles))
        problem = replace(problem, data=null.data.rebased(problem.reduced.model))
        base = taken(problem, self.fit, ("calibration", "nuisance"))
        return problem.fitted_with(effect, self.fit.fit.of(effect), base)

    def p_after(self, leader: "Explanation") -> float:
        """P of the test that the damping it leaves follows the change by a leader."""
        damping, test = self.case.prepared.problem.damping, self.chances.test
        if test is None or damping is None:
            return 1.0
        left = damping.beyond(self.fit.fit.state)
        self.after = damping_test_along_effect(test, leader.fit, left)
        return self.after.p

    def forget_model(self) -> None:
        """Keep the fit, not the vectors that were added to the basis for it."""
        self.fit = on_common_basis(self.case.prepared.problem, self.fit)
        for form in ("own", "written", "halved"):
            vars(self).pop(form, None)
        self.rival = True


@dataclass(eq=False)
class Hypotheses:
    """All hypotheses of a diagnosis, and the problem on which one of them is fitted again."""

    prepared: Prepared
    found: Diagnosis
    # the last rival that was fitted again; it keeps its model, 10 to 300 MB on a tailgate, until
    # the next one is
    spare: Explanation | None = None

    @cached_property
    def null(self) -> Explanation:
        """Calibration alone."""
        return self._of(self.found.null)

    @cached_property
    def plain_halved(self) -> HypothesisFit | None:
        """Calibration alone in the form of a deck with every shell halved; None without one."""
        if self.found.halved:
            return self.found.halved[0]
        try:
            return as_written(self.found.null, self.prepared.problem.mass_measurement, halved=True)
        except ModelError:
            return None

    @cached_property
    def singles(self) -> tuple[Explanation, ...]:
        """The best of every family, best first."""
        return tuple(self._of(t, k > 0) for k, t in enumerate(self.found.hypotheses))

    @cached_property
    def sets(self) -> tuple[Explanation, ...]:
        """Several effects together, in the order in which the sets grew."""
        return tuple(Explanation(self, s.hypothesis, together=s) for s in self.found.sets)

    def _of(self, fit: HypothesisFit, rival: bool = False) -> Explanation:
        known = self.found.test if fit is self.found.leading else None
        return Explanation(self, fit, rival, known=known)

    @cached_property
    def poles(self) -> bool:
        """True if natural frequencies are compared."""
        return isinstance(self.found.null.data, Poles)

    @cached_property
    def enough(self) -> bool:
        """True if there are data enough to separate explanations as a rule."""
        return not self.prepared.too_little

    @cached_property
    def contradicted(self) -> bool:
        """True if there are more numbers than any effect has unknowns."""
        return self.prepared.numbers >= CONTRADICTED

    def gain(self, one: Explanation) -> float:
        """Gain over calibration alone, in -2 ln evidence."""
        return self.found.two_log_bayes_factor(one.fit)

    def due(self, one: Explanation) -> float:
        """Gain required to name one; a set counts in addition to the families tried."""
        return self.found.due_of(one.fit, more=one.together is not None)

    @property
    def calibrated(self) -> str:
        """The verdict where nothing is named; joints beyond their usual scatter are calibrated.

        No rule of evidence keeps a deck whose natural frequencies are farther off than those of any
        model. Wide priors would charge its calibration more than it gains on few frequencies.
        """
        deck, data = self.found.nominal, self.found.nominal.data
        misfits = isinstance(data, Poles) and not of_poles(data, deck.fit.state).passes
        changed = misfits or -self.found.two_log_bayes_factor(deck) > RULES.changed
        return "calibration only" if changed or self.null.strained else "nothing missing"

    def suffices(self, gain: float, due: float, news: Callable[[], float]) -> bool:
        """True if fitted and held-out data together bring the required gain ``due``.

        P(fitted) P(held out | fitted) = P(both): the evidence of all data is the sum of both gains.
        Fitted responses must bring ``good_part`` of it. Natural frequencies are few, and any part
        will do.
        """
        part = 0.0 if self.poles else RULES.good_part
        return gain > part * due and gain + news() > due
