"""Poles nearer than a bandwidth that move alike are said to be one peak, and joined into one."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.modal_frfs import modal_frf

from chladni.ema.coincident_poles import peak_notes, peaks, twins_joined
from chladni.ema.identification import identify

F = np.array([40.0, 60.0, 90.0])
SHAPES = np.array([[1.0, 1.0, 0.3], [0.5, -1.0, 0.9], [0.2, 0.4, -1.0], [1.0, 0.3, 0.5]])


@pytest.fixture(scope="module")
def found():
    frf = modal_frf(np.linspace(20, 120, 800), F, SHAPES)
    out = identify(frf, (25.0, 115.0))
    return out.sel(out.inside & (out.frequency < 100))


def beside(found, one, other, half_bandwidths, shape):
    """Pole ``other`` moved beside ``one``, with the shape of ``shape``."""
    poles, residues = found.poles.copy(), found.residues.copy()
    poles[other] = poles[one] + 1j * half_bandwidths * abs(poles[one].real)
    residues[other] = 0.2 * residues[shape]
    return replace(found, poles=poles, residues=residues)


def test_modes_apart_are_peaks_of_their_own(found):
    assert_allclose(found.frequency, F, rtol=1e-6)
    assert peak_notes(found) == []
    assert_allclose(twins_joined(found).poles, found.poles)


def test_two_poles_of_one_shape_in_one_peak_are_said_and_joined(found):
    twin = beside(found, 0, 1, 1.0, shape=0)
    (said,) = peak_notes(twin)
    assert said.startswith("40 and 40.4 Hz are in one peak")
    joined = twins_joined(twin)
    assert joined.order == 2
    assert_allclose(joined.residues.sum(axis=0), twin.residues.sum(axis=0))


@pytest.mark.parametrize(("half_bandwidths", "shape"), [(3.0, 0), (1.0, 1)])
def test_farther_away_or_of_another_shape_it_is_another_mode(found, half_bandwidths, shape):
    assert len(list(peaks(beside(found, 0, 1, half_bandwidths, shape)))) == 3


def test_one_channel_cannot_tell_shapes_apart(found):
    twin = beside(found, 0, 1, 1.0, shape=1)
    alone = replace(twin, residues=twin.residues[:, :1], outputs=twin.outputs[:1])
    assert len(peak_notes(alone)) == 1
