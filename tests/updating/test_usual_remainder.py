"""What a name may leave: half of Q; more where all that is left is what models err by."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from chladni.updating import outcome
from chladni.updating.adequacy import FitTest
from chladni.updating.diagnosis import Diagnosis
from chladni.updating.held_out_evidence import HeldOutEvidence
from chladni.updating.outcome import FittedScores, judged, named_with_what_is_usual
from chladni.updating.question import Prepared

FOR_IT = HeldOutEvidence(5.0, 70.0, 60.0)
USUAL = FitTest(True, 1.0, "as models err", "")
NULL = SimpleNamespace(data=None, neg2_log_evidence=100.0)


def lead(channels=()):
    return SimpleNamespace(
        verdict="missing physics", name="mass-patch", neg2_log_evidence=0.0, data=None,
        physics=not channels, channels=channels,
        effect=SimpleNamespace(name="mass-patch", text="x"),
    )  # fmt: skip


def judgement(monkeypatch, left, fits=USUAL, heard=FOR_IT, channels=()):
    """The verdict of the strict rule, and of what follows it."""
    scores = tuple(FittedScores(1.0, share, 1.0) for share in left)
    asked = []
    monkeypatch.setattr(Diagnosis, "due", 30.0)
    monkeypatch.setattr(outcome, "fitted_scores", lambda prepared, found: scores)
    monkeypatch.setattr(outcome, "held_out_evidence", lambda *a: asked.append(a) or heard)
    monkeypatch.setattr(outcome, "as_written", lambda found, mass: found)
    monkeypatch.setattr(outcome, "tested", lambda found, problem: found)
    monkeypatch.setattr(outcome, "tied", lambda found, others: {found.name: 0.0})
    named = Diagnosis(
        NULL, NULL, NULL, (lead(channels),), "missing physics", ("renewed",), adequacy=fits
    )  # type: ignore[arg-type]
    prepared = cast(
        Prepared,
        SimpleNamespace(problem=SimpleNamespace(mass_measurement=None), unseen=None),
    )
    first = judged(prepared, named)
    then = named_with_what_is_usual(prepared, named, first, ("pair is not borne",))
    assert len(asked) == 1  # what was heard is not asked again
    return first, then


@pytest.mark.parametrize("left", [(0.6, 0.75), (0.58, 1.15), (1.05, 0.53)])
def test_what_is_usual_may_stay_where_a_fifth_goes(monkeypatch, left):
    first, then = judgement(monkeypatch, left)
    assert first.found is None
    assert "leaves more than it explains" in first.refused
    assert then.found is not None
    assert not then.refused
    assert then.notes[0] == "renewed"
    assert not any("so it is not named" in note for note in then.notes)
    assert "something less may be missing beside it" in then.notes[-2]
    assert then.notes[-1] == "pair is not borne"


@pytest.mark.parametrize(
    ("left", "fits", "heard"),
    [
        ((0.85, 0.95), USUAL, FOR_IT),
        ((0.6, 0.75), replace(USUAL, p=0.65), FOR_IT),
        ((0.6, 0.75), replace(USUAL, passes=False), FOR_IT),
        ((0.6, 0.75), None, FOR_IT),
        ((0.6, 0.75), USUAL, HeldOutEvidence(-1.0, 70.0, 60.0)),
        ((0.6, 1.6), USUAL, FOR_IT),  # it does harm
    ],
)
def test_it_may_not_where_anything_speaks_against_it(monkeypatch, left, fits, heard):
    first, then = judgement(monkeypatch, left, fits, heard)
    assert first.found is None
    assert then is first


def test_a_name_that_explains_most_is_left_as_it_was(monkeypatch):
    first, then = judgement(monkeypatch, (0.4, 0.3))
    assert first.found is not None
    assert then is first


@pytest.mark.parametrize(
    ("left", "named"), [((0.94, 0.97), False), ((0.84, 0.44), True), ((0.2, 0.97), False)]
)
def test_a_fault_of_one_channel_is_asked_of_what_that_channel_recorded(monkeypatch, left, named):
    first, then = judgement(monkeypatch, left, channels=("61:+X",))
    assert (first.found is not None) == named
    assert (then.found is not None) == named
