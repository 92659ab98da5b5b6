"""FRFs from time data: records made from known FRFs are given back, whatever excited them."""

import numpy as np
import pytest
from tests.builders.modal_frfs import modal_sum
from tests.builders.refusals import says

from chladni.dynamics.frf import FRF
from chladni.ema.frf_estimate import EstimateSettings, estimate, excitation_of
from chladni.ema.identification import identify
from chladni.ema.ring_down import ring_downs
from chladni.ema.time_record import TimeRecord, overloaded
from chladni.workflows.identify import without_window

RATE = 1024.0
MODES, ZETA = np.array([31.3, 57.1, 92.4]), np.array([0.006, 0.01, 0.008])
SHAPES = np.array([[1.0, 0.7, -0.5], [0.4, -1.0, 0.8]])  # at two outputs; the first is driven
LABELS = ("1:+Z",), ("1:+Z", "2:+Z")


def accelerance(f: np.ndarray) -> np.ndarray:
    """(n_f, 2)."""
    return modal_sum(2j * np.pi * f, MODES, SHAPES, SHAPES[:1], ZETA)[:, :, 0]


def respond(force: np.ndarray) -> np.ndarray:
    """Responses (..., 2, n) to a force (..., n) that repeats itself: exact, line by line."""
    n = force.shape[-1]
    H = accelerance(np.fft.rfftfreq(n, 1 / RATE))
    return np.fft.irfft(np.fft.rfft(force)[..., None, :] * H.T, n)


def record(force: np.ndarray, noise: float = 0.0, seed: int = 0) -> TimeRecord:
    """(b, n) forces and what they cause, with noise relative to the rms of the responses."""
    y = respond(force)
    rng = np.random.default_rng([seed, 7])  # not the seed of a force
    y = y + noise * np.sqrt((y**2).mean()) * rng.normal(size=y.shape)
    return TimeRecord(force[:, None], y, RATE, *LABELS)


def hits(n: int = 8192, count: int = 5, seed: int = 1) -> np.ndarray:
    """Half sines of 4 ms, a little different in size and place."""
    rng, out = np.random.default_rng(seed), np.zeros((count, n))
    for k in range(count):
        at = 20 + int(rng.integers(6))
        out[k, at : at + 5] = (50 + 10 * rng.random()) * np.sin(np.pi * np.arange(1, 6) / 6)
    return out


