"""What is coupled to an article does what the theory of each part says."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.errors import ShapeError
from chladni_bench.accelerometers import AccelerometerType, drawn_gains, shown
from chladni_bench.bench_rig import BenchSetup, bench_rig
from chladni_bench.cords import INNER, THESIS, cord, cord_matrices, cords_for
from chladni_bench.shaker import ForceGauge, Shaker, Stinger

WEIGHTLESS = AccelerometerType(mass=0.0, gain_sd=0.0, resonance=1e9)
F = np.linspace(15.0, 200.0, 60)


def alone(article):
    """Accelerance of the article by superposition of its modes, rigid ones at 0 Hz."""
    s, w = 2j * np.pi * F, 2 * np.pi * article.frequency
    h = s[:, None] ** 2 / (s[:, None] ** 2 + 2 * article.damping * w * s[:, None] + w**2)
    return np.einsum("kr,or,r->ko", h, article.outputs, article.drive[0])


def free(small, **changes):
    return small(hangers=np.zeros((0, 3, 16)), **changes)


def test_without_anything_on_it_the_article_is_itself(small):
    """Swinging at 0.7 Hz changes a rigid motion at 15 Hz by (0.7/15)²; nothing else is there."""
    setup = BenchSetup(WEIGHTLESS, None)
    found = bench_rig(free(small), setup).frf(F)
    due = alone(free(small))
    assert np.abs(found - due).max() < 2 * (0.9 / 15) ** 2 * np.abs(due).max()


def test_a_soft_stinger_and_a_light_gauge_leave_the_article_alone(small):
    """The force that is measured is the force on the article, whatever the shaker behind it is."""
    soft = Shaker(stinger=Stinger(E=3e5), gauge=ForceGauge(mass=1e-9))
    article = free(small)
    found = bench_rig(article, BenchSetup(WEIGHTLESS, soft)).frf(F)
    plain = bench_rig(article, BenchSetup(WEIGHTLESS, None)).frf(F)
    assert np.abs(found - plain).max() < 1e-3 * np.abs(plain).max()


def test_the_mass_behind_the_crystal_is_not_seen_the_one_before_it_is(small):
    """Of the gauge the share beyond the crystal loads the article: H / (1 + m A_dd)."""
    article = free(small, rotations=0.0)
    article = article.turned(article.frequency, article.damping, np.eye(16), "A")
    drive = article.drive.copy()
    drive[1:] = 0.0
    outputs = np.vstack([article.drive[:1], article.outputs[1:]])  # the first is at the drive
    article = free(small, drive=drive, outputs=outputs)
    plain = bench_rig(article, BenchSetup(WEIGHTLESS, None)).frf(F)
    gauge = ForceGauge(mass=0.5, beyond=0.3)
    found = bench_rig(article, BenchSetup(WEIGHTLESS, Shaker(gauge=gauge))).frf(F)
    np.testing.assert_allclose(found, plain / (1 + 0.15 * plain[:, :1]), rtol=1e-6)


def test_two_channels_of_one_sensor_weigh_as_one_sensor(small):
    """As the table of sensors has it: rows of one place are one device."""
    mounts = free(small).mounts[[0, 0, 2]]
    setup = BenchSetup(replace(WEIGHTLESS, mass=0.05), None)
    two = bench_rig(free(small, mounts=mounts, channels=np.array([2, 2, 1])), setup)
    one = bench_rig(free(small, mounts=mounts, masses=np.array([0.05, 1e-12, 0.05])), setup)
    each = bench_rig(free(small, mounts=mounts), setup)
    np.testing.assert_allclose(two.frf(F), one.frf(F), rtol=1e-6)
    assert np.abs(each.frf(F) / one.frf(F) - 1).max() > 0.01


def test_sensors_lower_frequencies_as_rayleigh_says(small):
    """Δf/f = -½ Σ m |φ|² to first order: half the mass halves what is left of it by a quarter."""
    article = small(hangers=np.zeros((0, 3, 16)))
    lowest = int(np.flatnonzero(article.frequency)[0])
    phi2 = (article.mounts[:, :, lowest] ** 2).sum()
    rest = []
    for mass in (0.002, 0.001):
        kind = AccelerometerType(mass=mass)
        poles = np.abs(bench_rig(article, BenchSetup(kind, None)).model.poles) / 2 / np.pi
        f0 = article.frequency[lowest]
        f = poles[np.abs(poles - f0).argmin()]
        rest.append(abs((f / f0 - 1) / (-0.5 * mass * phi2) - 1))
    assert rest[0] < 0.05
    assert rest[1] / rest[0] == pytest.approx(0.5, abs=0.1)


def test_a_stinger_holds_across_and_against_turning():
    """The end stiffness of a clamped beam: a force alone bends it by L³/3EI, a moment by L/EI."""
    rod = Stinger(0.1, 0.002, 3e9)
    EI = 3e9 * np.pi * 0.002**4 / 64
    bent = np.linalg.inv(rod.restraint())
    assert bent[0, 0] == pytest.approx(0.1**3 / (3 * EI))
    assert bent[1, 1] == pytest.approx(0.1 / EI)
    assert bent[0, 1] == pytest.approx(0.1**2 / (2 * EI))


def test_a_stiff_stinger_holds_the_article_and_no_gauge_sees_it(small):
    """Across and in rotation it is a spring to ground, which no axial force is."""
    article = free(small, damping=1e-3)
    lowest = int(np.flatnonzero(article.frequency)[0])
    f = np.linspace(27, 30, 12000)
    peak = {}
    for E in (3e5, 3e11):
        rod = Stinger(E=E, diameter=0.006, rho=1e-3)
        shaker = Shaker(stinger=rod, gauge=ForceGauge(mass=1e-9))
        H = bench_rig(article, BenchSetup(WEIGHTLESS, shaker)).frf(f)
        peak[E] = f[np.abs(H[:, 0]).argmax()]
    d, K = article.drive, rod.restraint()
    ways = (np.array([d[1], d[5]]), np.array([d[2], -d[4]]))
    held = np.diag((2 * np.pi * article.frequency) ** 2) + sum(w.T @ K @ w for w in ways)
    raised = np.sqrt(np.maximum(np.linalg.eigvalsh(held), 0.0)) / (2 * np.pi)
    due = raised[np.abs(raised - 28.3).argmin()] - article.frequency[lowest]
    assert due > 0.1
    assert peak[3e11] - peak[3e5] == pytest.approx(due, rel=0.02)


def test_the_force_drops_at_resonance(small):
    """At a light mode the shaker's force falls where the article moves most."""
    rig = bench_rig(small())
    f = np.linspace(26, 30, 800)
    force = np.abs(rig.measured.response(2j * np.pi * f)[:, 0, 0])
    motion = np.abs(rig.frf(f)).max(axis=1)
    assert force[motion.argmax()] < 0.5 * np.median(force)


