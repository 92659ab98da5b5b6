"""Gramians in closed form against Lyapunov, balancing against its definition, actuators."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_lyapunov

from chladni.dynamics.modes import ModalModel
from chladni.dynamics.statespace import StateSpace, state_space
from chladni.errors import AccuracyError, ShapeError
from chladni_planning import (
    balanced,
    best_actuators,
    condition,
    controllability_gramian,
    driving_point_residue,
    gramian_quotient,
    gramians,
    hankel_values,
    modal_rank,
    observability_gramian,
    ranked_actuators,
    rattle_margin,
    shaking,
)

QUANTITIES = ["receptance", "mobility", "accelerance"]


def specimen(r=5, n_out=4, n_in=2, seed=0):
    rng = np.random.default_rng(seed)
    f = np.sort(rng.uniform(20, 200, r))
    zeta = rng.uniform(0.003, 0.03, r)
    return f, zeta, rng.normal(size=(n_out, r)), rng.normal(size=(n_in, r))


def system(f, zeta, phi_out, phi_in, quantity="receptance"):
    modal = ModalModel(f, zeta, np.zeros((0, len(f))), np.zeros((0, 2), dtype=int))
    names = [[f"{k}:+Z" for k in range(len(p))] for p in (phi_out, phi_in)]
    return state_space(modal, phi_out, phi_in, outputs=names[0], inputs=names[1], quantity=quantity)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(QUANTITIES))
def test_closed_form_solves_the_lyapunov_equations(seed, quantity):
    f, zeta, phi_out, phi_in = specimen(seed=seed)
    ss = system(f, zeta, phi_out, phi_in, quantity)
    Wc = solve_continuous_lyapunov(ss.A, -ss.B @ ss.B.T)
    Wo = solve_continuous_lyapunov(ss.A.T, -ss.C.T @ ss.C)
    close = {"rtol": 1e-7, "atol": 0}
    scale = lambda W: np.sqrt(np.outer(np.diag(W), np.diag(W)))  # noqa: E731
    for ours, theirs in (
        (controllability_gramian(f, zeta, phi_in), Wc),
        (observability_gramian(f, zeta, phi_out, quantity), Wo),
    ):
        np.testing.assert_allclose(1 + ours / scale(theirs), 1 + theirs / scale(theirs), **close)


def test_one_mode_is_the_textbook():
    """W_c = b²/(4 ζ ω³) I for a single mode, so σ = |b c| / (4 ζ ω²) twice (Gregory 1984)."""
    f, zeta, b, c = np.array([10.0]), np.array([0.02]), np.array([[3.0]]), np.array([[2.0]])
    omega = 2 * np.pi * f[0]
    np.testing.assert_allclose(
        controllability_gramian(f, zeta, b), 9 / (4 * 0.02 * omega**3) * np.eye(2)
    )
    sigma = hankel_values(controllability_gramian(f, zeta, b), observability_gramian(f, zeta, c))
    np.testing.assert_allclose(sigma, 6 / (4 * 0.02 * omega**2), rtol=0.05)


def test_rigid_or_undamped_modes_are_refused():
    f, zeta, phi, _ = specimen()
    with pytest.raises(ShapeError, match="rigid or undamped"):
        controllability_gramian(np.r_[0.0, f[1:]], zeta, phi)
    with pytest.raises(ShapeError, match="rigid or undamped"):
        observability_gramian(f, 0 * zeta, phi)


@pytest.mark.parametrize("quantity", ["receptance", "mobility"])
def test_balanced_realisation(quantity):
    """Both gramians, solved anew by scipy, are diag(σ); the FRF and the Hankel values stay."""
    f, zeta, phi_out, phi_in = specimen(seed=4)
    ss = system(f, zeta, phi_out, phi_in, quantity)
    new = balanced(ss)
    A, B, C = new.system.A, new.system.B, new.system.C
    for W in (solve_continuous_lyapunov(A, -B @ B.T), solve_continuous_lyapunov(A.T, -C.T @ C)):
        np.testing.assert_allclose(
            W / new.hankel[0], np.diag(new.hankel / new.hankel[0]), atol=1e-8
        )
    lines = np.linspace(10, 220, 50)
    np.testing.assert_allclose(new.system.frf(lines).values, ss.frf(lines).values, rtol=1e-6)
    np.testing.assert_allclose(hankel_values(*gramians(ss)), new.hankel, rtol=1e-6)


def test_hankel_values_do_not_depend_on_coordinates():
    """Gramians do (Echaniz Granado 2015, section 2.4.2.2), Hankel values do not."""
    f, zeta, phi_out, phi_in = specimen(seed=5)
    ss = system(f, zeta, phi_out, phi_in)
    T = np.random.default_rng(1).normal(size=ss.A.shape) + 3 * np.eye(len(ss.A))
    inverse = np.linalg.inv(T)
    other = StateSpace(
        inverse @ ss.A @ T, inverse @ ss.B, ss.C @ T, ss.D, ss.outputs, ss.inputs, ss.quantity
    )
    assert gramian_quotient(gramians(other)[1]) != pytest.approx(gramian_quotient(gramians(ss)[1]))
    np.testing.assert_allclose(
        hankel_values(*gramians(other)), hankel_values(*gramians(ss)), rtol=1e-5
    )


def test_an_unseen_state_has_no_balanced_realisation():
    f, zeta, phi_out, phi_in = specimen()
    phi_out[:, 2] = 0
    with pytest.raises(AccuracyError, match="not both observable and controllable"):
        balanced(system(f, zeta, phi_out, phi_in))


def test_rank_is_that_of_the_observability_matrix():
    """Kalman's matrix in scaled time, on a system small enough for it."""
    f, zeta, phi_out, phi_in = specimen(r=3)
    phi_out[:, 1] = 0
    ss = system(f, zeta, phi_out, phi_in)
    A = ss.A / np.abs(ss.A).max()
    kalman = np.vstack([ss.C @ np.linalg.matrix_power(A, k) for k in range(6)])
    assert modal_rank(f, phi_out) == np.linalg.matrix_rank(kalman) == 4


