"""A loud room: as loud as asked, from a few sources, the same in time and in closed form."""

import numpy as np
import pytest

from chladni_bench.bench_recording import BenchTest, PhysicalRun, record
from chladni_bench.bench_rig import bench_rig
from chladni_bench.room import SOURCES
from chladni_bench.sine_schedule import Stage, dwells_of
from chladni_bench.sine_sweep import swept

BAND, LOUD, RATE = (15.0, 200.0), 3e-3, 512.0


@pytest.fixture
def many(small):
    """An article with eight sensors."""
    draw = np.random.default_rng(565)

    def made(**changes):
        r = 16
        labels = tuple(f"{k}:+Z" for k in range(1, 9))
        parts = {"outputs": draw.normal(size=(8, r)) / 2, "output_labels": labels}
        return small(mounts=draw.normal(size=(8, 3, r)) / 2, **parts, **changes)

    return made


def at_rest(rig, seconds):
    """(channels, n): what the front end sees while nothing is driven."""
    run = PhysicalRun(rig, RATE, BenchTest("burst-random", BAND, 1.0))
    n = int(seconds * RATE)
    return run.on(np.zeros(n * run.finer), np.random.default_rng(566))


def test_the_room_moves_the_median_sensor_as_asked(many, ideal):
    """Parseval over the band; four sources behind eight sensors and the gauge, at every line."""
    x = at_rest(bench_rig(many(damping=0.03), ideal(room=LOUD)), 256)
    X = np.fft.rfft(x * np.hanning(x.shape[1]), axis=1) / x.shape[1] * np.sqrt(8 / 3)
    f = np.fft.rfftfreq(x.shape[1], 1 / RATE)
    inside = (f >= BAND[0]) & (f <= BAND[1])
    rms = np.sqrt(2 * (np.abs(X[1:, inside]) ** 2).sum(axis=1))
    assert np.median(rms) == pytest.approx(LOUD, rel=0.1)
    for low in np.flatnonzero(inside)[:: inside.sum() // 8][:-1]:
        lines = X[:, low : low + 16]  # 0.06 Hz: the system hardly changes over them
        size = np.linalg.svd(lines, compute_uv=False)
        assert size[SOURCES] < 0.1 * size[SOURCES - 1]


def test_no_room_no_noise(many, ideal):
    assert not at_rest(bench_rig(many(), ideal()), 2).any()


def test_closed_form_and_time_have_the_same_noise(many, ideal):
    """Variance of the FRFs over twenty sweeps, by both ways to run a stepped sine."""
    rig = bench_rig(many(damping=0.03), ideal(room=LOUD))
    lines = dwells_of((Stage(60, 120, 8, 30),))
    test = BenchTest("stepped-sine", (60.0, 120.0), 1.0, sweeps=20)
    exact = swept(rig, test, lines, np.random.default_rng(1))
    in_time = swept(rig, test, lines, np.random.default_rng(2), keep_time=True)
    ratio = (in_time.frf.variance / exact.frf.variance)[:, :, 0]
    assert 0.7 < np.exp(np.log(ratio).mean()) < 1.4


def test_coherence_falls_as_the_room_says(many, ideal):
    """Twice the noise, four times (1 - γ²) / γ² where that is small."""
    lost, article = [], many(damping=0.05)
    for room in (LOUD, 2 * LOUD):
        rig = bench_rig(article, ideal(room=room))
        test = BenchTest("multisine", BAND, 1.0, 0.5, averages=8)
        gamma = record(rig, test, np.random.default_rng(3)).frf.coherence
        lost.append(np.median((1 - gamma) / gamma))
    assert lost[1] / lost[0] == pytest.approx(4, rel=0.2)
