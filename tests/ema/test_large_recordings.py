"""Many channels or lines: band by band is as good as all at once."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from chladni.ema import identification, pole_fitting, pole_search_by_parts
from chladni.ema.condensed_lines import condensed, oversampled
from chladni.ema.identification import identify, kept_lines, pole_data
from chladni.ema.out_of_band_poles import outside, with_outer_poles
from chladni.ema.pole_fitting import PoleData, linear, normal_matrices, polish, solve
from chladni.ema.pole_search import selected
from chladni.ema.pole_search_by_parts import core_bands, few_channels, searched_by_parts
from chladni.ema.pole_selection import ORDERS, Rule, shared_noise, uncertainty
from chladni_evidence.identification_evidence import held_against, recording, structure


@pytest.mark.parametrize("kind", ["share", "floor, unsaid"])
def test_bands_find_what_the_whole_finds(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three bands, forty channels in thirty-two combinations: as sure as the fit of all at once.

    At the ends of the band the two may stand for what rings beyond by other poles, so that there
    only the truth is asked.
    """
    known = structure(7, 9, 40)
    frf, variance = recording(known, kind, 7, lines=900)
    whole = identify(frf)
    monkeypatch.setattr(identification, "is_large", lambda data: True)
    monkeypatch.setattr(pole_search_by_parts, "PER_BAND", 300)
    found = identify(frf)
    sure([held_against(known, frf, variance, found)])
    here, there = (one.sel(np.flatnonzero(one.inside)[1:-1]) for one in (found, whole))
    assert (np.abs(here.frequency - there.frequency) < there.frequency_sd).all()
    np.testing.assert_allclose(here.frequency_sd, there.frequency_sd, rtol=0.25)
    assert found.chi == pytest.approx(whole.chi, rel=0.02)


def test_combinations_of_channels_carry_the_modes_and_the_noise() -> None:
    """Weights are those of the noise: what is left of the combinations has unit variance."""
    known = structure(8, 6, 60)
    frf, _ = recording(known, "floor", 8, lines=500)
    data, _ = pole_data(frf, frf.frequency > 0)
    few = few_channels(data)
    data_scale = (2 * np.pi * frf.frequency[-1]) ** 2
    clean = known.accelerance(frf.frequency) / data_scale
    h = np.sqrt((data.w**2).mean(axis=0))
    V, *_ = np.linalg.lstsq(h * data.y, few.y, rcond=None)
    fresh = recording(known, "floor", 80, lines=500)[0].values[:, :, 0] / data_scale
    noise = few.w * ((h * (fresh - clean)) @ V)  # V knows the noise it was made of
    assert (np.abs(noise) ** 2).mean() == pytest.approx(2.0, rel=0.05)
    left = h * clean - (h * clean) @ V.real @ V.real.T
    assert np.linalg.norm(left) < 1e-2 * np.linalg.norm(h * clean)


def test_bands_are_cut_between_resonances() -> None:
    known = structure(9, 12, 10)
    frf, _ = recording(known, "floor", 9, lines=4000)
    data, _ = pole_data(frf, frf.frequency > 0)
    bands = core_bands(data)
    assert bands[0][0] == 0
    assert bands[-1][1] == 4000
    assert all(a[1] == b[0] for a, b in pairwise(bands))
    for low, _ in bands[1:]:
        gap = np.abs(2 * np.pi * frf.frequency[low] - np.abs(known.poles))
        assert (gap > 2 * np.abs(known.poles.real)).all()


def sure(told: list) -> None:
    """No mode is missed or invented, and errors are as large as the standard deviations say."""
    assert {(one.missed, one.invented) for one in told} == {(0, 0)}
    z = np.concatenate([z for one in told for z in (one.z_frequency, one.z_damping)])
    assert np.sqrt((z**2).mean()) < 1 + 3 / np.sqrt(2 * len(z))


def test_many_lines_are_as_sure_as_they_say() -> None:
    """What rings beside the band stands out of the noise of many lines; no mode inside moves."""
    told = []
    for seed in (588, 590):
        known = structure(seed, 6, 3)
        frf, variance = recording(known, "share", seed, lines=2500)
        told.append(held_against(known, frf, variance, identify(frf)))
    sure(told)


