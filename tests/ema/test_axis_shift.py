"""The frequency axis of a recording begins at zero, and by how much it does not."""

from dataclasses import replace

import numpy as np
import pytest
from tests.ema.test_frf_maps import plate_like

from chladni.ema.axis_shift import axis_check, axis_shift
from chladni.ema.identification import identify


def recorded(shift, scale=1.0, seed=3):
    """Four modes with 0.3 % noise, on an axis times ``scale`` and off by ``shift`` [Hz]."""
    frf, rng = plate_like(), np.random.default_rng(seed)
    noise = 0.003 * np.abs(frf.values) * rng.normal(size=(2, *frf.values.shape))
    values = frf.values + noise[0] + 1j * noise[1]
    frf = replace(frf, values=values, frequency=scale * frf.frequency + shift)
    return frf.sel(band=(10.0, 190.0))


@pytest.mark.parametrize("shift", [-2.0, 2.0, 5.0])
def test_a_shift_is_found_within_its_interval(shift):
    frf = recorded(shift)
    found, sd, _ = axis_shift(frf, identify(frf))
    assert found == pytest.approx(shift, abs=4 * sd)
    (finding,), check = axis_check(frf, identify(frf))
    assert (finding.kind, finding.severity) == ("frequency offset", "fault")
    assert f"too {'high' if shift > 0 else 'low'}" in finding.text
    assert ("subtract" if shift > 0 else "add") in finding.repair
    assert check.passed is False


@pytest.mark.parametrize("scale", [1.0, 1.06])
def test_an_axis_that_begins_at_zero_passes_whatever_its_scale(scale):
    """A factor on the axis is a stiffer structure: the recording cannot tell."""
    findings, check = axis_check(recorded(0.0, scale), identify(recorded(0.0, scale)))
    assert findings == []
    assert check.passed
