"""Local forces in time: laws solved exactly, second order in the step, what theory says of each."""

import numpy as np
import pytest

from chladni_bench.bench_rig import bench_rig
from chladni_bench.first_order_hold import HeldRun
from chladni_bench.local_forces import Clearance, CubicSpring, JenkinsSlider
from chladni_bench.local_integration import LocalRun
from chladni_bench.pole_model import by_poles

W, ZETA = 2 * np.pi * 20.0, 0.02


def oscillator(laws=1):
    """m = 1 kg at 20 Hz: inputs a force, then the force of every site; opening = displacement."""
    load, one = np.ones((1, 1 + laws)), np.ones((1, 1))
    matrices = (one, 2 * ZETA * W * one, W**2 * one)
    seen = (np.ones((1 + laws, 1)), np.zeros((1 + laws, 1)), np.zeros((1 + laws, 1)))
    return by_poles(matrices, load, seen, np.zeros((1 + laws, 1 + laws)))


def moved(law, u, h):
    """Displacement and local force under the force u (n,)."""
    model = oscillator()
    f = LocalRun(model.outputs([1]), (law,), h).on(u[None])
    x = HeldRun(model, h).on(np.vstack([u[None], f]))[0]
    return x, f[0]


@pytest.mark.parametrize(
    "law", [Clearance(0.4, 3.0), CubicSpring(5.0), JenkinsSlider(2.0, 0.3)], ids=lambda x: x.name
)
def test_each_law_is_met_at_the_end_of_the_step(law):
    """x = a + S f and f = -law(x), the slider where it was or at its limit."""
    S = 0.7
    for a in np.linspace(-2, 2, 41):
        f, after = law.solve(float(a), S, 0.05)
        x = a + S * f
        if isinstance(law, Clearance):
            assert f == pytest.approx(-law.k * max(x - law.gap, 0), abs=1e-12)
        elif isinstance(law, CubicSpring):
            assert f == pytest.approx(-law.k3 * x**3, rel=1e-9)
        else:
            assert f == pytest.approx(-law.k * (x - after), abs=1e-12)
            assert abs(f) <= law.limit + 1e-12
            assert after == 0.05 or abs(f) == pytest.approx(law.limit)


def test_a_gap_that_never_closes_and_a_slider_that_sticks_are_linear():
    t = np.arange(1, 4001) / 2000
    u = np.sin(2 * np.pi * 17 * t)
    plain = HeldRun(oscillator(), 1 / 2000).on(np.vstack([u, 0 * u]))[0]
    far, none = moved(Clearance(1.0, 1e5), u, 1 / 2000)
    assert not none.any()
    np.testing.assert_allclose(far, plain, atol=1e-15)
    stuck, _ = moved(JenkinsSlider(0.5 * W**2, 1e9), u, 1 / 2000)
    stiff = by_poles(
        (np.ones((1, 1)), 2 * ZETA * W * np.ones((1, 1)), 1.5 * W**2 * np.ones((1, 1))),
        np.ones((1, 1)), (np.ones((1, 1)), np.zeros((1, 1)), np.zeros((1, 1))), np.zeros((1, 1)),
    )  # fmt: skip
    due = HeldRun(stiff, 1 / 2000).on(u[None])[0]
    assert np.abs(stuck - due).max() < 1e-3 * np.abs(due).max()


@pytest.mark.parametrize(
    ("law", "leaves"),
    [(Clearance(2e-3, W**2), 100), (JenkinsSlider(0.5 * W**2, 8e-4 * W**2), 100)],
    ids=lambda x: getattr(x, "name", ""),
)
def test_steps_taken_at_once_are_the_steps_one_by_one(law, leaves):
    """The same recursion to rounding, over blocks of any length, on and off every piece."""
    rng, h, n = np.random.default_rng(0), 1 / 2000, 6000
    u = 0.3 * np.cumsum(rng.normal(size=n)) + 2 * W * np.sin(0.05 * np.arange(n))
    together, alone = (LocalRun(oscillator().outputs([1]), (law,), h) for _ in range(2))
    blocks = [u[None, a:b] for a, b in ((0, 5), (5, 2777), (2777, n))]
    f = np.hstack([together.on(x)[0] for x in blocks])
    due = np.hstack([alone._by_steps(alone.free.on(x))[0] for x in blocks])
    kinks = np.abs(np.diff(due, 2)) > 0.01 * np.abs(due).max()
    assert kinks.sum() > leaves
    np.testing.assert_allclose(f, due, atol=1e-11 * np.abs(due).max())
    np.testing.assert_allclose(together.state, alone.state, rtol=1e-9)


