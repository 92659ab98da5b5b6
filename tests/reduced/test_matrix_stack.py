"""A stack that shares its inner matrices sums and multiplies as one that holds them all."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.reduced.matrix_stack import COLUMNS, stacked

G, R, K = 5, 4, 2


def symmetric(rng, size):
    A = rng.normal(size=(G, size, size))
    return A + A.transpose(0, 2, 1)


@pytest.mark.parametrize("r", [R, COLUMNS + 3])
def test_bordered_sums_and_products_are_those_of_the_whole(r):
    rng = np.random.default_rng(3)
    A = symmetric(rng, r + 2 * K)
    once = stacked(A[:, :r, :r]).bordered(A[:, : r + K, r : r + K])
    twice = once.bordered(A[:, :, r + K :])
    weights, z = rng.normal(size=G), rng.normal(size=(r + 2 * K, 3))
    assert twice.shape == (G, r + 2 * K)
    for stack in (twice, stacked(A)):
        assert_allclose(stack.weighted(weights), np.tensordot(weights, A, 1), atol=1e-12)
        assert_allclose(stack.times(z), A @ z, atol=1e-12)


def test_what_is_common_is_held_once():
    inner = stacked(np.ones((G, R, R)))
    grown = [inner.bordered(np.ones((G, R + K, K))) for _ in range(3)]
    assert all(stack.blocks[0] is inner.blocks[0] for stack in grown)
