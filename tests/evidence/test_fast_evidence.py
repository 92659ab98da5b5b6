"""One hidden effect is found, nothing is found in one null, among all effects of the catalogue.

Through :func:`chladni.diagnose` alone, on the plate of the blind benchmark. In every run of the
suite the same is asked of smaller plates (``tests/workflows/test_moving_base.py``).
"""

import numpy as np
import pytest

import chladni
from chladni_evidence.blind_make import made_of
from chladni_evidence.evidence_sets import Order
from chladni_evidence.made_case import write_case

pytestmark = pytest.mark.slow


def blind(effect, folder):
    """The answer of :func:`chladni.diagnose` to a case folder, and then the truth."""
    case = made_of(Order("plate", effect, 560, "fine"))
    write_case(case, folder / "case", folder / "sealed.json")
    return chladni.diagnose(chladni.load_case(folder / "case")), case.truth


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
    assert evidence(found, truth)["outcome"] == "right"


def test_nothing_is_found_where_nothing_is_missing(tmp_path, evidence):
    """Scatter, noise, and another element formulation are not missing physics."""
    found, truth = blind("nothing", tmp_path)
    assert found.verdict in ("nothing missing", "calibration only")
    assert found.effects == ()
    assert found.agreement.largest_two_log_bayes_factor < found.agreement.threshold
    assert found.agreement.two_log_bayes_factor is None
    assert all(a.why_not for a in found.alternatives)
    assert evidence(found, truth)["outcome"] == "right"
