"""An effect that stays, one that moves or grows, one that is in some states only."""

from chladni.effects.estimate import Estimate, Location
from chladni.inference.result import NamedEffect
from chladni.workflows.diagnosis_result import DiagnosisResult, StateResult
from chladni.workflows.effects_by_state import by_state


def state(name, *effects):
    return StateResult(name, DiagnosisResult(effects=effects))


def mass(x, m, radius=0.01):
    size = Estimate("M", m, "kg", 0.8 * m, 1.2 * m)
    where = Location(f"near x = {x}", point_m=(x, 0.0, 0.0), radius_m=radius)
    return NamedEffect("point-mass", where=where, parameters=(size,))


def test_what_stays_is_common():
    (said,) = by_state([state("a", mass(0.1, 0.02)), state("b", mass(0.105, 0.021))])
    assert said.startswith("point-mass is in 'a', 'b', in every state")
    assert "it stays, with the same size within its uncertainty" in said


def test_what_moves_and_grows_is_told_with_how_far():
    (said,) = by_state([state("a", mass(0.1, 0.02)), state("b", mass(0.15, 0.04))])
    assert "from 'a' to 'b' it moves by 50 mm, M from 0.02 to 0.04 kg" in said


def test_what_is_in_some_states_only_is_said_to_be():
    fault = NamedEffect("sensor-fault", where=Location("channel 1:+Z"))
    said = by_state([state("a"), state("b", mass(0.1, 0.02)), state("c", fault)])
    assert said == ["point-mass is in 'b' only", "sensor-fault is in 'c' only"]
    assert by_state([state("a"), state("b")]) == []


def test_two_of_a_family_in_one_state_are_not_taken_for_one_that_moves():
    (said,) = by_state([state("a", mass(0.1, 0.02), mass(0.4, 0.05)), state("b", mass(0.1, 0.02))])
    assert said.startswith("point-mass is in 'a', 'b', in every state; ")
    assert "it moves" not in said
