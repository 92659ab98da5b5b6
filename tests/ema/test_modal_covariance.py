"""Covariance of poles, residues and shapes against their scatter; what a MAC is worth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest
from tests.builders.refusals import says

from chladni.ema import condensed_lines, propagation
from chladni.ema.condensed_lines import line_bins
from chladni.ema.correlation import mac
from chladni.ema.identification import evaluate, identify, kept_lines, pole_data
from chladni.ema.mac_significance import best_half, chance_of, effective_channels, likeness
from chladni.ema.modal_covariance import modal_covariance
from chladni.ema.pole_fitting import solve
from chladni.ema.propagation import propagated
from chladni.ema.response_variance import frf_variance
from chladni.ema.shapes import real_shapes, shape_covariance, shape_sd, shape_spread, shapes
from chladni_evidence.identification_evidence import recording, structure

SEEDS, CHANNELS, MODES = 24, 6, 4


@pytest.fixture(scope="module")
def found():
    """The same structure recorded again and again; runs that found the same poles."""
    known = structure(565, MODES, CHANNELS)
    runs = [identify(recording(known, "share", k, lines=300)[0]) for k in range(SEEDS)]
    runs = [r.sel(r.inside) for r in runs]
    runs = [r for r in runs if r.order == MODES]
    assert len(runs) > 0.8 * SEEDS
    return runs


def whole_covariance(root, local):
    """C (2 + 2 n_c, 2 + 2 n_c) of one mode's pole and residues."""
    C = root @ root.T
    for c, block in enumerate(local):
        C[2 + 2 * c : 4 + 2 * c, 2 + 2 * c : 4 + 2 * c] += block
    return C


def test_it_is_the_inverse_of_the_whole_information_matrix():
    """(JᵀJ)⁻¹ over poles, residues and residual terms of all channels, J by differences."""
    frf = recording(structure(566, 2, 3), "share", 1, lines=200)[0]
    found = identify(frf)
    r, n_c = found.order, 3
    w = np.sqrt(2 / frf_variance(frf)).reshape(len(frf.frequency), n_c)
    s = 2j * np.pi * frf.frequency

    def model(x):
        p, R = x[: 2 * r].view(complex), x[2 * r : 2 * r * (1 + n_c)].view(complex)
        lower, upper = x[-2 * n_c : -n_c, None], x[-n_c:, None]
        one = replace(found, lower=lower, upper=upper)
        H = w * evaluate(one, s, p, R.reshape(r, n_c, 1))[:, :, 0]
        return np.concatenate([H.real.ravel(), H.imag.ravel()])

    x = np.concatenate([
        found.poles.view(float), found.residues.ravel().view(float), found.lower.ravel(),
        found.upper.ravel(),
    ])  # fmt: skip
    J = []
    for k in range(len(x)):
        h = np.zeros(len(x))
        h[k] = 1e-6 * max(abs(x[k]), 1e-12)
        J.append((model(x + h) - model(x - h)) / (2 * h[k]))
    scale = np.linalg.norm(J, axis=1)
    J = np.array(J).T / scale
    C = np.linalg.inv(J.T @ J) / np.outer(scale, scale) * max(1.0, found.chi) ** 2
    for k in range(r):
        if not found.inside[k]:
            continue
        at = np.r_[2 * k, 2 * k + 1, 2 * r + 2 * n_c * k + np.arange(2 * n_c)]
        due = C[np.ix_(at, at)]
        sd = np.sqrt(np.diag(due))
        got = whole_covariance(*found.covariance.of_mode(k))
        np.testing.assert_allclose(got / np.outer(sd, sd), due / np.outer(sd, sd), atol=2e-3)
    both = C[: 2 * r, : 2 * r]
    L = found.covariance.pole.reshape(2 * r, -1)
    sd = np.sqrt(np.diag(both))
    np.testing.assert_allclose(L @ L.T / np.outer(sd, sd), both / np.outer(sd, sd), atol=2e-3)


