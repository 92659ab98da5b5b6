"""A hypothesis that holds the null within it never loses to it for want of a start."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.updating.diagnosis import BEHIND, _tried

NULL = SimpleNamespace(S=100.0, fit=SimpleNamespace(x=np.ones(2)))


class Search:
    """A fit from zeros stops at ``first``, one from the null's parameters at ``again``."""

    def __init__(self, first, again):
        self.ends, self.starts = {0.0: first, 1.0: again}, []

    def trial(self, effect, start, base, steps):
        self.starts.append(float(base[0]))
        return SimpleNamespace(S=self.ends[float(base[0])])


@pytest.mark.parametrize(
    ("first", "again", "starts", "end"),
    [
        (90.0, 0.0, [0.0], 90.0),  # better than the null: no second start
        (100.0 + BEHIND - 1, 0.0, [0.0], 100.0 + BEHIND - 1),  # behind by its price only
        (5000.0, 80.0, [0.0, 1.0], 80.0),  # stopped on the way
        (5000.0, 9000.0, [0.0, 1.0], 5000.0),  # the better of both
    ],
)
def test_what_stays_behind_the_null_begins_there(first, again, starts, end):
    search = Search(first, again)
    assert _tried(search, NULL, None, np.zeros(1), np.zeros(2)).S == end
    assert search.starts == starts
