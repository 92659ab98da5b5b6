"""Further sensors on tied articles, with every verdict from all effects fitted anew."""

from itertools import islice

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.search import measurement_forecasts
from chladni_evidence import next_evidence
from chladni_evidence.next_evidence import AGENTS, MOST, Course, _upward, courses, score, share
from chladni_specimens import plate


@pytest.fixture(scope="module")
def found():
    """One article on a small plate; no odds are enough, so that it stays open."""
    deck = plate(0.4, 0.3, 6, 5, 2e-3)
    with pytest.MonkeyPatch.context() as patch:
        for name, n in (("PLACES", 5), ("LINES", 8)):
            patch.setattr(measurement_forecasts, name, n)
        patch.setattr(next_evidence, "MOST", 1)
        layout = tuple(_upward(deck, [f"{n}:+Z"]) for n in deck.ids[[1, 17]])
        every = courses(deck, layout, (20.0, 150.0), ("point-mass", "mass-patch"), 5, 1e12)
        yield list(islice(every, 1 + len(AGENTS)))


def test_every_agent_follows_an_open_article(found):
    first, *own = found
    assert first.name == "point-mass"
    assert [c.agent for c in own] == list(AGENTS)
    assert all(len(c.right) == len(c.forecast) == len(c.made) == 1 for c in own)


def test_the_table_counts_shares_and_forecasts():
    """Two of four courses settle rightly at once, one wrongly; of three forecasts of 0.8 two came.

    A course that is settled stays so, and is forecast no further.
    """
    settled = Course(AGENTS[0], "crack", ("1:n",), (0.8,), (True,) * MOST, (False,) * MOST)
    wrong = Course(AGENTS[0], "crack", ("1:n",), (0.8,), (False,) * MOST, (True,) * MOST)
    never = Course(AGENTS[0], "crack", ("1:n",), (0.1,), (False,) * MOST, (False,) * MOST)
    lines = score([settled, settled, wrong, never])
    assert [line.split()[2] for line in lines if "right" in line and "(" in line][:1] == ["right"]
    assert any(line.count("50 (15-85) %") == MOST for line in lines)
    assert any(line.count("25 (5-70) %") == MOST for line in lines)
    assert "forecast 70% to 90%, mean 80%: 67 (21-94) % of 3 came" in lines


def test_the_interval_is_that_of_wilson():
    """(p + z²/2n ± z √(p(1-p)/n + z²/4n²)) / (1 + z²/n)."""
    z, n, p = 1.959964, 40, 0.9
    half = z * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    ends = [(p + z**2 / (2 * n) + way * half) / (1 + z**2 / n) for way in (-1, 1)]
    said = [float(v) for v in share(36, 40).split("(")[1].split(")")[0].split("-")]
    assert_allclose(said, 100 * np.array(ends), atol=0.5)
