"""Fitted, choosing and reporting data are disjoint; no decision uses data that report."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.recordings import accelerances, across, noisy

from chladni.fem.modelled import modelled
from chladni.inference.likelihood import Responses
from chladni.inference.map_fit import MassMeasurement
from chladni.model.point_masses import with_masses
from chladni.search.decide import concluded, decide
from chladni.search.diagnosis import diagnose
from chladni.search.held_out_data import HeldOutChoice, of_poles, upper_part
from chladni.search.hypotheses import Hypotheses
from chladni.search.preparation import prepare
from chladni.search.question import HeldOut, Question
from chladni.search.written_scores import scores_of
from chladni_specimens.plates import plate

LABELS = tuple("abcdefgh")
LOW, HIGH = 20.0, 170.0
F = np.linspace(15, 200, 60)


def choice(sensors: int, with_band: bool) -> HeldOutChoice:
    held = np.isin(np.arange(len(LABELS)), [6, 1, 4, 3, 0][:sensors])
    band = upper_part(LOW, HIGH) if with_band else (HIGH, HIGH)
    return HeldOutChoice(held, band, (LOW, band[0]), (LOW, HIGH))


def split(made: HeldOutChoice, zeta: float) -> tuple[np.ndarray, HeldOut]:
    """Fitted samples, and those that are held out."""
    values = np.ones((len(F), len(LABELS), 1), complex)
    s = 2 * np.pi * F * (zeta + 1j)
    data = Responses(values, s, None, None, made.training(F), "accelerance")
    return data.use, made.samples(data)


@pytest.mark.parametrize("with_band", [True, False])
@pytest.mark.parametrize("sensors", range(6))
def test_a_sample_is_fitted_or_chooses_or_reports(sensors, with_band):
    """No sample does two of these, and all samples of the band that is compared do one."""
    made = choice(sensors, with_band)
    fitted, held = split(made, 0.08)
    parts = np.array([fitted, held.choosing, held.reporting])
    inside = (F >= LOW) & (F <= HIGH)
    assert parts.sum(axis=0).max() == 1
    assert parts.any(axis=0)[inside].all()
    assert not parts.any(axis=0)[~inside].any()
    assert held.reporting.any() == (sensors > 0 or with_band)
    assert held.choosing.any() == (sensors > 1 or with_band)
    again = split(made, 0.02)[1]  # the same frequencies at any damping
    np.testing.assert_array_equal(again.choosing, held.choosing)


def test_held_out_data_are_described_by_their_use():
    made = choice(3, True)
    assert made.in_words(LABELS, True) == "1 sensor (b), band 140-170 Hz of 2 others"
    assert made.in_words(LABELS, False) == "2 sensors (e, g), band 140-170 Hz of 3 others"
    assert choice(0, False).in_words(LABELS, True) == "nothing"
    assert choice(1, False).in_words(LABELS, False) == "nothing"


@pytest.mark.parametrize("n", range(5))
def test_every_third_held_out_frequency_reports(n):
    held = np.arange(9) >= 9 - n
    made = of_poles(held)
    np.testing.assert_array_equal(made.choosing | made.reporting, held)
    assert not (made.choosing & made.reporting).any()
    assert made.reporting.sum() == -(-n // 3)
    assert made.reporting[-1] == (n > 0)


GRIDS = np.array([2, 4, 6, 18, 20, 30, 33, 43, 45, 47])
PLATE = plate(0.3, 0.22, 6, 6, 1e-3)


@pytest.fixture(scope="module")
def question() -> Question:
    """A plate that carries 25 g which the deck lacks, with 2 of 10 sensors held out."""
    model = modelled(with_masses(PLATE, (32,), 0.025), 900.0)
    outputs, inputs = across(PLATE, GRIDS), across(PLATE, GRIDS[:1])
    H = accelerances(model, outputs, inputs, np.linspace(15, 200, 350))
    frf = replace(H, values=noisy(H.values, 0.007, 3))
    return Question(
        PLATE, outputs, inputs, frf=frf, band=(LOW, HIGH), effects=("point-mass",),
        mass_measurement=MassMeasurement(0.518 + 0.025, 0.001),
    )  # fmt: skip


@pytest.fixture(scope="module")
def answered(question):
    """The question made ready, the null of its search, and what is answered."""
    ready = prepare(question)
    return ready, *_answer(ready)


def test_no_decision_uses_data_that_report(question, answered):
    """Nonsense on all samples that report: every number of the decision stays, reported Q moves."""
    ready, _, decision, Q = answered
    spoilt = replace(
        ready, score=_spoilt(ready.score, ready.held.reporting),
        problem=replace(ready.problem, data=_spoilt(ready.problem.data, ready.unseen.reporting)),
    )  # fmt: skip
    _, again, worse = _answer(spoilt)
    assert decision.named
    assert (again.verdict, again.news) == (decision.verdict, decision.news)
    assert [h.fit.neg2_log_evidence for h in again.order] == [
        h.fit.neg2_log_evidence for h in decision.order
    ]
    (fitted, held), (fitted_again, spoilt_Q) = Q, worse
    assert_allclose(fitted, fitted_again, rtol=1e-9)
    assert held[1] < 0.1 * held[0]
    assert spoilt_Q[1] > 100 * held[1]


def test_data_that_choose_speak_against_a_name(question, answered):
    """Samples that choose are as the calibration without the mass predicts: they oppose it."""
    ready, null, decision, _ = answered
    problem, at = ready.problem, ready.unseen.choosing[..., None]
    foretold = problem.data.rebased(null.model).model(null.fit.state)
    data = replace(problem.data, values=np.where(at, foretold, problem.data.values))
    spoilt = replace(ready, problem=replace(problem, data=data))
    opposed = _answer(spoilt)[1]
    assert opposed.news < 0 < decision.news


def _spoilt(data: Responses, at: np.ndarray) -> Responses:
    return replace(data, values=np.where(at[..., None], 7.0 + 3.0j, data.values))


def _answer(prepared):
    found = diagnose(prepared.problem)
    case = Hypotheses(prepared, found)
    decision = decide(case)
    said = concluded(case, decision)[0]
    decks = said.plain, said.as_deck or said.plain
    return found.null, decision, scores_of(prepared, decks[-1], decks, prepared.held.reporting)
