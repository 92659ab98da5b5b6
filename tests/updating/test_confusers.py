"""Explanations of nearly the same evidence are one answer, with the measurement that separates."""

from types import SimpleNamespace

import pytest

from chladni.effects.registry import families
from chladni.updating.confusers import TIED, with_confusers
from chladni.updating.diagnosis import Diagnosis


def found(*evidence, verdict="missing physics"):
    hypotheses = tuple(
        SimpleNamespace(neg2_log_evidence=S, effect=SimpleNamespace(name=name))
        for name, S in zip(("point-mass", "sensor-mass", "suspension"), evidence, strict=True)
    )
    return with_confusers(Diagnosis(None, None, None, hypotheses, verdict))


def test_near_ones_are_listed_with_what_would_settle_it():
    answer = found(0.0, TIED - 1, TIED + 1)
    assert answer.one_of[:2] == ("point-mass", "sensor-mass")
    assert "weigh the structure" in answer.one_of[2]
    assert "suspension" not in answer.one_of
    assert "sensor-mass" in answer.notes[-1]


@pytest.mark.parametrize("verdict", ["missing physics", "measurement fault"])
def test_a_clear_lead_is_a_name(verdict):
    assert found(0.0, TIED + 1, 2 * TIED, verdict=verdict).one_of == ()


def test_where_nothing_is_named_nothing_is_tied():
    assert found(0.0, 1.0, 2.0, verdict="calibration only").one_of == ()


def test_every_family_says_what_would_settle_it():
    assert all(f.settled_by for f in families() if f.effect.__module__.startswith("chladni."))
