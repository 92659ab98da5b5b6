"""Identification against models whose poles are known, on even and uneven frequency grids."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.modal_frfs import modal_sum, noisy
from tests.builders.refusals import says

from chladni.dynamics.frf import FRF
from chladni.ema import pole_fitting as fitting
from chladni.ema.identification import DERIVATIVES, Identified, equalised, evaluate, identify
from chladni_evidence.identification_evidence import recording, structure

EVEN, LOG = np.linspace(20.0, 200.0, 500), np.geomspace(20.0, 200.0, 500)


class Truth:
    """Modes, residual terms and noise: H = s^q [Σ φφᵀ/(s²+2ζωs+ω²) + L/s² + U]."""

    def __init__(self, f: np.ndarray, zeta: np.ndarray, n_out: int, n_in: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.omega, self.zeta = 2 * np.pi * f, zeta
        self.phi = rng.normal(size=(n_out, len(f)))
        self.psi = self.phi[:n_in]
        self.lower, self.upper = rng.normal(size=(2, n_out, n_in)) * [[[0.1]], [[1e-6]]]
        self.rng = rng

    @property
    def poles(self) -> np.ndarray:
        return self.omega * (-self.zeta + 1j * np.sqrt(1 - self.zeta**2))

    def values(self, s: np.ndarray, q: int, undamped: bool = False) -> np.ndarray:
        zeta = 0.0 if undamped else self.zeta
        H = modal_sum(s, self.omega / (2 * np.pi), self.phi, self.psi, zeta, 0)
        s = s[:, None, None]
        return s**q * (H + self.lower / s**2 + self.upper)

    def frf(self, f: np.ndarray, quantity: str, noise: float) -> FRF:
        H = self.values(2j * np.pi * f, DERIVATIVES[quantity])
        names = tuple(f"{k}:+Z" for k in range(len(self.phi)))
        exact = FRF(H, f, names, names[: len(self.psi)], quantity)  # type: ignore[arg-type]
        return noisy(exact, noise, 0.1 * noise, self.rng)

    def misses(self, found: Identified) -> np.ndarray:
        """Distance of the nearest pole to each true one, over its half bandwidth."""
        return np.abs(found.poles[:, None] - self.poles).min(axis=0) / np.abs(self.poles.real)


def a_truth(seed: int, r: int, n_out: int, n_in: int = 1, spacing: float = 0.0) -> Truth:
    rng = np.random.default_rng(1000 + seed)
    f = np.exp(np.linspace(np.log(22), np.log(190), r) + rng.uniform(-0.3, 0.3, r) * 2 / r)
    if spacing:
        f[1::2] = f[: len(f[1::2]) * 2 : 2] * (1 + spacing)
    return Truth(f, 10 ** rng.uniform(-3, -1.7, r), n_out, n_in, seed)


def matched(found: Identified, truth: Truth) -> np.ndarray:
    """Position of the pole nearest to each true one."""
    return np.abs(found.poles[:, None] - truth.poles).argmin(axis=0)


@pytest.mark.parametrize("f", [EVEN, LOG], ids=["even", "log"])
@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_poles_are_found_on_any_grid_in_any_quantity(f: np.ndarray, quantity: str) -> None:
    """Twelve modes, 1 % noise: none missed, none invented, nothing left but noise."""
    truth = a_truth(0, 12, 6)
    found = identify(truth.frf(f, quantity, 0.01))
    assert found.order == 12
    assert truth.misses(found).max() < 0.1
    assert found.chi == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("f", [EVEN, LOG], ids=["even", "log"])
def test_errors_are_as_large_as_the_spread_says(f: np.ndarray) -> None:
    """z-scores of 32 frequencies and 32 damping ratios have rms 1, to three of their own sd."""
    z, d = [], []
    for seed in range(4):
        truth = a_truth(seed, 8, 3)
        found = identify(truth.frf(f, "accelerance", 0.01))
        k = matched(found, truth)
        z.append((found.frequency[k] - truth.omega / 2 / np.pi) / found.frequency_sd[k])
        d.append((found.damping[k] - truth.zeta) / found.damping_sd[k])
    for score in (np.array(z), np.array(d)):
        assert np.sqrt((score**2).mean()) == pytest.approx(1.0, abs=3 / np.sqrt(2 * score.size))


@pytest.mark.parametrize(
    ("seed", "outputs", "inputs", "spacing"), [(0, 1, 1, 0.0), (1, 1, 1, 0.0), (0, 5, 2, 0.01)]
)
def test_one_response_or_close_modes_with_two_exciters(
    seed: int, outputs: int, inputs: int, spacing: float
) -> None:
    """Pairs 1 % apart."""
    truth = a_truth(seed, 8, outputs, inputs, spacing)
    found = identify(truth.frf(EVEN, "accelerance", 0.01))
    assert found.order == 8
    assert truth.misses(found).max() < (0.2 if outputs == 1 else 0.1)


def test_residues_and_residual_terms_without_noise() -> None:
    """What is identified is what was put in, residual terms too, and the FRF is rebuilt."""
    truth = a_truth(1, 8, 4, n_in=2)
    H = truth.frf(LOG, "mobility", 1e-9)
    found = identify(replace(H, variance=1e-8 * np.abs(H.values) ** 2))
    k = matched(found, truth)
    due = np.einsum("ir,jr->rij", truth.phi, truth.psi) / (2j * truth.poles.imag)[:, None, None]
    np.testing.assert_allclose(found.poles[k], truth.poles, rtol=1e-7)
    np.testing.assert_allclose(found.residues[k], due, atol=1e-6 * np.abs(due).max())
    np.testing.assert_allclose(found.lower, truth.lower, atol=1e-5)
    np.testing.assert_allclose(found.upper, truth.upper, atol=1e-10)
    np.testing.assert_allclose(evaluate(found, 2j * np.pi * LOG), H.values, rtol=1e-5)


def test_equalised_is_the_undamped_model() -> None:
    """p -> i|p| on s = ω (ζ + i): Σ φφᵀ / (ω_r² + s²), whatever the damping was."""
    truth = a_truth(2, 10, 5)
    H = truth.frf(EVEN, "accelerance", 1e-9)
    found = identify(replace(H, variance=1e-8 * np.abs(H.values) ** 2))
    s = 2 * np.pi * LOG[::10] * (0.03 + 1j)
    due = truth.values(s, 2, undamped=True)
    np.testing.assert_allclose(equalised(found, s), due, rtol=1e-5)


def test_a_far_pole_that_a_residual_term_makes_up_for_does_so_when_equalised() -> None:
    """R = iCp² brings 2C Im p - 2s² Re(iC/p) + ...: a constant, here 10⁴ times the response.

    Moved to i|p| it would bring another one, by a share of ζ².
    """
    truth = a_truth(2, 10, 5)
    found = identify(truth.frf(EVEN, "accelerance", 1e-9))
    s = 2 * np.pi * LOG[::10] * (0.03 + 1j)
    due, p = equalised(found, s), 2 * np.pi * 2e6 * (-0.06 + 1j)
    large = 1e4 * float(np.abs(due / s[:, None, None] ** 2).mean())
    R = np.full((1, *found.lower.shape), 1j * p**2 * large / (2 * p.imag))
    one = dict.fromkeys(("frequency_sd", "damping_sd", "relative_delta_chi2"), 1.0)
    more = replace(
        found, poles=np.append(found.poles, p), residues=np.concatenate([found.residues, R]),
        upper=found.upper - large,
        **{name: np.append(getattr(found, name), sd) for name, sd in one.items()},
    )  # fmt: skip
    for whole, of in ((evaluate(more, s), evaluate(found, s)), (equalised(more, s), due)):
        np.testing.assert_allclose(whole, of, atol=0.05 * np.abs(of).mean())


def test_a_gap_in_the_data_does_no_harm() -> None:
    """Lines left out (the cord's band) take no modes elsewhere with them."""
    truth = a_truth(4, 8, 6)
    f = truth.omega / 2 / np.pi
    between = np.sqrt(f[3] * f[4])
    use = np.abs(EVEN - between) > 0.15 * (f[4] - f[3])
    found = identify(truth.frf(EVEN, "accelerance", 0.01), use=use)
    assert found.order == 8
    assert (np.abs(found.frequency[matched(found, truth)] / f - 1) < 1e-3).all()


def test_dead_and_broken_samples_are_passed_over() -> None:
    truth = a_truth(5, 6, 5)
    H = truth.frf(EVEN, "accelerance", 0.01)
    values = H.values.copy()
    values[:, 2] = 0
    values[100:110, 3] = np.nan
    found = identify(replace(H, values=values, variance=None))
    assert found.order == 6


def test_noise_alone_has_no_modes() -> None:
    rng = np.random.default_rng(0)
    shape = (400, 3, 1)
    H = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    labels = ("1:+Z", "2:+Z", "3:+Z")
    frf = FRF(H, np.linspace(10, 100, 400), labels, ("1:+Z",), variance=np.full(shape, 2.0))
    assert identify(frf).order == 0


def test_slope_is_the_derivative() -> None:
    """Jᵀr against central differences of χ²: variable projection, exact at the optimum of x."""
    truth = a_truth(6, 4, 3)
    H = truth.frf(EVEN, "mobility", 1e-6)
    omega_max = 2 * np.pi * EVEN[-1]
    y, w = H.values.reshape(500, -1), 1 / np.sqrt(H.variance.reshape(500, -1))  # type: ignore[union-attr]
    data = fitting.PoleData(2j * np.pi * EVEN / omega_max, y / omega_max, w * omega_max, 1)
    p = truth.poles / omega_max * (1 + 1e-4)
    _, slope = fitting.solve(data, p, slope=True)
    assert slope is not None
    for k in range(4):
        for part, unit in enumerate((1.0, 1j)):
            h = 1e-6 * abs(p[k].real) * unit * (np.arange(4) == k)
            rise = fitting.solve(data, p + h)[0].chi2 - fitting.solve(data, p - h)[0].chi2
            due = -2 * slope.g[2 * k + part]
            due, small = -2 * slope.g[2 * k + part], 1e-3 * abs(slope.g).max()
            assert rise / (2 * abs(h[k])) == pytest.approx(due, rel=2e-2, abs=small)


def test_vector_fitting_finds_poles_from_afar() -> None:
    """Without noise a few relocations lead to machine precision on a log grid."""
    truth = a_truth(7, 6, 3)
    H = truth.frf(LOG, "receptance", 0.0)
    omega_max = 2 * np.pi * LOG[-1]
    y = H.values.reshape(500, -1)
    data = fitting.PoleData(2j * np.pi * LOG / omega_max, y, 1 / np.abs(y), 0)
    p = np.linspace(0.15, 0.95, 6) * (-0.01 + 1j)
    for _ in range(15):
        p = fitting.relocated(data, p)
    np.testing.assert_allclose(np.sort(p.imag), np.sort(truth.poles.imag) / omega_max, rtol=1e-8)


def test_a_band_without_lines_is_refused() -> None:
    said = r"0 lines between [\d.]+ and [\d.]+ Hz .* covers 20 to 200 Hz"
    says(said, identify, a_truth(0, 4, 2).frf(EVEN, "mobility", 0.01), band=(300, 400))


def test_a_distorted_resonance_is_one_mode() -> None:
    """4 % of distortion across the peak (a joint that slips a little) makes no second mode."""
    f0, zeta = 90.0, 0.008
    f = np.linspace(60, 130, 700)
    H = -(f**2) / (f0**2 - f**2 + 2j * zeta * f0 * f)
    H = H * (1 + 0.04 * np.tanh((f - f0) / (zeta * f0)))
    H = H + 0.002 * np.random.default_rng(0).normal(size=(2, 700)).T @ [1, 1j] * np.abs(H)
    found = identify(FRF(H[:, None, None], f, ("1:+Z",), ("1:+Z",), "accelerance"))
    near = np.abs(found.frequency - f0) < 3 * zeta * f0
    assert near.sum() == 1
    np.testing.assert_allclose(found.frequency[near], f0, rtol=1e-3)


@pytest.mark.parametrize("seed", range(2))
def test_modes_crowded_beyond_the_band_do_not_spoil_it(seed: int) -> None:
    """Six modes 12-30 % above, eight inside, two of them 0.15 % apart: all inside are found."""
    rng = np.random.default_rng(seed)
    inside = np.array([25.0, 40.0, 62.0, 88.0, 120.0, 150.0, 185.0, 185.3])
    beyond = 200.0 * np.linspace(1.12, 1.3, 6)
    f = np.concatenate([inside, beyond])
    truth = Truth(f, 10 ** rng.uniform(-2.3, -1.9, len(f)), 12, 1, seed)
    found = identify(truth.frf(np.arange(20.0, 200.0, 0.4), "accelerance", 0.01))
    s = 2 * np.pi * np.geomspace(25, 190, 40) * (0.08 + 1j)
    delta = np.log10(equalised(found, s) / truth.values(s, 2, undamped=True))
    assert (found.inside).sum() == len(inside)
    assert found.chi == pytest.approx(1.0, abs=0.05)
    assert np.sqrt((np.abs(delta) ** 2).mean(axis=(1, 2))).max() < 0.02


def test_what_had_paid_for_itself_once_is_asked_again_at_the_end() -> None:
    """Of tuning structure 590 a pole near 30.8 Hz paid until all poles were where they fit best."""
    known = structure(590)
    found = identify(recording(known, "share, unsaid", 590)[0])
    inside = np.sort(found.frequency[found.inside])
    np.testing.assert_allclose(inside, np.sort(np.abs(known.inside)) / (2 * np.pi), rtol=1e-4)