def bursts(n: int = 8192, count: int = 12) -> np.ndarray:
    force = np.random.default_rng(2).normal(size=(count, n))
    force[:, n // 3 :] = 0
    return force


def sweep(frequencies: np.ndarray, seconds: float = 3.0) -> np.ndarray:
    """Dwells of constant frequency, the phase without a jump."""
    each = np.repeat(frequencies, int(seconds * RATE))
    return 3.0 * np.sin(2 * np.pi * np.cumsum(each) / RATE)


NOISE = np.random.default_rng(3).normal(size=(1, 2**17))
KINDS = {"hammer": hits(), "burst": bursts(), "random": NOISE}


def apart(frf: FRF) -> np.ndarray:
    """|ΔH| over the rms of each channel, on the lines from 20 to 120 Hz (n_f, 2)."""
    f = frf.frequency
    use = (f > 20) & (f < 120)
    due = accelerance(f[use])
    return np.abs(frf.values[use, :, 0] - due) / np.sqrt((np.abs(due) ** 2).mean(axis=0))


@pytest.mark.parametrize("kind", KINDS)
def test_the_excitation_is_recognised(kind: str) -> None:
    assert excitation_of(record(KINDS[kind])) == kind
    assert excitation_of(record(sweep(np.arange(20.0, 30.0))[None])) == "sine"


@pytest.mark.parametrize("method", ["H1", "H2", "Hv"])
@pytest.mark.parametrize("kind", ["hammer", "burst"])
def test_transients_that_die_within_their_block_do_not_leak(kind: str, method: str) -> None:
    """To the 1/1000 that the softest mode has left at the end: e^(-ζωT) is 8e-5 of a block."""
    made = record(KINDS[kind])
    found = estimate(made, EstimateSettings(method=method, exponential=1.0))  # type: ignore[arg-type]
    assert found.excitation == kind
    assert apart(found.frf).max() < 2e-3


def test_a_pulse_fills_the_band_it_drives_and_no_more() -> None:
    """The half sine of 6 samples has its first zero at 1.5 rate / 6, where the lines end."""
    top = estimate(record(hits())).frf.frequency[-1]
    assert 0.8 * 1.5 * RATE / 6 < top <= 1.5 * RATE / 6


def test_hann_windows_leak_and_local_polynomials_less() -> None:
    """The same record: windows bend the peaks, polynomials of the whole record fit the leakage."""
    made = record(NOISE[:, : 2**15], 0.001)
    hann = estimate(made)
    local = estimate(made, EstimateSettings(method="LPM"))
    assert hann.excitation == local.excitation == "random"
    assert np.median(apart(local.frf)) < 0.2 * np.median(apart(hann.frf))


@pytest.mark.parametrize(("kind", "method"), [("burst", "H1"), ("random", "LPM")])
def test_the_variance_is_that_of_repeats(kind: str, method: str) -> None:
    """E|ΔH|² is the mean of the variances stated, where noise is all that is wrong.

    Six means of five degrees of freedom and more: the ratio is too large by 1/30 at most. Lines
    within ten half-bandwidths of a mode are left out, for polynomials bend peaks as well.
    """
    squares, stated = [], []
    for seed in range(6):
        made = record(KINDS[kind][:, : 2**15], 0.2, seed)
        found = estimate(made, EstimateSettings(method=method, band=(20, 120)))  # type: ignore[arg-type]
        assert found.frf.variance is not None
        due = accelerance(found.frf.frequency)
        squares.append(np.abs(found.frf.values[:, :, 0] - due) ** 2)
        stated.append(found.frf.variance[:, :, 0])
    f = found.frf.frequency
    away = (np.abs(f[:, None] - MODES) > 10 * ZETA * MODES).all(axis=1)
    ratio = np.mean(squares, axis=0)[away] / np.mean(stated, axis=0)[away]
    assert ratio.mean() == pytest.approx(1.0, rel=0.2)


def test_an_exponential_window_is_taken_off_the_damping() -> None:
    short = record(hits(2048))
    found = estimate(short)
    assert found.added_damping > 1.0
    bent = identify(found.frf, (20.0, 120.0))
    mended = without_window(bent, found.added_damping)
    wide, true = bent.damping[bent.inside], mended.damping[bent.inside]
    assert (wide > 1.2 * ZETA).all()
    np.testing.assert_allclose(true, ZETA, rtol=0.1)


def test_double_hits_are_left_out() -> None:
    force = hits()
    force[2, 400:405] = 0.5 * force[2].max()
    found = estimate(record(force))
    assert found.averages == 4
    assert "1 of 5 hits are double" in " ".join(found.notes)
    says("all hits are double", estimate, record(force[[2, 2]]))


def test_hits_of_one_long_record_are_cut_apart() -> None:
    whole = hits(8192, 4).reshape(1, -1)
    found = estimate(record(whole), EstimateSettings(exponential=1.0))
    assert found.averages == 4
    assert apart(found.frf).max() < 2e-3


def test_a_stepped_sine_is_demodulated_with_its_harmonics() -> None:
    lines = np.arange(25.0, 45.0, 2.5)
    made = record(sweep(lines, 12.0)[None])  # six seconds settle to e^-7
    y = made.response.copy()
    y[:, 1] += 1e-2 * y[:, 1] ** 2 / np.abs(y[:, 1]).max()  # a second harmonic and a mean
    found = estimate(TimeRecord(made.force, y, RATE, *LABELS))
    assert found.excitation == "sine"
    np.testing.assert_allclose(found.frf.frequency, lines, rtol=1e-4)
    due = accelerance(found.frf.frequency)
    np.testing.assert_allclose(found.frf.values[:, 0, 0], due[:, 0], rtol=0.01)
    assert found.distortion is not None
    size = np.abs(due[:, 1]) * 3.0
    expected = 0.5e-2 * size / np.abs(made.response[:, 1]).max()  # (A cos)² is A²/2 cos 2ωt + ...
    np.testing.assert_allclose(found.distortion[:, 1], expected, rtol=0.1, atol=2e-4)
    assert found.distortion[:, 0].max() < 2e-3


def test_a_free_decay_gives_poles_and_keeps_a_linear_damping() -> None:
    found = ring_downs(record(hits()))
    np.testing.assert_allclose([d.frequency for d in found], MODES, rtol=2e-3)
    np.testing.assert_allclose([d.damping for d in found], ZETA, rtol=0.05)
    assert all(d.moves < 1.2 for d in found)


def test_friction_shows_as_damping_that_grows_as_the_decay_fades() -> None:
    """The envelope of dry friction falls on a straight line: ζ ω = -A'/A grows as 1/A."""
    t = np.arange(8192) / RATE
    envelope = np.maximum(1 - t / 7.0, 0.0)
    x = np.zeros((1, 1, 8192))
    x[0, 0, 20:] = (envelope * np.sin(2 * np.pi * 40 * t))[:-20]
    force = np.zeros((1, 1, 8192))
    force[0, 0, 15:20] = 50.0
    (found,) = ring_downs(TimeRecord(force, x, RATE, ("1:+Z",), ("1:+Z",)))
    assert found.frequency == pytest.approx(40.0, rel=1e-3)
    assert found.moves > 2.5
    assert (np.diff(found.damping_at) > 0).all()


def test_clipped_channels_are_named_and_round_tops_are_not() -> None:
    made = record(bursts(count=3))
    top = 0.6 * np.abs(made.response[1, 1]).max()
    y = made.response.copy()
    y[1, 1] = np.clip(y[1, 1], -top, top)
    assert overloaded(made) == {}
    assert overloaded(TimeRecord(made.force, y, RATE, *LABELS)) == {"output 2:+Z": 1}
    sine = np.round(200 * np.sin(2 * np.pi * 0.001 * np.arange(8192)))[None, None]  # of few steps
    assert overloaded(TimeRecord(sine, sine, RATE, ("1:+Z",), ("1:+Z",))) == {}


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (dict(excitation="shock"), "no 'shock'; there are hammer"),
        (dict(method="H3"), "there are H1, H2, Hv, LPM"),
        (dict(method="LPM"), "that of a hit is smooth"),
        (dict(exponential=2.0), r"falls to \(0, 1\], not 2"),
        (dict(band=(600.0, 700.0)), "holds 0 of its lines"),
        (dict(excitation="random", resolution=1e-3), "need blocks of"),
        (dict(excitation="sine"), "0 dwells of constant frequency"),
    ],
)
def test_what_cannot_be_done_is_refused(settings, said) -> None:
    says(said, estimate, record(hits(8192, 3)), EstimateSettings(**settings))


def test_silence_is_no_excitation() -> None:
    silent = TimeRecord(np.zeros((1, 1, 512)), np.ones((1, 1, 512)), RATE, ("a",), ("b",))
    says("nothing was excited", estimate, silent)
