"""Where the leader is refused a rival that nothing refuses is the answer, unless it is refuted."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.updating import rivals
from chladni.updating.confusers import with_confusers
from chladni.updating.diagnosis import UNEXPLAINED, Diagnosis
from chladni.updating.held_out_evidence import HeldOutEvidence
from chladni.updating.outcome import CONFLICT
from chladni.updating.result_parts import why_not
from chladni.updating.rivals import rival_named

DUE = Diagnosis(None, SimpleNamespace(data=None), None, (None,) * 4, "").due
GAIN = 5 * DUE  # of the leader


def tried(name, gain):
    effect = SimpleNamespace(name=name, becomes=lambda x: "", implausible=lambda x: "")
    fit = SimpleNamespace(of=lambda e: np.zeros(1), effects=())
    return SimpleNamespace(
        neg2_log_evidence=-gain, effect=effect, name=name, fit=fit, verdict="missing physics"
    )


def asked(monkeypatch, gains, sound=("point-mass",), news=0.0, leader=0.0, too_little=""):
    """What is answered where mass-patch leads and is refused, and only those that are sound not.

    Parameters
    ----------
    news, leader : what held-out data say of a rival, and of the leader
    """

    def tested(diagnosis, problem):
        return diagnosis

    def judged(prepared, diagnosis):
        heard = HeldOutEvidence(news, 0.0, 0.0)
        if diagnosis.hypotheses[0].name in sound:
            return replace(diagnosis, heard=heard)
        return replace(diagnosis, heard=heard, verdict="calibration only", refused="it is no good")

    monkeypatch.setattr(rivals, "tested", tested)
    monkeypatch.setattr(rivals, "judged", judged)
    names = ("mass-patch", "point-mass", "crack", "suspension")
    null = SimpleNamespace(neg2_log_evidence=0.0, data=None, fit=SimpleNamespace(effects=()))
    refused = Diagnosis(
        null, null, null, tuple(map(tried, names, gains)), "not in catalogue",
        notes=(f"it rubs{UNEXPLAINED}",), heard=HeldOutEvidence(leader, 0.0, 0.0),
        refused="it made the deck worse",
    )  # fmt: skip
    prepared = SimpleNamespace(problem=None, too_little=too_little)
    return rival_named(
        prepared, refused, lambda t: SimpleNamespace(hypothesis=t, note="", distrust=("odd",))
    )


def test_a_rival_that_nothing_refuses_is_the_answer(monkeypatch):
    """It is named, with what refused the leader; no sentence says that nothing explains."""
    found, distrust = asked(monkeypatch, (GAIN, GAIN - 1, GAIN - 2, 0.0))
    assert found.found.name == "point-mass"
    assert distrust == ("odd",)
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
        ((GAIN, DUE - 1, 0.0, 0.0), {}),  # it would not be named alone
        ((GAIN, GAIN - CONFLICT * DUE - 1, 0.0, 0.0), {}),  # the leader explains far more
        ((GAIN, GAIN - 0.7 * DUE, 0.0, 0.0), {"news": -0.4 * DUE}),  # and of what no fit saw
        ((GAIN, GAIN - 0.7 * DUE, 0.0, 0.0), {"leader": 0.4 * DUE}),
        ((GAIN, GAIN - 1, 0.0, 0.0), {"sound": ()}),
        ((GAIN, GAIN - 1, 0.0, 0.0), {"too_little": "3 modes"}),
    ],
)
def test_else_the_refusal_stays(monkeypatch, gains, more):
    """What is refuted by the leader as calibration alone would be is not the answer either."""
    assert asked(monkeypatch, gains, **more) == (None, ())


def test_a_rival_nearly_refuted_stands(monkeypatch):
    """Just on the other side of both limits."""
    for behind, leader in ((0.7, 0.2), (1.9, -1.0)):
        gains = (GAIN, GAIN - behind * DUE, 0.0, 0.0)
        assert asked(monkeypatch, gains, leader=leader * DUE)[0] is not None
