"""The recovery study: the article has the drawn values on its own mesh, and is scored by them."""

import numpy as np
import pytest

from chladni.effects.estimate import Estimate
from chladni.fem.energy import mass_properties
from chladni.inference.calibration_result import CalibrationStudy
from chladni.inference.result import CalibratedParameter
from chladni.workflows.diagnosis_result import DiagnosisResult
from chladni_evidence.recovery import COARSE, article, compared_with, drawn, panel, summary


def test_the_article_has_the_drawn_values_on_a_finer_mesh():
    """Mass is ρ t A, whatever the mesh: the patch and E change none of it."""
    deck, none = panel(COARSE), dict.fromkeys(drawn(600), 0.0)
    plain = article(deck, none)
    assert len(plain.shells.nodes) == pytest.approx(4 * len(deck.shells.nodes), rel=0.01)
    heavier = article(deck, none | {"rho": 0.1, "E lower": 0.2, "patch E": 0.3})
    ratio = mass_properties(heavier)[0] / mass_properties(plain)[0]
    assert ratio == pytest.approx(np.exp(0.1), rel=0.01)  # the glue keeps its own density
    assert drawn(600) == drawn(600) != drawn(601)


def test_intervals_are_held_against_the_truth_and_what_is_missing_is_frozen():
    def row(where, name, low, high, deck):
        return CalibratedParameter(where, Estimate(name, deck, "", low, high), deck)

    found = DiagnosisResult(
        study=CalibrationStudy(),
        calibrated=(
            row("E glue: E of glue", "E", 18e6, 22e6, 20e6), row("rho of lower", "rho", 1, 2, 10),
            row("patch: the patch about 3 welds", "R", 0.01, 0.03, 0.02),
        ),
    )  # fmt: skip
    rows = compared_with({"E glue": 0.05, "rho": 0.0, "patch R": 0.0, "nu": 0.1}, found)
    assert [r.inside for r in rows] == [True, False, True, None]
    lines = summary([rows], [0.001])
    assert "2 of 3 intervals of 95 % contain the truth (66.7%)" in lines[-1]
    assert any(line.split()[:4] == ["nu", "0", "0", "1"] for line in lines)
