"""First tests of articles in which an effect is concealed, and what their recordings leave open.

Before any test, each effect of interest is put into the deck at random, in size and place, as the
virtual bench conceals it.  The planned sensors record the responses of that article.  All effects
of interest are then fitted to the recording, as in a diagnosis.  What it leaves open is the
question of further measurements (:mod:`.next_measurement`).
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..effects.effect import Effect
from ..effects.family import Article
from ..effects.registry import family
from ..errors import FileError, ModelError
from ..fem.energy import mass_properties
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import modelled
from ..geometry.grid_normals import normals_at
from ..geometry.sampling import nearest_points
from ..inference.hypothesis_fit import HypothesisFit, UpdatingProblem
from ..inference.likelihood import LN10, Responses
from ..inference.map_fit import Fit, MassMeasurement, Status
from ..inference.sensor_errors import gauge_errors, sensor_errors
from ..model.assembly import Assembly
from ..progress import Progress, silent, within
from ..reduced.reduced_model import evaluate
from ..reduced.reduced_problem import ReducedProblem, reduced_problem
from .base_effects import mesh_hidden, nuisances
from .candidates import candidates
from .diagnosis import without_effects
from .measurement_forecasts import COSTS, WEIGHED, outlook
from .next_measurement import FurtherTest, Outlook
from .preparation import SOLVED, ZETA, equalised_lines, ready_for_responses, updating_problem
from .question import Question
from .search_round import search_round

NOISE = 0.01  # of |H|, at every line that is compared
WEIGHED_SD = 0.002  # of the mass
LEAST = 1e-9  # probability of a rival, so that its logarithm exists


def unmeasured(question: Question, noise: float = NOISE) -> UpdatingProblem:
    """The updating problem of a test in the planned band; its responses are the deck's own."""
    low, f_max = question.band
    nominal = modelled(question.searched(question.assembly), SOLVED * f_max)
    built = nominal.structure
    rows = question.outputs.rows(built), question.inputs.rows(built)
    test = question.outputs, question.inputs, built, question.accuracy
    mesh = mesh_hidden(nominal, f_max, question.rows)
    reduced = ready_for_responses(question, nominal, f_max)
    f = equalised_lines((low, f_max), question.exclude, ZETA)
    s = 2 * np.pi * f * (ZETA + 1j)
    shape = (len(s), len(question.outputs.labels), len(question.inputs.labels))
    unit = Responses(
        np.ones(shape, complex), s, *rows, np.ones(shape[:2], bool),
        noise=np.full(shape, noise / LN10),
        direct=question.outputs.moved_with_base(question.inputs),
        sensors=sensor_errors(*test),
    ).rebased(reduced.model)  # fmt: skip
    nuisance = [*nuisances(reduced, nominal, mesh), *gauge_errors(*test)]
    problem = updating_problem(question, reduced, unit, nuisance)
    state = evaluate(reduced.model, problem.base, problem.mean())
    return replace(problem, data=replace(unit, values=unit.model(state)))


@dataclass(frozen=True, eq=False)
class FirstTest:
    """The first test of an article with a concealed effect, and fits of the rival explanations."""

    name: str  # of the concealed effect
    question: Question
    article: Article
    problem: UpdatingProblem  # with the recording
    reduced: ReducedProblem  # of the article itself
    hypotheses: tuple[HypothesisFit, ...]  # the rivals
    names: tuple[str, ...]
    probability: np.ndarray  # of each after the recording

    def forecasts(self, kinds: Collection[str] = tuple(COSTS)) -> Outlook:
        """Forecasts of further measurements of some kinds."""
        found = outlook(
            self.problem, self.hypotheses, self.names, self.probability, kinds,
            self.question.further,
        )  # fmt: skip
        assert found is not None
        return found

    def settled(self, odds: float) -> bool:
        """True if one explanation has these odds already."""
        return bool(self.probability.max() >= odds / (1 + odds))

    @property
    def of_truth(self) -> float:
        """Probability of the concealed effect."""
        return float(self.probability[self.names.index(self.name)])

    @property
    def right(self) -> bool:
        """True if the concealed effect has the best odds."""
        return self.names[int(np.argmax(self.probability))] == self.name

    @property
    def itself(self) -> HypothesisFit:
        """The article as an explanation without unknowns."""
        data, model = self.problem.data, self.reduced.model
        assert isinstance(data, Responses)
        state, none = evaluate(model, (), np.zeros(0)), np.zeros((0, 0))
        own = replace(data, sensors=None, known=None, error=None).rebased(model)
        fit = Fit((), np.zeros(0), none, 0.0, 0.0, state, own, Status.CONVERGED)
        return HypothesisFit(Effect(), fit, model)


def first_tests(
    question: Question, names: Sequence[str], each: int = 1, seed: int = 0, scatter: float = 0.0,
    progress: Progress = silent,
) -> Iterator[FirstTest]:  # fmt: skip
    """Test articles with each of the effects concealed in turn, and fit all of the effects.

    The question has no recording: its band and sensors are the planned ones. E, rho and t of the
    articles have a ``scatter`` in units of their prior standard deviation.
    """
    question = replace(question, effects=tuple(names))
    if question.mass_measurement is None:
        mass = mass_properties(question.assembly)[0]
        question = replace(question, mass_measurement=MassMeasurement(mass, WEIGHED_SD * mass))
    progress("the planned test", 0.0)
    problem = unmeasured(question)
    jobs = [name for _ in range(each) for name in names]
    for n, name in enumerate(jobs):
        stage = within(progress, 0.2 + 0.8 * n / len(jobs), 0.2 + 0.8 * (n + 1) / len(jobs))
        stage(f"an article with {name}", 0.0)
        rng = np.random.default_rng([seed, n])
        yield _tested(question, problem, name, rng, scatter)


