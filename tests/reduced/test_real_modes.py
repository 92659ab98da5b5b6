"""Modes of a reduced model keep their digits beside something a trillion times as stiff."""

import numpy as np
import pytest
import scipy.linalg as sl

from chladni.reduced.real_modes import real_modes


@pytest.mark.parametrize("stiff", [0.0, 1e18])
def test_soft_modes_keep_their_digits(stiff):
    """A spring along one direction; rigid beside it: what is left of K and M where that is held."""
    rng = np.random.default_rng(3)
    n = 12
    a, M = rng.normal(size=(n, n)), np.eye(n)
    K = 1e4 * (a @ a.T)
    e = np.eye(n)[4]
    lam, phi = real_modes(K + stiff * np.outer(e, e), M)
    if not stiff:
        due = sl.eigvalsh(K)
    else:
        rest = np.delete(np.arange(n), 4)
        free = K[np.ix_(rest, rest)] - np.outer(K[rest, 4], K[4, rest]) / (stiff + K[4, 4])
        due = sl.eigvalsh(free)
    assert lam[: len(due)] == pytest.approx(due, rel=1e-9)
    assert phi.T @ M @ phi == pytest.approx(np.eye(n), abs=1e-9)
