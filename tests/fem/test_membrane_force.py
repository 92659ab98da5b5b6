"""The stiffness of a membrane force against plates, strings, buckling and rigid motions."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.system import System
from chladni.fem.assemble import structure
from chladni.fem.energy import rigid_motions
from chladni.fem.membrane_force import geometric_stiffness, membrane_force
from chladni.model.assembly import Shells
from chladni_specimens.plates import STEEL, plate

A, B, T = 0.4, 0.3, 1e-3
X, Y, ROUND = np.diag([1.0, 0, 0]), np.diag([0, 1.0, 0]), np.eye(3)
D = STEEL.E * T**3 / 12 / (1 - STEEL.nu**2)


def triangles(assembly):
    """Every quadrilateral cut along a diagonal."""
    s = assembly.shells
    halves = [s.nodes[:, [0, 1, 2, 2]], s.nodes[:, [0, 2, 3, 3]]]
    twice = {k: np.concatenate([v, v]) for k, v in vars(s).items() if k not in ("nodes", "ids")}
    cut = Shells(ids=np.arange(1, 2 * len(s) + 1), nodes=np.concatenate(halves), **twice)
    return replace(assembly, shells=cut)


def held(assembly, edges):
    """Points at these edges held across the sheet, all of them in it and against drilling."""
    x, y = assembly.points[:, 0], assembly.points[:, 1]
    rim = ((np.abs(x - x.min()) < 1e-9) | (np.abs(x - x.max()) < 1e-9)) & ("x" in edges)
    rim |= ((np.abs(y - y.min()) < 1e-9) | (np.abs(y - y.max()) < 1e-9)) & ("y" in edges)
    every = np.arange(len(x))
    flat = [(r, c) for c in (1, 2, 6) for r in every]
    return replace(assembly, supports=np.array([*flat, *((r, 3) for r in every[rim])]))


def ends(assembly, tensor):
    """Points at the edges where the force pulls."""
    X = assembly.points[:, :2]
    at = (np.abs(X - X.min(axis=0)) < 1e-9) | (np.abs(X - X.max(axis=0)) < 1e-9)
    return np.flatnonzero((at & (np.diag(tensor)[:2] > 0)).any(axis=1))


def with_force(assembly, tensor, N):
    """The system with N times the unit force over all of its sheet."""
    built = structure(assembly)
    force = membrane_force(assembly, np.arange(len(assembly.shells)), tensor)
    s, K = built.system, geometric_stiffness(built, force, ends(assembly, tensor))
    return System(s.M, s.V, s.K + N * K, s.dofs)


def lowest(system, count=6):
    return (2 * np.pi * normal_modes(system, count).frequency) ** 2


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("tensor", [X, Y, ROUND])
def test_energy_of_a_wave_to_second_order(cut, tensor):
    """∫ (∂w/∂x)² dA = k_x² AB/4 of sin k_x x sin k_y y; the error falls as h²."""
    off = []
    for n in (24, 48):
        made = plate(A, B, n, 3 * n // 4, T)
        made = triangles(made) if cut else made
        net = membrane_force(made, np.arange(len(made.shells)), tensor).net
        for waves in ((2, 1), (1, 3)):
            k = np.array(waves) * np.pi / (A, B)
            w = np.prod(np.sin(made.points[:, :2] * k), axis=1)
            off.append(w @ (net @ w) / (k**2 @ np.diag(tensor)[:2] * A * B / 4) - 1)
    assert_allclose(np.array(off[:2]) / off[2:], 4, rtol=0.05)


@pytest.mark.parametrize(("tensor", "N"), [(X, 2000.0), (Y, -900.0), (ROUND, 1500.0)])
def test_simply_supported_plate_by_theory(tensor, N):
    """ω² = ω_0² + (N_x k_x² + N_y k_y²) / ρt of every mode sin k_x x sin k_y y."""
    made = held(plate(A, B, 24, 18, T), "xy")
    k = np.array([(m * np.pi / A, n * np.pi / B) for m in range(1, 5) for n in range(1, 4)]) ** 2
    free = D * k.sum(axis=1) ** 2 / (STEEL.rho * T)
    due = k @ np.diag(tensor)[:2] * N / (STEEL.rho * T)
    pulled = lowest(with_force(made, tensor, N))
    assert_allclose(pulled, np.sort(free + due)[:6], rtol=0.02)
    rise = pulled[0] - lowest(with_force(made, tensor, 0.0))[0]
    assert_allclose(rise, due[0], rtol=0.01)


def test_string_where_the_sheet_has_no_stiffness_of_its_own():
    """f_n = n/2L √(N/ρt) of a strip held at its ends, t → 0."""
    t, N, L = 1e-6, 500.0, 1.0
    strip = held(plate(L, 0.02, 60, 1, t), "x")
    f = normal_modes(with_force(strip, X, N), 30).frequency
    due = np.arange(1, 4) / (2 * L) * np.sqrt(N / (STEEL.rho * t))
    near = np.array([f[np.abs(f / d - 1).argmin()] for d in due])
    assert_allclose(near, due, rtol=0.003)


def test_buckles_where_theory_says():
    """N_cr = 4π² D / b² of a square plate pressed along one side: the lowest λ is nothing there."""
    square = held(plate(A, A, 20, 20, T), "xy")
    cr = -4 * np.pi**2 * D / A**2
    lam = [lowest(with_force(square, X, f * cr))[0] for f in (0.0, 0.5, 0.98)]
    assert_allclose(np.array(lam) / lam[0], [1.0, 0.5, 0.02], atol=0.012)


@pytest.mark.parametrize("tensor", [X, ROUND])
@pytest.mark.parametrize("rim", [[0, 8, 54, 62], [0, 3, 20, 40, 62]])
def test_rigid_motions_cost_nothing_and_no_pull_gives_way(tensor, rim):
    """Whatever grids the pulls turn with, of quadrilaterals and triangles, flat and curved."""
    flat = triangles(plate(A, B, 8, 6, T))
    x, y, _ = flat.points.T
    domed = replace(flat, points=np.column_stack([x, y, 0.3 * x * y + 0.2 * x**2]))
    for made in (flat, domed, plate(A, B, 8, 6, T)):
        built = structure(made)
        force = membrane_force(made, np.arange(len(made.shells)), tensor)
        K = geometric_stiffness(built, force, np.array(rim))
        R = sl.lstsq(built.T.toarray(), rigid_motions(made))[0]
        assert np.abs(K @ R).max() < 1e-12 * np.abs(K).max()
        assert np.linalg.eigvalsh(K.toarray())[0] > -1e-12 * np.abs(K).max()


def test_even_slope_costs_force_times_area():
    """½ N A of w = x, whatever the mesh."""
    made = plate(A, B, 5, 4, T)
    force = membrane_force(made, np.arange(len(made.shells)), X)
    w = made.points[:, 0]
    assert_allclose(w @ (force.net @ w), A * B, rtol=1e-12)
    assert_allclose(made.points[:, 1] @ (force.net @ w), 0, atol=1e-15)
