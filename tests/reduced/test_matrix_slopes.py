"""Slopes multiply vectors as the matrices that nobody assembles."""

from types import SimpleNamespace

import numpy as np
from numpy.testing import assert_allclose

from chladni.reduced.matrix_slopes import MatrixSlopes, spanned
from chladni.reduced.matrix_stack import stacked

P, M, R = 3, 7, 5  # parameters; dofs, those of effects last
RNG = np.random.default_rng(8)
Z = RNG.normal(size=(M, 4))


def test_parts_add_to_their_parameters_alone():
    A = RNG.normal(size=(2, R, R))
    A, B = A + A.swapaxes(1, 2), np.diag(np.arange(1.0, M + 1))
    b, c, db = RNG.normal(size=(2, M)), RNG.normal(size=2), RNG.normal(size=(2, M))
    change = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 3.0]])
    gradient = RNG.normal(size=(2, 2))
    slopes, due = MatrixSlopes(P), np.zeros((P, M, M))
    slopes.add_groups(stacked(A), change)
    slopes.add_operator(B, np.array([0.0, 5.0, 0.0]))
    slopes.add_points(b, gradient, slice(1, 3), {1: db}, c)
    due[:, :R, :R] = np.einsum("gp,gij->pij", change, A)
    due[1] += 5 * B
    due[1:] += np.einsum("ki,kp,kj->pij", b, gradient, b)
    half = (b.T * c) @ db
    due[2] += half + half.T
    assert_allclose(slopes.times(Z), due @ Z, atol=1e-12)
    assert_allclose(slopes.along(Z), np.einsum("ik,pij,jk->pk", Z, due, Z), atol=1e-11)


def test_few_vectors_span_neighbouring_lines():
    """Y = Q C to ten digits of each column, whatever its size; real vectors, complex columns."""
    s = (0.08 + 1j) * np.geomspace(1.0, 3.0, 60)
    poles, size = np.linspace(0.5, 30.0, 40), 10.0 ** np.arange(60)
    Y = size / (poles[:, None] ** 2 + s**2)
    Q, C = spanned(Y)
    assert Q.shape[1] < 30
    assert_allclose(Q.T @ Q, np.eye(Q.shape[1]), atol=1e-12)
    assert_allclose(Q @ C / size, Y / size, atol=1e-8)


def test_the_last_parameters_alone_have_the_same_slopes():
    """Of sums, of scaled and of transformed slopes; what moves none of them is left out."""
    A = RNG.normal(size=(2, R, R))
    A, G = A + A.swapaxes(1, 2), RNG.normal(size=(M, M))
    inner, slopes = MatrixSlopes(P), MatrixSlopes(P)
    inner.add_groups(stacked(A), np.array([[1.0, 0.0, 0.0], [2.0, 3.0, 0.0]]))
    inner.add_points(RNG.normal(size=(2, M)), RNG.normal(size=(2, 1)), slice(2, 3), {}, np.ones(2))
    slopes.add_scaled(inner.transformed(lambda z: G @ z, lambda y: G.T @ y), 0.7)
    slopes.add_half(2, RNG.normal(size=(M, 2)), np.arange(3), RNG.normal(size=(2, 3)))
    slopes.add_operator(np.eye(M), np.array([1.0, 0.0, 2.0]))
    for k in (1, 2, P):
        few = slopes.of_last(k)
        assert few.count == k
        assert_allclose(few.times(Z), slopes.times(Z)[P - k :], atol=1e-12)

    def refused(z):
        raise AssertionError("multiplied for nothing")

    dear = MatrixSlopes(P)
    dear.add_groups(SimpleNamespace(shape=(1, R), times=refused), np.array([[1.0, 1.0, 0.0]]))
    assert not dear.of_last(1).times(Z).any()
