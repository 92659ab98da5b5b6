"""Faults that a recording shows by itself, and by the modes identified from it."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.modal_frfs import modal_frf, noisy

from chladni.dynamics.frf import FRF
from chladni.ema.chain_checks import (
    fitted_delay,
    level_checks,
    median_slope,
    modal_gains,
    other_reading,
)
from chladni.ema.channel_checks import channel_checks
from chladni.ema.frf_maps import misreadings
from chladni.ema.identification import Identified, identify
from chladni.ema.recording_screening import screened, strong_modes
from chladni.ema.setup import Recording
from chladni.ema.shape_faults import ModelShapes, shape_faults

F = np.arange(10.0, 130.0, 0.2)
MODES = np.array([17.0, 28.0, 41.0, 55.0, 67.0, 83.0, 99.0, 115.0])
N = 9
PHI = np.random.default_rng(0).normal(size=(N, len(MODES)))
LABELS = tuple(f"{k}:+Z" for k in range(1, N + 1))


def recording(noise: float = 0.01, phi: np.ndarray = PHI, drives=(0,)) -> FRF:
    """Accelerances from output 1, its own drive point."""
    return noisy(modal_frf(F, MODES, phi, 0.008, drives=drives), noise, 1e-3)


def kinds(frf: FRF) -> dict[str, tuple[str, ...]]:
    return {f.kind: f.channels for f in channel_checks(frf)[0]}


@pytest.mark.parametrize("given", [True, False])
def test_a_sound_recording_is_left_in_peace(given: bool) -> None:
    frf = recording() if given else replace(recording(), variance=None)
    found = screened(Recording("a", frf), identify(frf))
    assert found.findings == ()
    assert "no fault found" in found.sentence


def test_lines_are_counted_for_the_modes_that_are_reported() -> None:
    frf = recording()
    found = identify(frf)
    spurious = np.arange(found.order) == 3
    checks = screened(Recording("a", frf), found, spurious=spurious).checks
    (said,) = (c.result for c in checks if c.name == "lines per half-bandwidth")
    assert f"of {(found.inside & found.firm & ~spurious).sum()} modes" in said


def test_a_channel_of_noise_is_dead() -> None:
    frf, rng = replace(recording(), variance=None), np.random.default_rng(4)
    values = frf.values.copy()
    values[:, 3, 0] = 0.1 * (rng.normal(size=len(F)) + 1j * rng.normal(size=len(F)))
    assert kinds(replace(frf, values=values)) == {"dead channel": ("4:+Z",)}


def rough(level: float) -> Recording:
    """One channel whose lines follow no curve at levels above 1, as a hard spring leaves them."""
    frf, rng = recording(noise=1e-4), np.random.default_rng(4)
    values = frf.values.copy()
    if level > 1:
        values[:, 3, 0] *= np.exp(rng.normal(size=len(F)) + 1j * rng.normal(size=len(F)))
    return Recording(f"level {level:g}", replace(frf, values=values, variance=None), level=level)


def dead_ones(r: Recording, *others: Recording) -> list[tuple[str, ...]]:
    return [f.channels for f in screened(r, calmer=others).findings if f.kind == "dead channel"]


def test_a_channel_that_repeats_is_not_dead() -> None:
    """A variance that is known says that the lines are no noise, whatever curve they follow."""
    r = rough(5.0)
    assert dead_ones(r) == [("4:+Z",)]
    assert r.frf is not None
    known = replace(r.frf, variance=1e-6 * np.abs(r.frf.values) ** 2)
    assert dead_ones(replace(r, frf=known)) == []


def test_a_channel_that_lives_at_a_lower_level_is_not_dead() -> None:
    """Unless it went silent since, as one does whose cable came off."""
    assert dead_ones(rough(5.0), rough(1.0)) == []
    assert dead_ones(rough(5.0), rough(7.0)) == [("4:+Z",)]
    assert dead_ones(rough(5.0), replace(rough(1.0), article="B")) == [("4:+Z",)]
    loud = rough(5.0)
    assert loud.frf is not None
    values = loud.frf.values * np.where(np.arange(N) == 3, 1e-2, 1.0)[:, None]
    assert dead_ones(replace(loud, frf=replace(loud.frf, values=values)), rough(1.0)) == [("4:+Z",)]


@pytest.mark.parametrize("given", [True, False])
def test_one_signal_under_two_labels_shares_its_noise(given: bool) -> None:
    """No two sensors have the same noise, so no model is needed."""
    frf = recording()
    values, variance = frf.values.copy(), frf.variance.copy()  # type: ignore[union-attr]
    values[:, 6], variance[:, 6] = values[:, 2], variance[:, 2]
    frf = replace(frf, values=values, variance=variance if given else None)
    (found,) = channel_checks(frf)[0]
    assert (found.kind, found.severity) == ("duplicated channels", "fault")
    assert found.channels == ("3:+Z", "7:+Z")
    assert 'use = "no"' in found.repair


def test_two_equal_places_are_looked_at_but_no_fault() -> None:
    """Mirror places of a symmetric article answer alike, each with a noise of its own."""
    phi = PHI.copy()
    phi[6] = phi[2]
    (found,) = channel_checks(recording(phi=phi))[0]
    assert (found.kind, found.severity) == ("equal channels", "warning")


def test_the_force_puts_power_in() -> None:
    frf = recording()
    values = frf.values.copy()
    values[:, 0] *= -1
    assert kinds(replace(frf, values=values)) == {"reversed sign": ("1:+Z",)}
    for quantity in ("receptance", "mobility"):
        assert kinds(frf.to(quantity)) == {}  # type: ignore[arg-type]


def test_reciprocity_needs_and_finds_two_drive_points() -> None:
    frf = recording(1e-3, drives=(0, 1))
    assert kinds(frf) == {}
    wrong = frf.values.copy()
    wrong[:, 1] *= 1.3  # output 2 reads 30 % too much
    assert kinds(replace(frf, values=wrong)) == {"not reciprocal": ("1:+Z", "2:+Z")}
    said = {c.name: c.passed for c in channel_checks(recording())[1]}
    assert said["reciprocity"] is None
    assert said["coherence"] is None


@pytest.mark.parametrize("delay", [4e-4, -2e-3])
def test_a_delay_of_the_whole_chain_is_measured(delay: float) -> None:
    frf = recording()
    late = replace(frf, values=frf.values * np.exp(-2j * np.pi * F * delay)[:, None, None])
    found = screened(Recording("a", late), identify(late))
    (fault,) = [f for f in found.findings if f.kind == "delay"]
    assert fault.value == pytest.approx(delay, rel=0.1)
    assert f"delay = {fault.value:.4g}" in fault.repair


def test_the_fit_of_a_delay_is_modulo_pi() -> None:
    omega = 2 * np.pi * MODES
    fit = fitted_delay(omega, -omega * 1e-3 + np.pi * np.arange(len(omega)))
    assert fit.delay == pytest.approx(1e-3, rel=0.01)
    assert fit.after < 0.02 < fit.before
    assert fitted_delay(omega, np.full(len(omega), np.pi / 2)).quarter == 1


def gains(frf: FRF, known: Identified | None = None) -> tuple:
    found = strong_modes(known or identify(frf))
    return found, *modal_gains(found, PHI, PHI[:1], 1.07 * MODES)


def test_levels_of_a_sound_recording_agree_with_a_model_whose_frequencies_are_off() -> None:
    findings, check = level_checks(*gains(recording()), outputs=N)
    assert findings == []
    assert check.passed


@pytest.mark.parametrize("factor", [9.80665, 1 / 4.4482216])
def test_wrong_units_are_named_with_the_factor_that_mends_them(factor: float) -> None:
    frf = recording()
    wrong = replace(frf, values=frf.values / factor, variance=frf.variance / factor**2)  # type: ignore[operator]
    (found,), _ = level_checks(*gains(wrong), outputs=N)
    assert found.kind == "wrong units"
    assert found.value == pytest.approx(factor, rel=1e-6)
    assert level_checks(*gains(wrong), known_gain=False, outputs=N)[0] == []


@pytest.mark.parametrize("quantity", ["receptance", "mobility"])
def test_a_wrong_quantity_is_named(quantity: str) -> None:
    """Whether the gain is known or not."""
    wrong = replace(recording().to(quantity), quantity="accelerance")  # type: ignore[arg-type]
    modes = identify(wrong, use=np.arange(len(F)) % 3 == 0)
    screening = screened(Recording("a", wrong), modes)
    found = screening.findings
    if quantity == "mobility":  # found by reading it otherwise; a receptance by its level
        roving = next(c for c in screening.checks if c.name == "one mass at all outputs")
        assert (roving.passed, "right reading" in roving.result) == (None, True)
    for known in (True, False):
        more, _ = level_checks(*gains(wrong, modes), known_gain=known, outputs=N)
        named = [f for f in (*found, *more) if f.kind == "wrong quantity"]
        assert named
        assert f'quantity = "{quantity}"' in " ".join(f.repair for f in named)


def test_a_reading_that_fits_no_better_is_no_other_one() -> None:
    """Twice the residual, and the same."""
    modes, (error, *_) = identify(recording()), misreadings(recording())
    for chi in (modes.chi, 2 * modes.chi):
        assert other_reading(modes, {error: replace(modes, chi=chi)}) == []


def test_a_reversed_force_turns_every_mode() -> None:
    frf = recording()
    (found,), _ = level_checks(*gains(replace(frf, values=-frf.values)), outputs=N)
    assert found.kind == "reversed force"


# a model whose frequencies are 5 % off, whose modes are mixed a little and shapes wrong by 5 %
MANY = 18
SHAPES = np.random.default_rng(11).normal(size=(MANY, len(MODES)))
NAMES = tuple(f"{k}:+Z" for k in range(1, MANY + 1))
_ERROR = np.random.default_rng(8)
MIXED = SHAPES @ (np.eye(8) + 0.05 * _ERROR.normal(size=(8, 8)))
WRONG = MIXED * (1 + 0.05 * _ERROR.normal(size=SHAPES.shape))
MODEL = ModelShapes(WRONG, 1.05 * MODES)


def faults(psi: np.ndarray, model: ModelShapes = MODEL) -> list[tuple[str, tuple[str, ...]]]:
    return [(f.kind, f.channels) for f in shape_faults(NAMES, psi, MODES, model)]


def test_shapes_of_an_imperfect_model_raise_no_alarm() -> None:
    assert faults(SHAPES) == []
    assert faults(SHAPES * np.linspace(-3, 5, 8)) == []  # the scale of a mode is nothing


def test_a_sign_a_gain_and_an_exchange_are_told_apart() -> None:
    exchanged = np.arange(MANY)
    exchanged[[2, 7]] = 7, 2
    for change, due in (
        (times({3: -1.0}), [("reversed sign", ("4:+Z",))]),
        (times({4: 2.0}), [("wrong gain", ("5:+Z",))]),
        (times({1: -1.0, 6: 3.0}), [("reversed sign", ("2:+Z",)), ("wrong gain", ("7:+Z",))]),
        (np.eye(MANY)[exchanged], [("swapped channels", ("3:+Z", "8:+Z"))]),
    ):
        assert sorted(faults(change @ SHAPES)) == due


@pytest.mark.parametrize("gain", [0.02, 10.0, 400.0, -25.0])
def test_a_gain_of_any_size_is_told_as_it_is(gain: float) -> None:
    """The line that is asked for divides it away at once, not by steps."""
    (found,) = shape_faults(NAMES, times({4: gain}) @ SHAPES, MODES, MODEL)
    assert (found.kind, found.channels) == ("wrong gain", ("5:+Z",))
    assert found.value == pytest.approx(gain, rel=0.1)


def times(gains: dict[int, float]) -> np.ndarray:
    return np.diag([gains.get(k, 1.0) for k in range(MANY)])


def test_a_sensor_elsewhere_and_one_turned_are_found_among_the_places_offered() -> None:
    places = np.random.default_rng(9).normal(size=(30, 8))
    ways = np.random.default_rng(10).normal(size=(4, 8))
    model = replace(
        MODEL,
        turned=lambda i: (ways, ["+X", "-X", "+Y", "-Y"]),
        elsewhere=lambda i: (places, [f"grid {k}" for k in range(30)]),
    )
    assert faults(SHAPES, model) == []
    for row, kind in ((places[11], "misplaced sensor"), (ways[2], "turned sensor")):
        psi = SHAPES.copy()
        psi[5] = row
        (found,) = shape_faults(NAMES, psi, MODES, model)
        assert (found.kind, found.channels) == (kind, ("6:+Z",))
        assert ("grid 11" if kind == "misplaced sensor" else "+Y") in found.text


def test_few_channels_or_modes_say_nothing() -> None:
    assert shape_faults(NAMES[:4], -SHAPES[:4], MODES, ModelShapes(SHAPES[:4], MODES)) == []
    assert shape_faults(NAMES, SHAPES[:, :3], MODES[:3], MODEL) == []


def test_a_channel_that_the_model_misjudges_has_no_wrong_gain() -> None:
    """Twice as large in half of its modes and half as large in the others, it has no gain at all.

    Larger in all of them, if not by the same factor, it is half explained by one; that is what a
    patch about the sensor does, and no calibrator finds it.
    """
    each = np.exp(np.linspace(0.1, 0.9, SHAPES.shape[1]))
    for factors in (each, np.tile([2.0, 0.5], SHAPES.shape[1])[: SHAPES.shape[1]]):
        psi = SHAPES.copy()
        psi[4] *= factors
        assert faults(psi) == []
    assert faults(times({4: 1.65}) @ SHAPES) == [("wrong gain", ("5:+Z",))]


@pytest.mark.parametrize("n", [5, 6, 14])
def test_slope_and_interval_are_those_of_theil_and_sen(n: int) -> None:
    from scipy.stats import theilslopes

    rng = np.random.default_rng(n)
    x = np.sort(rng.normal(size=n))
    y = -2 * x + 0.3 * rng.standard_t(2, size=n)
    slope, _, low, high = theilslopes(y, x, 0.999)
    np.testing.assert_allclose(median_slope(y, x), (slope, low, high), rtol=1e-12)
