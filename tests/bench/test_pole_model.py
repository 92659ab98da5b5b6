"""A system by its poles is the system: its responses, its filters, its steps in time."""

import numpy as np
import pytest
from scipy.linalg import expm

from chladni.errors import ShapeError
from chladni_bench.first_order_hold import STRIDE, HeldRun
from chladni_bench.front_end import PASS, STOP, anti_alias
from chladni_bench.pole_model import PoleFilter, by_poles, filtered


def matrices(n=5, seed=0):
    """Random M, C, K of a structure whose damping is not proportional."""
    rng = np.random.default_rng(seed)
    A, B, D = (rng.normal(size=(n, n)) for _ in range(3))
    M, K = A @ A.T + n * np.eye(n), 400 * (B @ B.T + n * np.eye(n))
    return M, 0.3 * D @ D.T, K


def made(n=5):
    rng = np.random.default_rng(1)
    load = rng.normal(size=(n, 2))
    seen = tuple(rng.normal(size=(3, n)) for _ in range(3))
    through = rng.normal(size=(3, 2))
    return matrices(n), load, seen, through


def test_the_response_is_that_of_the_matrices():
    """P(s) (M s² + C s + K)⁻¹ F + D, on the axis and off it."""
    (M, C, K), F, (Pd, Pv, Pa), D = parts = made()
    s = np.array([3j, 17j, 40j, 2.0 + 9j])
    due = [(Pd + z * Pv + z**2 * Pa) @ np.linalg.solve(M * z**2 + C * z + K, F) + D for z in s]
    np.testing.assert_allclose(by_poles(*parts).response(s), due, rtol=1e-9, atol=1e-12)


def test_overdamped_modes_have_real_poles():
    (M, C, K), F, seen, D = made()
    model = by_poles((M, 100 * C, K), F, seen, D)
    assert (np.abs(model.poles.imag) < 1e-9 * np.abs(model.poles)).any()
    z = 5j
    due = (seen[0] + z * seen[1] + z**2 * seen[2]) @ np.linalg.solve(M * z**2 + 100 * C * z + K, F)
    np.testing.assert_allclose(model.response(np.array([z]))[0], due + D, rtol=1e-8)


def test_a_filter_in_series_is_a_product():
    model, low = by_poles(*made()), anti_alias(64.0)
    s = 2j * np.pi * np.array([1.0, 11.0, 25.0, 70.0])
    due = low.at(s)[:, None, None] * model.response(s)
    np.testing.assert_allclose(filtered(model, low).response(s), due, rtol=1e-6, atol=1e-9)


def test_the_anti_alias_filter_is_flat_and_stops():
    rate = 1024.0
    f = np.linspace(1, 2000, 4000)
    size = np.abs(anti_alias(rate).at(2j * np.pi * f))
    assert 20 * np.log10(size[f < PASS * rate]).min() > -0.06
    assert 20 * np.log10(size[f > 0.5 * rate]).max() < -STOP + 1


def held(model, h, u):
    return HeldRun(model, h).on(u)


def test_steps_are_exact_for_straight_inputs():
    """Against the matrix exponential of the whole system with the input as two more states."""
    (M, C, K), F, seen, D = made()
    model, h, n = by_poles((M, C, K), F, seen, D), 0.02, 40
    rng = np.random.default_rng(5)
    u = rng.normal(size=(2, n))
    k = len(M)
    A = np.zeros((2 * k + 4, 2 * k + 4))
    A[:k, k : 2 * k] = np.eye(k)
    A[k : 2 * k, : 2 * k] = -np.linalg.solve(M, np.hstack([K, C]))
    A[k : 2 * k, 2 * k : 2 * k + 2] = np.linalg.solve(M, F)
    A[2 * k : 2 * k + 2, 2 * k + 2 :] = np.eye(2)
    step, x, last, due = expm(A * h), np.zeros(2 * k + 4), np.zeros(2), []
    for now in u.T:
        x[2 * k : 2 * k + 2], x[2 * k + 2 :] = last, (now - last) / h
        x = step @ x
        z, v = x[:k], x[k : 2 * k]
        a = np.linalg.solve(M, F @ now - C @ v - K @ z)
        due.append(seen[0] @ z + seen[1] @ v + seen[2] @ a + D @ now)
        last = now
    np.testing.assert_allclose(held(model, h, u), np.array(due).T, rtol=1e-8, atol=1e-9)


def test_blocks_carry_on_where_the_last_one_ended():
    model, h = by_poles(*made()), 0.01
    u = np.random.default_rng(2).normal(size=(2, 300))
    run = HeldRun(model, h)
    parts = [run.on(u[:, a:b]) for a, b in ((0, 7), (7, 200), (200, 300))]
    np.testing.assert_allclose(np.hstack(parts), held(model, h, u), rtol=1e-10, atol=1e-12)


def test_outputs_between_states_are_those_of_every_step():
    """States far apart and products between, or a step a sample; every third is every third."""
    model, h = by_poles(*made()), 0.01
    u = np.random.default_rng(3).normal(size=(2, 3 * (STRIDE + 7)))
    run = HeldRun(model, h)
    due = np.hstack([run.on(now[:, None]) for now in u.T])
    np.testing.assert_allclose(held(model, h, u), due, rtol=1e-9, atol=1e-11)
    third = HeldRun(model, h).on(u, 3)
    np.testing.assert_allclose(third, due[:, 2::3], rtol=1e-9, atol=1e-11)
    with pytest.raises(ShapeError, match="no multiple of 2"):
        HeldRun(model, h).on(u[:, :3], 2)


def test_a_curved_input_is_met_to_second_order():
    """The error of the straight line between samples falls as h²."""
    model = by_poles(*made()).inputs([0])
    errors = []
    for n in (200, 400, 800):
        t = np.arange(1, n + 1) * (2.0 / n)
        fine = np.arange(1, 64 * n + 1) * (2.0 / (64 * n))
        rough = held(model, 2.0 / n, np.sin(20 * t)[None])[:, -1]
        exact = held(model, 2.0 / (64 * n), np.sin(20 * fine)[None])[:, -1]
        errors.append(np.abs(rough - exact).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.2)


def test_shapes_are_held_to():
    model = by_poles(*made())
    with pytest.raises(ShapeError, match="poles and feedthrough say"):
        type(model)(model.poles[1:], model.b, model.c, model.d)
    assert PoleFilter(np.array([-1.0 + 0j]), np.array([1.0 + 0j])).at(np.array([0j]))[0] == 1.0
