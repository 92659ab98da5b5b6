"""Tests on the bench give the FRFs the theory of each excitation says, and flag what goes wrong."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.ema.frf_estimate import EstimateSettings, estimate, excitation_of
from chladni.ema.setup import Recording
from chladni.ema.time_record import overloaded
from chladni.errors import ModelError
from chladni.workflows.evaluation import evaluate_recordings
from chladni_bench.accelerometers import AccelerometerType
from chladni_bench.bench_recording import BenchTest, level_for, record
from chladni_bench.bench_rig import BenchSetup, bench_rig
from chladni_bench.drive_signals import ON, burst, multisine, pink_rms
from chladni_bench.front_end import FrontEnd, digitised, sampling_rate
from chladni_bench.sine_schedule import TABLE_3, SineLine, dwells_of, stage_lines, stages_for
from chladni_bench.sine_sweep import swept

BAND = (15.0, 200.0)


def rng():
    return np.random.default_rng(7)


def far(recording):
    """Largest error against the ideal FRF, relative to the rms of its channel."""
    H, due = recording.frf.values[:, :, 0], recording.truth
    return (np.abs(H - due) / np.sqrt((np.abs(due) ** 2).mean(axis=0))).max()


def test_bursts_leak_no_more_than_what_is_left_of_them(small, ideal):
    """A mode has (1 - ON) T to die: e^(-ζωT(1-ON)) leaks; with a fifth of the time, far more."""
    rig = bench_rig(small(damping=0.02), ideal())
    errors = {}
    for resolution in (0.1, 0.5):
        test = BenchTest("burst-random", BAND, 1.0, resolution, averages=6)
        found = record(rig, test, rng())
        errors[resolution] = far(found)
        slowest = np.abs(rig.measured.poles.real)[np.abs(rig.measured.poles.imag) > 2 * np.pi * 15]
        left = np.exp(-slowest.min() * (1 - ON) / resolution)
        assert errors[resolution] < max(30 * left, 1e-4)
        if resolution == 0.1:
            assert found.frf.coherence.min() > 1 - 1e-4
    assert errors[0.5] > 10 * errors[0.1]


def test_a_multisine_in_steady_state_does_not_leak(small, ideal):
    """After one period of 10 s nothing but rounding and swinging is left: whole periods are exact.

    Only odd lines are driven, and only they are given.
    """
    rig = bench_rig(small(damping=0.02), ideal())
    found = record(rig, BenchTest("multisine", BAND, 1.0, 0.1, averages=3), rng(), keep_time=True)
    assert far(found) < 1e-4
    assert np.all(np.round(found.frf.frequency / 0.1).astype(int) % 2 == 1)
    assert excitation_of(found.time) == "multisine"


def test_a_hammer_finds_the_same_article(small, ideal):
    """The exponential window adds the damping it says; where that is little, H is the ideal one."""
    rig = bench_rig(small(damping=0.02), ideal(shaker=None))
    found = record(rig, BenchTest("hammer", BAND, 1.0, averages=3), rng(), keep_time=True)
    assert found.added_damping < 0.2 * 0.02 * 2 * np.pi * 28
    assert np.median(np.abs(found.frf.values[:, :, 0] / found.truth - 1)) < 0.02
    assert excitation_of(found.time) == "hammer"
    with pytest.raises(ModelError, match="hammer"):
        record(bench_rig(small(), ideal()), BenchTest("hammer", BAND, 1.0), rng())


def test_time_data_give_the_frf_that_was_given(small):
    """Estimated again from the time data alone, as ``chladni test`` would: the same numbers."""
    rig = bench_rig(small())
    test = BenchTest("burst-random", BAND, 2.0, 0.25, averages=5)
    found = record(rig, test, rng(), keep_time=True)
    again = estimate(found.time).frf.sel(band=BAND)
    np.testing.assert_allclose(again.values, found.frf.values, rtol=1e-9)
    few = EstimateSettings(band=(25.0, 35.0))  # about the first mode
    (read,) = evaluate_recordings(Recording("a.uff", time=found.time), few).recordings
    assert read.estimate is not None
    assert read.screening.checks
    frf = read.recording.frf
    due = again.sel(band=(frf.frequency[0], frf.frequency[-1]))
    np.testing.assert_allclose(frf.values, due.values)


def lines(damping, delay):
    f = 28 * np.exp(np.linspace(-0.1, 0.1, 41))
    return [SineLine(float(x), delay, 20, 1.0) for x in f]


def test_a_stepped_sine_is_the_response_but_for_its_transient(small, ideal):
    """The error of every line is no more than its residual transient, here and in the force."""
    rig = bench_rig(small(), ideal())
    found = swept(rig, BenchTest("stepped-sine", BAND, 1.0, sweeps=2), lines(0.01, 30), rng())
    error = np.abs(found.frf.values[:, :, 0] / found.truth - 1).max(axis=1)
    assert np.all(error < 4 * found.transient + 1e-9)
    assert found.transient.max() > 1e-4


def test_the_transient_dies_with_the_delay_as_the_mode_does(small, ideal):
    """Driven by a bare force at its resonance, e^(-2πζN): ten cycles more are a known factor."""
    rig = bench_rig(small(), ideal(shaker=None))
    poles = rig.measured.poles
    pole = poles[np.abs(np.abs(poles) / (2 * np.pi) - 28).argmin()]
    f = float(np.abs(pole) / (2 * np.pi))
    left = {}
    for delay in (30, 40):
        steps = ((f / 1.05, 3, 3), (f, delay, 20), (1.1 * f, 30, 20))
        test = BenchTest("stepped-sine", BAND, 1.0, sweeps=1)
        sweep = [SineLine(*step, 1.0) for step in steps]
        left[delay] = swept(rig, test, sweep, rng()).transient[1]
    assert left[40] / left[30] == pytest.approx(np.exp(pole.real * 10 / f), rel=0.05)


def test_the_sweep_in_time_is_the_sweep_in_closed_form(small, ideal):
    """Sampled, filtered and fitted by least squares, the FRF is the same to the front end's
    ripple of the step between two samples."""
    rig = bench_rig(small(damping=0.02), ideal())
    test = BenchTest("stepped-sine", BAND, 1.0, sweeps=1)
    some = [SineLine(float(f), 40, 20, 1.0) for f in (20.0, 27.0, 28.5, 60.0, 111.0, 180.0)]
    closed = swept(rig, test, some, rng())
    timed = swept(rig, test, some, rng(), keep_time=True)
    assert closed.time is None
    size = np.abs(closed.frf.values).max()
    np.testing.assert_allclose(timed.frf.values, closed.frf.values, atol=2e-3 * size)
    assert excitation_of(timed.time) == "sine"


def test_a_line_begins_with_what_the_line_before_left(small, ideal):
    """No delay, one frequency: from line to line the transient dies as the mode does, no faster."""
    rig = bench_rig(small(), ideal(shaker=None))
    cycles = [SineLine(28.0 * (1 + k * 1e-9), 0, 4, 1.0) for k in range(3)]
    left = swept(rig, BenchTest("stepped-sine", BAND, 1.0, sweeps=1), cycles, rng()).transient
    poles = rig.measured.poles
    pole = poles[np.abs(np.abs(poles) / (2 * np.pi) - 28).argmin()]
    np.testing.assert_allclose(left[2] / left[1], np.exp(pole.real * 4 / 28), rtol=0.1)


def test_the_force_is_held_at_its_level(small, ideal):
    """From the second sweep on the measured force is the level times its share, dip or no dip."""
    rig = bench_rig(small(), ideal())
    sweep = [replace(line, share=0.5) for line in lines(0.01, 60)]
    test = BenchTest("stepped-sine", BAND, 3.0, sweeps=2)
    held = swept(rig, test, sweep, rng()).force
    assert np.abs(held[1] / 1.5 - 1).max() < 0.02
    assert np.abs(held[0] / 1.5 - 1).max() > 0.05  # by the line before alone it is not


def test_the_schedule_is_that_of_the_thesis():
    every = dwells_of(TABLE_3)
    np.testing.assert_allclose([x.frequency for x in every], stage_lines(TABLE_3))
    waits = [(x.frequency, x.delay, x.measure) for x in every]
    table = ((12, 10), (30, 30), (70, 80), (150, 120), (300, 300))
    for f, delay in table:
        assert min(waits, key=lambda w: abs(w[0] - f))[1:] == (delay, 20)
    assert dwells_of(stages_for(10.0, 400.0)) == every
    wide = stages_for(26.0, 900.0)
    assert (wide[0].low, wide[0].delay, wide[-1].high, wide[-1].delay) == (26.0, 30, 900.0, 300)


def test_a_converter_of_b_bits_leaves_a_twelfth_of_its_step_squared():
    """Widrow: rounding of a busy signal is uniform noise of variance Δ²/12."""
    front = FrontEnd(volts=1.0, bits=10, noise=0.0)
    x = np.random.default_rng(0).normal(size=(2, 200_000)) / 8
    assert front.step == 2.0 / 2**10
    y, over = digitised(x, np.zeros(2), 1.0, front, rng())
    assert ((y - x) ** 2).mean() == pytest.approx(front.step**2 / 12, rel=0.02)
    assert not over.any()


def test_noise_has_the_density_it_says():
    """White to half the rate: variance = density² rate/2."""
    y, _ = digitised(np.zeros((1, 100_000)), np.array([3e-3]), 1024.0, FrontEnd(noise=4e-3), rng())
    assert y.var() == pytest.approx(25e-6 * 512, rel=0.03)


def test_overload_is_flagged_and_seen_by_the_screening(small):
    rig = bench_rig(small())
    level = level_for(rig, "burst-random", BAND)
    test = BenchTest("burst-random", BAND, level, 0.25, averages=3)
    assert not record(rig, test, rng()).overloads
    loud = record(rig, replace(test, level=20 * level), rng(), keep_time=True)
    assert loud.overloads
    assert set(overloaded(loud.time)) == set(loud.overloads)
    assert loud.frf.coherence.min() < 0.9


def test_a_clipped_sine_is_flagged_too(small):
    rig = bench_rig(small())
    level = level_for(rig, "stepped-sine", BAND)
    test = BenchTest("stepped-sine", BAND, level, sweeps=2)
    assert not swept(rig, test, lines(0.01, 40), rng()).overloads
    loud = swept(rig, replace(test, level=20 * level), lines(0.01, 40), rng())
    assert loud.overloads
    peak = np.abs(loud.frf.values).max()
    assert peak < 0.9 * np.abs(loud.truth).max()


@pytest.mark.parametrize("kind", ["burst-random", "stepped-sine"])
def test_the_variance_is_that_of_the_errors(small, kind):
    """Noisy sensors of right gain: |H - H_0|² over the stated variance is one on average."""
    noisy = AccelerometerType(gain_sd=0.0, noise=3e-2)
    rig = bench_rig(small(damping=0.03), BenchSetup(noisy, cords=None))
    test = BenchTest(kind, BAND, 0.3, 0.5, averages=40, sweeps=12)
    if kind == "burst-random":
        found = record(rig, test, rng())
    else:
        sweep = [SineLine(float(f), 200, 20, 1.0) for f in np.linspace(20, 190, 150)]
        found = swept(rig, test, sweep, rng())
    error = np.abs(found.frf.values[:, :, 0] - found.truth) ** 2
    ratio = error.sum(axis=0) / found.frf.variance[:, :, 0].sum(axis=0)
    np.testing.assert_allclose(ratio, 1.0, atol=0.35)


def test_bursts_are_pink_and_silent_at_the_end():
    x = burst(4096, 1024.0, BAND, rng())
    assert np.abs(x[int(ON * 4096) + 1 :]).max() == 0.0
    n = 2**14
    signals = [burst(n, 1024.0, BAND, np.random.default_rng(k)) for k in range(60)]
    power = np.mean([np.abs(np.fft.rfft(s)) ** 2 for s in signals], axis=0)
    f = np.fft.rfftfreq(n, 1 / 1024.0)

    def octave(low):
        inside = (f >= low) & (f < 2 * low)
        return power[inside].sum()

    assert octave(20) == pytest.approx(octave(80), rel=0.2)
    assert power[f > 1.2 * BAND[1]].max() < 1e-3 * power.max()


def test_pink_noise_of_rms_one_is_even_over_octaves():
    """Through H = 1 it is itself, through √f its power is the band over the ln of its ends."""
    f = np.geomspace(10, 160, 4000)
    found = pink_rms(f, np.stack([np.ones_like(f), 1j * np.sqrt(f)], axis=1))
    np.testing.assert_allclose(found, [1, np.sqrt(150 / np.log(16))], rtol=1e-6)


def test_signals_on_a_finer_grid_pass_through_the_same_samples():
    for make in (burst, multisine):
        rough = make(512, 256.0, (15.0, 100.0), rng())
        fine = make(512, 256.0, (15.0, 100.0), rng(), finer=4)
        np.testing.assert_allclose(fine[::4] / fine.std() * rough.std(), rough, atol=0.05)


def test_rates_are_those_of_a_front_end():
    assert sampling_rate(400.0) == 1024.0
    assert sampling_rate(401.0) == 2048.0
