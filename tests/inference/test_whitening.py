"""Whitening in the space of the data, against dense covariances."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.inference.whitening import spanned, whitening

LINES, OUTPUTS, INPUTS = 12, 3, 2


@dataclass(frozen=True, eq=False)
class Plain:
    """Samples stacked as responses stack them, not whitened."""

    use: np.ndarray
    values: np.ndarray

    def stacked(self, z):
        picked = z[:, self.use].reshape(len(z), -1).T
        return np.concatenate([picked.real, picked.imag])


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


def test_the_span_holds_its_columns_and_nothing_else(made):
    data, own, common, sd = made
    span, V = spanned(data, own, common, sd), dense(data, own / sd, common / sd)
    assert_allclose(span.projected(V), V, atol=1e-9)
    assert span.leverage.sum() == pytest.approx(np.linalg.matrix_rank(V))
    r = np.random.default_rng(3).normal(size=len(V))
    across = r - V @ np.linalg.lstsq(V, r, rcond=None)[0]
    assert_allclose(span.projected(across), 0, atol=1e-9)


ONE_LINE = np.arange(LINES) == 3
DEGENERATE = {  # factors on the columns of channels and in common, and lines in use
    "no error of a channel": (0.0, 1.0, np.ones(LINES, bool)),
    "no error in common": (1.0, 0.0, np.ones(LINES, bool)),
    "no error at all": (0.0, 0.0, np.ones(LINES, bool)),
    "a silent channel": (np.array([1.0, 0.0, 1.0])[:, None], 1.0, np.ones(LINES, bool)),
    "one line": (1.0, 1.0, ONE_LINE),
}


@pytest.mark.parametrize("case", DEGENERATE)
def test_columns_that_others_hold_already_span_nothing_more(case):
    """Else the rounding that is left of them would count as errors: ln det 293 for one line."""
    on_own, on_common, lines = DEGENERATE[case]
    rng = np.random.default_rng(4)
    use = np.repeat(lines[:, None], OUTPUTS, axis=1)
    data = Plain(use, np.ones((LINES, OUTPUTS, INPUTS), complex))
    own, common, sd = drawn(rng, 3) * on_own, drawn(rng, 4) * on_common, np.ones_like(data.values)
    span, V = spanned(data, own, common, sd.real), dense(data, own, common)
    assert span.leverage.sum() == pytest.approx(np.linalg.matrix_rank(V))
    made = whitening(data, own, common, span)
    due = np.linalg.slogdet(np.eye(V.shape[1]) + V.T @ V)[1]
    assert made.log_det == pytest.approx(due, abs=1e-6)


@pytest.mark.parametrize("within", [False, True])
def test_whitened_errors_have_unit_covariance(made, within):
    """W (P + V Vᵀ) Wᵀ = P, with P the projection on the span, or 1 without one."""
    data, own, common, sd = made
    span = spanned(data, own, common, sd) if within else None
    V = dense(data, own / sd, common / sd)
    P = np.eye(len(V)) if span is None else span.projected(np.eye(len(V)))
    known = whitening(data, own / sd, common / sd, span)
    W = known.whitened(np.eye(len(V)))
    assert_allclose(W @ (P + V @ V.T) @ W.T, P, atol=1e-8)


def test_transposed_whitening_makes_the_inverse_covariance(made):
    """Wᵀ W r is C⁻¹ r on the span."""
    data, own, common, sd = made
    span, V = spanned(data, own, common, sd), dense(data, own / sd, common / sd)
    known = whitening(data, own / sd, common / sd, span)
    r = V @ np.random.default_rng(4).normal(size=V.shape[1])
    found = known.transposed(known.whitened(r))
    assert_allclose(found + V @ (V.T @ found), r, atol=1e-8)


def test_evidence_does_not_depend_on_the_spread_that_is_assumed_of_data_within_the_span(made):
    """Where known errors are much larger than the rest, how large the rest is says nothing."""
    data, own, common, sd = made
    r = data.stacked(own[:1] + common[:1])[:, 0]

    def neg2_log_density(sd):
        span = spanned(data, own, common, sd)
        known = whitening(data, 1e4 * own / sd, 1e4 * common / sd, span)
        z = known.whitened(r / np.tile(sd[data.use].ravel(), 2))
        return z @ z + known.log_det

    assert neg2_log_density(sd) == pytest.approx(neg2_log_density(3 * sd), abs=1e-3)
    assert neg2_log_density(sd) == pytest.approx(neg2_log_density(np.ones(sd.shape)), abs=1e-3)
