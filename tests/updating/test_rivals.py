"""Where the leader is refused a rival that nothing refuses is the answer, unless it is refuted."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.updating import rivals
from chladni.updating.adequacy import FitTest
from chladni.updating.confusers import with_confusers
from chladni.updating.diagnosis import UNEXPLAINED, Diagnosis, threshold
from chladni.updating.held_out_evidence import HeldOutEvidence
from chladni.updating.outcome import BEYOND, CONFLICT
from chladni.updating.result_parts import why_not
from chladni.updating.rivals import heard_of_rivals

DUE = threshold(None, 4)
GAIN = 5 * DUE  # of the leader
FITS = FitTest(True, 0.5, "all is well", "")


def tried(name, gain):
    effect = SimpleNamespace(
        name=name,
        becomes=lambda x: "",
        implausible=lambda x: "",
        nearly=lambda x, sd: "",
        expected=False,
    )
    fit = SimpleNamespace(
        of=lambda e: np.zeros(1), sd=lambda e: np.zeros(1), effects=(), state=name
    )
    return SimpleNamespace(
        neg2_log_evidence=-gain, effect=effect, name=name, fit=fit, verdict="missing physics"
    )


def asked(monkeypatch, gains, sound=("point-mass",), news=0.0, leader=0.0, follows=None):
    """What is answered where mass-patch leads and is refused, and only those that are sound not.

    Parameters
    ----------
    news, leader : what held-out data say of a rival, and of the leader
    follows : name of the effect that takes off the damping that follows the leader; None: none does
    """

    def tested(diagnosis, problem):
        return replace(diagnosis, adequacy=FITS)

    def heard_of_damping(test, hypothesis, damping):
        assert hypothesis.name == "mass-patch"
        return replace(test, passes=follows is None or damping.taken == follows, what="it rubs")

    def judged(prepared, diagnosis):
        heard = HeldOutEvidence(news, 0.0, 0.0)
        if diagnosis.hypotheses[0].name in sound:
            return replace(diagnosis, heard=heard)
        return replace(diagnosis, heard=heard, verdict="calibration only", refused="it is no good")

    monkeypatch.setattr(rivals, "tested", tested)
    monkeypatch.setattr(rivals, "judged", judged)
    monkeypatch.setattr(rivals, "_on_its_own_basis", lambda problem, refused, rival: rival)
    monkeypatch.setattr(rivals, "heard_of_damping", heard_of_damping)
    names = ("mass-patch", "point-mass", "crack", "suspension")
    null = SimpleNamespace(neg2_log_evidence=0.0, data=None, fit=SimpleNamespace(effects=()))
    refused = Diagnosis(
        null, null, null, tuple(map(tried, names, gains)), "not in catalogue",
        notes=(f"it rubs{UNEXPLAINED}",), heard=HeldOutEvidence(leader, 0.0, 0.0),
        refused="it made the deck worse", one_of=("mass-patch", BEYOND),
    )  # fmt: skip
    damping = SimpleNamespace(beyond=lambda state: SimpleNamespace(taken=state))
    prepared = SimpleNamespace(problem=SimpleNamespace(damping=damping))
    return heard_of_rivals(
        prepared, refused, lambda t: SimpleNamespace(hypothesis=t, note="", distrust=("odd",))
    )


def test_a_rival_that_nothing_refuses_is_the_answer(monkeypatch):
    """It is named, with what refused the leader; no sentence says that nothing explains."""
    found, distrust = asked(monkeypatch, (GAIN, GAIN - 1, GAIN - 2, 0.0))
    assert found.found.name == "point-mass"
    assert distrust == ("odd",)
    assert found.one_of == ()
    assert not any(note.endswith(UNEXPLAINED) for note in found.notes)
    assert any("mass-patch is not the answer" in note for note in found.notes)
    lead = found.hypotheses[1]
    assert lead.name == "mass-patch"
    assert why_not(found, lead, found.found).endswith("but it made the deck worse")
    told = with_confusers(found).one_of
    assert "crack" in told  # which nobody has refused
    assert "mass-patch" not in told


def test_the_next_is_asked_where_a_rival_is_refused_too(monkeypatch):
    """With the reasons of all that were passed over."""
    found, _ = asked(monkeypatch, (GAIN, GAIN - 1, GAIN - 2, 0.0), sound=("crack",))
    assert found.found.name == "crack"
    over = (("mass-patch", "it made the deck worse"), ("point-mass", "it is no good"))
    assert found.passed_over == over


@pytest.mark.parametrize(
    ("gains", "more"),
    [
        ((1.5 * DUE, DUE - 1, 0.0, 0.0), {}),  # it would not be named alone
        (
            (GAIN, GAIN - CONFLICT * DUE - 1, 0.0, 0.0),
            {"news": 1.5 * DUE},
        ),  # the leader explains far more
        ((GAIN, GAIN - 0.7 * DUE, 0.0, 0.0), {"news": -0.4 * DUE}),  # and of what no fit saw
        ((GAIN, GAIN - 0.7 * DUE, 0.0, 0.0), {"leader": 0.4 * DUE}),
        ((GAIN, GAIN - 1, 0.0, 0.0), {"sound": ()}),
        ((GAIN, GAIN - 1, 0.0, 0.0), {"follows": "crack"}),  # the leader gives and dissipates
    ],
)
def test_else_the_refusal_stays(monkeypatch, gains, more):
    """What is refuted by the leader as calibration alone would be is not the answer either."""
    found, distrust = asked(monkeypatch, gains, **more)
    assert (found.verdict, distrust) == ("not in catalogue", ())
    assert found.notes[-1].endswith(UNEXPLAINED)
    rival = found.hypotheses[1]
    if len(found.passed_over) > 1:  # why it was passed over is told
        reasons = ("it is no good", "far more than it does", "it rubs")
        assert why_not(found, rival, found.null).endswith(reasons)


def test_what_dissipates_itself_may_stand_for_what_gives_and_dissipates(monkeypatch):
    """Beside what a viscoelastic joint takes, damping follows the leader no more."""
    found, _ = asked(monkeypatch, (GAIN, GAIN - 1, 0.0, 0.0), follows="point-mass")
    assert found.found.name == "point-mass"


def test_a_rival_nearly_refuted_stands(monkeypatch):
    """Just on the other side of both limits."""
    for behind, leader in ((0.7, 0.2), (1.9, -1.0)):
        gains = (GAIN, GAIN - behind * DUE, 0.0, 0.0)
        assert asked(monkeypatch, gains, leader=leader * DUE)[0] is not None
