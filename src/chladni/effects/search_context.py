"""What a search offers a family of effects that proposes its candidates.

Effects stand below the search and do not know it; they see it as these protocols. A family says
which service it wants; how the service works is the search's own affair.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .effect import Effect
from .joints import Connection
from .surroundings import ElementGrids, Surroundings


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect worth a fit: its start (n_p,), and the start of the base effects (n_base,)."""

    effect: Effect
    start: np.ndarray
    base: np.ndarray


class Loose(Protocol):
    """A fastener, or several as one, as it is loosened."""

    @property
    def joint(self) -> Connection:
        """What it is in the deck."""

    @property
    def share(self) -> np.ndarray:
        """Share z/(w + z) of the sheets in the stiffness of both (r,)."""


class FastenerRow(Protocol):
    """Adjacent fasteners of one line, any run of which may be loosened as one."""

    def __len__(self) -> int:
        """How many they are."""

    def run(self, first: int, last: int) -> Loose:
        """The fasteners from one to another as one."""


class ResponseScan(Protocol):
    """Scores of many changes at once, where responses were measured.

    ``about`` is the position in :attr:`SearchContext.bases` of the state that is changed.
    """

    @property
    def deviation(self) -> np.ndarray:
        """log10(H_model / H_test) of the calibrated model (n_f, n_out, n_in), fitted lines."""

    def point_scores(
        self, about: int, matrix: str, strengths: np.ndarray, places: ElementGrids | None = None
    ) -> np.ndarray:
        """Score of a mass ("M", kg) or spring ("K", N/m) at each place (n_places, n_strengths).

        ``places`` are those of :class:`Surroundings` unless others are given.
        """

    def oscillator_scores(
        self, about: int, mass: float, hertz: np.ndarray, places: ElementGrids
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best mass [kg] of a lump on a spring, and the score with it (n_places, n_hertz).

        ``mass`` is a typical one, ``hertz`` the frequencies of the lump on the spring alone.
        """

    def field_scores(
        self, about: int, field: str, change: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best amount of each change of ln t, E or rho (n_groups, k), and the score: (k,), (k,)."""

    def bending_scores(
        self, about: int, sets: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best amount of bending stiffness each set of shells gains, and the score: (k,), (k,).

        The amount is in units of what the set has; the responses are taken as linear in it.
        """

    def fastener_scores(self, about: int, left: np.ndarray) -> np.ndarray:
        """Score of each of the context's fasteners with some of its stiffness left (n, k).

        ``left`` (n, k) is in units of what the fastener has; nothing is linearised.
        """

    @property
    def fastener_rows(self) -> Sequence[FastenerRow]:
        """The context's fasteners by the lines in which they stand."""

    def run_scores(
        self, about: int, row: int, first: int, last: int, left: np.ndarray
    ) -> np.ndarray:
        """Score of a run of a row with some of its stiffness left (k,)."""


class SearchContext(Protocol):
    """The structure, the test, two states of the base effects, and scores of what is tried.

    A score is -2 ln posterior up to a constant: the smaller, the better.
    """

    @property
    def where(self) -> Surroundings:
        """The structure and its test."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Outputs of the test."""

    @property
    def bases(self) -> tuple[np.ndarray, ...]:
        """Base parameters of the nominal and of the calibrated model, scatter idle in both."""

    @property
    def null(self) -> np.ndarray:
        """Base parameters of the best fit without any effect."""

    @property
    def weighs_more(self) -> float:
        """What the scales tell beyond the nominal model [kg]; 0 where nothing was weighed."""

    @property
    def scan(self) -> ResponseScan | None:
        """Fast scores; None where only natural frequencies are known."""

    @property
    def fasteners(self) -> tuple[tuple[Connection, np.ndarray], ...]:
        """Welds and fasteners of the structure; of each the share z/(w + z) of its rows (r,)."""

    def scores(
        self, effect: Effect, starts: Sequence[np.ndarray], carried: bool = False, about: int = -1
    ) -> np.ndarray:
        """Score of an effect at each start about one of ``bases`` (n_ways, n_starts).

        With ``carried``, or where the effect lets clamps go, the basis is widened by what it moves,
        as it is for a fit.
        """

    def modal_operators(self, effect: Effect, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """λ (m,) of the calibrated model, and φᵀ A φ of the operators of an effect (k, m, m)."""

    def valleys(self, effect: Effect) -> list[np.ndarray]:
        """Where poles alone are known: the lowest minima over the effect's whole prior."""


APART = 1 / 6  # of the structure's size lie between places that are both followed


def best_starts(context: SearchContext, effects: Sequence[Effect]) -> list[Candidate]:
    """Effects whose place is known, each from the best of its starts.

    With poles alone an effect of many parameters begins in each of its lowest valleys.
    """
    out: list[Candidate] = []
    for effect in effects:
        if context.scan is None and len(effect.parameters) > 2:
            out += [Candidate(effect, x, context.bases[0]) for x in context.valleys(effect)]
            continue
        starts = effect.starts()
        for scores in context.scores(effect, starts):
            out.append(Candidate(effect, starts[int(np.argmin(scores))], context.bases[-1]))
    return out


def best_places(
    context: SearchContext, effects: Sequence[Effect], point: np.ndarray, wanted: int = 2,
    apart: float = APART, carried: bool = False,
) -> list[Candidate]:  # fmt: skip
    """The same effect at many places, each evaluated at all its starts: the best places.

    Parameters
    ----------
    point : (n_effects, 3)   their places [m]
    apart : see :func:`distinct`
    carried : see :meth:`SearchContext.scores`
    """
    options = []
    for effect in effects:
        scores = context.scores(effect, effect.starts(), carried)[0]
        options.append((float(scores.min()), effect.starts()[int(np.argmin(scores))]))
    best = distinct(np.array([score for score, _ in options]), point, [], wanted, apart)
    return [Candidate(effects[k], options[k][1], context.bases[-1]) for k in best]


def distinct(
    score: np.ndarray, point: np.ndarray, taken: Sequence[int], wanted: int, apart: float = APART
) -> list[int]:
    """The best positions, none within a share of the structure's size of another one chosen.

    Parameters
    ----------
    score : (n,)       the smaller, the better
    point : (n, 3)     [m]
    taken : positions chosen before
    apart : the share; negative: they may share a place
    """
    reach = apart * np.linalg.norm(np.ptp(point, axis=0))
    out: list[int] = []
    for k in np.argsort(score):
        if all(np.linalg.norm(point[k] - point[j]) > reach for j in [*taken, *out]):
            out.append(int(k))
        if len(out) == wanted:
            break
    return out
