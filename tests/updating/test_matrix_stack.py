"""A stack that shares its inner matrices sums as one that holds them all."""

import numpy as np
from numpy.testing import assert_allclose

from chladni.updating.matrix_stack import Bordered, Whole

G, R, K = 5, 4, 2


def symmetric(rng, size):
    A = rng.normal(size=(G, size, size))
    return A + A.transpose(0, 2, 1)


def test_bordered_sums_are_those_of_the_whole():
    rng = np.random.default_rng(3)
    whole = symmetric(rng, R + 2 * K)
    inner = Whole(whole[:, :R, :R])
    once = Bordered(inner, whole[:, :R, R : R + K], whole[:, R : R + K, R : R + K])
    twice = Bordered(once, whole[:, : R + K, R + K :], whole[:, R + K :, R + K :])
    weights = rng.normal(size=(3, G))
    expected = np.einsum("pg,gij->pij", weights, whole)
    assert twice.shape == (G, R + 2 * K)
    assert_allclose(twice.weighted(weights), expected, atol=1e-12)
    assert_allclose(Whole(whole).weighted(weights), expected, atol=1e-12)


def test_what_is_common_is_held_once():
    inner = Whole(np.ones((G, R, R)))
    grown = [Bordered(inner, np.ones((G, R, K)), np.ones((G, K, K))) for _ in range(3)]
    assert all(stack.inner is inner for stack in grown)
