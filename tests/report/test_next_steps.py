"""After every verdict something can be done, and the most useful comes first."""

import pytest

from chladni.report.diagnosis_json import from_json
from chladni.report.next_steps import next_steps
from chladni.report.sentence import sentence
from chladni.report.verdict import HEADING

MASS = {"name": "M", "value": 0.06, "unit": "kg", "low": 0.05, "high": 0.07}
SPOT = {"text": "near grid 18"}
LUMP = {"name": "point-mass", "claim": "a lump", "where": SPOT, "parameters": [MASS]}
FAULT = {"name": "sensor-fault", "where": {"text": "channel 7", "channels": ["7:+Z"]}}


def steps(**result):
    return next_steps(from_json(result))


@pytest.mark.parametrize("verdict", HEADING)
@pytest.mark.parametrize("mass", [None, {"model_kg": 1.9}])
def test_every_verdict_says_what_to_do(verdict, mass):
    found = steps(verdict=verdict, mass=mass)
    assert found
    assert len(found) == len(set(found)) <= 6
    assert all(s[0].isupper() and s.endswith(".") and "None" not in s for s in found)


def test_a_finding_is_looked_for_first_at_its_place_and_with_its_size():
    first, second, *_ = steps(verdict="missing physics", effects=[LUMP])
    assert first.startswith("Near grid 18: check")
    assert "0.05 to 0.07" in first or "50 to 70" in first
    assert "confirms point-mass" in second


def test_what_cannot_be_told_apart_is_settled_first():
    tied = {"one_of": [["point-mass", "stiffness-patch"]], "effects": [LUMP]}
    first, second, *_ = steps(verdict="missing physics", **tied)
    assert "distinguishes point-mass from the others" in first
    assert "distinguishes stiffness-patch" in second


def test_a_fault_is_measured_again():
    found = steps(verdict="measurement fault", effects=[FAULT])
    assert found[0] == "Measure 7:+Z again with another sensor and another cable."
    assert any("column use of sensors.csv" in s for s in found)


def test_outside_the_catalogue_the_place_that_does_not_fit_comes_first():
    spot = {"text": "stiffness is missing", "grid": 9, "parts": ["hem"]}
    test = {"passes": False, "p": 0.0, "what": "misfit", "where": [spot]}
    found = steps(verdict="not in catalogue", adequate=test)
    assert "near grid 9" in found[0]
    assert "hem" in found[0]


@pytest.mark.parametrize("verdict", ["not in catalogue", "calibration only", "nothing missing"])
def test_a_calibration_is_followed_by_a_diagnosis(verdict):
    spot = {"text": "largest near 293 Hz", "grid": 9, "parts": ["hem"]}
    test = {"passes": False, "p": 0.0, "what": "misfit", "where": [spot]}
    found = steps(verdict=verdict, searched=False, adequate=test)
    assert found[0] == "Run chladni diagnose, which searches for missing physics."
    assert not any("grid 9" in s for s in found)


def test_a_misfit_of_all_modes_is_at_no_place():
    spot = {"text": "over all modes", "grid": None, "parts": []}
    test = {"passes": False, "p": 0.0, "what": "misfit", "where": [spot]}
    found = steps(verdict="not in catalogue", adequate=test)
    assert found[0] == "Look at the structure for physics that the deck lacks: over all modes."
    assert not any("there" in s for s in found)


def test_a_calibration_measures_what_moved_most():
    moved = [
        {"where": f"t of {part}", "name": "t", "value": v, "unit": "m", "deck_value": 1e-3}
        for part, v in (("hem", 1.01e-3), ("panel", 1.3e-3), ("frame", 1.1e-3))
    ]
    found = steps(verdict="calibration only", calibrated=moved)
    assert "t of panel" in found[0]
    assert "t of frame" in found[1]
    assert not any("hem" in s for s in found)


@pytest.mark.parametrize(("error", "said"), [(0.0, False), (0.043, True)])
def test_a_quiet_answer_on_a_coarse_mesh_says_what_it_cannot_see(error, said):
    found = {"verdict": "calibration only", "mesh_error": error}
    assert ("(up to 4.3 % of a frequency)" in sentence(from_json(found))) == said
    assert steps(**found)[0].startswith("Refine the mesh, which takes frequencies up to") == said


def test_a_structure_that_was_not_weighed_is_weighed():
    weigh = [any(s.startswith("Weigh the test article as") for s in
                 steps(verdict="nothing missing", mass={"model_kg": 2.0, "weighed_kg": kg}))
             for kg in (None, 2.0)]  # fmt: skip
    assert weigh == [True, False]


@pytest.mark.parametrize(("doubts", "verb"), [([], "Use"), (["held-out Q grew"], "Do not use")])
def test_a_deck_is_recommended_only_without_a_doubt(doubts, verb):
    found = steps(
        verdict="calibration only", distrust=doubts,
        files={"deck": "calibrated.bdf"}, deck_changed=True,
    )  # fmt: skip
    assert any(s.startswith(f"{verb} calibrated.bdf") for s in found)


@pytest.mark.parametrize(("why", "times"), [("", 0), ("on the given mesh it predicts worse", 1)])
def test_headline_and_recommendation_name_halved_shells(why, times):
    found = {"verdict": "missing physics", "effects": [LUMP], "halved": why, "deck_changed": True,
             "files": {"deck": "updated.bdf"}}  # fmt: skip
    (use,) = (s for s in steps(**found) if s.startswith("Use updated.bdf"))
    assert use.count(f"; every shell of it is halved, because {why}.") == times
    headline = sentence(from_json(found))
    assert headline.count(f"Every shell of the written decks is halved, because {why}.") == times
