"""Evidence in every run of the suite: one concealed effect is found, nothing is found in one null.

Through :func:`chladni.diagnose` alone, on the plate of the blind run; seeds nobody tuned on.
"""

import json

import numpy as np
import pytest

import chladni
from chladni_evidence.blind import Blind
from chladni_evidence.concealed import SPECIMENS, made, write

SEED = 40


def blind(effect, folder):
    """The answer of :func:`chladni.diagnose` to a case folder, and then the truth."""
    case = Blind("plate", effect, SEED, folder)
    write(made(SPECIMENS["plate"], effect, SEED), case.folder, case.seal)
    found = chladni.diagnose(chladni.load_case(case.folder))
    return found, json.loads(case.seal.read_text(encoding="utf-8"))


def test_a_concealed_mass_is_named_placed_and_weighed(tmp_path, evidence):
    found, truth = blind("point-mass", tmp_path)
    (effect,) = found.effects
    assert found.verdict == "missing physics"
    assert effect.name == "point-mass"
    assert np.linalg.norm(np.subtract(effect.where.point_m, truth["point_m"])) < 0.06
    (mass,) = effect.parameters
    assert mass.low <= truth["value"] <= mass.high
    held = found.agreement.held_out
    assert held.with_effect < 0.5 * held.calibrated
    assert held.with_effect < 0.5 * held.nominal
    assert len(found.models.final.model.assembly.masses) == 1
    assert evidence(found, truth)["right"]


def test_nothing_is_found_where_nothing_is_missing(tmp_path, evidence):
    """Scatter, noise, and another element formulation are not missing physics."""
    found, truth = blind("nothing", tmp_path)
    assert found.verdict in ("nothing missing", "calibration only")
    assert found.effects == ()
    assert found.agreement.largest_two_log_bayes_factor < found.agreement.threshold
    assert found.agreement.two_log_bayes_factor is None
    assert all(a.why_not for a in found.alternatives)
    assert evidence(found, truth)["right"]


def test_the_blind_run_asks_the_same_function(monkeypatch, tmp_path):
    """What a blind run scores is what :func:`chladni.diagnose` answers."""
    from chladni_evidence import blind

    asked = []
    answer = chladni.workflows.diagnosis_result.DiagnosisResult(verdict="nothing missing")
    assert blind.diagnose is chladni.diagnose
    monkeypatch.setattr(blind, "diagnose", lambda case: asked.append(case) or answer)
    rows = blind.answered_rows(blind.blinds(tmp_path, [SEED], ["nothing"], ["plate"]))
    assert len(asked) == 1
    assert [r["called"] for r in rows] == ["nothing missing"]
    with pytest.raises(chladni.errors.LabelError, match="point-mass"):
        blind.blinds(tmp_path, [SEED], ["teapot"])
