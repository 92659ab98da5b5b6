"""Articles that CalculiX solved, on quadratic shells: the diagnosis knows neither code nor mesh."""

import pytest

import chladni
from chladni_evidence.blind_make import made_of
from chladni_evidence.calculix import installed
from chladni_evidence.evidence_sets import Order
from chladni_evidence.made_case import write_case

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not installed(), reason="CalculiX (ccx) is not installed"),
]
KINDS = (
    "nothing", "calibration", "orthotropic-material", "thickness-distribution", "point-mass",
)  # fmt: skip


@pytest.mark.parametrize("name", ["plate", "panel"])
@pytest.mark.parametrize("kind", KINDS)
def test_is_named_on_articles_of_another_code(name, kind, tmp_path, evidence):
    """The right name, the place within 60 mm, held-out Q better than plain calibration's."""
    case = made_of(Order(name, kind, 561, "calculix"))
    write_case(case, tmp_path / "case", tmp_path / "sealed.json")
    row = evidence(chladni.diagnose(chladni.load_case(tmp_path / "case")), case.truth)
    assert row["outcome"] == "right"
    assert row["near"] in (True, None)
    assert row["gain_share"] is None or row["gain_share"] > 0
