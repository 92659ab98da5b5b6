"""Maps of FRFs: each gives back what it was stored from, and none is tried that cannot be."""

import numpy as np
import pytest
from tests.builders.modal_frfs import modal_frf

from chladni.dynamics.frf import FRF
from chladni.ema.frf_maps import mapped, misreadings

F = np.linspace(5, 200, 800)


def plate_like(level=1.0):
    """Accelerance of four modes at three outputs, on both sides of 0 dB."""
    phi = np.array([[1, 0.8, -0.6, 0.9], [0.7, -1, 0.9, 0.4], [-0.8, 0.5, 1, -0.7]])
    frf = modal_frf(F, [18.0, 47.0, 90.0, 140.0], phi)
    return with_values(frf, level * frf.values)


def with_values(frf, values):
    return FRF(values, frf.frequency, frf.outputs, frf.inputs, frf.quantity)


def decibels(H):
    return 20 * np.log10(np.abs(H))


STORED = {  # map that undoes it: what was stored of H
    ("factor", "-1"): lambda H: -H,
    ("conjugated",): np.conj,
    ("swapped parts",): lambda H: H.imag + 1j * H.real,
    ("phase in radians",): lambda H: np.abs(H) * np.exp(1j * np.radians(np.angle(H))),
    ("decibels",): lambda H: decibels(H) * np.exp(1j * np.angle(H)),
    ("decibels and degrees",): lambda H: decibels(H) + 1j * np.degrees(np.angle(H)),
    ("decibels and radians",): lambda H: decibels(H) + 1j * np.angle(H),
    ("magnitude and degrees",): lambda H: np.abs(H) + 1j * np.degrees(np.angle(H)),
    ("magnitude and radians",): lambda H: np.abs(H) + 1j * np.angle(H),
    ("reversed", "2:+Z"): lambda H: H * np.array([1, -1, 1])[:, None],
    ("exchanged", "1:+Z", "3:+Z"): lambda H: H[:, ::-1],
}


@pytest.mark.parametrize("mend", STORED, ids=" ".join)
@pytest.mark.parametrize("level", [1.0, 1e-3, 40.0])
def test_a_map_gives_back_what_was_stored(mend, level):
    true = plate_like(level)
    stored = with_values(true, STORED[mend](true.values))
    np.testing.assert_allclose(mapped(stored, mend).values, true.values, rtol=1e-6)


def test_only_possible_maps_are_tried():
    """FRFs of all phases and both signs may have exchanged parts or be decibels, nothing else."""
    assert {m.kind for m in misreadings(plate_like(1e4))} == {"swapped parts"}
    narrow = with_values(plate_like(), STORED["phase in radians",](plate_like().values))
    assert "phase in radians" in {m.kind for m in misreadings(narrow)}
