"""Cords spread as the mass is: rigid motions at their frequency, elastic modes hardly changed."""

import numpy as np
from numpy.testing import assert_allclose

from chladni.effects.unknown_cords import TILTING, unknown_cords
from chladni.fem.modelled import modelled
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

TOP, SLOW = 200.0, 4.0  # [Hz]
UP = np.array([[0.0, 0.0, 1.0]])


def frequencies(x):
    model = modelled(plate(0.4, 0.3, 16, 12, 1.5e-3), 3 * TOP)
    (cords,) = unknown_cords(model.structure, np.array([SLOW]), UP)
    reduced = reduced_problem(model, TOP)
    lam = evaluate(reduced.model, [cords], np.asarray(x), False).lam
    return np.sqrt(np.maximum(lam, 0)) / (2 * np.pi), model.modes.frequency


def test_springs_in_proportion_to_the_mass_add_to_the_square_of_every_frequency():
    f, free = frequencies([0.0, -30.0, -30.0])
    free = np.where(free < 0.1, 0.0, free)
    assert_allclose(np.sort(f)[:3], 0.0, atol=0.05)  # motions in the plane stay free
    assert_allclose(np.sort(f)[3:6], SLOW, rtol=0.01)
    assert_allclose(np.sort(f)[6:9], np.sqrt(free[6:9] ** 2 + SLOW**2), rtol=1e-3)


def test_springs_at_the_ends_hold_a_tilt_more_than_the_bounce():
    """The mean of ξ⁴ is 9/5 of the square of that of ξ² along a line of mass."""
    f, _ = frequencies([-30.0, 0.0, -30.0])
    tilt = SLOW * np.sqrt(TILTING * np.array([1.0, 1.0, 9 / 5]))
    assert_allclose(np.sort(f)[3:6], tilt, rtol=0.02)


def test_nothing_is_unknown_without_slow_modes():
    model = modelled(plate(0.4, 0.3, 4, 3, 1.5e-3), TOP)
    assert unknown_cords(model.structure, np.zeros(0), UP) == []
