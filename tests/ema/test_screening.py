"""Screening: dead and incoherent channels, usable bands, linear or not."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.dynamics.frf import FRF
from chladni.ema.finding import Finding, Screening
from chladni.ema.screening import homogeneity, levels_checked, roughness, runs
from chladni.ema.setup import Recording

F = np.arange(1.0, 401.0)
LABELS = tuple(f"{k}:+Z" for k in range(5))


def resonance(
    stiffness: float = 1.0, noise: float = 0.01, seed: int = 0, given: bool = True
) -> FRF:
    """Five channels of one mode and a floor, with noise of a known size."""
    rng = np.random.default_rng(seed)
    f0 = 150 * np.sqrt(stiffness)
    H = 1 / (f0**2 - F**2 + 0.04j * f0 * F)[:, None, None] * np.linspace(1, 2, 5)[None, :, None]
    H = H + 1e-5
    sd = noise * np.abs(H)
    hiss = rng.normal(size=(2, *H.shape)) / np.sqrt(2)
    H = H + sd * (hiss[0] + 1j * hiss[1])
    return FRF(H, F, LABELS, ("9:+Z",), variance=sd**2 if given else None)


def test_noise_is_seen_in_the_roughness() -> None:
    """The estimate from one recording is the variance that was put in, beside the resonance."""
    H = resonance(noise=0.02, seed=4, given=False)
    due = (0.02 * np.abs(H.values)) ** 2
    away = np.abs(F - 150) > 30
    assert np.median((roughness(H) / due)[away]) == pytest.approx(1.0, rel=0.25)


@pytest.mark.parametrize("given", [True, False])
def test_repeats_of_a_linear_structure_differ_by_noise(given: bool) -> None:
    result = homogeneity(resonance(seed=1, given=given), resonance(seed=2, given=given))
    assert result.linear
    if given:
        assert result.ratio == pytest.approx(1.0, abs=5 / np.sqrt(2000))


@pytest.mark.parametrize("given", [True, False])
def test_a_structure_that_stiffens_with_the_level_is_found(given: bool) -> None:
    """2 % in stiffness between the levels; the lines that show it lie about the resonance."""
    result = homogeneity(resonance(seed=1, given=given), resonance(1.02, seed=2, given=given))
    assert not result.linear
    assert abs(result.frequency[result.line.argmax()] - 150) < 15


def test_band_and_channels_of_what_is_not_linear_are_named() -> None:
    """Only the last two channels move, and only about their resonance."""
    low, high = resonance(seed=1), resonance(1.02, seed=2)
    values = resonance(seed=3).values.copy()
    values[:, 3:] = high.values[:, 3:]
    there = replace(high, values=values)
    found, _ = levels_checked(Recording("a", low, level=1.0), [Recording("b", there, level=5.0)])
    assert set(found[0].channels) == {"3:+Z", "4:+Z"}
    first, last = homogeneity(low, there).bands[0]
    assert 20 < first < 150 < last < 260
    assert f"{first:.4g} to {last:.4g} Hz" in found[0].text


def test_the_channel_that_moves_most_is_named_first() -> None:
    """Half its own response in 5 % of noise, not a fiftieth of it in 0.1 % of noise."""
    low, rng = resonance(seed=1), np.random.default_rng(2)
    clean, share = resonance(noise=0.0).values, np.array([0.01, 0.01, 0.001, 0.05, 0.01])
    sd = share[:, None] * np.abs(clean)
    frfs = []
    for change in (np.zeros(5), np.array([0, 0, 0.02, 0.5, 0])):
        hiss = rng.normal(size=(2, *sd.shape)) / np.sqrt(2)
        values = clean * (1 + change[:, None]) + sd * (hiss[0] + 1j * hiss[1])
        frfs.append(replace(low, values=values, variance=sd**2))
    found = homogeneity(*frfs)
    assert found.channel[2] > found.channel[3]
    assert found.channels == ("3:+Z", "2:+Z")
    assert homogeneity(*reversed(frfs)).channels == ("3:+Z", "2:+Z")


@pytest.mark.parametrize("count", [10, pytest.param(100, marks=pytest.mark.slow)])
def test_levels_of_a_linear_structure_are_never_found(count: int) -> None:
    for k in range(count):
        a, b = resonance(seed=1000 + k), resonance(seed=3000 + k)
        assert homogeneity(a, b).linear
        found, _ = levels_checked(Recording("a", a, level=1.0), [Recording("b", b, level=4.0)])
        assert not found


def test_significant_but_negligible_is_linear() -> None:
    """With hardly any noise a thousandth of a per cent is significant; it still is no effect."""
    result = homogeneity(resonance(noise=1e-6, seed=1), resonance(1.00001, noise=1e-6, seed=2))
    assert result.ratio > 10
    assert result.linear


def test_levels_on_other_lines_are_interpolated() -> None:
    H = resonance(noise=1e-4)
    f0, f = 150.0, F + 0.5
    values = 1 / (f0**2 - f**2 + 0.04j * f0 * f)[:, None, None] * np.linspace(1, 2, 5)[:, None]
    finer = replace(H, frequency=f, values=values + 1e-5)
    result = homogeneity(H, finer)
    assert result.rms < 5e-3
    says("share 0 lines", homogeneity, H, replace(H, frequency=F + 1000))
    says(r"FRF\.sel", homogeneity, H, H.sel(LABELS[:2]))


def test_runs_of_lines() -> None:
    assert runs(F[:5], np.array([True, False, True, True, True])) == ((3.0, 5.0),)


def test_what_is_found_several_times_is_said_once():
    """As levels do that all differ from the lowest."""
    one = Finding("not linear", "levels differ.", "warning", ("2:+Z",))
    said = Screening("a", (one, replace(one, kind="delay"), one)).sentence
    assert said == "a is to be checked: 2 times not linear (2:+Z), delay (2:+Z)"
