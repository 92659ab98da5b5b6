import numpy as np
import pytest
import scipy.sparse as sp

from chladni.dynamics.system import System


def line(n, free=True, k=1e5, m=1.0, first=1):
    """n masses in a row on springs: ω_r = 2 √(k/m) sin(r π / 2n) when free."""
    main = np.full(n, 2.0)
    if free:
        main[[0, -1]] = 1.0
    K = k * sp.diags_array([main, -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1])
    M = m * sp.eye_array(n)
    dofs = np.c_[np.arange(first, first + n), np.full(n, 3)]
    return System(sp.csr_array(M), sp.csr_array((n, n)), sp.csr_array(K), dofs)


def line_frequency(n, r, k=1e5, m=1.0):
    """Hz of the r-th mode (0: rigid) of the free line."""
    return 2 * np.sqrt(k / m) * np.sin(np.asarray(r) * np.pi / (2 * n)) / (2 * np.pi)


def inverted(system, rows_out, rows_in, frequency, structural=0.0):
    """Receptance (K (1 + i g) - ω² M + i ω V)⁻¹, line by line (n_f, n_out, n_in)."""
    M, V, K = (A.toarray() for A in (system.M, system.V, system.K * (1 + 1j * structural)))
    omega = 2 * np.pi * np.asarray(frequency)[:, None, None]
    return np.linalg.inv(K - omega**2 * M + 1j * omega * V)[:, rows_out][:, :, rows_in]


@pytest.fixture
def chain():
    return line(10, free=False)
