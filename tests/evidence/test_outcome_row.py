"""What an answer is worth against a truth."""

import numpy as np
import pytest

from chladni.search.decision_in_words import Reason
from chladni_evidence.blind_diagnosis import Answer
from chladni_evidence.outcome_row import line, row
from chladni_evidence.outcome_table import (
    calibration_against_diagnosis,
    confusion,
    overall,
    table,
    tables,
)

TRUTH = {
    "effect": "point-mass", "structure": "tailgate", "seed": 600, "mesh": "16 mm",
    "point_m": [0.0, 0.0, 0.0], "moved_by_effect_decades": 0.3, "moved_by_scatter_decades": 0.1,
    "values": {"E": {"a": 200e9, "b": 220e9}, "rho": {"a": 7850.0, "b": 7850.0}, "t": {"a": 1e-3}},
    "part_mass_kg": {"a": 1.0, "b": 1.0}, "mass_kg": 2.0, "unweighed_kg": 0.0, "value": 0.1,
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


GLUED = several("sensor-mass", "adhesive-stiffness")
GLUED.result["one_of"] = [["adhesive-stiffness", "hem-contact", "cut through the hem"]]


def told(effect="point-mass", **more):
    return {**TRUTH, "effect": effect, **more}


@pytest.mark.parametrize(
    ("given", "truth", "outcome"),
    [
        (answer(), told(), "right"),
        (answer("suspension"), told(), "wrong"),
        (answer("suspension", one_of=[["suspension", "point-mass", "weigh it"]]), told(), "among"),
        (answer("suspension", one_of=[["suspension", "stiffener"]]), told("rib"), "among"),
        (answer("suspension", one_of=[["suspension", "crack"]]), told("rib"), "wrong"),
        (answer(None, "calibration only"), told(), "none"),
        (answer(None, "nothing missing"), told("calibration"), "right"),
        (answer(), told("nothing"), "wrong"),
        (answer(None, "not in catalogue"), told("rotor"), "admitted"),
        (answer(code=3), told("foam"), "admitted"),
        (answer(), told("rotor"), "wrong"),
        (fault(), told("sensor-fault", channel="7:+Z"), "right"),
        (fault(), told("sensor-fault", channel="8:+Z"), "wrong"),
        (fault(), told("duplicated-pair", channel="8:+Z", copy_of="7:+Z"), "right"),
        (several("sensor-mass", "point-mass"), told("point-mass + sensor-mass"), "right"),
        (several("point-mass", "point-mass"), told("point-mass + point-mass"), "right"),
        (answer(), told("point-mass + point-mass"), "part"),
        (several("point-mass", "crack"), told("point-mass + sensor-mass"), "wrong"),
        (several("point-mass", "crack"), told(), "wrong"),
        (answer("hem-contact"), told("hem-stretch"), "right"),
        (several("sensor-mass", "hem-contact"), told("hem-stretch + sensor-mass"), "right"),
        (GLUED, told("hem-stretch + sensor-mass"), "among"),
        (GLUED, told("suspension + sensor-mass"), "wrong"),
        (answer(code=2), told(), "refused"),
        (answer(code=1), told(), "crash"),
        (Answer(0, 1.0, 0.1, ""), told(), "crash"),
    ],
)
def test_outcome(given, truth, outcome):
    assert row(given, truth)["outcome"] == outcome


@pytest.mark.parametrize("why", [Reason.AGAINST.value, Reason.WORSE.value])
def test_the_veto_is_told_from_the_evidence(why):
    """A name the held-out data refused counts by evidence, and the veto was wrong to refuse it."""
    note = f"point-mass gained 1314 in -2 ln evidence, but {why} (nothing was held out)"
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


def estimate(value, low, high, **more):
    return {"value": value, "low": low, "high": high, **more}


def test_intervals_of_parts_together_are_held_against_their_mean():
    """E of a and b is (200·220)^½ GPa for equal masses."""
    entries = [
        estimate(210e9, 209e9, 211e9, where="E of a, b"),
        estimate(1.15e-3, 1.1e-3, 1.2e-3, where="t of a"),
        estimate(0.5, 0.0, 1.0, where="E of welds"),
        estimate(7850.0, None, None, where="rho of a"),
    ]
    covered = row(answer(calibrated=entries), told())["covered"]
    assert covered == {"E": [1, 1], "rho": [0, 0], "t": [0, 1], "wall": [0, 0], "effect": [0, 0]}


@pytest.mark.parametrize(
    ("lists", "truth", "listed"),
    [
        ([["calibration alone", "crack"]], told("crack"), True),
        ([["calibration alone", "crack"]], told("point-mass"), False),
        ([["crack"], ["sensor-mass", "point-mass"]], told("point-mass + sensor-mass"), True),
        ([["crack", "point-mass"]], told("point-mass + sensor-mass"), False),
        ([], told("crack"), False),
        ([["calibration alone", "crack"]], told("nothing"), True),
        ([], told("nothing"), False),
    ],
)
def test_a_list_counts_if_all_of_the_truth_is_in_it(lists, truth, listed):
    given = answer(None, "calibration only", one_of=lists)
    assert row(given, truth)["listed"] is listed


@pytest.mark.parametrize(("sigmas", "inside"), [(1.6, 1), (1.7, 0), (-1.6, 1), (-1.7, 0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_interval_of_95_percent_is_scored_as_one_of_90(sigmas, inside, sign):
    """Ends at 1.960 sd are drawn in to 1.645, in ln where all is positive, else as they are."""

    def off(by):
        return float(0.1 * np.exp(0.3 * by)) if sign > 0 else -0.1 + 0.3 * by

    effects = answer().result["effects"]
    effects[0]["parameters"] = [estimate(off(0), off(-1.96), off(1.96), name="M")]
    truth = told(value=off(sigmas))
    assert row(answer(effects=effects), truth)["covered"]["effect"] == [inside, 1]
    assert row(answer(effects=effects), {**truth, "effect": "mass-patch"})["covered"]["effect"] == [
        0, 0,
    ]  # fmt: skip


def test_parameters_with_names_of_their_own_are_held_against_these():
    effects = answer("orthotropic-material").result["effects"]
    effects[0]["parameters"] = [estimate(2.0, 1.0, 3.0, name=n) for n in ("E1", "E2", "nu12")]
    truth = told("orthotropic-material", E1=2.1, E2=9.0)
    del truth["value"]
    assert row(answer("orthotropic-material", effects=effects), truth)["covered"]["effect"] == [
        1,
        2,
    ]


@pytest.mark.parametrize(
    ("given", "truth", "kin"),
    [
        (answer("mass-patch"), told(), True),
        (answer("suspension"), told(), False),
        (answer("crack"), told("stiffness-patch"), True),
        (fault(), told("duplicated-pair"), True),
        (answer(None, "calibration only"), told("nothing"), True),
        (answer(None, "calibration only"), told(), False),
        (answer("point-mass"), told("rotor"), False),
    ],
)
def test_family(given, truth, kin):
    assert row(given, truth)["kin"] is kin


@pytest.mark.parametrize(("structure", "near"), [("tailgate", True), ("plate", False)])
def test_a_place_is_near_on_the_scale_of_the_structure(structure, near):
    """100 mm off: within 150 mm on the tailgate, beyond 60 mm elsewhere."""
    effects = answer().result["effects"]
    effects[0]["where"]["point_m"] = [0.1, 0.0, 0.0]
    assert row(answer(effects=effects), told(structure=structure))["near"] is near
    assert row(answer(None, "calibration only"), told())["near"] is None


def test_plain_calibration_stands_beside():
    """It lies 10 % about E where the diagnosis lies 1 %; held-out Q 0.5 against 0.2."""
    truth = told(values={"E": {"a": 200e9}, "rho": {}, "t": {}})

    def said(off, **more):
        entry = estimate(200e9 * np.exp(off), 1.0, 2.0, where="E of a")
        return answer(calibrated=[entry], mass={"model_kg": 2.0 * np.exp(off)}, **more)

    r = row(said(0.01), truth, said(0.1, name=None, verdict="calibration only", fit={
        "held_out": {"Q_calibrated": 0.5, "Q_floor": 0.1}}))  # fmt: skip
    one, other = r["beside"]["calibration"], r["beside"]["diagnosis"]
    assert (one["E"], other["E"]) == (pytest.approx(0.1), pytest.approx(0.01))
    assert (one["mass"], other["mass"]) == (pytest.approx(0.1), pytest.approx(0.01))
    assert (one["Q"], other["Q"], one["t"]) == (0.5, 0.2, None)
    lines = {
        text[:28].strip(): text[28:].split()
        for text in calibration_against_diagnosis([r, r]).splitlines()
    }
    assert lines["E off, %"] == ["10", "1", "2"]
    assert lines["held-out Q"] == ["0.5", "0.2", "2"]
    assert "t off, %" not in lines
    assert "not tested" in calibration_against_diagnosis([row(said(0.0), truth)])


def test_what_an_answer_leaves_open_is_no_crash():
    """A null stands where a diagnosis has nothing to say."""
    empty = dict.fromkeys(("adequate", "one_of", "notes", "calibrated", "fit"))
    r = row(answer(None, "calibration only", **empty), told())
    assert (r["outcome"], r["p"], r["gain_share"]) == ("none", None, None)


def test_uniformity_of_p_is_of_right_answers_by_mesh():
    """Of two values with a largest distance d = 0.4, p = 1 - 2 (2d - 1/2)² = 0.82."""
    right = row(answer(), told())
    rows = [{**right, "mesh": m, "p": p} for m, p in (("a", 0.2), ("a", 0.6), ("b", 0.5))]
    rows += [{**right, "mesh": "b", "p": None}, {**right, "outcome": "wrong", "p": 0.001}]
    lines = [line for line in overall(rows).splitlines() if line.startswith("p of the test")]
    assert lines == [
        "p of the test of fit, a: 2 right, median 0.40, least 0.20, uniform p 0.82",
        "p of the test of fit, b: 1 right, median 0.50, least 0.50, uniform p 1",
    ]


def test_tables_add_up():
    """Every case once in the matrix; an unknown effect named is wrong, a null named an alarm."""
    rows = [
        row(answer(), told()), row(answer("suspension"), told()), row(answer(), told("rotor")),
        row(answer(), told("nothing")), row(answer(code=2), told()), row(answer(code=1), told()),
    ]  # fmt: skip
    assert [int(w) for w in table(rows).splitlines()[1].split()[1:10]] == [
        4,
        1,
        0,
        0,
        1,
        0,
        0,
        1,
        1,
    ]
    _, *lines, legend = confusion(rows).splitlines()
    counts = {text.split()[0]: text.split()[1:] for text in lines}
    assert legend == "called 1: crash, 2: point-mass, 3: refused, 4: suspension"
    assert counts["point-mass"] == ["1", "1", "1", "1"]
    assert counts["nothing"] == [".", "1", ".", "."]
    said = overall(rows)
    assert "right name: 1/4; right family: 1/4" in said
    assert "right place, of the right names that have one: 1/1" in said
    assert "false alarms: 1 of 1" in said
    assert "outside the catalogue: 0 admitted, 1 wrong of 1" in said
    assert "75% of the way" in said
    assert tables([])


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


@pytest.mark.parametrize(("part", "near", "counted"), [("a", True, 2), ("b", False, 0)])
def test_values_of_a_force_count_in_the_part_that_has_it(part, near, counted):
    """Each force is compared with the one of its name."""
    forces = [estimate(-100.0, -120.0, -80.0, name="N along"),
              estimate(-30.0, -40.0, -20.0, name="N across")]  # fmt: skip
    effect = {"name": "membrane-prestress", "where": {"parts": [part]}, "parameters": forces}
    truth = told("membrane-prestress", **{"N along": -105.0, "N across": -70.0, "part": "a"})
    truth.pop("point_m")
    found = row(answer(effects=[effect]), truth)
    assert found["near"] == near
    assert found["covered"]["effect"] == [counted // 2, counted]