def ratio(values, covariances):
    """Mean of dᵀC⁻¹d over its expectation; 1 where C is the covariance of the values."""
    values = np.asarray(values)
    away, q, rank = values - values.mean(axis=0), 0.0, 0
    for d, C in zip(away, covariances, strict=True):
        w, U = np.linalg.eigh(C)
        keep = w > 1e-9 * w[-1]
        q += ((U[:, keep].T @ d) ** 2 / w[keep]).sum()
        rank += keep.sum()
    return q / rank * len(values) / (len(values) - 1)


def close_to_one(ratios, dof):
    """Four standard deviations of a mean of χ² over all modes, which are nearly independent."""
    assert abs(np.mean(ratios) - 1) < 4 * np.sqrt(2 / dof)


def test_poles_and_residues_scatter_as_foretold(found):
    ratios = []
    for k in range(MODES):
        values, covariances = [], []
        for one in found:
            R = one.residues[k].ravel()
            p = one.poles[k]
            values.append(np.stack([np.r_[p, R].real, np.r_[p, R].imag], axis=1).ravel())
            covariances.append(whole_covariance(*one.covariance.of_mode(k)))
        ratios.append(ratio(values, covariances))
    close_to_one(ratios, MODES * len(found) * (2 + 2 * CHANNELS))


@pytest.fixture(scope="module")
def real(found):
    """Real shapes of every run with one sign (runs, channels, modes), and their covariances."""
    psi = np.array([real_shapes(one) for one in found])
    psi *= np.sign(np.einsum("knr,nr->kr", psi, psi[0]))[:, None]
    return psi, np.array([shape_covariance(one) for one in found])


def test_shapes_scatter_as_foretold(real):
    """A unit shape has no spread along itself."""
    psi, C = real
    ratios = [ratio(psi[:, :, k], C[:, k]) for k in range(MODES)]
    close_to_one(ratios, MODES * len(psi) * (CHANNELS - 1))
    along = np.einsum("knr,krnm,kmr->kr", psi, C, psi)
    assert (along < 1e-6 * np.trace(C, axis1=2, axis2=3)).all()


def test_noise_leaves_the_mac_that_is_foretold(real):
    """Shapes of runs against the mean of all: 1 - MAC is the trace of the covariance."""
    psi, C = real
    lost, due = [], []
    for k in range(MODES):
        every = psi[:, :, k]
        lost.append(1 - mac(every.mean(axis=0)[:, None], every.T).mean())
        one = likeness(every[:1].T, every[0], C[:, k].mean(axis=0), 0, np.array([0]))
        due.append(1 - one.noise_leaves)
    close_to_one(np.divide(lost, due), MODES * len(psi) * (CHANNELS - 1))


def test_scaled_shapes_have_the_spread_that_is_written(found):
    values = np.array([shapes(one).values for one in found])
    values *= np.sign((values * values[0].conj()).real.sum(axis=1, keepdims=True))
    sd = np.array([shape_sd(one) for one in found])
    for part in (np.real, np.imag):
        over = part(values).var(axis=0, ddof=1) / (part(sd) ** 2).mean(axis=0)
        assert abs(over.mean() - 1) < 4 * np.sqrt(2 / (MODES * len(found)))


def test_the_root_holds_the_known_spread_of_poles(found):
    for one in found[:3]:
        size = np.abs(one.poles)
        C = propagated(one, lambda i: np.stack([np.abs(i.poles), i.damping], axis=1))
        sd = np.sqrt(np.diagonal(C, axis1=1, axis2=2))
        np.testing.assert_allclose(sd[:, 0] / size, one.frequency_sd / one.frequency, rtol=0.01)
        np.testing.assert_allclose(sd[:, 1], one.damping_sd, rtol=0.01)
        L = one.covariance.pole.reshape(2 * MODES, -1)
        assert np.linalg.eigvalsh(L @ L.T).min() > 0


