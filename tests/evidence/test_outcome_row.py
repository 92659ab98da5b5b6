"""What an answer is worth against a truth."""

import pytest

from chladni_evidence.blind_diagnosis import Answer
from chladni_evidence.outcome_row import line, row, table

TRUTH = {
    "effect": "point-mass", "structure": "tailgate", "seed": 600, "mesh": "16 mm",
    "point_m": [0.0, 0.0, 0.0], "moved_by_effect_decades": 0.3, "moved_by_scatter_decades": 0.1,
    "values": {"E": {"a": 200e9, "b": 220e9}, "rho": {"a": 7850.0, "b": 7850.0}, "t": {"a": 1e-3}},
    "part_mass_kg": {"a": 1.0, "b": 1.0},
}  # fmt: skip
HELD = {"Q_calibrated": 0.5, "Q_with_effect": 0.2, "Q_floor": 0.1}


def answer(name="point-mass", verdict="missing physics", code=0, **more):
    where = {"point_m": [0.03, 0.04, 0.0], "channels": ["7:+Z"]}
    effects = [{"name": name, "where": where}] if name else []
    result = {"verdict": verdict, "effects": effects, "fit": {"held_out": HELD}} | more
    return Answer(code, 10.0, 0.5, "", result if code == 0 else {})


def fault():
    return answer("sensor-fault", "measurement fault")


def several(*names):
    return answer(
        effects=[
            {"name": name, "where": {"point_m": [0.3 * k, 0.0, 0.0], "channels": []}}
            for k, name in enumerate(names)
        ]
    )


def told(effect="point-mass", **more):
    return {**TRUTH, "effect": effect, **more}


@pytest.mark.parametrize(
    ("given", "truth", "outcome"),
    [
        (answer(), told(), "right"),
        (answer("suspension"), told(), "wrong"),
        (answer("suspension", one_of=[["suspension", "point-mass", "weigh it"]]), told(), "among"),
        (answer(None, "calibration only"), told(), "none"),
        (answer(None, "nothing missing"), told("calibration"), "right"),
        (answer(), told("nothing"), "wrong"),
        (answer(None, "not in catalogue"), told("rotor"), "admitted"),
        (answer(code=3), told("foam"), "admitted"),
        (answer(), told("rotor"), "wrong"),
        (
            fault(),
            told("sensor-fault", channel="7:+Z"),
            "right",
        ),
        (
            fault(),
            told("sensor-fault", channel="8:+Z"),
            "wrong",
        ),
        (
            fault(),
            told("duplicated-pair", channel="8:+Z", copy_of="7:+Z"),
            "right",
        ),
        (several("sensor-mass", "point-mass"), told("point-mass + sensor-mass"), "right"),
        (several("point-mass", "point-mass"), told("point-mass + point-mass"), "right"),
        (answer(), told("point-mass + point-mass"), "part"),
        (several("point-mass", "crack"), told("point-mass + sensor-mass"), "wrong"),
        (several("point-mass", "crack"), told(), "wrong"),
        (answer(code=2), told(), "refused"),
        (answer(code=1), told(), "crash"),
        (Answer(0, 1.0, 0.1, ""), told(), "crash"),
    ],
)
def test_outcome(given, truth, outcome):
    assert row(given, truth)["outcome"] == outcome


def test_the_veto_is_told_from_the_evidence():
    """A name the held-out data refused counts by evidence, and the veto was wrong to refuse it."""
    note = "point-mass gained 1314 in -2 ln evidence but left the data no fit saw worse explained"
    given = answer(None, "calibration only", notes=["first", note])
    r = row(given, told())
    assert (r["outcome"], r["by_evidence"], r["vetoed"]) == ("none", "right", "point-mass")
    assert r["veto_right"] is False
    null = row(given, told("nothing"))
    assert (null["outcome"], null["by_evidence"], null["veto_right"]) == ("right", "wrong", True)


def test_figures():
    """50 mm off, three quarters of the way to the floor, three times the scatter."""
    r = row(answer(), told())
    assert r["place_m"] == pytest.approx(0.05)
    assert r["gain_share"] == pytest.approx(0.75)
    assert r["times_scatter"] == pytest.approx(3.0)
    assert "50 mm off" in line(r)


def test_intervals_of_parts_together_are_held_against_their_mean():
    """E of a and b is (200·220)^½ GPa for equal masses."""
    entries = [
        {"where": "E of a, b", "low": 209e9, "high": 211e9},
        {"where": "t of a", "low": 1.1e-3, "high": 1.2e-3},
        {"where": "E of welds", "low": 0.0, "high": 1.0},
    ]
    covered = row(answer(calibrated=entries), told())["covered"]
    assert covered == {"E": [1, 1], "rho": [0, 0], "t": [0, 1]}


def test_what_an_answer_leaves_open_is_no_crash():
    """A null stands where a diagnosis has nothing to say."""
    empty = dict.fromkeys(("adequate", "one_of", "notes", "calibrated", "fit"))
    r = row(answer(None, "calibration only", **empty), told())
    assert (r["outcome"], r["p"], r["gain_share"]) == ("none", None, None)


def test_table_adds_up():
    rows = [row(answer(), told()), row(answer("suspension"), told()), row(answer(), told("rotor"))]
    text = table(rows)
    assert "point-mass" in text
    assert "outside the catalogue: 0 admitted, 1 wrong of 1" in text
    assert [int(w) for w in text.splitlines()[1].split()[1:6]] == [2, 1, 0, 0, 1]


def test_of_several_the_place_farthest_off_counts():
    """Each is held against the nearest that has its name."""
    effects = [
        {"effect": "point-mass", "point_m": [0.31, 0.0, 0.0]},
        {"effect": "point-mass", "point_m": [0.0, 0.05, 0.0]},
    ]
    truth = told("point-mass + point-mass", effects=effects)
    truth.pop("point_m")
    assert row(several("point-mass", "point-mass"), truth)["place_m"] == pytest.approx(0.05)
    assert row(several("sensor-mass", "crack"), truth)["place_m"] is None
