"""One product in place of a sum over three arrays."""

import numpy as np
import pytest

from chladni.dynamics import modal_sum as room
from chladni.dynamics.modal_sum import modal_sum


@pytest.mark.parametrize("at_once", [1, 70, room.AT_ONCE])
def test_it_is_the_sum_that_it_says(at_once, monkeypatch):
    rng = np.random.default_rng(3)
    left, right = rng.standard_normal((7, 5)), rng.standard_normal((4, 5))
    d = rng.standard_normal((6, 5)) + 1j * rng.standard_normal((6, 5))
    monkeypatch.setattr(room, "AT_ONCE", at_once)
    told = np.einsum("ar,fr,br->fab", left, d, right)
    assert np.allclose(modal_sum(left, d, right), told, rtol=1e-12, atol=1e-12)


def test_no_place_gives_nothing():
    assert modal_sum(np.zeros((0, 3)), np.ones((2, 3)), np.ones((4, 3))).shape == (2, 0, 4)


def test_real_modes_of_a_real_line_are_summed_as_well():
    assert modal_sum(np.ones((1, 2)), np.array([[1.0, 2.0]]), np.ones((1, 2))).ravel() == [3]
