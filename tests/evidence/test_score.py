"""Scores of answers against truths, on answers written by hand."""

import pytest

from chladni.report.diagnosis_json import from_json
from chladni_evidence.score import confusion, scored, summary


def answer(name=None, verdict="missing physics", point=None, channels=(), held=(0.4, 0.1)):
    where = {"point_m": point, "channels": list(channels)}
    q = {"Q_calibrated": held[0], "Q_with_effect": held[1]}
    return {
        "verdict": verdict,
        "effects": [] if name is None else [{"name": name, "where": where}],
        "fit": {"held_out": q, "largest_gain": 55.0},
    }


def score(answer, truth):
    return scored(from_json(answer), truth)


def truth(effect, **more):
    return {"specimen": "plate", "seed": 3, "effect": effect, **more}


def test_place_is_a_distance_in_millimetres():
    row = score(
        answer("point-mass", point=[0.13, 0.24, 0.0]), truth("point-mass", point_m=[0.1, 0.2, 0.0])
    )
    assert row["right"]
    assert row["place_mm"] == pytest.approx(50.0)
    assert row["ratio"] == pytest.approx(0.25)
    assert row["gain"] == 55.0


@pytest.mark.parametrize("effect", ["nothing", "calibration"])
@pytest.mark.parametrize("verdict", ["nothing missing", "calibration only"])
def test_null_is_right_where_no_effect_is_named(effect, verdict):
    row = score(answer(verdict=verdict), truth(effect))
    assert row["right"]
    assert row["called"] == verdict
    assert row["place_mm"] is None
    assert row["ratio"] is None


@pytest.mark.parametrize(
    ("given", "due"),
    [
        (answer("point-mass", point=[0, 0, 0]), truth("nothing")),
        (answer(verdict="nothing missing"), truth("point-mass", point_m=[0, 0, 0])),
        (answer("suspension"), truth("sensor-mass", value=1.0)),
        (answer(verdict="error: the deck is gone"), truth("nothing")),
        (answer(verdict="error: the deck is gone"), truth("suspension", value=1.0)),
    ],
)
def test_wrong_is_wrong(given, due):
    assert not score(given, due)["right"]


@pytest.mark.parametrize(("channel", "right"), [("7:+Z", True), ("8:+Z", False)])
def test_a_faulty_sensor_is_right_on_its_own_channel_only(channel, right):
    row = score(answer("sensor-fault", channels=[channel]), truth("sensor-fault", channel="7:+Z"))
    assert row["right"] is right


def test_intervals_are_held_against_the_truth_that_is_known():
    """Thinning inside, radius outside; a parameter without a truth does not count."""
    named = answer("thickness-distribution", point=[0.0, 0.0, 0.0])
    named["effects"][0]["parameters"] = [
        {"name": "thinning", "value": 0.2, "low": 0.1, "high": 0.3},
        {"name": "R", "low": 0.1, "high": 0.2},
        {"name": "other", "low": 0.0, "high": 1.0},
    ]
    sealed = truth("thickness-distribution", parameters={"thinning": 0.2, "R": 0.09})
    row = score(named, sealed)
    assert row["covered"] == (1, 2)
    assert summary([row]).endswith("; intervals hold the truth 1 of 2")
    assert score(named, {**sealed, "effect": "point-mass"})["covered"] == (0, 0)


def test_confusion_counts_every_case_once():
    rows = [
        {"effect": e, "called": c}
        for e, c in [("a", "a"), ("a", "a"), ("a", "b"), ("bcd", "b"), ("bcd", "nothing missing")]
    ]
    head, first, second, legend = confusion(rows).splitlines()
    assert head.split() == ["concealed", "1", "2", "3"]
    assert first.split() == ["a", "2", "1", "."]
    assert second.split() == ["bcd", ".", "1", "1"]
    assert legend == "called 1: a, 2: b, 3: nothing missing"


def test_summary_judges_place_and_ratio_of_the_right_ones_only():
    def row(right, place, ratio):
        return {"effect": "point-mass", "right": right, "place_mm": place, "ratio": ratio}

    rows = [row(True, 10, 0.1), row(True, 100, 0.9), row(False, 1, 0.01)]
    assert summary(rows) == (
        "point-mass: 2 of 3 right; place within 60 mm 1 of 2, median 55 mm; "
        "held-out Q halved 1 of 2, median x 0.50"
    )


def test_nothing_to_score():
    assert summary([]) == ""
    assert confusion([]).startswith("concealed")