@pytest.fixture
def data(monkeypatch: pytest.MonkeyPatch) -> PoleData:
    """A recording that is searched in three bands."""
    monkeypatch.setattr(pole_search_by_parts, "PER_BAND", 400)
    frf, _ = recording(structure(588, 6, 3), "share", 588, lines=1200)
    return pole_data(frf, kept_lines(frf))[0]


def test_a_pole_that_is_significant_in_its_band_only_is_removed(data, monkeypatch) -> None:
    """Each band returns a pole too many; all lines together show that it explains nothing."""
    part = pole_search_by_parts._part

    def with_one_more(*given):
        found = part(*given)
        middle = 0.5 * (found.begin + min(found.end, 1.0))
        return replace(found, poles=np.append(found.poles, middle * (1j - 1e-4)))

    monkeypatch.setattr(pole_search_by_parts, "_part", with_one_more)
    found = searched_by_parts(data, Rule(3, len(data.s)), True, ORDERS, 4)
    assert not (np.abs(found.fit.p.real) < 5e-4 * np.abs(found.fit.p)).any()


def test_bands_that_are_polished_apart_do_not_worsen_the_whole(data, monkeypatch) -> None:
    """If separate polishing moves the poles to a poorer fit, the joint fit is the answer."""
    given = data, Rule(3, len(data.s)), True, ORDERS, 4
    polished, right = pole_search_by_parts._polished, searched_by_parts(*given)

    def astray(*given):
        p, *rest = polished(*given)
        return 1.01 * p, *rest

    monkeypatch.setattr(pole_search_by_parts, "_polished", astray)
    found = searched_by_parts(*given)
    assert found.chi == pytest.approx(right.chi, rel=1e-2)
    inside = ~outside(data, right.fit.p)
    apart = np.abs(found.fit.p[:, None] - right.fit.p[inside]).min(axis=0)
    assert (apart < 10 * right.spread[0][inside]).all()


def test_noise_that_all_channels_share_is_no_mode() -> None:
    """Noise of the force is in all channels: it costs as much as one channel's, and looks sharp."""
    known = structure(594, 5, 20)
    frf, _ = recording(known, "share", 594, lines=700)
    data, omega_max = pole_data(frf, kept_lines(frf))
    inner = known.inside / omega_max
    A = linear(data.s, inner, data.q)
    clean = A @ np.linalg.lstsq(A, data.y, rcond=None)[0].real
    rng = np.random.default_rng(594)
    own, common = (rng.normal(size=(len(data.s), n, 2)) @ [1, 1j] for n in (20, 1))
    noise = np.sqrt(0.1) * own + np.sqrt(0.9) * common
    noisy = PoleData(data.s, clean + noise / data.w, data.w, data.q)
    fit, _ = selected(noisy, ORDERS, Rule(20, len(data.s)), 12)
    inside = ~outside(noisy, fit.p)
    assert inside.sum() == len(inner)
    assert shared_noise(own) == pytest.approx(1.0, abs=0.01)
    assert shared_noise(np.repeat(common, 20, axis=1)) == pytest.approx(20.0, rel=0.01)


def test_noise_that_nobody_states_goes_with_all_that_rings(monkeypatch: pytest.MonkeyPatch) -> None:
    """A band's own modes are a part of the response; noise is a share of the whole of it."""
    monkeypatch.setattr(identification, "is_large", lambda data: True)
    monkeypatch.setattr(pole_search_by_parts, "PER_BAND", 60)
    told = []
    for seed in (588, 591):
        known = structure(seed, 9, 10)
        frf, variance = recording(known, "share, unsaid", seed, lines=700)
        told.append(held_against(known, frf, variance, identify(frf)))
    sure(told)