def test_the_scheme_is_of_second_order():
    """A smooth law: halving the step leaves a quarter of the error."""
    T, ends = 0.5, []
    for n in (1000, 2000, 4000, 32000):
        t = np.arange(1, n + 1) * (T / n)
        x, _ = moved(CubicSpring(W**2 / 1e-6), 0.5 * np.sin(W * t), T / n)
        ends.append(x[-1])
    errors = np.abs(np.array(ends[:-1]) - ends[-1])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.35)


def test_a_cubic_spring_raises_the_resonance_by_its_describing_function():
    """ω²(A) = ω_0² + ¾ k3 A² (Nayfeh and Mook 1979): in phase quadrature at that frequency.

    The fundamental of the steady state there is met by harmonic balance to O((¾ k3 A²/ω²)²).
    """
    k3, A = 0.1 * W**2 / 1e-6, 1e-3  # ¾ k3 A² is 7.5 % of the stiffness
    w = np.sqrt(W**2 + 0.75 * k3 * A**2)
    force = 2 * ZETA * W * w * A
    n = 256
    t = np.arange(1, 200 * n + 1) * (2 * np.pi / w / n)
    x, _ = moved(CubicSpring(k3), force * np.cos(w * t), 2 * np.pi / w / n)
    last = slice(-20 * n, None)
    z = 2 * (x[last] * np.exp(-1j * w * t[last])).mean()
    assert abs(z) == pytest.approx(A, rel=5e-3)
    assert np.angle(z) == pytest.approx(-np.pi / 2, abs=0.05)


def test_friction_dissipates_what_the_loop_says():
    """Of a slider driven to an amplitude X: 4 μN (X - μN/k) a cycle."""
    k, limit, X, memory = 100.0, 0.5, 0.02, 0.0
    law, t = JenkinsSlider(k, limit), np.linspace(0, 4 * np.pi, 40001)
    x, f = X * np.sin(t), []
    for a in x:
        force, memory = law.solve(float(a), 0.0, memory)
        f.append(force)
    f = np.array(f)
    half = len(t) // 2
    work = -np.trapezoid(f[half:], x[half:])
    assert work == pytest.approx(4 * limit * (X - limit / k), rel=1e-3)


def test_sites_are_solved_together(small):
    """Two springs at two sites are one linear structure more: against both put into it."""
    k = 2e4
    laws = (JenkinsSlider(k, 1e9), JenkinsSlider(2 * k, 1e9))
    article = small(laws=laws, damping=0.1)
    rig, h = bench_rig(article), 1 / 4096
    angle = 2 * np.pi * 33 * np.arange(1, 8193) * h
    u = np.sin(angle)
    f = LocalRun(rig.openings, laws, h).on(u[None])
    y = HeldRun(rig.measured, h).on(np.vstack([u[None], f]))
    s = 2j * np.pi * np.array([33.0])
    whole = rig.model.response(s)[0]
    n = 1 + len(article.outputs)
    x = np.linalg.solve(np.eye(2) + whole[n:, 1:] @ np.diag([k, 2 * k]), whole[n:, 0])
    due = whole[:n, 0] - whole[:n, 1:] @ (np.array([k, 2 * k]) * x)
    late = slice(-2048, None)
    A = np.column_stack([np.sin(angle), np.cos(angle)])[late]
    got = np.linalg.lstsq(A, y[:, late].T, rcond=None)[0]
    size = np.abs(due).max()
    assert np.abs(got[0] + 1j * got[1] - due).max() < 0.01 * size
