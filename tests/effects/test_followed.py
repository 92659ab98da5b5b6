"""A line moves to the neighbour that explains more at its own strength."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.search_context import BETTER, MOVES, best_places, followed

LONGEST = MOVES + 3


def context(best):
    """Lines 1, 2, ... edges long; each has the optimum 1 / length, and one of them is the best."""
    return SimpleNamespace(
        scores=lambda line, starts, extended: np.array(
            [[abs(line - best) + 1e3 * (x[0] - 1 / line) ** 2 for x in starts]]
        ),
        own=lambda line, start: (2 * BETTER * abs(line - best), np.array([1 / line])),
        idle=99.0,
    )


def longer_or_shorter(line):
    return [k for k in (line - 1, line + 1) if 1 <= k <= LONGEST]


@pytest.mark.parametrize("best", [1, 2, 6])
def test_a_line_is_followed_to_the_best_although_its_strength_must_change(best):
    """At the strength of one of two edges every other line explains less."""
    known, begun = context(best), np.array([0.5])
    scores = [known.scores(k, [begun], True)[0, 0] for k in range(1, LONGEST)]
    assert best == 2 or np.argmin(scores) != best - 1
    line, x = followed(known, 2, begun, longer_or_shorter)
    assert (line, *x) == pytest.approx((best, 1 / best))


def test_moves_end_at_a_small_gain_without_neighbours_and_in_time():
    known = context(5)
    known.own = lambda line, start: (0.9 * BETTER * abs(line - 5), start)
    assert followed(known, 2, np.ones(1), longer_or_shorter)[0] == 2
    assert followed(context(5), 2, np.ones(1), lambda line: [])[0] == 2
    assert followed(context(LONGEST), 1, np.ones(1), longer_or_shorter)[0] == 1 + MOVES


def test_what_explains_nothing_does_not_move():
    known = context(5)
    known.idle = known.own(2, None)[0]
    assert followed(known, 2, np.ones(1), longer_or_shorter)[0] == 2


@pytest.mark.parametrize("optimised", [False, True])
def test_a_strong_effect_leads_by_its_own_optimum_and_by_no_start(optimised):
    """Its data are sharp: a start beside the optimum scores worse than a wrong place."""
    places = [SimpleNamespace(point=(float(k), 0.0, 0.0), best=k == 3) for k in range(7)]
    for e in places:
        e.starts = lambda: [np.zeros(1), np.ones(1)]
    known = SimpleNamespace(
        bases=("null",),
        scores=lambda e, starts, extended: np.array([[9e4, 5e4] if e.best else [9.0, 8.0]]),
        own=lambda e, start: (1.0 if e.best else 7.0, start + 0.5),
    )
    (led,) = best_places(known, places, 1, anywhere=True, optimised=optimised)
    assert led.effect.best == optimised
    assert led.start == pytest.approx(1.5 if optimised else 1.0)