def test_poles_stand_beside_the_band_only_where_something_rings() -> None:
    """With modes there the noise alone is left; of residual terms alone no pole is made."""
    known = structure(589, 5, 4)
    frf, _ = recording(known, "share", 589, lines=4000)
    data, omega_max = pole_data(frf, kept_lines(frf))
    rule = Rule(4, len(data.s))
    inner = known.inside / omega_max
    fit, _ = with_outer_poles(data, inner, rule)
    assert outside(data, fit.p).any()
    assert fit.chi2 < data.samples + 4 * np.sqrt(2 * data.samples)

    rng = np.random.default_rng(589)
    A = linear(data.s, inner, data.q)
    clean = A @ np.linalg.lstsq(A, data.y, rcond=None)[0].real
    noise = (rng.normal(size=clean.shape) + 1j * rng.normal(size=clean.shape)) / data.w
    alone, _ = with_outer_poles(PoleData(data.s, clean + noise, data.w, data.q), inner, rule)
    assert not outside(data, alone.p).any()
    assert len(alone.p) == len(inner)


@pytest.mark.parametrize("channels", [3, 40])
def test_normal_matrices_are_the_weighted_sums(channels: int, monkeypatch) -> None:
    """Few channels one by one, many by products of columns, in blocks of lines: Σ v² q qᵀ."""
    monkeypatch.setattr(pole_fitting, "_PRODUCTS", 200)
    rng = np.random.default_rng(590)
    n, m = 50, 6
    y = rng.normal(size=(2, n, channels + 2))
    data = PoleData(1j * np.linspace(0.1, 1, n), y[0] + 1j * y[1], rng.uniform(0, 2, y[0].shape), 2)
    Q, at = rng.normal(size=(2 * n, m)), slice(1, channels + 1)
    G, b = normal_matrices(Q, data, at)
    g = np.concatenate([data.common] * 2)
    v = np.concatenate([data.w] * 2)[:, at] / g[:, None]
    t = g[:, None] * np.concatenate([data.y.real, data.y.imag])[:, at]
    np.testing.assert_allclose(G, np.einsum("ki,kc,kj->cij", Q, v**2, Q), atol=1e-12)
    np.testing.assert_allclose(b, np.einsum("ki,kc,kc->ci", Q, v**2, t), atol=1e-12)


def test_bins_of_lines_know_the_poles_as_well_as_the_lines_do() -> None:
    """From poles that are off by many standard deviations both fits arrive at the same place."""
    known = structure(589, 6, 4)
    frf, _ = recording(known, "share", 589, lines=4000)
    data, _ = pole_data(frf, kept_lines(frf))
    inner = known.inside / (2 * np.pi * frf.frequency[-1])
    p = with_outer_poles(data, inner, Rule(4, len(data.s)))[0].p
    off = np.where(outside(data, p), p, p * (1 + 3e-4))
    few = condensed(data, solve(data, off)[0])
    assert len(few.s) < len(data.s) / 8
    assert (few.w**2).sum() == pytest.approx((data.w**2).sum())
    (a, slope_a), (b, slope_b) = polish(data, off, tol=1e-3), polish(few, off, tol=1e-3)
    sd, its = (uncertainty(p, slope, 1.0)[0] for slope in (slope_a, slope_b))
    within = ~outside(data, p)
    assert (np.abs(off - a.p) > 5 * sd)[within].all()
    assert (np.abs(b.p - a.p) < 0.25 * sd)[within].all()
    np.testing.assert_allclose(its[within], sd[within], rtol=0.03)


def test_a_long_identification_says_how_long_it_takes(monkeypatch) -> None:
    """Its size before, a count and the time that is left during; the order of work changes none."""
    monkeypatch.setattr(identification, "is_large", lambda data: True)
    monkeypatch.setattr(pole_search_by_parts, "PER_BAND", 300)
    frf, _ = recording(structure(7, 9, 5), "share", 7, lines=900)
    seen: list[tuple[str, float]] = []
    found = identify(frf, progress=lambda what, x: seen.append((what, x)))
    assert seen[0] == ("identifying 5 channels x 900 lines: band 0 of 3", 0.0)
    assert [what.split(",")[0][-6:] for what, _ in seen[1:4]] == ["1 of 3", "2 of 3", "3 of 3"]
    assert all(a[1] <= b[1] for a, b in pairwise(seen))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    np.testing.assert_array_equal(identify(frf).poles, found.poles)


