"""A line moves to the neighbour that explains more at its own strength."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.search_context import BETTER, MOVES, followed

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
