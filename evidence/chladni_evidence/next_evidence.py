"""Evidence on the next measurement: articles whose first test leaves explanations open.

An effect is concealed in an article that differs from the deck in E, rho and t.  Its recording is
the response of a full model of that article.  Where the first test leaves the name open, a sensor,
a drive, a wider band or a weighing is added.  All effects are fitted anew to the whole recording,
and so on, until one name has the odds: the loop of ``chladni diagnose`` and ``chladni next``.
Forecasts never see the article.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import binomtest

from chladni.fem.measured_dofs import MeasuredDofs
from chladni.inference.expected_information import Predicted
from chladni.model.assembly import Assembly
from chladni.parallel import one_blas_thread
from chladni.search.next_measurement import ODDS, Outlook
from chladni.search.question import Question
from chladni.search.simulated_test import FirstTest, first_tests, with_further
from chladni_specimens import plate

MOST = 3  # further measurements
KINDS = "sensor", "drive", "band", "weighing"
EFFECTS = ("point-mass", "mass-patch", "crack", "stiffness-patch", "thickness-distribution")
SHELLS = 18, 13  # of the plate
BAND = 20.0, 250.0  # [Hz]
INFORMED, RANDOM = "expected information", "random"
AGENTS = (INFORMED, "effective independence", RANDOM)
BINS = 0.0, 0.3, 0.7, 0.9, 1.0  # of forecasts


@dataclass(frozen=True, eq=False)
class Course:
    """Further measurements of one article, as one agent chose them.

    Attributes
    ----------
    agent, truth : by name
    made : labels of the sensors and drives, kinds of the others
    forecast : probability, before each, that the true name then has the odds
    right, wrong : whether the true or a wrong name has the odds after each
    """

    agent: str
    truth: str
    made: tuple[str, ...]
    forecast: tuple[float, ...]
    right: tuple[bool, ...]
    wrong: tuple[bool, ...]


Found = Course | FirstTest


def course(
    test: FirstTest, known: Outlook, agent: str, rng: np.random.Generator, odds: float = ODDS
) -> Course:
    """Measure further until one name has the odds, or ``MOST`` measurements were made.

    Parameters
    ----------
    known : forecasts of the first of them
    """
    made, forecast, right, wrong = list[str](), list[float](), list[bool](), list[bool]()
    for _ in range(MOST):
        if not test.settled(odds):
            known = (test.forecasts(KINDS) if made else known).without(made)
            k = _choice(agent, known, rng)
            forecast.append(known.rivals.forecast(known.seen[k]).settled(odds))
            made.append(known.candidates[k].label or known.candidates[k].kind)
            test = with_further(test, known.candidates[k], rng)
        right.append(test.settled(odds) and test.right)
        wrong.append(test.settled(odds) and not test.right)
    each = (tuple(made), tuple(forecast), tuple(right), tuple(wrong))
    return Course(agent, test.name, *each)


def _choice(agent: str, known: Outlook, rng: np.random.Generator) -> int:
    """Position of the measurement that an agent makes; effective independence takes sensors."""
    if agent == RANDOM:
        return int(rng.integers(len(known.seen)))
    if agent == INFORMED:
        return int(np.argmax([known.information([k]) for k in range(len(known.seen))]))

    def growth(seen: Predicted) -> float:
        each = [np.linalg.slogdet(np.eye(F.shape[1]) + F.T @ F)[1] for F in seen.factors]
        return float(known.rivals.probability @ each)

    sensors = [k for k, c in enumerate(known.candidates) if c.kind == "sensor"]
    return max(sensors, key=lambda k: growth(known.seen[k]))


def courses(
    deck: Assembly, layout: tuple[MeasuredDofs, ...], band: tuple[float, float],
    effects: Sequence[str], seed: int, odds: float = ODDS,
) -> Iterator[Found]:  # fmt: skip
    """First tests, and for those that are open the course of each agent.

    Parameters
    ----------
    layout : outputs and inputs of the first test
    """
    question = Question(deck, layout[0], layout[1], band=band)
    with one_blas_thread():
        for n, test in enumerate(first_tests(question, effects, seed=seed, scatter=1.0)):
            yield test
            if not test.settled(odds):
                known = test.forecasts(KINDS)
                for agent in AGENTS:
                    yield course(test, known, agent, np.random.default_rng([seed, n]), odds)


def score(found: Sequence[Found], odds: float = ODDS) -> list[str]:
    """Lines of the table: settled rightly and wrongly after each sensor, and calibration.

    Intervals of 95 % are those of Wilson (1927, J. Am. Stat. Assoc. 22, 209-212).
    """
    tests = [t for t in found if isinstance(t, FirstTest)]
    open_ = sum(not t.settled(odds) for t in tests)
    missed = sum(t.settled(odds) and not t.right for t in tests)
    lines = [f"{len(tests)} articles, {open_} open after the first test, {missed} settled wrongly"]
    lines.append(f"{'':33s}" + "".join(f"{f'after {k + 1}':18s}" for k in range(MOST)).rstrip())
    for agent in AGENTS:
        own = [c for c in found if isinstance(c, Course) and c.agent == agent]
        for what in ("right", "wrong") if own else ():
            counts = np.sum([getattr(c, what) for c in own], axis=0)
            shares = "".join(f"{share(int(k), len(own)):18s}" for k in counts)
            lines.append(f"{agent:24s}{what:9s}{shares}".rstrip())
    pairs = np.array([
        (f, r) for c in found if isinstance(c, Course)
        for f, r in zip(c.forecast, c.right, strict=False)
    ]).reshape(-1, 2)  # fmt: skip
    for low, high in pairwise(BINS):
        at = (pairs[:, 0] >= low) & ((pairs[:, 0] < high) | (high == BINS[-1]))
        if n := int(at.sum()):
            mean, came = pairs[at, 0].mean(), int(pairs[at, 1].sum())
            lines.append(
                f"forecast {low:.0%} to {high:.0%}, mean {mean:.0%}: {share(came, n)} of {n} came"
            )
    return lines


def share(k: int, n: int) -> str:
    """A share in percent with its interval of 95 %.

    >>> share(36, 40)
    '90 (77-96) %'
    """
    ends = binomtest(k, n).proportion_ci(method="wilson")
    return f"{100 * k / n:.0f} ({100 * ends.low:.0f}-{100 * ends.high:.0f}) %"


def next_evidence(seeds: Iterable[int], say: Callable[[str], None]) -> None:
    """Conceal every effect in a plate once a seed, seen by one sensor at random, and score."""
    found = list[Found]()
    for seed in seeds:
        for one in courses_of_seed(seed):
            found.append(one)
            if isinstance(one, FirstTest):
                each = zip(one.names, one.probability, strict=True)
                say(f"{seed} {one.name}: " + ", ".join(f"{n} {p:.2g}" for n, p in each))
    for line in score(found):
        say(line)


def courses_of_seed(seed: int) -> Iterator[Found]:
    """The courses of a seed: one sensor and one drive anywhere on the plate."""
    deck = plate(0.5, 0.35, *SHELLS, 2e-3)
    ids = np.random.default_rng([seed, 1]).choice(deck.ids, 2, replace=False)
    layout = tuple(_upward(deck, [f"{n}:+Z"]) for n in ids)
    return courses(deck, layout, BAND, EFFECTS, seed)


def _upward(deck: Assembly, labels: Sequence[str]) -> MeasuredDofs:
    """The normal motion of some grids of a flat plate."""
    ids = np.array([int(name.partition(":")[0]) for name in labels])
    zero, up = np.zeros(len(ids)), np.tile([0.0, 0.0, 1.0], (len(ids), 1))
    return MeasuredDofs(tuple(labels), ids, deck.points[deck.rows(ids)], up, zero, zero)
