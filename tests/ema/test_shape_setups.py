"""Shapes of several set-ups become those of one test."""

import numpy as np
import pytest

from chladni.ema.correlation import mac
from chladni.ema.setup import Shapes
from chladni.ema.shape_setups import merged
from chladni.errors import ShapeError

F, NOISE = np.array([10.0, 14.0, 14.8, 22.0]), 0.01
DOFS = tuple(f"{k}:+Z" for k in range(1, 13))


def setup(rng: np.random.Generator, psi: np.ndarray, at: range, noise: float = NOISE) -> Shapes:
    """The shapes at some dofs, with noise, each mode with a complex factor of its own."""
    size = np.sqrt((psi**2).mean(axis=0))
    values = psi[at] + noise * size * rng.normal(size=(len(at), len(F)))
    factor = rng.lognormal(size=len(F)) * np.exp(2j * np.pi * rng.uniform(size=len(F)))
    f = F * (1 + 1e-3 * rng.normal(size=len(F)))
    return Shapes(f, np.full(len(F), 0.01), values * factor, tuple(DOFS[k] for k in at))


def test_roving_sensors() -> None:
    """Three set-ups with channels in common: the whole shape, its scatter, mean frequencies."""
    rng = np.random.default_rng(0)
    psi = rng.normal(size=(len(DOFS), len(F)))
    parts = [setup(rng, psi, at) for at in (range(0, 6), range(2, 9), range(5, 12))]
    whole = merged(parts)
    assert whole.dofs == DOFS
    assert np.diag(mac(whole.values, psi.astype(complex))).min() > 0.998
    np.testing.assert_allclose(whole.frequency, np.mean([p.frequency for p in parts], axis=0))
    assert whole.sd is not None
    size = np.sqrt((np.abs(whole.values) ** 2).mean(axis=0))
    assert 0.4 * NOISE < np.mean(whole.sd / size) < 2.5 * NOISE
    assert whole.frequency_sd is not None
    assert (whole.frequency_sd > 0).all()


def test_modes_that_one_set_up_lacks_are_left_out() -> None:
    rng = np.random.default_rng(1)
    psi = rng.normal(size=(len(DOFS), len(F)))
    one, other = setup(rng, psi, range(8)), setup(rng, psi, range(4, 12))
    whole = merged([one, other.sel(np.array([0, 2, 3]))])
    np.testing.assert_allclose(whole.frequency, F[[0, 2, 3]], rtol=5e-3)


def test_without_common_channels_there_is_no_scale() -> None:
    rng = np.random.default_rng(2)
    psi = rng.normal(size=(len(DOFS), len(F)))
    with pytest.raises(ShapeError, match="no channel in common"):
        merged([setup(rng, psi, range(5)), setup(rng, psi, range(5, 12))])
