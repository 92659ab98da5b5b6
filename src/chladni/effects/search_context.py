"""The services of a search to a family of effects that proposes its candidates.

Effects do not import the search, which is a higher layer; they see it as these protocols. A family
calls a service, and the search implements it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from .effect import Effect
from .effect_context import EffectContext, ElementGrids
from .joints import Connection

NEIGHBOURS = 6  # places round a place of a sheet
MOVES, NEAREST = 8, 3  # of a line: steps at most, and neighbours whose optima are found in each
BETTER = 0.5  # least gain of a move in -2 ln evidence
E = TypeVar("E", bound=Effect)


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect worth a fit, its start (n_p,), and the start of the base effects (n_base,).

    Poles need a start of the base. With responses it follows from the own optimum of the effect.
    """

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
    """Scores of many changes at once, for measured responses.

    ``about`` is the position of the state that is changed in :attr:`SearchContext.bases`.
    """

    @property
    def deviation(self) -> np.ndarray:
        """log10(H_model / H_test) of the calibrated model (n_f, n_out, n_in), fitted lines only."""

    def point_scores(
        self, about: int, matrix: str, strengths: np.ndarray, places: ElementGrids | None = None
    ) -> np.ndarray:
        """Score of a mass ("M", kg) or spring ("K", N/m) at each place (n_places, n_strengths).

        ``places`` are those of :class:`EffectContext` unless others are given.
        """

    def oscillator_scores(
        self, about: int, mass: float, hertz: np.ndarray, places: ElementGrids
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best mass [kg] of a resonator, and the score with it (n_places, n_hertz).

        ``mass`` is a typical value, ``hertz`` are the natural frequencies of the resonator alone.
        """

    def spin_scores(
        self, about: int, places: ElementGrids, sd: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best angular momentum of a spinning part at each place, and the score: (k, 3), (k,).

        The responses are linear in it; ``sd`` is that of its prior along each axis [kg m²/s].
        """

    def field_scores(
        self, about: int, field: str, change: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best amount of each change of ln t, E or rho (n_groups, k), and the score: (k,), (k,)."""

    def effect_scores(
        self, about: int, effect: Effect, change: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best amount of each change (n_p, k) of an effect, and the score: (k,), (k,).

        The responses are linearised in its parameters at their nominal values.
        """

    def bending_scores(
        self, about: int, sets: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best change of bending stiffness of each set of shells, and the score: (k,), (k,).

        The change is relative to the stiffness of the set; the responses are linearised in it.
        """

    def fastener_scores(self, about: int, left: np.ndarray) -> np.ndarray:
        """Score of each fastener of the context with a reduced stiffness (n, k).

        ``left`` (n, k) is the remaining share of the stiffness; nothing is linearised.
        """

    @property
    def fastener_rows(self) -> Sequence[FastenerRow]:
        """The context's fasteners by the lines in which they stand."""

    def run_scores(
        self, about: int, row: int, first: int, last: int, left: np.ndarray
    ) -> np.ndarray:
        """Score of a run of a row with some of its stiffness left (k,)."""


class SearchContext(Protocol):
    """The structure, the test, two states of the base effects, and scores of trial effects.

    A score is -2 ln posterior up to a constant; a smaller score is better.
    """

    @property
    def where(self) -> EffectContext:
        """The structure and its test."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Outputs of the test."""

    @property
    def bases(self) -> tuple[np.ndarray, ...]:
        """Base parameters of the nominal and of the calibrated model, both without scatter."""

    @property
    def null(self) -> np.ndarray:
        """Base parameters of the best fit without any effect."""

    @property
    def idle(self) -> float:
        """-2 ln evidence of that fit, to compare with :meth:`own`; inf if only poles are known."""

    @property
    def weighs_more(self) -> float:
        """Weighed mass minus that of the nominal model [kg]; 0 if nothing was weighed."""

    @property
    def scan(self) -> ResponseScan | None:
        """Fast scores; None if only natural frequencies are known."""

    @property
    def tells_places(self) -> bool:
        """True if the data tell neighbouring places apart: responses, or modes with shapes."""

    @property
    def fasteners(self) -> tuple[tuple[Connection, np.ndarray], ...]:
        """Welds and fasteners of the structure, each with the share z/(w + z) of its rows (r,)."""

    def scores(
        self, effect: Effect, starts: Sequence[np.ndarray], extended: bool = False, about: int = -1
    ) -> np.ndarray:
        """Score of an effect at each start, from one of ``bases`` (n_ways, n_starts).

        With ``extended``, or if the effect releases clamps, the basis is extended by the responses
        of the effect, as for a fit. The static flexibility of few dofs stands for that basis.
        """

    def own(self, effect: Effect, start: np.ndarray) -> tuple[float, np.ndarray]:
        """-2 ln evidence at the own optimum of an effect from a start, and the optimum (n_p,).

        The base follows linearly. Poles are scored at the start alone.
        """

    def modal_operators(self, effect: Effect, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """λ (m,) of the calibrated model, and φᵀ A φ of the operators of an effect (k, m, m)."""

    def optima(self, effect: Effect) -> list[np.ndarray]:
        """The lowest local minima over the effect's whole prior, if only poles are known."""


def best_starts(context: SearchContext, effects: Sequence[Effect]) -> list[Candidate]:
    """Candidates for effects of known place, each from the best of its starts.

    With poles only, an effect of many parameters starts in each of its lowest local minima. With
    responses it starts at its prior mean as well: scores about a model without a strong effect say
    little of its several numbers, and a fit that begins far from them stays there.
    """
    out: list[Candidate] = []
    for effect in effects:
        if context.scan is None and len(effect.parameters) > 2:
            out += [Candidate(effect, x, context.bases[0]) for x in context.optima(effect)]
            continue
        starts = effect.starts()
        for scores in context.scores(effect, starts):
            out.append(Candidate(effect, starts[int(np.argmin(scores))], context.bases[-1]))
        if len(effect.parameters) > 2:
            mean = np.array([p.mean for p in effect.parameters])
            if not np.array_equal(mean, out[-1].start):
                out.append(Candidate(effect, mean, context.bases[0]))
    return out


def best_places(
    context: SearchContext, effects: Sequence[Effect], wanted: int = 2, *, anywhere: bool = False,
    extended: bool = False, point: np.ndarray | None = None, optimised: bool = False,
) -> list[Candidate]:  # fmt: skip
    """The best places of an effect, evaluated at many places with all its starts.

    Parameters
    ----------
    anywhere : the best wherever they are, not those of different valleys
    extended : see :meth:`SearchContext.scores`
    point : (n_effects, 3)   their places [m], where these are not the points of the effects
    optimised : each at its own optimum from its best start; a strong effect scores well at no start
    """
    if not effects:
        return []
    point, options = np.array([e.point for e in effects]) if point is None else point, []
    for effect in effects:
        scores = context.scores(effect, effect.starts(), extended)[0]
        start = effect.starts()[int(np.argmin(scores))]
        options.append(context.own(effect, start) if optimised else (float(scores.min()), start))
    least = np.array([score for score, _ in options])
    best = np.argsort(least)[:wanted] if anywhere else valleys(least, point, wanted=wanted)
    return [Candidate(effects[k], options[k][1], context.bases[-1]) for k in best]


def followed(
    context: SearchContext, effect: E, start: np.ndarray, around: Callable[[E], Sequence[E]]
) -> tuple[E, np.ndarray]:
    """Move an effect that explains anything to its neighbours while they explain more.

    Each is at its own optimum. A longer line needs less strength: at the strength of the shorter
    one it explains nothing. The optima of the ``NEAREST`` neighbours by score are found.
    """
    least, x = context.own(effect, start)
    for _ in range(MOVES if least < context.idle else 0):
        near = around(effect)
        scores = [float(context.scores(e, [x], True).min()) for e in near]
        best = [near[k] for k in np.argsort(scores)[:NEAREST]]
        own = [context.own(e, x) for e in best]
        k = min(range(len(own)), key=lambda k: own[k][0], default=-1)
        if k < 0 or own[k][0] > least - BETTER:
            break
        effect, (least, x) = best[k], own[k]
    return effect, x


def valleys(
    score: np.ndarray, point: np.ndarray, taken: Sequence[int] = (), wanted: int = 1
) -> list[int]:
    """The best positions whose neighbours all score worse: each is the bottom of its own valley.

    A distance instead of neighbours loses a true place that is near to a false one with a better
    score.

    Parameters
    ----------
    score : (n,)       a smaller score is better
    point : (n, 3)     [m]; positions that share a point are neighbours
    taken : positions chosen before
    """
    from scipy.spatial import cKDTree

    places, place = np.unique(point, axis=0, return_inverse=True)
    least = np.full(len(places), np.inf)
    np.minimum.at(least, place, score)
    near = cKDTree(places).query(places, k=min(NEIGHBOURS + 1, len(places)))[1]
    bottom = least <= least[near.reshape(len(places), -1)].min(axis=1)
    bottom[place[list(taken)]] = False
    bottoms = np.flatnonzero(bottom & np.isfinite(least))
    best = bottoms[np.argsort(least[bottoms], kind="stable")][:wanted]
    return [int(np.argmin(np.where(place == at, score, np.inf))) for at in best]