def test_twin_poles_need_two_sensors():
    """One sensor cannot tell two modes of one frequency; two sensors can (PBH)."""
    f, phi = np.array([10.0, 10.0, 20.0]), np.random.default_rng(0).normal(size=(2, 3))
    assert modal_rank(f, phi[:1]) == 4
    assert modal_rank(f, phi) == 6


def test_quotient_in_coordinates_of_displacement_and_velocity():
    """With states (η, η') the velocity entries are smaller by ω²."""
    f, zeta, phi_out, _ = specimen()
    W = observability_gramian(f, zeta, phi_out)
    diagonal = np.r_[np.diag(W)[::2], np.diag(W)[1::2] / (2 * np.pi * f) ** 2]
    assert gramian_quotient(W, f) == pytest.approx(diagonal.max() / diagonal.min())


def test_actuator_condition_is_that_of_its_system():
    """Each candidate's figure by scipy's gramians, one system at a time (Echaniz Granado 2015)."""
    f, zeta, phi_out, phi_in = specimen(n_in=6, seed=8)
    ours = shaking(f, zeta, phi_out, phi_in).conditions()
    for k in range(6):
        sigma = hankel_values(*gramians(system(f, zeta, phi_out, phi_in[k : k + 1])))
        assert ours[k] == pytest.approx(sigma[0] / sigma[-1], rel=1e-5)


def test_an_actuator_on_a_node_is_last():
    f, zeta, phi_out, phi_in = specimen(n_in=6, seed=9)
    phi_in[2, 1] = 0
    ranking = ranked_actuators(shaking(f, zeta, phi_out, phi_in), f, phi_in)
    assert ranking.order[-1] == 2
    assert ranking.condition[2] == np.inf
    assert ranking.residue[2] == 0


def test_veto_puts_the_best_behind_all_others():
    f, zeta, phi_out, phi_in = specimen(n_in=6, seed=10)
    shaker = shaking(f, zeta, phi_out, phi_in)
    best = ranked_actuators(shaker, f, phi_in).order[0]
    margin = np.full(6, 2.0)
    margin[best] = 0.5
    ranking = ranked_actuators(shaker, f, phi_in, margin=margin)
    assert ranking.order[-1] == best
    assert not ranking.allowed[best]


