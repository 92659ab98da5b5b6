"""Correlation: bounds and blindness of MAC, what COMAC shows, what Q is made of."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.builders.refusals import says

from chladni.dynamics.frf import FRF
from chladni.ema.correlation import auto_mac, comac, deviation, mac, quality, subspace_mac, wrapped
from chladni.ema.mode_pairing import pair

seeds = st.integers(0, 10_000)


def shapes(seed: int, n: int = 12, r: int = 4) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(n, r)) + 1j * rng.normal(size=(n, r))


@given(seeds)
@settings(max_examples=20)
def test_mac_is_bounded_and_blind_to_scale_and_phase(seed: int) -> None:
    phi, psi = shapes(seed), shapes(seed + 1)
    scale = shapes(seed + 2, 1)[0]
    A = mac(phi, psi)
    assert ((A >= 0) & (A <= 1)).all()
    np.testing.assert_allclose(mac(phi * scale, psi), A, atol=1e-12)
    np.testing.assert_allclose(mac(psi, phi), A.T, atol=1e-12)
    np.testing.assert_allclose(np.diag(auto_mac(phi)), 1, atol=1e-12)


@given(seeds)
@settings(max_examples=20)
def test_close_modes_may_mix_within_their_space(seed: int) -> None:
    """MAC falls when two shapes turn in their plane, the subspace MAC does not."""
    phi, _ = np.linalg.qr(shapes(seed).real)
    c, s = np.cos(0.7), np.sin(0.7)
    turned = phi.copy()
    turned[:, :2] = phi[:, :2] @ np.array([[c, -s], [s, c]])
    np.testing.assert_allclose(np.diag(mac(phi, turned))[:2], c**2, atol=1e-12)
    np.testing.assert_allclose(subspace_mac(turned[:, :2], phi[:, :2]), 1, atol=1e-12)
    np.testing.assert_allclose(subspace_mac(phi[:, 2:], phi[:, :2]), 0, atol=1e-12)


def test_comac_finds_the_wrong_channel() -> None:
    """Allemang's is blind to a sign, the enhanced one is not; both are perfect without a fault."""
    phi = shapes(3).real
    psi = phi * np.array([2.0, -0.1, 5.0, 1.0])
    np.testing.assert_allclose(comac(phi, psi), 1, atol=1e-12)
    np.testing.assert_allclose(comac(phi, psi, "enhanced"), 0, atol=1e-12)
    psi[7] *= -1
    assert comac(phi, psi).min() > 0.9
    assert comac(phi, psi, "enhanced").argmax() == 7
    swapped = phi.copy()
    swapped[[2, 9]] = swapped[[9, 2]]
    assert set(np.argsort(comac(phi, swapped))[:2]) == {2, 9}


def frf(values: np.ndarray) -> FRF:
    n = values.shape
    outputs = tuple(f"{i}:+Z" for i in range(n[1]))
    return FRF(values, np.arange(1.0, n[0] + 1), outputs, ("9:+Z",) * n[2])


def test_deviation_of_a_gain_and_a_turn() -> None:
    """H_A = 10 e^{iπ/2} H_X gives δ = 1 + i π / (2 ln 10) everywhere; Q is its square."""
    H = frf(shapes(1, 30, 3)[:, :, None])
    delta = deviation(frf(10j * H.values), H)
    np.testing.assert_allclose(delta, 1 + 0.5j * np.pi / np.log(10), atol=1e-12)
    q = quality(delta, H.frequency, bands=[(1, 10), (11, 30)])
    np.testing.assert_allclose(q.Q, 1 + (np.pi / 2 / np.log(10)) ** 2)
    np.testing.assert_allclose([q.magnitude, q.total], [1, q.Q * delta.size])
    np.testing.assert_allclose(q.magnitude + q.phase, q.Q)


@given(seeds)
@settings(max_examples=20)
def test_q_is_the_mean_of_its_parts(seed: int) -> None:
    delta = shapes(seed, 24, 4).reshape(24, 2, 2)
    f = np.arange(24.0)
    weight = np.random.default_rng(seed).uniform(size=delta.shape)
    q = quality(delta, f, [(0, 11), (12, 23)])
    np.testing.assert_allclose([q.channel.mean(), q.band.mean()], q.Q)
    w = quality(delta, f, [(0, 11), (12, 23)], weight)
    np.testing.assert_allclose((w.channel * weight.sum(0)).sum() / weight.sum(), w.Q)


@given(st.floats(-50, 50), st.floats(-50, 50))
def test_wrapping_keeps_the_number_the_logarithm_stands_for(re: float, im: float) -> None:
    z = np.array([re / 50 + 1j * im])
    w = wrapped(z)
    np.testing.assert_allclose(10**w, 10**z, rtol=1e-10)
    assert abs(w[0].imag) <= np.pi / np.log(10) * (1 + 1e-12)


def test_what_cannot_be_compared_is_refused() -> None:
    H = frf(shapes(5, 30, 3)[:, :, None])
    dead = H.values.copy()
    dead[:, 1] = 0
    says(r"leave out 1:.Z", deviation, H, frf(dead))
    says(r"FRF.sel and FRF.to", deviation, H, H.to("mobility"))
    says("shapes over 3 and 4 dofs", mac, np.eye(3), np.eye(4))


@given(seeds, st.floats(-0.12, 0.12))
@settings(max_examples=40)
def test_pairing_without_shapes_survives_missing_modes(seed: int, shift: float) -> None:
    """Modes 15 % apart and more, some unseen, all moved by one factor and 1 % of their own."""
    rng = np.random.default_rng(seed)
    model = 20 * np.cumprod(rng.uniform(1.15, 1.4, 12))
    seen = np.sort(rng.choice(12, 10, replace=False))
    test = model[seen] * np.exp(shift) * (1 + 0.01 * rng.uniform(-1, 1, 10))
    visible = np.where(np.isin(np.arange(12), seen), 1.0, 1e-3)
    pairs = pair(model, test, visibility=visible)
    wrong = (pairs.model != seen[pairs.test]).sum() + len(pairs.alone_test)
    assert wrong <= (0 if abs(shift) < 0.05 else 2)


@given(seeds)
@settings(max_examples=20)
def test_pairing_by_shapes_finds_swapped_modes(seed: int) -> None:
    """Order in frequency says nothing when shapes are known; a mode without partner stays alone."""
    rng = np.random.default_rng(seed)
    phi, _ = np.linalg.qr(rng.normal(size=(20, 6)))
    f = np.array([10.0, 10.2, 20.0, 20.5, 33.0, 41.0])
    order = np.array([1, 0, 3, 2, 5])
    pairs = pair(f, f[[0, 1, 2, 3, 5]], mac(phi, phi[:, order]))
    np.testing.assert_array_equal(pairs.model[np.argsort(pairs.test)], order)
    np.testing.assert_array_equal(pairs.alone_model, [4])
    np.testing.assert_allclose(pairs.mac, 1, atol=1e-12)


@pytest.mark.parametrize(("gap", "alike"), [(0.02, True), (0.2, False)])
def test_half_alike_modes_are_paired_only_where_near(gap: float, alike: bool) -> None:
    """MAC 0.6: a pair at 2 %, strangers at 20 % whatever else is there to pair with."""
    pairs = pair(np.array([100.0 * np.exp(gap)]), np.array([100.0]), np.array([[0.6]]))
    assert len(pairs) == alike


def test_pairing_of_nothing() -> None:
    assert len(pair(np.array([1.0]), np.zeros(0))) == 0
    np.testing.assert_array_equal(pair(np.array([10.0]), np.array([100.0])).alone_test, [0])
