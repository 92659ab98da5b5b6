"""Repeats and articles measure a spread; levels tell whether frequencies move; all are scored."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.recordings import accelerances, across, noisy

from chladni.ema.identification import equalised, identify
from chladni.ema.level_modes import AtLevel
from chladni.ema.level_study import level_study
from chladni.ema.level_words import level_notes
from chladni.fem.modelled import modelled
from chladni.inference.map_fit import MassMeasurement
from chladni.model.point_masses import with_masses
from chladni.search.other_recordings import (
    levels,
    measured_spread,
    others_identified,
    scored_others,
)
from chladni.search.preparation import prepare
from chladni.search.question import OtherRecording, Question
from chladni_specimens.plates import plate

GRIDS = np.array([2, 4, 7, 18, 30, 43])
F = np.linspace(15, 200, 700)


def recorded(assembly, seed, stretch=1.0, noise=0.005):
    """Accelerances with every frequency stretched, 1 % damping and some noise."""
    ends = across(assembly, GRIDS), across(assembly, [2])
    H = accelerances(modelled(assembly, 900.0), *ends, F, stretch=stretch)
    return replace(H, values=noisy(H.values, noise, seed))


DECK = plate(0.3, 0.22, 6, 6, 1e-3)


def asked(*others, level=None):
    return Question(
        DECK, across(DECK, GRIDS), across(DECK, [2]), frf=recorded(DECK, 0), band=(20.0, 170.0),
        mass_measurement=MassMeasurement(0.518, 0.001), others=others, level=level,
    )  # fmt: skip


def test_the_spread_of_articles_is_the_slope_of_their_frequencies():
    """d log10 H = -(∂ log10 H / ∂ ln f) d ln f: a stretch of 0.4 % on a single other article."""
    question = asked(OtherRecording("B", "article", recorded(DECK, 1, 1.004, 1e-5)))
    question = replace(question, frf=recorded(DECK, 0, 1.0, 1e-5))
    others, notes = others_identified(question, (20.0, 170.0))
    assert not notes
    first = identify(question.frf, (20.0, 170.0))
    s = 2 * np.pi * np.linspace(40, 150, 60) * (0.08 + 1j)
    spread = measured_spread(equalised(first, s), others, s)
    moved = np.log10(equalised(others[0][1], s) / equalised(first, s))
    due = np.abs(moved) / np.sqrt(2)  # two values, K - 1 = 1: |d|²/2
    assert spread.shape == due.shape
    rms = lambda x: np.sqrt((x**2).mean())  # noqa: E731
    assert_allclose(rms(spread), rms(due), rtol=0.1)


def test_a_level_is_no_repeat():
    question = asked(OtherRecording("hard", "level", recorded(DECK, 1, 0.98), 4.0), level=1.0)
    others, _ = others_identified(question, (20.0, 170.0))
    assert measured_spread(np.ones((3, 6, 1), complex), others, 1j * np.ones(3)) is None


@pytest.mark.parametrize(("stretch", "moves"), [(1.0, False), (0.985, True)])
def test_frequencies_that_move_from_level_to_level_are_named(stretch, moves):
    """All of them by one factor: the object drifted."""
    other = OtherRecording("hard", "level", recorded(DECK, 7, stretch), 4.0)
    question = asked(other, level=1.0)
    others, _ = others_identified(question, (20.0, 170.0))
    first = AtLevel(question.level, question.frf, identify(question.frf, (20.0, 170.0)))
    note = level_notes(level_study([first, *levels(others)]))[0]
    drifted = "all modes change by one factor from level to level (1, 4)"
    calm = "no natural frequency or damping changes with level (1, 4)"
    assert note.startswith(drifted if moves else calm)


def test_the_fit_is_not_asked_to_go_below_the_spread_and_others_are_scored():
    article = with_masses(DECK, (49,), 0.004)
    alone = prepare(asked())
    ready = prepare(asked(OtherRecording("B", "article", recorded(article, 3))))
    assert np.all(ready.problem.data.noise >= alone.problem.data.noise)
    assert ready.problem.data.noise.mean() > 2 * alone.problem.data.noise.mean()
    assert any("B and the recording that is fitted differ by" in note for note in ready.notes)
    heavy = modelled(article, ready.nominal.band)
    (row,) = scored_others(ready, [ready.nominal, ready.nominal, heavy])
    assert (row.name, row.relation) == ("B", "article")
    assert_allclose(row.nominal, row.apart, rtol=0.2)  # the deck is the first article
    assert row.with_effect < 0.1 * row.nominal


def test_one_that_cannot_be_identified_is_named():
    empty = replace(recorded(DECK, 0), values=np.zeros((len(F), len(GRIDS), 1), complex))
    others, notes = others_identified(asked(OtherRecording("C", "repeat", empty)), (20.0, 170.0))
    assert not others
    assert "C (repeat) is not used: " in notes[0]


def test_where_frequencies_are_compared_others_are_named_as_not_used():
    """Places are uncertain by 2 cm, so no response of the second article is looked at."""
    question = asked(OtherRecording("B", "article", recorded(DECK, 1)))
    vague = replace(question.outputs, sd=np.full(len(GRIDS), 0.02))
    ready = prepare(replace(question, outputs=vague))
    assert not ready.others
    assert any("not used" in note and "B (article)" in note for note in ready.notes)
