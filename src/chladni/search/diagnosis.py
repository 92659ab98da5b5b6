"""From a recording to the name of the missing physics.

1. Null: calibration parameters and scatter alone, from several starts.
2. Scan: every candidate of the catalogue by fast re-analysis about two baselines, u = 0.
3. Own optima of every candidate, with the base linear; joint fits of the families that may win.
4. Evidence: Laplace, with 2 ln of the number of places tried. Leaders restart the null.
5. Verdict.
6. Sets of several effects (``several``), if an effect is named or nothing fits.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ..effects.effect import Effect
from ..effects.registry import families
from ..effects.search_context import Candidate
from ..errors import ModelError
from ..inference.adequacy import FitTest, adequacy
from ..inference.discrepancy import MEDIAN
from ..inference.hypothesis_fit import CLOSE, ROUGH, HypothesisFit, UpdatingProblem, fitted
from ..inference.likelihood import Responses
from ..inference.local_damping_test import damping_instead_of_spin, damping_test_along_effect
from ..inference.written_hypothesis import as_written, preferred_mesh
from ..model.assembly import Assembly
from ..progress import Progress, silent, within
from ..reduced.accuracy import accuracy
from ..reduced.reduced_model import evaluate
from ..sparse.freed_memory import give_back_freed_memory
from .basis_refinement import TRIES
from .candidates import UpdatingContext, proposals, unasked
from .decision_rules import fits, required_gain
from .search_round import on_common_basis, search_round, taken
from .several import PAIRED, Several, several

SHIFTS = np.arange(-14, 15) / 20  # of ln E: 2.5 % of frequency apart
CAREFUL = 0.005  # least spread of ln f of careful models: a smaller error moves nothing


@dataclass(frozen=True)
class FitChances:
    """The test of fit of a hypothesis, with p of it and of damping that follows what it changes.

    p is NaN where there is no test, and where damping is no less likely than the rest.
    """

    test: FitTest | None
    p: float
    p_damping: float

    @property
    def fits(self) -> bool:
        """True if it is more probable than a cause outside the catalogue, or has no test.

        Modal damping that follows an elastic change is a second test of the same hypothesis.
        """
        return fits(self.p) and fits(self.p_damping)


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Fits of a diagnosis, and the answer that a decision gave."""

    # without, and with calibration parameters free; scatter is allowed in both
    nominal: HypothesisFit
    null: HypothesisFit
    plain: HypothesisFit  # the null in the form of a deck, with which a named effect is compared
    hypotheses: tuple[HypothesisFit, ...]  # the best of every family, best first
    verdict: str = ""  # one of the public verdicts
    notes: tuple[str, ...] = ()  # what was done and why, one sentence each
    sets: tuple[Several, ...] = ()  # of several effects, in the order in which they grew
    test: FitChances | None = None  # of fit of :attr:`leading`, where it was made
    written: HypothesisFit | None = None  # the named effect in the form of a deck
    # ``plain`` and ``written`` with every shell halved, where the data prefer that mesh
    halved: tuple[HypothesisFit, ...] = ()
    adequacy: FitTest | None = None  # the absolute test of fit, where there is one
    one_of: tuple[str, ...] = ()  # what the data cannot separate, and what would settle it
    gains: tuple[float, ...] = ()  # in -2 ln evidence, of each named effect with the others
    refused: str = ""  # why the leader is not named although it gains what is due
    shared: bool = False  # whether the deck's numbers are those of several states of one object
    passed_over: tuple[tuple[str, str], ...] = ()  # names before the leader, and their refusals

    @property
    def found(self) -> HypothesisFit | None:
        """The named effect, if any."""
        named = self.verdict in ("missing physics", "measurement fault")
        return self.hypotheses[0] if named and self.hypotheses else None

    @property
    def as_deck(self) -> HypothesisFit | None:
        """The named effect as the updated deck holds it, if anything is named."""
        return self.written or self.found

    @property
    def unexplained(self) -> bool:
        """True if neither the answer nor calibration alone explains the recording."""
        return self.adequacy is not None and not self.adequacy.passes

    @property
    def due(self) -> float:
        """Gain in -2 ln evidence that is needed to name the best of the families tried."""
        return self.due_of(self.hypotheses[0] if self.hypotheses else self.null)

    def due_of(self, hypothesis: HypothesisFit, more: bool = False) -> float:
        """Required gain of a hypothesis; one set ``more`` than the families may have been tried."""
        tried = (len(self.hypotheses) or len(families())) + more
        poles = not isinstance(self.null.data, Responses)
        return required_gain(poles, tried, hypothesis.effect.expected)

    @property
    def leading(self) -> HypothesisFit:
        """The best hypothesis if it gains what is due by what was fitted, or calibration alone."""
        gains = bool(self.hypotheses) and self.two_log_bayes_factor(self.hypotheses[0]) > self.due
        return self.hypotheses[0] if gains else self.null

    def two_log_bayes_factor(self, hypothesis: HypothesisFit) -> float:
        """How much better than the null, in -2 ln evidence."""
        return self.null.neg2_log_evidence - hypothesis.neg2_log_evidence


