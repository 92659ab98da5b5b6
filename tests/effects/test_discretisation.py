"""The mesh error where a mesh is far too coarse for what was measured on it."""

import numpy as np

from chladni.effects.discretisation import mesh_errors
from chladni.fem.modelled import modelled
from chladni_specimens.plates import plate

TOP = 380.0  # [Hz]; ten flexible modes on sixteen shells


def test_no_mode_loses_all_its_stiffness():
    """Laid out as linear, twice the change to the finer mesh would leave less than none."""
    coarse = modelled(plate(0.4, 0.3, 4, 4, 1.5e-3), 4 * TOP)
    error, modes = mesh_errors(coarse, TOP)[0], coarse.up_to(1.4 * TOP)
    flexible = modes.frequency > 1.0
    b = error.rows @ modes.shapes[:, flexible]
    lam = (2 * np.pi * modes.frequency[flexible]) ** 2
    change = (b.T * error.change) @ b / np.sqrt(np.outer(lam, lam))
    assert np.linalg.eigvalsh(np.eye(len(lam)) + 2 * change).min() > 0
    assert np.linalg.eigvalsh(change).min() < -0.4  # it is as coarse as that
