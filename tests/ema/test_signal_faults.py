"""Faults of signals are named with channel and time; sound recordings of every kind raise none."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from chladni.ema.channel_delays import channel_delays
from chladni.ema.frf_estimate import estimate, excitation_of
from chladni.ema.identification import identify
from chladni.ema.recording_screening import screened
from chladni.ema.setup import Recording
from chladni.ema.signal_faults import signal_checks
from chladni.ema.time_record import TimeRecord

RATE = 1024.0
KINDS = ("random", "burst", "hammer", "multisine", "sine")
MODES = np.array([31.0, 77.0, 128.0, 205.0, 330.0])
PHI = np.array(
    [[1.0, 0.9, -0.8, 1.1, 0.7], [0.8, -1.0, 0.7, 0.6, -0.9], [-0.6, 0.5, 1.0, -0.9, 0.8]]
)


def forces(kind, rng):
    """Blocks of force (b, n) of each kind of test."""
    n = 2048
    t = np.arange(n) / RATE
    if kind == "random":
        return rng.normal(size=(1, 16 * n))
    if kind == "burst":
        return np.where(t < 0.6 * n / RATE, rng.normal(size=(8, n)), 0.0)
    if kind == "hammer":
        size = np.exp(0.2 * rng.normal(size=(8, 1)))
        return size * np.where((t > 0.02) & (t < 0.024), np.sin(np.pi * (t - 0.02) / 0.004), 0.0)
    if kind == "multisine":
        return np.tile(np.fft.irfft(np.exp(2j * np.pi * rng.uniform(size=n // 2 + 1)), n), (8, 1))
    f = np.repeat(np.geomspace(25.0, 200.0, 40), n)
    return np.sin(2 * np.pi * np.cumsum(f) / RATE)[None]


def recording(kind="random", seed=0, noise=1e-3, damping=0.01, bits=0, quantity="accelerance"):
    """A record of three outputs on a structure of five real modes, the first at the drive point."""
    rng = np.random.default_rng([seed, 3])
    force = forces(kind, rng)
    n = force.shape[1]
    s = 2j * np.pi * np.fft.rfftfreq(2 * n, 1 / RATE)
    w = 2 * np.pi * MODES
    power = {"receptance": 0, "mobility": 1, "accelerance": 2}[quantity]
    g = s[:, None] ** power / (w**2 + 2 * damping * w * s[:, None] + s[:, None] ** 2)
    H = np.einsum("or,r,fr->of", PHI, PHI[0], g)
    steady = kind == "multisine"
    F = np.fft.rfft(np.tile(force, (1, 2)) if steady else np.pad(force, ((0, 0), (0, n))))
    y = np.fft.irfft(H * F[:, None])[..., n:] if steady else np.fft.irfft(H * F[:, None])[..., :n]
    x = np.concatenate([force[:, None], y], axis=1)
    x = x + noise * x.std(axis=(0, 2), keepdims=True) * rng.normal(size=x.shape)
    if bits:
        step = np.abs(x).max(axis=(0, 2), keepdims=True) / 2 ** (bits - 1)
        x = step * np.round(x / step)
    labels = ("1:+Z", "2:+Z", "3:+Z")
    return TimeRecord(x[:, :1], x[:, 1:], RATE, ("1:+Z",), labels, quantity)


def with_output(record, o, change):
    """The record with one output made by ``change`` of its samples in a row."""
    response = record.response.copy()
    response[:, o] = change(response[:, o].ravel()).reshape(response[:, o].shape)
    return replace(record, response=response)


def late(record, modes_of=None):
    """Channels that are late by the modes of the record, or of another one."""
    frf = estimate(record).frf
    return channel_delays(frf, identify(estimate(modes_of or record).frf, (20.0, 400.0)))


@pytest.mark.parametrize("bits", [0, 10])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 3e-2])
@pytest.mark.parametrize("kind", KINDS)
def test_a_sound_recording_has_no_fault_of_its_signals(kind, noise, bits):
    """With exact silence, of coarse converters, noisy or not, stiffly and lightly damped."""
    for seed, damping in ((1, 0.03), (2, 0.003)):
        record = recording(kind, seed, noise, damping, bits)
        assert excitation_of(record) == kind or noise > 0.01
        found, checks = signal_checks(record, estimate(record).frf)
        assert not found
        assert len(checks) == 4


@pytest.mark.parametrize("quantity", ["mobility", "receptance"])
def test_an_article_that_swings_does_not_drift(quantity):
    """A displacement may be slow and large for a while: the sway of the cords."""
    record = recording(quantity=quantity)
    t = np.arange(record.response.shape[2]) / RATE
    swing = with_output(record, 1, lambda x: x + 5 * x.std() * np.sin(2 * np.pi * 0.5 * t))
    assert not [f for f in signal_checks(swing)[0] if f.kind in ("drift", "step")]


@pytest.mark.parametrize("kind", ["random", "multisine", "sine"])
@pytest.mark.parametrize("length", [12, 100, 4000])
@pytest.mark.parametrize("held", ["zero", "last"])
def test_a_dropout_is_named_with_its_channel_and_time(kind, length, held):
    record = recording(kind, seed=4)
    at = 5003

    def gone(x):
        x = x.copy()
        x[at : at + length] = 0.0 if held == "zero" else x[at - 1]
        return x

    found, _ = signal_checks(with_output(record, 2, gone))
    (one,) = (f for f in found if f.kind == "dropout")
    assert one.channels == ("3:+Z",)
    assert f"{at / RATE:.4g} s" in one.text or f"{(at - 1) / RATE:.4g} s" in one.text
    assert one.value * RATE == pytest.approx(length, abs=2)


def test_a_channel_that_dies_is_a_dropout():
    """To the end of the record: a cable that came off."""
    record = recording()
    gone = with_output(record, 0, lambda x: np.where(np.arange(len(x)) < 20_000, x, 0.0))
    found, _ = signal_checks(gone, estimate(gone).frf)
    assert ("dropout", ("1:+Z",)) in {(f.kind, f.channels) for f in found}


@pytest.mark.parametrize(("kind", "lag"), [("random", 1), ("burst", 3), ("random", 40)])
def test_a_late_channel_is_named_with_its_delay(kind, lag):
    """From one sample on; the interval holds the truth, and the others are left alone."""
    record = recording(kind, seed=lag)
    rolled = with_output(record, 1, lambda x: np.roll(x, lag))
    (one,) = late(rolled, record if lag > 10 else None)[0]
    assert one.channels == ("2:+Z",)
    assert one.value == pytest.approx(lag / RATE, rel=1e-2, abs=2e-5)
    assert "lags" in one.text


def test_channels_in_step_are_not_late():
    for seed, noise in ((0, 1e-4), (1, 3e-2)):
        found, check = late(recording(seed=seed, noise=noise))
        assert not found
        assert check.passed


def test_a_delay_of_the_whole_chain_is_no_channels():
    """All responses late by the same time: another check names that."""
    record = recording()
    assert not late(replace(record, response=np.roll(record.response, 2, axis=2)), record)[0]


@pytest.mark.parametrize("kind", ["random", "burst", "multisine"])
@pytest.mark.parametrize("size", [3.0, 20.0])
def test_a_drift_is_named(kind, size):
    record = recording(kind)

    def drifting(x):
        return x + size * x.std() * np.linspace(0, 1, len(x)) ** 2

    found, _ = signal_checks(with_output(record, 1, drifting))
    assert [(f.kind, f.channels) for f in found] == [("drift", ("2:+Z",))]


def test_a_step_is_named_with_its_time():
    record = recording()
    step = with_output(record, 1, lambda x: x + 5 * x.std() * (np.arange(len(x)) > 12_288))
    found, _ = signal_checks(step)
    (one,) = (f for f in found if f.kind == "step")
    assert one.channels == ("2:+Z",)
    assert "at 12 s" in one.text


@pytest.mark.parametrize("kind", ["random", "burst", "hammer", "multisine"])
@pytest.mark.parametrize("factor", [9.81, 1 / 9.81, 0.5])
def test_a_gain_that_changes_is_named(kind, factor):
    """A unit or a range that is exchanged half way, in one channel.

    The FRF is a mean over both gains, line by line, so eight blocks know the factor to a quarter.
    """
    record = recording(kind, damping=0.03)
    half = record.response[:, 0].size // 2

    def changed(x):
        return np.where(np.arange(len(x)) < half, x, factor * x)

    record = with_output(record, 2, changed)
    found, _ = signal_checks(record, estimate(record).frf)
    (one,) = (f for f in found if f.kind == "changed gain")
    assert one.channels == ("3:+Z",)
    assert one.value == pytest.approx(factor, rel=0.25)


def test_a_lone_spike_is_named_and_a_blow_is_not():
    record = recording()

    def spiked(x):
        x = x.copy()
        x[7777] += 15 * x.std()
        return x

    found, _ = signal_checks(with_output(record, 0, spiked))
    assert [(f.kind, f.channels) for f in found] == [("spikes", ("1:+Z",))]
    assert f"{7777 / RATE:.4g} s" in found[0].text
    force = record.force.copy()
    force[0, 0, 7777] += 100.0
    blow = recording()
    response = np.array([np.convolve(x, [1.0, 0.4, -0.2])[: len(x)] for x in force[0, [0, 0, 0]]])
    assert not signal_checks(replace(blow, force=force, response=response[None]))[0]


def test_a_stepped_sine_is_cut_before_it_is_stacked():
    """No dwell copies the whole record: cost and memory grow with its length alone."""
    one = recording("sine")
    response = np.tile(one.response, (1, 8, 1))
    many = replace(one, response=response, outputs=tuple(f"{k}:+Z" for k in range(1, 25)))
    tracemalloc.start()
    estimate(many)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < many.response.nbytes


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("dropout", lambda x: np.where(np.arange(len(x)) // 3000 == 2, 0.0, x)),
        ("channel delay", lambda x: np.roll(x, 40)),
        ("drift", lambda x: x + 20 * np.linspace(0, x.std(), len(x))),
    ],
)
def test_the_screening_says_it(kind, change):
    """Dropout, drift and delay are no sound recording any more."""
    sound = recording()
    record, modes = with_output(sound, 1, change), identify(estimate(sound).frf, (20.0, 400.0))
    found = screened(Recording("r", frf=estimate(record).frf, time=record), modes)
    assert f"{kind} (2:+Z)" in found.sentence