def test_a_clamp_shakes_nothing_though_it_never_rattles():
    f, zeta, phi_out, phi_in = specimen(n_in=6, seed=10)
    phi_in[4] = 0.0
    margin = np.full(6, 0.5)
    margin[4] = np.inf
    ranking = ranked_actuators(shaking(f, zeta, phi_out, phi_in), f, phi_in, margin=margin)
    assert not ranking.allowed.any()
    assert ranking.order[-1] == 4


@pytest.mark.parametrize("exhaustive", [2000, 1])
def test_several_actuators(exhaustive):
    """Exchange comes near what trying every pair finds."""
    f, zeta, phi_out, phi_in = specimen(r=4, n_in=9, seed=11)
    shaker = shaking(f, zeta, phi_out, phi_in)
    two = best_actuators(shaker, 2, exhaustive=exhaustive, even=True)
    every = min(shaker.condition([i, j]) for i in range(9) for j in range(i))
    assert shaker.condition(two) <= 1.2 * every
    if exhaustive > 1:
        assert shaker.condition(two) == pytest.approx(every)


def test_a_place_where_nothing_moves_is_last_however_evenly_it_drives():
    """A hundredth of a shape is a hundredth of its Hankel values, at the same condition number."""
    f, zeta, phi_out, phi_in = specimen(n_in=6, seed=10)
    before = ranked_actuators(shaking(f, zeta, phi_out, phi_in), f, phi_in)
    k = before.order[0]
    phi_in[k] *= 0.01
    shaker = shaking(f, zeta, phi_out, phi_in)
    ranking = ranked_actuators(shaker, f, phi_in)
    assert ranking.condition[k] == pytest.approx(before.condition[k])
    assert ranking.weakest[k] < 0.05
    assert ranking.order[-1] == k
    assert best_actuators(shaker, 1) == before.order[1]
    assert best_actuators(shaker, 1, even=True) == k


def test_a_second_actuator_frees_a_mode_the_first_cannot_drive():
    f, zeta, phi_out, phi_in = specimen(r=3, n_in=2, seed=12)
    phi_in[0, 0] = phi_in[1, 2] = 0
    shaker = shaking(f, zeta, phi_out, phi_in)
    assert np.isinf(shaker.conditions()).all()
    assert np.isfinite(shaker.condition([0, 1]))


def test_too_many_actuators_are_refused():
    f, zeta, phi_out, phi_in = specimen(n_in=3)
    with pytest.raises(ShapeError, match="2 candidates are allowed"):
        best_actuators(shaking(f, zeta, phi_out, phi_in), 3, np.array([True, True, False]))


def test_rattle_is_the_peak_of_the_response():
    """The margin is clearance over the peak of |H| F across the gap, one mode at a time."""
    f, zeta, phi, gap = np.array([30.0]), 0.01, np.array([[0.7], [0.2]]), np.array([[0.5]])
    omega = 2 * np.pi * np.linspace(28, 32, 20001)
    H = 0.7 * 0.5 / ((2 * np.pi * 30) ** 2 - omega**2 + 2j * zeta * 2 * np.pi * 30 * omega)
    margin = rattle_margin(f, zeta, phi, gap, np.array([1e-4]), 3.0)
    assert margin[0] == pytest.approx(1e-4 / np.abs(3 * H).max(), rel=1e-3)
    assert margin[1] == pytest.approx(margin[0] * 0.7 / 0.2)


def test_driving_point_residue_is_that_of_the_receptance():
    """Near a lightly damped resonance H_ii ≈ φ² / (2ω) / (i (ω_r - ω) ...): the pole's residue."""
    f, phi = np.array([12.0]), np.array([[0.4]])
    zeta = 1e-6
    pole = 2 * np.pi * 12 * (-zeta + 1j * np.sqrt(1 - zeta**2))
    s = pole * (1 + 1e-5)
    H = 0.4**2 / (s**2 + 2 * zeta * 2 * np.pi * 12 * s + (2 * np.pi * 12) ** 2)
    assert abs(H * (s - pole)) == pytest.approx(driving_point_residue(f, phi)[0, 0], rel=1e-4)


def test_condition_of_a_dead_system_is_infinite():
    assert condition(np.array([1.0, 0.0])) == np.inf