def diagnose(problem: UpdatingProblem, progress: Progress = silent) -> Diagnosis:
    """Name the missing physics, or say that none is missing."""
    progress("calibration without new physics", 0.05)
    problem, null = without_effects(problem)
    nominal = best_base_fit(problem, problem.nuisance, [problem.begun(problem.nuisance)])
    progress("scan of the catalogue", 0.2)
    tried, lost = proposals(UpdatingContext(problem, null))
    give_back_freed_memory()
    hypotheses = search_round(problem, null, tried, within(progress, 0.3, 0.8))
    notes = (*unasked(problem), *could_not_be_evaluated(tried, lost, hypotheses))
    starts = [taken(problem, lead, ("calibration", "nuisance")) for lead in hypotheses[:2]]
    null = restarted(problem, null, starts)
    progress("verdict", 0.95)
    plain = as_written(null, problem.mass_measurement)
    finer = preferred_mesh(null, plain, problem.mass_measurement)
    halved = () if finer is None else (finer,)
    found = Diagnosis(nominal, null, plain, tuple(hypotheses), notes=notes, halved=halved)
    test = fit_test(problem, found.leading)
    whole = 2 if test.fits else PAIRED  # a search begins from these
    found = _names_alone(problem, replace(found, test=test), whole)
    del hypotheses  # what is behind keeps no basis of its own: 10 to 300 MB each on a tailgate
    give_back_freed_memory()
    found = _with_sets_of_effects(problem, found, within(progress, 0.8, 1.0))
    return _names_alone(problem, found, 1)


def could_not_be_evaluated(
    tried: Sequence[Candidate], lost: Mapping[str, str], hypotheses: Sequence[HypothesisFit]
) -> Iterator[str]:
    """Sentences on families that failed numerically, where they were scanned or fitted."""
    unfit = dict.fromkeys((c.effect.name for c in tried), "no start of its fit is a structure")
    for name, why in {**unfit, **lost}.items():
        if name not in {t.effect.name for t in hypotheses}:
            yield f"the hypothesis {name} could not be evaluated: {why}"


def _names_alone(problem: UpdatingProblem, found: Diagnosis, whole: int) -> Diagnosis:
    """The diagnosis with all but the first of its hypotheses on the common basis."""
    behind = (on_common_basis(problem, t) for t in found.hypotheses[whole:])
    return replace(found, hypotheses=(*found.hypotheses[:whole], *behind))


def _with_sets_of_effects(
    problem: UpdatingProblem, alone: Diagnosis, progress: Progress
) -> Diagnosis:
    """The tested diagnosis with the sets of several effects that explain more than its leader.

    Natural frequencies alone are too few numbers to bear two names.
    """
    data, unfit = alone.null.data, alone.test is not None and not alone.test.fits
    many = isinstance(data, Responses) and data.error is not None
    if not (many and alone.hypotheses) or (alone.leading is alone.null and not unfit):
        return alone
    due = required_gain(False, len(alone.hypotheses))
    search = several(problem, alone.hypotheses, due, unfit, progress)
    notes = (*alone.notes, search.note) if search.note else alone.notes
    return replace(alone, sets=search.sets, notes=notes)


def fit_test(problem: UpdatingProblem, hypothesis: HypothesisFit) -> FitChances:
    """Test the data against the predictions of a hypothesis."""
    alone = hypothesis.effect not in hypothesis.fit.effects  # errors spread from the null as it is
    winner = hypothesis if alone else problem.about_itself(hypothesis, ROUGH)
    state, mass, labels = winner.fit.state, problem.mass_measurement, problem.labels
    real = state.dissipated is None and state.spin is None
    damping, coupling = problem.damping, problem.coupling if real else None
    damping = damping and damping.beyond(state)
    fits = adequacy(winner, mass, labels, damping=damping, coupling=coupling)
    if fits is None:
        return FitChances(None, np.nan, np.nan)
    fits = damping_instead_of_spin(fits, winner, problem)
    both = damping_test_along_effect(fits, winner, damping)
    return FitChances(both, fits.against, both.p if both.p != fits.p else np.nan)


