"""Evidence on the next measurement: articles whose first test leaves explanations open.

An effect is concealed in an article that differs from the deck in E, rho and t.  Its recording is
the response of a full model of that article.  Where the first test leaves the name open,
measurements are made until one name has the odds.  Their data come from the same full model: they
test the forecast, which never saw it.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.fem.measured_dofs import MeasuredDofs
from chladni.inference.expected_information import Predicted, Rivals, nothing
from chladni.model.assembly import Assembly
from chladni.parallel import one_blas_thread
from chladni.search.measurement_forecasts import Rival, measurements
from chladni.search.next_measurement import ODDS, Outlook
from chladni.search.question import Question
from chladni.search.simulated_test import FirstTest, first_tests
from chladni_specimens import plate

MOST = 3  # further measurements
EFFECTS = ("point-mass", "mass-patch", "crack", "stiffness-patch", "thickness-distribution")
BAND = 20.0, 250.0  # [Hz] of the first tests
AGENTS = ("expected information", "effective independence", "random")


@dataclass(frozen=True, eq=False)
class Course:
    """Further measurements of one article, as one agent chose them.

    Attributes
    ----------
    agent, truth : by name
    forecast : probability, before each measurement, that the true name then has the odds
    right, wrong : whether the true or a wrong name has the odds after each
    """

    agent: str
    truth: str
    forecast: tuple[float, ...]
    right: tuple[bool, ...]
    wrong: tuple[bool, ...]


def data_of(test: FirstTest) -> tuple[Outlook, list[np.ndarray]]:
    """The outlook of a first test in all its data, and what the article itself shows there."""
    rivals = [Rival(test.problem, h) for h in (*test.hypotheses, test.itself)]
    found = list(measurements(test.problem, rivals))
    seen = tuple(
        Predicted(np.stack([m for m, _ in each[:-1]]), tuple(F for _, F in each[:-1]))
        for _, each in found
    )
    known = replace(test.outlook, candidates=tuple(c for c, _ in found), seen=seen)
    return known, [each[-1][0] for _, each in found]


def course(
    test: FirstTest, known: Outlook, shown: Sequence[np.ndarray], agent: str,
    rng: np.random.Generator, odds: float = ODDS,
) -> Course:  # fmt: skip
    """Measure until one name has the odds, or ``MOST`` measurements were made."""
    y = [s + rng.standard_normal(len(s)) for s in shown]
    truth, enough = test.names.index(test.name), odds / (1 + odds)
    made, data, left = nothing(known.seen[0]), np.zeros(0), list(range(len(known.seen)))
    forecast, right, wrong = list[float](), list[bool](), list[bool]()
    p = known.rivals.probability
    for _ in range(MOST):
        if p.max() < enough:
            now = Rivals(p)
            seen = [s.after(made, data).short for s in known.seen]
            k = left.pop(_choice(agent, known, now, [seen[q] for q in left], left, rng))
            forecast.append(now.forecast(seen[k]).settled(odds))
            made, data = made + known.seen[k], np.append(data, y[k])
            p = known.rivals.posterior(made, data[:, None])[:, 0]
        right.append(bool(p[truth] >= enough))
        wrong.append(bool(p.max() >= enough and p[truth] < enough))
    return Course(agent, test.name, tuple(forecast), tuple(right), tuple(wrong))


def _choice(
    agent: str, known: Outlook, now: Rivals, seen: Sequence[Predicted], left: Sequence[int],
    rng: np.random.Generator,
) -> int:  # fmt: skip
    """Position in ``left`` of the measurement that an agent makes."""
    if agent == "random":
        return int(rng.integers(len(left)))
    cost = np.array([known.candidates[q].cost for q in left])
    if agent == "expected information":
        return int(np.argmax([now.forecast(s).information for s in seen] / cost))
    sensors = np.array([known.candidates[q].kind == "sensor" for q in left])
    growth = [
        sum(
            w * np.linalg.slogdet(np.eye(F.shape[1]) + F.T @ F)[1]
            for w, F in zip(now.probability, s.factors, strict=True)
        )
        for s in seen
    ]
    return int(np.argmax(np.where(sensors, growth, -np.inf)))


def courses(
    deck: Assembly, layout: tuple[MeasuredDofs, ...], band: tuple[float, float],
    effects: Sequence[str],
    articles: int, seed: int, odds: float = ODDS,
) -> Iterator[Course | FirstTest]:  # fmt: skip
    """First tests, and for those that are open the course of each agent.

    Parameters
    ----------
    layout : outputs and inputs of the first test
    articles : with each effect
    """
    question = Question(deck, layout[0], layout[1], band=band)
    with one_blas_thread():
        for n, test in enumerate(first_tests(question, effects, articles, seed=seed, scatter=1.0)):
            yield test
            if test.settled(odds):
                continue
            known, shown = data_of(test)
            for agent in AGENTS:
                yield course(test, known, shown, agent, np.random.default_rng([seed, n]), odds)


def score(found: Sequence[Course | FirstTest], odds: float = ODDS) -> list[str]:
    """Lines of the table: settled rightly and wrongly after each measurement, and calibration."""
    tests = [t for t in found if isinstance(t, FirstTest)]
    open_ = sum(not t.settled(odds) for t in tests)
    missed = sum(t.settled(odds) and not t.right for t in tests)
    lines = [f"{len(tests)} articles, {open_} open after the first test, {missed} settled wrongly"]
    for agent in AGENTS:
        own = [c for c in found if isinstance(c, Course) and c.agent == agent]
        if own:
            right, wrong = (
                np.mean([getattr(c, w) for c in own], axis=0) for w in ("right", "wrong")
            )
            shares = "  ".join(f"{r:4.0%} ({w:.0%})" for r, w in zip(right, wrong, strict=True))
            lines.append(f"{agent:24s} settled rightly (wrongly) after 1, 2, 3: {shares}")
    pairs = np.array([
        (f, r) for c in found if isinstance(c, Course)
        for f, r in zip(c.forecast, c.right, strict=False)
    ]).reshape(-1, 2)  # fmt: skip
    for low, high in ((0.0, 0.3), (0.3, 0.7), (0.7, 0.9), (0.9, 1.01)):
        came = pairs[(pairs[:, 0] >= low) & (pairs[:, 0] < high), 1]
        if len(came):
            lines.append(
                f"forecast {low:.0%} to {min(high, 1):.0%}: {came.mean():.0%} of {len(came)} came"
            )
    return lines


def next_evidence(seeds: Iterable[int], say: Callable[[str], None]) -> None:
    """Conceal every effect in a plate once a seed, seen by one sensor at random, and score."""
    deck, found = plate(0.5, 0.35, 12, 9, 2e-3), list[Course | FirstTest]()
    for seed in seeds:
        at = np.random.default_rng([seed, 1]).choice(len(deck.ids), 2, replace=False)
        layout = tuple(_upward(deck, int(k)) for k in at)
        for one in courses(deck, layout, BAND, EFFECTS, 1, seed):
            found.append(one)
            if isinstance(one, FirstTest):
                odds = ", ".join(
                    f"{n} {p:.2g}" for n, p in zip(one.names, one.probability, strict=True)
                )
                say(f"{seed} {one.name}: {odds}")
    for line in score(found):
        say(line)


def _upward(deck: Assembly, k: int) -> MeasuredDofs:
    """The normal motion of one grid of a flat plate."""
    zero = np.zeros(1)
    return MeasuredDofs(
        (f"{deck.ids[k]}:+Z",), deck.ids[[k]], deck.points[[k]], np.eye(3)[[2]], zero, zero
    )
