"""Slopes of a stiffness that rises with frequency are those by differences, whatever its band."""

import numpy as np
import pytest
import scipy.linalg as sl
from numpy.testing import assert_allclose

from chladni.effects.effect import MatrixTerm, Rise
from chladni.reduced.frequency_dependent_stiffness import Rising
from chladni.reduced.matrix_slopes import MatrixSlopes

R, X = 8, np.array([0.3, 0.2, 0.1])  # coefficient, power, and a parameter of the rest
RNG = np.random.default_rng(6)
HERTZ = np.linspace(20, 160, R)
B = RNG.normal(size=(R, 2))
OPERATOR = 2e4 * B @ B.T
SOFT = (lambda A: 1e4 * (A + A.T))(RNG.normal(size=(R, R)))
HEAVY = (lambda A: 0.02 * (A + A.T))(RNG.normal(size=(R, R)))


def risen(x, top, gradient=False):
    """The state with the rise at x; the band ends at ``top`` Hz."""
    rise = Rise(x[1], np.array([0.0, 1.0]), 60.0, (10.0, top), 0.4, np.array([0.0, 0.5]))
    part = MatrixTerm("K", None, x[0], np.array([1.0, 0.0]), rise)
    K = np.diag((2 * np.pi * HERTZ) ** 2) + x[0] * OPERATOR + x[2] * SOFT
    M = np.eye(R) + x[2] * HEAVY
    lam, phi = sl.eigh(K, M)
    dK, dM = MatrixSlopes(3), MatrixSlopes(3)
    dK.add_operator(OPERATOR, np.eye(3)[0])
    dK.add_operator(SOFT, np.eye(3)[2])
    dM.add_operator(HEAVY, np.eye(3)[2])
    rising = Rising()
    rising.add(part, OPERATOR, slice(0, 2))
    return rising.over_basis(lam, phi, dK, dM, M, gradient)


@pytest.mark.parametrize("top", [90.0, 400.0], ids=["some modes above", "all modes within"])
def test_slopes_are_those_by_differences(top):
    state, h = risen(X, top, True), 1e-5
    slope = state.dK.along(state.phi) - state.lam * state.dM.along(state.phi)
    seen = state.lam < (2 * np.pi * 2 * top) ** 2
    for p, e in enumerate(h * np.eye(3)):
        above, below = risen(X + e, top), risen(X - e, top)
        due = (above.lam - below.lam) / (2 * h)
        assert_allclose(slope[p], due, atol=1e-5 * np.abs(state.lam).max())
        due = (above.dissipated.ratio - below.dissipated.ratio) / (2 * h)
        if p != 1:  # the loss is held at 0.4 here
            size = np.abs(state.dissipated.slopes).max()
            assert_allclose(state.dissipated.slopes[p, seen], due[seen], atol=1e-4 * size)