def test_cords_ring_where_they_were_tuned():
    """A string of mass m and tension T: f = √(T/(m L))/2; its inner modes are at f, 2f."""
    for one, f in zip(cords_for(10.5, 2), THESIS, strict=True):
        assert one.frequency == pytest.approx(f)
        M, _, K = cord_matrices(one, along=False)
        inner = np.sqrt(np.diag(K)[1:] / np.diag(M)[1:]) / (2 * np.pi)
        np.testing.assert_allclose(inner, f * np.arange(1, INNER + 1))


def test_a_cord_weighs_what_it_weighs():
    """Moved as a whole, end and all: its inertia is that of the line, m/3 at the end at most."""
    one = cord(10.0, 2, 23.0)
    M = cord_matrices(one, along=True, inner=60)[0]
    due = one.mass / 3 - (M[0, 1:] ** 2 / np.diag(M)[1:]).sum()
    assert abs(due) < 0.01 * one.mass  # the modes take over all of the end's inertia, as they must


def test_cord_resonances_are_seen_in_the_responses(small):
    """Against cords that weigh nothing: a small peak and dip at 23 and 24.5 Hz, little between."""
    article, f = small(), np.linspace(22.0, 25.5, 400)
    heavy = tuple(replace(c, damping=0.003) for c in cords_for(4.0, 2))
    light = tuple(replace(c, mass=1e-6) for c in heavy)
    H = [bench_rig(article, BenchSetup(WEIGHTLESS, None, c)).frf(f) for c in (heavy, light)]
    change = np.abs(H[0] / H[1] - 1).max(axis=1)
    for k in THESIS:
        assert change[np.abs(f - k) < 0.4].max() > 2 * change[np.abs(f - 25.4) < 0.05].max()


def test_the_highest_rigid_motion_is_below_five_hertz():
    """Two cords carry 10.5 kg: the bounce is at 2.5 Hz."""
    cords = cords_for(10.5, 2)
    bounce = np.sqrt(sum(c.stiffness for c in cords) / 10.5) / (2 * np.pi)
    assert bounce == pytest.approx(2.5)


def test_an_accelerometer_shows_one_far_below_its_resonance():
    kind = AccelerometerType()
    f = np.array([10.0, 400.0])
    due = 1 + (f / kind.resonance) ** 2
    np.testing.assert_allclose(np.abs(shown(kind, 2j * np.pi * f)), due, rtol=1e-5)


def test_gains_stay_within_what_the_calibrator_lets_pass():
    gains = drawn_gains(AccelerometerType(gain_sd=0.02), 4000, np.random.default_rng(0))
    assert np.abs(gains - 1).max() <= 0.03 + 1e-12
    assert np.std(gains) > 0.01


def test_shapes_are_held_to(small):
    with pytest.raises(ShapeError, match="drive"):
        small(drive=np.zeros((3, 16)))
