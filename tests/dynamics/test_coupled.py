"""Coupled superposition has two limits: plain superposition and direct inversion."""

import numpy as np
import pytest
import scipy.sparse as sp

from chladni.dynamics.coupled import coupled_receptance
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import transfer
from chladni.dynamics.system import System

from .conftest import inverted

RNG = np.random.default_rng(3)
F = np.linspace(1, 60, 40)


def chain(n=7, damper=0.0):
    K = 1e5 * (np.diag(np.full(n, 2.0)) - np.eye(n, k=1) - np.eye(n, k=-1))
    V = np.zeros((n, n))
    V[2, 2] = damper
    dofs = np.column_stack([np.arange(1, n + 1), np.full(n, 3)])
    return System(*(sp.csr_array(A) for A in (np.diag(RNG.uniform(0.8, 1.2, n)), V, K)), dofs)


@pytest.mark.parametrize("structural", [False, True])
def test_without_dampers_it_is_superposition(structural):
    modal = normal_modes(chain()).with_damping(0.02)
    phi = modal.shapes[[0, 3]]
    plain = transfer(modal, phi, phi, 2j * np.pi * F, structural=structural)
    np.testing.assert_allclose(
        coupled_receptance(modal, phi, phi, F, structural=structural), plain, rtol=1e-10
    )


def test_with_all_modes_it_is_inversion():
    """Dashpot and loss factor together: H = (K (1 + i g) - ω² M + i ω V)⁻¹."""
    system = chain(damper=8.0)
    modal = normal_modes(system)
    rows = np.array([0, 2, 5])
    phi = modal.shapes[rows]
    H = coupled_receptance(modal, phi, phi, F, V=system.V, loss=sp.csr_array(0.03 * system.K))
    exact = inverted(system, rows, rows, F, structural=0.03)
    np.testing.assert_allclose(H, exact, rtol=1e-8)
