"""Residual vectors: what they span, and that they leave complete modes alone."""

import numpy as np
import pytest
import scipy.sparse as sp

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.residual import with_residual_vectors
from chladni.dynamics.system import System


def chain(n=8, free=False):
    """Equal masses and springs in a row, held at one end or at none."""
    K = sp.diags_array(
        [np.full(n - 1, -1.0), np.full(n, 2.0), np.full(n - 1, -1.0)], offsets=(-1, 0, 1)
    )
    K = K.tolil()
    K[n - 1, n - 1] = 1.0
    if free:
        K[0, 0] = 1.0
    dofs = np.column_stack([np.arange(1, n + 1), np.ones(n, int)])
    M = sp.csr_array(sp.eye_array(n))
    return System(M, sp.csr_array((n, n)), sp.csr_array(K), dofs)


@pytest.mark.parametrize("free", [False, True])
def test_vectors_are_modes_of_their_own_kind(free):
    """ΦᵀMΦ = 1 and ΦᵀKΦ = Λ with the residual vectors among Φ."""
    s = chain(free=free)
    P = np.eye(8)[:, [7, 3]]
    full = with_residual_vectors(s, normal_modes(s, 3), P)
    assert len(full) == 5
    lam = (2 * np.pi * full.frequency) ** 2
    np.testing.assert_allclose(full.shapes.T @ (s.M @ full.shapes), np.eye(5), atol=1e-9)
    np.testing.assert_allclose(full.shapes.T @ (s.K @ full.shapes), np.diag(lam), atol=1e-5)
    assert np.all(np.diff(full.frequency) > -1e-9)


def test_static_answer_is_exact():
    """Σ φφᵀp/λ = K⁻¹p: at 0 Hz nothing is missing, whatever was left out."""
    s, p = chain(), np.eye(8)[:, [7]]
    few = normal_modes(s, 2)
    full = with_residual_vectors(s, few, p)
    u = full.shapes @ ((full.shapes.T @ p) / ((2 * np.pi * full.frequency) ** 2)[:, None])
    np.testing.assert_allclose(u, np.linalg.solve(s.K.toarray(), p), rtol=1e-5)


def test_complete_modes_get_none():
    s = chain(4)
    assert len(with_residual_vectors(s, normal_modes(s, 4), np.eye(4)[:, [1]])) == 4


def test_loads_that_repeat_one_another_count_once():
    s, p = chain(), np.eye(8)[:, [7]]
    few = normal_modes(s, 2)
    assert len(with_residual_vectors(s, few, np.hstack([p, 3 * p]))) == 3
