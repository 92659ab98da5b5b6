"""Modes on cords that a free deck does not hold are no data on its sheet."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.plate_recordings import DECK, SENSORS, SHAKERS, at, labels
from tests.builders.recordings import across, noisy

import chladni
from chladni.fem.modelled import modelled
from chladni.io.nastran import write_assembly
from chladni.model.ground_springs import with_springs
from chladni.reduced.reduced_model import evaluate
from chladni.search.measured_frequencies import suspended_below
from chladni.search.preparation import prepare
from chladni.search.question import Question

CORNERS = at(DECK, [(0, 0), (0.3, 0), (0, 0.22), (0.3, 0.22)])
CORDS = with_springs(DECK, CORNERS, np.tile([0.0, 0.0, 1.0], (4, 1)), 20.0)  # 2 to 4 Hz


@pytest.fixture(scope="module")
def question(tmp_path_factory):
    """Accelerances from 1 Hz on of the deck itself on cords."""
    hung = write_assembly(CORDS, tmp_path_factory.mktemp("hung") / "plate.bdf")
    ends, drive = (list(labels(DECK, p)) for p in (SENSORS, SHAKERS[:1]))
    frf = chladni.frf(chladni.load(hung, "SI"), ends, drive, np.linspace(1, 230, 1800)).frfs[0]
    frf = frf.to("accelerance")
    frf = replace(frf, values=noisy(frf.values, 0.005, 0))
    places = (across(DECK, at(DECK, p)) for p in (SENSORS, SHAKERS[:1]))
    return Question(DECK, *places, frf)


def off(prepared):
    """Rms deviation of the deck from the fitted samples [decades], and the lowest of them [Hz]."""
    score, state = prepared.score, evaluate(prepared.problem.reduced.model, (), np.zeros(0), False)
    lowest = score.s.imag[score.use.any(axis=tuple(range(1, score.use.ndim)))].min() / 2 / np.pi
    return float(np.sqrt(np.mean(np.abs(score.deviation(state)) ** 2))), lowest


def test_a_free_deck_is_compared_above_them(question):
    """Named hangers are places of the cords: a suspension may then be found, and is compared."""
    plain, hung = (prepare(q) for q in (question, replace(question, hangers=CORNERS)))
    (deviation, lowest), (unlike, all_lines) = off(plain), off(hung)
    assert all_lines < 2
    assert 5 < lowest < 40
    assert deviation < 0.1 * unlike
    said = f"the range below {plain.above:.3g} Hz is not compared"
    assert said in "".join(plain.notes)
    assert "is not compared" not in "".join(hung.notes)


HELD = replace(DECK, supports=np.array([(k, c) for k in range(7) for c in range(1, 7)]))


@pytest.mark.parametrize(
    ("deck", "frequency", "low"),
    [(DECK, [9.0, 14.0, 60.0], True), (DECK, [60.0, 90.0], False), (CORDS, [9.0, 60.0], False),
     (HELD, [2.0, 60.0], False), (DECK, [9.0, 14.0], True)],
)  # fmt: skip
def test_only_modes_far_below_the_first_elastic_one_are_on_cords(question, deck, frequency, low):
    """The limit lies between; a deck that is held, by supports or cords, has no such modes."""
    above = suspended_below(question, modelled(deck, 200.0), np.array(frequency), 190.0)
    assert (14.0 < above < 60.0) if low else above == 0.0