def _tested(
    question: Question, problem: UpdatingProblem, name: str, rng: np.random.Generator,
    scatter: float,
) -> FirstTest:  # fmt: skip
    """Conceal an effect, record the article, and fit all families of the problem."""
    made = question.assembly
    for effect in (e for e in problem.base if e.kind == "calibration"):
        sd = np.array([p.sd for p in effect.parameters])
        made = effect.apply(made, scatter * sd * rng.standard_normal(len(sd)))
    try:
        article = family(name).conceal(_article(question, made), rng)
    except (ModelError, ValueError, IndexError) as error:
        raise FileError(f"{name}: this deck has nothing that it acts on ({error})") from error
    measured, reduced = recorded(question, problem, article, rng)
    return explained(name, question, article, measured, reduced)


def with_further(test: FirstTest, made: FurtherTest, rng: np.random.Generator) -> FirstTest:
    """The test with a sensor of gain 1, a drive, a wider band or a weighing; all is fitted anew."""
    question = _with_further(test.question, made)
    gains = np.ones(len(question.outputs.labels))
    gains[: len(test.article.gains)] = test.article.gains
    article = replace(test.article, gains=gains)
    problem, reduced = recorded(question, unmeasured(question), article, rng)
    first, data = test.problem.data, problem.data
    assert isinstance(first, Responses)
    assert isinstance(data, Responses)
    values = data.values.copy()
    values[tuple(slice(n) for n in first.values.shape)] = first.values
    problem = replace(problem, data=replace(data, values=values))
    if made.kind != "weighing":
        problem = replace(problem, mass_measurement=test.problem.mass_measurement)
    return explained(test.name, question, article, problem, reduced)


def _with_further(question: Question, made: FurtherTest) -> Question:
    """The question of a test with a further measurement."""
    if made.kind == "band":
        return replace(question, band=(question.band[0], made.amount))
    if made.kind == "weighing":
        assert question.mass_measurement is not None
        return replace(question, mass_measurement=replace(question.mass_measurement, sd=WEIGHED))
    grid, zero = np.array([int(made.label.partition(":")[0])]), np.zeros(1)
    normal, at = normals_at(question.assembly, grid), question.assembly.rows(grid)
    place = MeasuredDofs((made.label,), grid, question.assembly.points[at], normal, zero, zero)
    if made.kind == "drive":
        return replace(question, inputs=question.inputs.joined(place))
    return replace(question, outputs=question.outputs.joined(place))


def recorded(
    question: Question, problem: UpdatingProblem, article: Article, rng: np.random.Generator
) -> tuple[UpdatingProblem, ReducedProblem]:
    """The problem with the recording of an article, which is weighed too, and the article."""
    f_max = problem.reduced.f_max
    solved = modelled(question.searched(article.assembly), SOLVED * f_max)
    rows = question.outputs.rows(solved.structure), question.inputs.rows(solved.structure)
    reduced = reduced_problem(solved, f_max, question.rows(solved.structure))
    data = problem.data
    assert isinstance(data, Responses)
    own = replace(data, outputs=rows[0], inputs=rows[1], sensors=None).rebased(reduced.model)
    values = own.model(evaluate(reduced.model, (), np.zeros(0), False))
    off = rng.standard_normal((2, *values.shape)) * NOISE
    values = values * article.gains[:, None] * np.exp(off[0] + 1j * off[1])
    weighed = problem.mass_measurement
    assert weighed is not None
    mass = article.weight - article.off_scale + weighed.sd * rng.standard_normal()
    weighed = replace(weighed, mass=mass + sum(m for _, m in question.sensor_masses))
    return replace(problem, data=replace(data, values=values), mass_measurement=weighed), reduced


def explained(
    name: str, question: Question, article: Article, measured: UpdatingProblem,
    reduced: ReducedProblem,
) -> FirstTest:  # fmt: skip
    """The test of an article, with all families of the problem fitted to its recording."""
    measured, null = without_effects(measured)
    found = search_round(measured, null, candidates(measured, null), silent)
    by_name = {h.effect.name: h for h in found}
    names = tuple(f.name for f in measured.families)
    if lost := [n for n in names if n not in by_name]:
        raise FileError(f"{lost[0]}: this deck has nothing that it acts on")
    fits = tuple(by_name[n] for n in names)
    S = np.array([h.neg2_log_evidence for h in fits])
    p = np.maximum(np.exp(-(S - S.min()) / 2), LEAST)
    return FirstTest(name, question, article, measured, reduced, fits, names, p / p.sum())


def _article(question: Question, made: Assembly) -> Article:
    """The article before an effect is concealed in it, with the deck's mesh."""
    deck, places = question.assembly, (question.outputs, question.inputs)
    grids, driven = (
        np.where(at.grids > 0, at.grids, deck.ids[nearest_points(deck.points, at.points)])
        for at in places
    )
    x, y, z = question.inputs.directions[0].tolist()
    return Article(
        made, deck, grids, np.array(question.hangers, dtype=np.int64), np.ones(len(grids)),
        drive=(int(driven[0]), (x, y, z)),
    )  # fmt: skip
