"""The modes of a deck take the damping of their partners in the test."""

from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.dynamics.frf import FRF
from chladni.fem.modelled import modelled
from chladni.search.measured_modes import MeasuredModes
from chladni.workflows.case_model import model_frf

ZETA = np.array([0.002, 0.004, 0.006, 0.008])


@pytest.fixture
def seen(case):
    """A model, and a test that shows its second to fifth elastic mode 1 % too high."""
    model = modelled(case.assembly, 600.0)
    modes = model.modes.sel(slice(7, 11))
    shapes = case.outputs.rows(model.structure) @ modes.shapes
    return model, MeasuredModes(1.01 * modes.frequency, ZETA, shapes)


def test_partners_are_damped_alike_and_others_as_the_case_says(case, seen):
    model, test = seen
    damping = test.damping_of(case.outputs, model, 0.03)
    np.testing.assert_allclose(damping[7:11], ZETA)
    assert set(np.delete(damping, range(7, 11))) == {0.03}


def test_what_the_deck_damps_itself_is_not_added_twice(case, seen):
    """A loss factor g is a damping ratio g/2: the identified one holds it already."""
    _, test = seen
    lossy = modelled(replace(case.assembly, structural_damping=0.007), 600.0)
    damping = test.damping_of(case.outputs, lossy, 0.03)[7:11]
    np.testing.assert_allclose(damping, np.maximum(ZETA - 0.0035, 0.0), atol=1e-9)


def test_a_table_of_frequencies_lends_no_damping(case, seen):
    model, test = seen
    table = MeasuredModes(test.frequency)
    assert set(table.damping_of(case.outputs, model, 0.03)) == {0.03}


def test_a_peak_is_as_high_as_the_identified_damping_lets_it(case):
    """|H| at a resonance is 1/ζ: the recording has 1 %, and 5 % in the case changes nothing."""
    result = chladni.calibrate(replace(case, damping=0.05))
    after = result.models.curves["after"]
    of_case = model_frf(case, result.models.final.model, 0.05, after)
    partners = np.array([row.after_hz for row in result.frequencies if row.after_hz])

    def peaks(frf: FRF) -> np.ndarray:
        size = np.sqrt((np.abs(frf.values) ** 2).mean(axis=(1, 2)))
        near = np.abs(frf.frequency[:, None] / partners - 1) < 0.02
        return np.array([size[one].max() for one in near.T])

    assert np.median(peaks(after) / peaks(of_case)) == pytest.approx(5, rel=0.2)
