"""The frequency axis of a recording begins at zero, and by how much it does not."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.modal_frfs import modal_sum, noisy
from tests.ema.test_frf_maps import F, plate_like

from chladni.ema.axis_shift import axis_check, axis_shift
from chladni.ema.identification import identify


def recorded(shift, scale=1.0):
    """Four modes with 0.3 % noise, on an axis times ``scale`` and off by ``shift`` [Hz]."""
    frf = noisy(plate_like(), 0.004, seed=3, stated=False)
    return replace(frf, frequency=scale * frf.frequency + shift).sel(band=(10.0, 190.0))


@pytest.mark.parametrize("shift", [-2.0, 2.0, 5.0])
def test_a_shift_is_found_within_its_interval(shift):
    frf = recorded(shift)
    modes = identify(frf)
    found, sd, _ = axis_shift(frf, modes)
    assert found == pytest.approx(shift, abs=4 * sd)
    (finding,), check = axis_check(frf, modes)
    assert (finding.kind, finding.severity) == ("frequency offset", "fault")
    assert f"too {'high' if shift > 0 else 'low'}" in finding.text
    assert ("subtract" if shift > 0 else "add") in finding.repair
    assert check.passed is False


@pytest.mark.parametrize("scale", [1.0, 1.06])
def test_an_axis_that_begins_at_zero_passes_whatever_its_scale(scale):
    """A factor on the axis is a stiffer structure: the recording cannot tell."""
    findings, check = axis_check(frf := recorded(0.0, scale), identify(frf))
    assert findings == []
    assert check.passed


def test_foam_below_the_band_is_no_shift():
    """A pole that relaxes belongs to the structure; the axis of its recording begins at zero."""
    frf, all_alike = plate_like(), np.ones((3, 1))
    foam = modal_sum(2j * np.pi * F, [9.0], all_alike, all_alike[:1], damping=1.0)
    frf = noisy(replace(frf, values=frf.values + foam), 0.004, seed=3, stated=False)
    frf = frf.sel(band=(10.0, 190.0))
    findings, check = axis_check(frf, identify(frf))
    assert (findings, check.passed) == ([], True)


@pytest.mark.parametrize("cords", [[5.5], [2.4, 5.5], [7.0]])
def test_a_mode_on_cords_that_was_not_identified_is_no_shift(cords):
    """It lies below the band, and its pull on the first lines is that of an axis that is off."""
    shapes = np.random.default_rng(0).normal(size=(3, len(cords))) * np.sqrt(3)
    swing = modal_sum(2j * np.pi * F, cords, shapes, shapes[:1], damping=0.02)
    frf = plate_like()
    frf = noisy(replace(frf, values=frf.values + swing), 0.004, seed=3, stated=False)
    frf = frf.sel(band=(10.0, 190.0))
    modes = identify(frf)
    modes = replace(modes, poles=modes.poles[modes.frequency > 10.0])
    findings, check = axis_check(frf, modes)
    assert (findings, check.passed) == ([], True)


def test_modes_that_do_not_fit_decide_nothing():
    frf = recorded(2.0)
    findings, check = axis_check(frf, replace(identify(frf), chi=100.0))
    assert (findings, check.passed) == ([], None)
