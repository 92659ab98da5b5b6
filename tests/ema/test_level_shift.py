"""Frequencies against level: followed by nearness, said where they move, else silent."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.frf import FRF
from chladni.ema.identification import identify
from chladni.ema.level_shift import level_notes

F = np.linspace(10, 60, 500)


@pytest.fixture(scope="module")
def modes():
    """Two modes, 0.2 % noise."""
    s, w = 2j * np.pi * F[:, None], 2 * np.pi * np.array([22.0, 41.0])
    H = (s**2 / (s**2 + 0.02 * w * s + w**2)).sum(axis=1)
    z = np.random.default_rng(0).normal(size=(2, len(F)))
    H = H * (1 + 0.002 * (z[0] + 1j * z[1]))
    return identify(FRF(H[:, None, None], F, ("1:+Z",), ("1:+Z",), "accelerance"), (12.0, 55.0))


def moved(modes, shift):
    """The same modes, the second with another frequency."""
    return replace(modes, poles=modes.poles * np.array([1.0, 1 + shift]))


def test_the_mode_that_moves_is_named_alone(modes):
    (note,) = level_notes([(1.0, modes), (8.0, moved(modes, -0.01))])
    assert note.startswith("nonlinear: natural frequencies move with level: 41")
    assert note.count("Hz at level 8") == 1


@pytest.mark.parametrize("shift", [0.0, 5e-4])
def test_what_is_too_small_to_say_is_no_move(modes, shift):
    (note,) = level_notes([(1.0, modes), (8.0, moved(modes, shift))])
    assert note == "no natural frequency moves with level (1, 8)"


def test_one_level_says_nothing(modes):
    assert level_notes([(1.0, modes), (1.0, modes)]) == []
    assert level_notes([(None, modes), (2.0, modes)]) == []


def test_a_mode_without_partner_is_not_followed(modes):
    (note,) = level_notes([(1.0, modes), (8.0, moved(modes, 0.2))])
    assert note.startswith("no natural frequency")
