"""A stack that shares its inner matrices sums as one that holds them all."""

import numpy as np
from numpy.testing import assert_allclose

from chladni.reduced.matrix_stack import Bordered, add_slopes, felt_alike, weighted, whole

G, R, K = 5, 4, 2


def symmetric(rng, size):
    A = rng.normal(size=(G, size, size))
    return A + A.transpose(0, 2, 1)


def test_bordered_sums_are_those_of_the_whole():
    rng = np.random.default_rng(3)
    A = symmetric(rng, R + 2 * K)
    inner = whole(A[:, :R, :R])
    once = Bordered(inner, A[:, :R, R : R + K], A[:, R : R + K, R : R + K])
    twice = Bordered(once, A[:, : R + K, R + K :], A[:, R + K :, R + K :])
    weights = rng.normal(size=(3, G))
    expected = np.einsum("pg,gij->pij", weights, A)
    assert twice.shape == (G, R + 2 * K)
    assert_allclose(weighted(twice, weights), expected, atol=1e-12)
    assert_allclose(weighted(whole(A), weights), expected, atol=1e-12)


def test_some_groups_add_to_what_is_there():
    """Each target in place, over a stretch of groups, the others left out."""
    rng = np.random.default_rng(4)
    A = symmetric(rng, R + K)
    stack = Bordered(whole(A[:, :R, :R]), A[:, :R, R:], A[:, R:, R:])
    weights, held = rng.normal(size=(2, 2)), rng.normal(size=(3, R + K, R + K))
    targets = held.copy()
    stack.add_to([targets[2], targets[0]], weights, slice(1, 3))
    assert_allclose(targets[2] - held[2], np.tensordot(weights[0], A[1:3], 1), atol=1e-12)
    assert_allclose(targets[0] - held[0], np.tensordot(weights[1], A[1:3], 1), atol=1e-12)
    assert_allclose(targets[1], held[1])


def test_what_is_common_is_held_once():
    inner = whole(np.ones((G, R, R)))
    grown = [Bordered(inner, np.ones((G, R, K)), np.ones((G, K, K))) for _ in range(3)]
    assert all(stack.inner is inner for stack in grown)


def test_slopes_are_summed_over_the_groups_that_are_felt():
    """Parameters of one part, of another, of both and of none."""
    change = np.zeros((5, 5))
    change[:2, 0], change[1, 1], change[:, 2], change[[0, 1], 4] = 1.0, 2.0, 3.0, (4.0, 5.0)
    felt = {(s.start, s.stop): alike for s, alike in felt_alike(change)}
    assert felt == {(0, 2): [0, 4], (1, 2): [1], (0, 5): [2]}
    A, slopes = symmetric(np.random.default_rng(2), 3), np.ones((5, 3, 3))
    add_slopes(whole(A), change, slopes)
    assert_allclose(slopes, 1 + np.einsum("gp,gij->pij", change, A), atol=1e-12)
