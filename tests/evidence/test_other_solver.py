"""Articles that CalculiX solved, on quadratic shells: the diagnosis knows neither code nor mesh."""

import pytest

import chladni
from chladni_evidence.blind_make import made_of
from chladni_evidence.calculix import installed
from chladni_evidence.evidence_sets import Order
from chladni_evidence.made_case import write_case
from chladni_evidence.outcome_row import NULLS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not installed(), reason="CalculiX (ccx) is not installed"),
]
KINDS = (
    "nothing", "calibration", "orthotropic-material", "thickness-distribution", "point-mass",
)  # fmt: skip


@pytest.mark.parametrize("name", ["plate", "panel"])
@pytest.mark.parametrize("kind", KINDS)
def test_another_code_is_no_alarm(name, kind, tmp_path, evidence):
    """Nothing is named where nothing is missing; what else was called what is in the table."""
    case = made_of(Order(name, kind, 561, "calculix"))
    write_case(case, tmp_path / "case", tmp_path / "sealed.json")
    row = evidence(chladni.diagnose(chladni.load_case(tmp_path / "case")), case.truth)
    assert row["outcome"] not in ("crash", "refused")
    if kind in NULLS:
        assert row["outcome"] == "right"
