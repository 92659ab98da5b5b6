"""Describing functions against the integral that defines them, their limits, and time."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.ema.describing_functions import cubic, drag, gap_spring, micro_slip, slider

A = np.array([0.3, 1.0, 1.7, 6.0])


def loops(force, amplitude, n=20000):
    """κ by the definition: (1/πA) ∮ f e^(-iθ) dθ over the second of two cycles."""
    theta = 2 * np.pi * np.arange(2 * n) / n
    f = force(amplitude * np.cos(theta))[n:]
    turn = theta[:n]
    real, imag = 2 * np.mean(f * np.cos(turn)), -2 * np.mean(f * np.sin(turn))
    return (real + 1j * imag) / amplitude


def sliding(k, slip):
    """A spring in series with a slider, sample by sample; it starts stuck at rest."""

    def force(x):
        f, out = 0.0, np.empty_like(x)
        for i, dx in enumerate(np.diff(x, prepend=0.0)):
            f = min(max(f + k * dx, -k * slip), k * slip)
            out[i] = f
        return out

    return force


@pytest.mark.parametrize("amplitude", A)
def test_springs_are_their_integrals(amplitude):
    due = loops(lambda x: 2.5 * x**3, amplitude)
    assert_allclose(cubic(np.array([amplitude]), 2.5), due, rtol=1e-9)
    play = loops(lambda x: 3.0 * np.sign(x) * np.maximum(np.abs(x) - 0.9, 0), amplitude)
    assert_allclose(gap_spring(np.array([amplitude]), 3.0, 0.9), play, rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("amplitude", A)
def test_a_slider_is_its_loop(amplitude):
    due = loops(sliding(3.0, 0.8), amplitude)
    assert_allclose(slider(np.array([amplitude]), 3.0, 0.8), [due], rtol=2e-3, atol=2e-3)


def test_a_slider_sticks_at_first_and_then_dissipates_what_coulomb_says():
    k, slip = 4.0, 0.5
    assert_allclose(slider(np.array([0.1, 0.5]), k, slip), k)
    kappa = slider(A[1:], k, slip)
    assert_allclose(np.pi * A[1:] ** 2 * kappa.imag, 4 * k * slip * (A[1:] - slip))
    assert abs(slider(np.array([1e6]), k, slip)[0]) < 1e-4


def test_a_gap_opens_nothing_within_its_play_and_is_a_spring_far_beyond():
    assert_allclose(gap_spring(np.array([0.2, 0.9]), 3.0, 0.9), 0, atol=1e-15)
    assert_allclose(gap_spring(np.array([1e4]), 3.0, 0.9), 3.0, rtol=2e-4)


@pytest.mark.parametrize("n", [0.4, 1.0])
def test_micro_slip_is_a_crowd_of_sliders(n):
    """Sliders of density ρ(φ) = φ^(n-1): backbone K F(x) = K x - c x^(n+1), loops by Masing."""
    phi = (np.arange(400) + 0.5) / 400 * 20.0
    each = phi ** (n - 1) * 20.0 / 400  # stiffness of every slider, slip at phi
    amplitude = np.array([2.0, 4.0, 8.0])
    crowd = sum(slider(amplitude, k, s) for k, s in zip(each, phi, strict=True))
    c = 1 / (n * (n + 1))  # F'' = -ρ(x): the backbone is behind by ∬ρ
    due = micro_slip(amplitude, c, n)
    assert_allclose(crowd.imag, due.imag, rtol=0.05)
    lost = crowd.real - each.sum()
    step = lambda x: x[1:] - x[:-1]  # noqa: E731 - the density's pole at 0 cuts off a constant
    assert_allclose(step(lost), step(due.real), rtol=0.05)


@pytest.mark.parametrize("n", [0.4, 1.0, 1.6])
def test_micro_slip_is_masings_loop(n):
    """Unloading from A: f = F(A) - 2 F((A - x)/2), with F = -c xⁿ⁺¹; the rest by symmetry."""

    def masing(x):
        top, half = np.abs(x).max(), len(x) // 4
        back = lambda y: -2.0 * np.abs(y) ** (n + 1)  # noqa: E731
        down = back(top) - 2 * back((top - x[:half]) / 2)
        return np.tile(np.concatenate([down, -down]), 2)

    for amplitude in A:
        due = loops(masing, amplitude)
        assert_allclose(micro_slip(np.array([amplitude]), 2.0, n), [due], rtol=1e-3)


def test_drag_dissipates_what_the_air_takes():
    """f = b v|v| takes 8/3 b ω² A³ a cycle."""
    b, omega = 0.3, 5.0
    kappa = drag(A, 8 / (3 * np.pi) * b * omega**2, 1.0)
    assert_allclose(np.pi * A**2 * kappa.imag, 8 / 3 * b * omega**2 * A**3)
