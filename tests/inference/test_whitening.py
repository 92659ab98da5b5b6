"""Whitening against dense covariances."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.inference.sensor_errors import whitening

LINES, OUTPUTS, INPUTS = 12, 3, 2


@dataclass(frozen=True, eq=False)
class Plain:
    """Samples stacked as responses stack them, not whitened."""

    use: np.ndarray
    values: np.ndarray

    def stacked(self, z):
        picked = z[:, self.use].reshape(len(z), -1).T
        return np.concatenate([picked.real, picked.imag])

    def whitened(self, own, common, r):
        output = np.tile(np.repeat(np.nonzero(self.use)[1], INPUTS), 2)
        return whitening(output, self.stacked(own), self.stacked(common)).whitened(r)


def drawn(rng, count):
    shape = (count, LINES, OUTPUTS, INPUTS)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


@pytest.fixture(scope="module")
def made():
    """Two columns a channel and three in common, some samples not in use."""
    rng = np.random.default_rng(2)
    use = rng.random((LINES, OUTPUTS)) > 0.2
    data = Plain(use, np.ones((LINES, OUTPUTS, INPUTS), complex))
    own, common = drawn(rng, 2), drawn(rng, 3)
    by_input = np.concatenate([own * each for each in np.eye(INPUTS)])
    return data, by_input, common, rng.uniform(0.5, 2.0, data.values.shape)


def dense(data, own, common):
    """Columns of each output by itself, then those of all (n, k)."""
    each = [own * (np.arange(OUTPUTS) == o)[:, None] for o in range(OUTPUTS)]
    return np.concatenate([data.stacked(z) for z in (*each, common)], axis=1)


def test_whitened_errors_have_unit_covariance(made):
    """W (1 + V Vᵀ) Wᵀ = 1."""
    data, own, common, sd = made
    V = dense(data, own / sd, common / sd)
    one = np.eye(len(V))
    W = data.whitened(own / sd, common / sd, one)
    assert_allclose(W @ (one + V @ V.T) @ W.T, one, atol=1e-8)


ONE_LINE = np.arange(LINES) == 3
DEGENERATE = {  # factors on the columns of channels and in common, and lines in use
    "no error of a channel": (0.0, 1.0, np.ones(LINES, bool)),
    "no error in common": (1.0, 0.0, np.ones(LINES, bool)),
    "no error at all": (0.0, 0.0, np.ones(LINES, bool)),
    "a silent channel": (np.array([1.0, 0.0, 1.0])[:, None], 1.0, np.ones(LINES, bool)),
    "one line": (1.0, 1.0, ONE_LINE),
}


@pytest.mark.parametrize("case", DEGENERATE)
def test_rounding_is_no_error(case):
    """Nor are columns that others hold already."""
    on_own, on_common, lines = DEGENERATE[case]
    rng = np.random.default_rng(4)
    use = np.repeat(lines[:, None], OUTPUTS, axis=1)
    data = Plain(use, np.ones((LINES, OUTPUTS, INPUTS), complex))
    own, common = drawn(rng, 3) * on_own, drawn(rng, 4) * on_common
    own = np.concatenate([own * each for each in np.eye(INPUTS)])
    V = dense(data, own, common)
    one = np.eye(len(V))
    W = data.whitened(own, common, one)
    assert_allclose(W @ (one + V @ V.T) @ W.T, one, atol=1e-8)
