"""What gives and dissipates is told from what only gives, by which modes are damped."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import kstest

from chladni.effects.crack import LineFinder, crack
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.springs import ExtraSupport
from chladni.inference.adequacy import LEAST_P, FitTest
from chladni.inference.damping_scatter import LOG_SD, SCATTER, ModalDamping
from chladni.inference.hypothesis_fit import HypothesisFit
from chladni.inference.local_damping_test import damping_test_along_effect, shifted
from chladni.reduced.reduced_model import evaluate

FLEXIBLE = 20.0  # Hz, below all modes of the plate that bend it
FITS = FitTest(True, 0.4, "it fits", "everywhere")


def cracked(reduced, x):
    """A line of shells of the plate that lost some of its bending stiffness, as if fitted."""
    lines = LineFinder.of(reduced.groups.structure.assembly)
    middle = int(np.argmin(np.linalg.norm(lines.middle - [0.13, 0.12, 0], axis=1)))
    effect, x = crack(reduced.groups, lines.drawn(np.array([middle]), (3.0,))[0], 1), np.array([x])
    model = reduced.model_for(effect, x)
    fitted = SimpleNamespace(
        effects=(effect,), x=x, state=evaluate(model, [effect], x, False), of=lambda _: x
    )
    return HypothesisFit(effect, fitted, model)


@pytest.fixture(scope="module")
def deep(reduced):
    return cracked(reduced, 3.0)


@pytest.fixture(scope="module")
def supported(reduced):
    """A spring to ground, as if fitted."""
    setup = Setup((), (), float(reduced.groups.weight.sum()), 400.0)
    where = EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)
    effect = ExtraSupport.near(where, 5)
    x = np.zeros(5)
    model = reduced.model_for(effect, x)
    fitted = SimpleNamespace(
        effects=(effect,), x=x, state=evaluate(model, [effect], x, False), of=lambda _: x
    )
    return HypothesisFit(effect, fitted, model)


def damping(frequency, ratio, sd=0.03):
    return ModalDamping(frequency, np.asarray(ratio), np.full(len(frequency), sd))


def test_a_small_fall_is_that_of_the_eigenvalues(reduced):
    """To first order φᵀK₀φ / λ - 1 is λ₀ / λ - 1 (Rayleigh); the rest is of second order."""
    slight = cracked(reduced, -7.0)
    frequency, fall = shifted(slight, FLEXIBLE)
    idle = evaluate(slight.model, slight.effects, np.array([slight.effect.parameters[0].nominal]))
    due = idle.lam[-len(frequency) :] / (2 * np.pi * frequency) ** 2 - 1
    assert due.max() > 1e-4
    np.testing.assert_allclose(fall[:12], due[:12], rtol=0.02, atol=1e-3 * due.max())


def test_modes_damped_as_much_as_they_give_are_said(deep):
    frequency, fall = shifted(deep, FLEXIBLE)
    n = int((frequency < 400).sum())
    lossy = damping(frequency[:n], 0.005 + 0.5 * 0.6 * fall[:n])
    found = damping_test_along_effect(FITS, deep, lossy)
    assert not found.passes
    assert "crack" in found.what
    assert "another level" in found.what
    assert found.where == deep.effect.text
    row = found.statistics[-1]
    assert row.value > row.high
    assert row.median == pytest.approx(1.0, abs=0.05)  # a factor, drawn as a multiple of its median
    assert 0 < row.low < 1 < row.high


def test_a_fit_that_is_too_good_does_not_hide_damping(deep):
    """Its small p is no evidence against the explanation."""
    frequency, fall = shifted(deep, FLEXIBLE)
    n = int((frequency < 400).sum())
    lossy = damping(frequency[:n], 0.005 + 0.5 * 0.6 * fall[:n])
    close = replace(FITS, p=1e-9, better=True)
    assert close.against == 1
    found = damping_test_along_effect(close, deep, lossy)
    assert not found.passes
    assert found.against == found.p


def test_what_holds_and_dissipates_is_no_spring(supported):
    """Foam to ground: the shares are those of the energy in the spring."""
    frequency, shift = shifted(supported, 0.0)
    kept = np.flatnonzero((frequency > 1.0) & (frequency < 400))
    share = -shift[kept]
    assert (share > -1e-9).all()  # Rayleigh: without a spring no mode has more energy than with it
    assert 0.05 < share.max() <= 1
    found = damping_test_along_effect(
        FITS, supported, damping(frequency[kept], 0.005 + 0.5 * 0.8 * share)
    )
    assert not found.passes
    assert "extra-support" in found.what
    assert "foam or rubber" in found.what
    assert damping_test_along_effect(
        FITS, supported, damping(frequency[kept], np.full(len(kept), 0.005))
    ).passes


def test_evenly_or_elsewhere_damped_modes_are_not(deep):
    frequency, fall = shifted(deep, FLEXIBLE)
    n = int((frequency < 400).sum())
    rng = np.random.default_rng(5)
    scattered = 0.005 * np.exp(SCATTER * rng.normal(size=n))
    assert damping_test_along_effect(FITS, deep, damping(frequency[:n], scattered)).passes
    elsewhere = 0.005 + 0.3 * (fall[:n].max() - fall[:n])
    assert damping_test_along_effect(FITS, deep, damping(frequency[:n], elsewhere)).passes


def test_low_modes_are_heard_however_far_a_basis_reaches(deep):
    """A reduced model has modes far above the band; they are no measure of what is rigid."""
    lam = np.sort(deep.fit.state.lam)
    frequency, fall = shifted(deep, FLEXIBLE)
    assert len(frequency) == len(fall) == len(lam) - 6
    assert frequency.min() == pytest.approx(np.sqrt(lam[6]) / (2 * np.pi))


def test_damping_of_foreign_poles_and_of_few_is_not_heard(deep):
    foreign = damping(np.linspace(1e4, 2e4, 8), np.geomspace(0.001, 0.2, 8))
    assert damping_test_along_effect(FITS, deep, foreign) is FITS
    assert damping_test_along_effect(FITS, deep, None) is FITS


@pytest.mark.parametrize("slope", [0.0, -0.8])
def test_p_is_uniform_where_damping_scatters_about_a_trend(slope):
    """Materials and air damp by frequency, and effects change low modes most."""
    rng = np.random.default_rng(9)
    f = np.linspace(30, 300, 12)
    share = rng.exponential(size=12) / f
    p = []
    for _ in range(300):
        sd = np.hypot(SCATTER * np.exp(LOG_SD * rng.normal()), 0.03)
        ratio = 0.005 * (f / 100) ** slope * np.exp(sd * rng.normal(size=12))
        p.append(damping(f, ratio).following(share)[0])
    assert kstest(p, "uniform").statistic < 1.63 / np.sqrt(300)  # 1 %


def test_scatter_is_that_of_the_recording():
    """Modes that are damped by their share alone need not leave the scatter of other structures."""
    rng = np.random.default_rng(3)
    share = rng.exponential(size=14)
    ratio = 0.006 * (1 + 0.35 * share) * np.exp(0.08 * rng.normal(size=14))
    assert np.log(ratio).std() < SCATTER
    assert damping(np.linspace(70, 300, 14), ratio).following(share)[0] < LEAST_P


def test_foam_that_damps_low_modes_many_times_is_found():
    """Damping grows with the share, its logarithm less: a line through it would leave scatter."""
    rng = np.random.default_rng(14)
    f = np.geomspace(25, 270, 10)
    share = np.minimum(1, rng.chisquare(1, size=10) * (30 / f) ** 2)
    ratio = 0.008 * np.exp(0.25 * rng.normal(size=10)) + 0.3 * share
    assert damping(f, ratio).following(share)[0] < LEAST_P
