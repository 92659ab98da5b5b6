"""Spinning parts over the modes: exact responses, reversed reciprocity, exact slopes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.effect import SpinTerm
from chladni.reduced.gyroscopic import skew, spin, whirling

M = 7  # modes
S = 2j * np.pi * np.array([9.0, 21.0, 40.0]) * (1 - 0.05j)


def made(h=(0.3, -0.2, 0.9), seed=0):
    """λ, one spinning part over its modes, and places left and right."""
    rng = np.random.default_rng(seed)
    lam = (2 * np.pi * np.sort(rng.uniform(5, 60, M))) ** 2
    beta, left, right = rng.normal(size=(3, M)), rng.normal(size=(4, M)), rng.normal(size=(2, M))
    moved = {1: rng.normal(size=(3, M))}
    term = SpinTerm(None, 20 * np.array(h), np.eye(3), 1)
    return lam, beta, moved, left, right, term


def direct(lam, beta, h, s, left, right):
    """The responses from the whole dynamic stiffness."""
    Z = np.diag(lam + s**2) + s * beta.T @ skew(h) @ beta
    return left @ np.linalg.solve(Z, right.T)


def test_a_spinning_part_acts_on_the_structure_by_h_cross_the_rate_of_rotation():
    h, rate = np.array([0.2, -1.0, 0.5]), np.array([3.0, 1.0, -2.0])
    assert_allclose(-skew(h) @ rate, np.cross(h, rate))


def test_responses_are_those_of_the_whole_dynamic_stiffness():
    lam, beta, _, left, right, term = made()
    part, d = spin([(term, slice(0, 3), beta, {})]), 1 / (lam + S[:, None] ** 2)
    still = np.einsum("or,fr,ir->foi", left, d, right)
    due = np.array([direct(lam, beta, term.momentum, s, left, right) for s in S])
    assert np.abs(due / still - 1).max() > 0.1
    assert_allclose(still + part.seen(S, d, left, right), due, rtol=1e-10)
    assert_allclose(part.passed(S, d, left) @ right.T, due, rtol=1e-10)
    back = part.reverse.passed(S, d, right) @ left.T
    assert_allclose(back.swapaxes(1, 2), due, rtol=1e-10)


def test_force_and_response_change_places_if_all_parts_spin_the_other_way():
    lam, beta, _, left, right, term = made()
    d = 1 / (lam + S[:, None] ** 2)
    other = SpinTerm(None, -term.momentum, term.gradient, 1)
    one, reversed_ = (spin([(t, slice(0, 3), beta, {})]) for t in (term, other))
    there, back = one.seen(S, d, left, right), reversed_.seen(S, d, right, left)
    assert_allclose(there, back.swapaxes(1, 2), rtol=1e-10)
    assert (
        np.abs(there - one.seen(S, d, right, left).swapaxes(1, 2)).max() > 1e-3 * abs(there).max()
    )


@pytest.mark.parametrize("p", range(3))
def test_slopes_are_those_of_differences(p):
    """By each component of h; the second one moves the place too."""
    lam, beta, moved, left, right, term = made()
    part, d = spin([(term, slice(0, 3), beta, moved)]), 1 / (lam + S[:, None] ** 2)
    ends = part.passed(S, d, left), part.reverse.passed(S, d, right)
    found = dict(part.seen_slopes(S, *ends))[p]
    e = 1e-6

    def at(x):
        h = term.momentum + x * np.eye(3)[p]
        rows = beta + x * moved.get(p, 0.0)
        return np.array([direct(lam, rows, h, s, left, right) for s in S])

    assert_allclose(found, (at(e) - at(-e)) / (2 * e), rtol=1e-6, atol=1e-9 * np.abs(found).max())


def test_a_free_wheel_nutates_at_its_momentum_over_its_inertia():
    """I θ'' = h x θ': the tip of the axis turns with h / I (Euler)."""
    inertia, h = 0.02, 0.5
    G = skew(np.array([0.0, 0.0, h]))[:2, :2] / inertia
    omega, _ = whirling(np.zeros(2), G)
    assert omega.max() == pytest.approx(h / inertia)
    assert omega.min() == pytest.approx(0.0, abs=1e-9)


def test_whirling_modes_are_those_of_the_quadratic_problem():
    lam, beta, _, _, _, term = made()
    G = beta.T @ skew(term.momentum) @ beta
    omega, psi = whirling(lam, G)
    left = (np.diag(lam) @ psi) + 1j * omega * (G @ psi) - omega**2 * psi
    assert np.abs(left).max() < 1e-8 * np.abs(lam).max()