def without_effects(problem: UpdatingProblem) -> tuple[UpdatingProblem, HypothesisFit]:
    """The problem with errors of the model's form as they spread from the null, and the null."""
    state, delta = evaluate(problem.reduced.model, problem.base, problem.mean(), False), MEDIAN
    starts = _null_starts(problem)
    for k in range(2):
        problem = problem.allowing_errors(state, delta)
        null = best_base_fit(problem, problem.base, starts)
        if not isinstance(null.data, Responses) or null.data.error is None:
            break
        before, delta = delta, null.data.error.delta
        if k and abs(np.log(delta / before)) < CLOSE:
            break
        state, starts = null.fit.state, [null.fit.x]
    return on_its_basis(problem, null)


def on_its_basis(
    problem: UpdatingProblem, fit: HypothesisFit
) -> tuple[UpdatingProblem, HypothesisFit]:
    """The problem over a basis that represents a fit without effects, and the fit made on it.

    The modes of a deck do not span those of a structure in which a part is several times softer.
    On them such a part appears too stiff, and its fitted number is too low.  Responses keep their
    basis here: it holds the static responses at sensors and drives, and their errors of form.
    """
    if isinstance(problem.data, Responses):
        return problem, fit
    for _ in range(TRIES):
        effects, x = fit.fit.effects, fit.fit.x
        found = accuracy(problem.reduced, fit.model, effects, x, problem.setup.f_max)
        if found.serves(CAREFUL):
            break
        reduced = replace(problem.reduced, model=found.refined(fit.model))
        problem = replace(problem, reduced=reduced, data=problem.data.rebased(reduced.model))
        fit = best_base_fit(problem, effects, [x, problem.begun(effects)])
    return problem, fit


def best_base_fit(
    problem: UpdatingProblem, effects: Sequence[Effect], starts: list[np.ndarray]
) -> HypothesisFit:
    """Best fit of these effects alone over several starts; invalid structures do not count."""
    model, fits = problem.reduced.model, []
    for k, x in enumerate(starts):
        try:
            fits.append(fitted(model, effects, problem.data, problem.mass_measurement, x))
        except ModelError:
            if not fits and k == len(starts) - 1:
                raise
    return HypothesisFit(Effect(), min(fits, key=lambda f: f.neg2_log_evidence), model)


def _null_starts(problem: UpdatingProblem) -> list[np.ndarray]:
    """The prior mean, and structures softer and stiffer by up to a half.

    Responses choose the one of them with the least Q: between two resonances a fit would stop.
    """
    mean = problem.mean()
    stiff = np.array([p.name == "E" for e in problem.base for p in e.parameters], dtype=float)
    if not isinstance(data := problem.data, Responses):
        return [mean + shift * stiff for shift in (0.0, -0.35, 0.35, -0.7, 0.7)]

    def Q(start: np.ndarray) -> float:
        try:
            return data.Q(evaluate(problem.reduced.model, problem.base, start, False), data.use)
        except ModelError:
            return np.inf

    best = min((mean + shift * stiff for shift in SHIFTS), key=Q)
    return [mean] if np.array_equal(best, mean) else [mean, best]


def restarted(
    problem: UpdatingProblem, null: HypothesisFit, starts: Sequence[np.ndarray]
) -> HypothesisFit:
    """The null again, from where other fits ended: it must not lose by a bad start."""
    tries = [null]
    for start in starts:
        with suppress(ModelError):
            tries.append(best_base_fit(problem, problem.base, [start]))
    return min(tries, key=lambda t: t.neg2_log_evidence)


def assemblies(given: Assembly, diagnosis: Diagnosis) -> tuple[Assembly, Assembly]:
    """The structure calibrated without new physics, and with the effect: one if none is named."""
    found = diagnosis.found
    nothing = diagnosis.verdict == "nothing missing"
    calibrated = given if nothing else applied(given, diagnosis.plain)
    if found is None or not found.physics:
        return calibrated, calibrated
    return calibrated, applied(given, diagnosis.as_deck or found)


def applied(assembly: Assembly, hypothesis: HypothesisFit) -> Assembly:
    """The assembly with the calibrated parameters and the effects of a hypothesis in it.

    Effects that change the material of a part come before effects that divide the part.
    """

    def turn(effect: Effect) -> int:
        if effect not in hypothesis.effects:
            return 0
        return 1 if effect.traits.remakes_structure else 2

    for effect in sorted(hypothesis.fit.effects, key=turn):
        assembly = effect.apply(assembly, hypothesis.fit.of(effect))
    return assembly
