"""Further measurements of tied articles, with data of a full model of the article."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.search import measurement_forecasts
from chladni_evidence.next_evidence import (
    AGENTS,
    BAND,
    MOST,
    _upward,
    course,
    courses,
    data_of,
    score,
)
from chladni_specimens import plate


@pytest.fixture(scope="module")
def found():
    """Two effects on a small plate; no odds are enough, so that every article stays open."""
    deck = plate(0.4, 0.3, 6, 5, 2e-3)
    with pytest.MonkeyPatch.context() as patch:
        for name, n in (("PLACES", 6), ("MASSES", 2), ("LINES", 8)):
            patch.setattr(measurement_forecasts, name, n)
        layout = tuple(_upward(deck, k) for k in (1, 17))
        yield list(courses(deck, layout, BAND, ("point-mass", "crack"), 1, 5, 1e12))


def test_every_open_article_is_followed_by_every_agent(found):
    first, second = found[0], found[1 + len(AGENTS)]
    assert (first.name, second.name) == ("point-mass", "crack")
    assert [c.agent for c in found[1 : 1 + len(AGENTS)]] == list(AGENTS)
    assert all(len(c.right) == len(c.forecast) == MOST for c in found[1 : 1 + len(AGENTS)])


def test_what_the_article_shows_is_not_drawn_from_the_forecast(found):
    """The data are the article's own; with the truth as its own forecast none would be left."""
    test = found[0]
    known, shown = data_of(test)
    off = [y - s.mean[test.names.index(test.name)] for y, s in zip(shown, known.seen, strict=True)]
    assert np.abs(np.concatenate(off)).max() > 0
    assert_allclose([len(y) for y in shown], [s.mean.shape[1] for s in known.seen])
    again = course(test, known, shown, AGENTS[0], np.random.default_rng(0), 1.0)
    assert again.forecast == ()  # the first test has these odds


def test_the_table_counts_open_articles(found):
    lines = score(found, 1e12)
    assert lines[0].startswith("2 articles, 2 open")
    assert sum(any(line.startswith(a) for a in AGENTS) for line in lines) == len(AGENTS)