def test_sums_of_lines_lead_to_the_poles_of_all_lines() -> None:
    """Neighbours are summed without knowledge of poles: off by their noise, none is lost.

    A second condensation about the poles found is as good as all lines.
    """
    known = structure(589, 6, 4)
    frf, _ = recording(known, "share", 589, lines=8000)
    data, omega_max = pole_data(frf, kept_lines(frf))
    few = oversampled(data)
    assert len(few.s) < len(data.s) / 4
    assert 0.99 < (few.w**2).sum() / (data.w**2).sum() < 1
    p = with_outer_poles(data, known.inside / omega_max, Rule(4, len(data.s)))[0].p
    (a, slope_a), (b, slope_b) = polish(data, p, tol=1e-3), polish(few, p, tol=1e-3)
    sd, its = (uncertainty(p, slope, 1.0)[0] for slope in (slope_a, slope_b))
    within = ~outside(data, p)
    np.testing.assert_allclose(its[within], sd[within], rtol=0.03)
    assert (np.abs(b.p - a.p) < 5 * sd)[within].all()
    c, _ = polish(condensed(data, solve(few, b.p)[0]), b.p, tol=1e-3)
    assert (np.abs(c.p - a.p) < 0.25 * sd)[within].all()


def test_samples_that_do_not_count_spoil_no_sum() -> None:
    frf, _ = recording(structure(589, 6, 4), "share", 589, lines=2000)
    data, _ = pole_data(frf, kept_lines(frf))
    w = data.w.copy()
    w[::40, 1] = 0
    few = oversampled(replace(data, w=w, y=np.where(w > 0, data.y, 0)))
    assert (few.w[:, 1] ** 2).sum() > 0.97 * (w[:, 1] ** 2).sum()


def test_a_peak_narrower_than_a_sum_stays_apart() -> None:
    """A line that stands out of the noise of all channels together is summed with none."""
    rng = np.random.default_rng(592)
    s, e = 1j * np.linspace(0.1, 1, 1000), rng.normal(size=(1000, 20, 2)) @ [1, 1j]
    data = PoleData(s, 3 + e, np.ones((1000, 20)), 2)
    e[500] += 4
    peak = replace(data, y=3 + e)
    assert len(oversampled(data).s) < 50
    assert np.abs(oversampled(peak).s - s[500]).min() == pytest.approx(0, abs=1e-12)


def test_the_noise_of_lines_is_their_own() -> None:
    """Noise stated ten times too large hides no course; ten times too small, lines still repeat."""
    frf, _ = recording(structure(589, 6, 4), "share", 589, lines=8000)
    data, _ = pole_data(frf, kept_lines(frf))
    for factor in (0.1, 10):
        np.testing.assert_allclose(
            oversampled(replace(data, w=factor * data.w)).s, oversampled(data).s
        )


def test_lines_that_resolve_nothing_stay() -> None:
    """Three lines a resonance, whatever noise is stated: none repeats its neighbour."""
    s = 1j * np.linspace(0.1, 1, 1200)
    p = np.linspace(0.1, 1, 400) * (1j - 1e-3)
    rng = np.random.default_rng(593)
    y = linear(s, p, 2)[:, :-2] @ rng.normal(size=(2 * len(p), 5))
    for noise in (1e-3, 1.0):
        w = np.full(y.shape, 1 / (noise * np.abs(y).mean()))
        assert len(oversampled(PoleData(s, y, w, 2)).s) > 0.9 * len(s)


def test_combinations_of_noise_alone_are_left_out() -> None:
    """Six modes in and beside a band have six shapes; forty channels hold no more than noise."""
    known = structure(8, 6, 40)
    frf, _ = recording(known, "floor", 8, lines=2000)
    data, _ = pole_data(frf, frf.frequency > 0)
    few = few_channels(data, above_noise=True)
    assert 6 <= few.y.shape[1] <= len(known.poles)
    loud = few_channels(replace(data, w=data.w / 10), above_noise=True)
    assert loud.y.shape[1] == few.y.shape[1]
    hiss = np.random.default_rng(8).normal(size=(*data.y.shape, 2)) @ [1, 1j]
    noise = replace(data, y=hiss / data.w)
    assert few_channels(noise, above_noise=True).y.shape[1] == 1
