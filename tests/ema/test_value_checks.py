"""Recordings of which a part is lost: no phase, or magnitudes cut off."""

import numpy as np
import pytest
from tests.ema.test_frf_maps import plate_like, with_values

from chladni.ema.channel_checks import channel_checks
from chladni.ema.value_checks import cut_off, without_phase

LOST = {
    "only imaginary parts": lambda H: 1j * H.imag,
    "only magnitudes": lambda H: np.abs(H) + 0j,
    "only real parts, only imaginary parts or decibels": lambda H: H.real + 0j,
}


@pytest.mark.parametrize("cause", LOST)
def test_an_frf_of_one_part_has_lost_its_phase(cause):
    frf = plate_like()
    (found,), check = without_phase(with_values(frf, LOST[cause](frf.values)))
    assert (found.kind, found.severity) == ("no phase", "fault")
    assert f"{cause} were stored" in found.text
    assert check.passed is False


def test_magnitudes_that_stop_at_one_value_are_cut_off():
    frf = plate_like()
    size = np.abs(frf.values)
    limit = 0.2 * size.max()
    (found,), _ = cut_off(with_values(frf, frf.values * np.minimum(1, limit / size)))
    assert found.kind == "cut off"
    assert found.value == pytest.approx(limit)
    assert found.channels == frf.outputs


@pytest.mark.parametrize("digits", [3, 6, 12])
def test_a_sound_recording_passes_however_few_digits_it_has(digits):
    """Lines near a peak may round to one value; their phase then hardly differs."""
    frf = plate_like()
    scale = 10.0 ** (digits - np.ceil(np.log10(np.abs(frf.values).max())))
    rounded = with_values(frf, np.round(frf.values * scale) / scale)
    assert [f.kind for f in channel_checks(rounded)[0] if f.kind in ("cut off", "no phase")] == []


def test_phases_that_jump_are_no_dead_channels():
    """Degrees read as radians turn 3 % of noise into two radians, and leave the magnitudes."""
    frf, rng = plate_like(), np.random.default_rng(2)
    phase = np.angle(frf.values) + 0.03 * rng.normal(size=frf.values.shape)
    wrong = np.abs(frf.values) * np.exp(1j * np.degrees(phase))
    kinds = [f.kind for f in channel_checks(with_values(frf, wrong))[0]]
    assert "jumping phase" in kinds
    assert "dead channel" not in kinds


def test_noise_alone_is_dead_whatever_its_phase():
    frf, rng = plate_like(), np.random.default_rng(2)
    noise = rng.normal(size=frf.values.shape) + 1j * rng.normal(size=frf.values.shape)
    kinds = [f.kind for f in channel_checks(with_values(frf, noise))[0]]
    assert "dead channel" in kinds
    assert "jumping phase" not in kinds