@pytest.mark.parametrize("noise", ["share", "floor"])
def test_bins_of_lines_lose_next_to_nothing(noise, monkeypatch):
    """Σ w² over a bin at its middle: the sum over its lines, as columns are smooth in a bin."""
    frf = recording(structure(565, MODES, CHANNELS), noise, 1, lines=3000)[0]
    whole = identify(frf)
    data, top = pole_data(frf, kept_lines(frf))
    fit, _ = solve(data, whole.poles / top)
    assert len(line_bins(data.s, fit.p)) < len(data.s) / 4
    full = modal_covariance(data, fit.p, fit.x, 1.0)
    monkeypatch.setattr(condensed_lines, "WORK", 0)
    few = modal_covariance(data, fit.p, fit.x, 1.0)

    def sd(c):
        return np.sqrt((c.shared**2).sum(axis=-1) + np.diagonal(c.local, axis1=2, axis2=3))

    np.testing.assert_allclose(sd(few)[whole.inside], sd(full)[whole.inside], rtol=0.02)


def test_modes_may_be_taken_one_after_the_other(found, monkeypatch):
    """So many at a time as memory holds; the standard deviations are roots of the diagonal."""
    whole, sd = shape_covariance(found[0]), shape_spread(found[0])
    np.testing.assert_allclose(sd**2, np.trace(whole, axis1=1, axis2=2), rtol=1e-9)
    monkeypatch.setattr(propagation, "_TOGETHER", 1)
    np.testing.assert_allclose(shape_covariance(found[0]), whole, rtol=1e-9, atol=1e-30)
    none = found[0].sel(np.zeros(MODES, bool))
    assert len(shape_spread(none)) == 0
    assert shape_sd(none).shape == (CHANNELS, 0)


def test_no_covariance_is_said(found):
    none = replace(found[0], covariance=None)
    says("no covariance", shape_covariance, none, error=ValueError)


@pytest.mark.parametrize(("n", "trials"), [(4, 1), (12, 1), (12, 7)])
def test_chance_is_uniform_for_random_shapes(n, trials):
    """P-values of the best of so many MACs of random directions are uniform."""
    rng = np.random.default_rng(565)
    best = [mac(rng.normal(size=(n, 1)), rng.normal(size=(n, trials))).max() for _ in range(600)]
    assert kstest([chance_of(x, n, trials) for x in best], "uniform").pvalue > 1e-3


def test_channels_that_move_together_count_once():
    """Copies of a channel add no evidence: neither dimension nor chance changes."""
    phi = np.random.default_rng(566).normal(size=(5, 40))
    twice = np.repeat(phi, 3, axis=0)
    assert effective_channels(twice) == pytest.approx(effective_channels(phi), rel=0.02)
    assert effective_channels(phi) == pytest.approx(5, rel=0.2)


def test_the_best_half_proves_nothing():
    """Half of the channels can be had alike for a random shape; a bad channel's half stands out."""
    rng = np.random.default_rng(567)
    phi, psi = rng.normal(size=(12, 6)), rng.normal(size=12)
    every = best_half(phi[:, 0], psi[:, None])[0]
    assert every > 2 * mac(phi[:, :1], psi[:, None])[0, 0]
    spoilt = phi[:, 0].copy()
    spoilt[:4] = 3 * rng.normal(size=4)
    none = np.zeros((12, 12))
    unit = spoilt / np.linalg.norm(spoilt)
    bad = likeness(phi, unit, none, 0, np.array([0]))
    noise = likeness(phi, psi / np.linalg.norm(psi), none, 0, np.array([0]))
    assert bad.half > 1 - 1e-9
    assert bad.half_chance < 0.01 < noise.half_chance


def test_what_is_not_seen_does_not_count():
    """Channels below their noise are left out without a look at the model."""
    rng = np.random.default_rng(568)
    phi = rng.normal(size=(10, 4))
    psi, C = phi[:, 1].copy(), np.zeros((10, 10))
    psi[:3], C[[0, 1, 2], [0, 1, 2]] = 0.3 * rng.normal(size=3), 1.0
    norm = np.linalg.norm(psi)
    found = likeness(phi, psi / norm, C / norm**2, 1, np.array([1, 2]))
    assert (found.seen, found.seen_mac) == (7, pytest.approx(1))
    assert found.mac < 1
    assert found.space >= found.mac
    assert found.chance < 1e-6
