"""A basis in blocks is the basis in one array, but for what it shares and what it never makes."""

import tracemalloc

import numpy as np
import scipy.sparse as sp
from numpy.testing import assert_allclose

from chladni.dynamics import reduction
from chladni.dynamics.reduction import Basis, beyond, orthonormal

N = 60


def blocks(rng, n=N):
    return tuple(rng.normal(size=(n, k)) for k in (5, 2, 1))


def symmetric(rng, n=N):
    """Few of its rows have entries."""
    A = sp.random_array((n, n), density=0.01, rng=rng, format="csr")
    return sp.csr_array(A + A.T)


def test_blocks_are_one_array_of_columns(monkeypatch):
    monkeypatch.setattr(reduction, "ROWS", 7)  # the operator in pieces
    rng = np.random.default_rng(0)
    parts, A = blocks(rng), symmetric(rng)
    basis, whole = Basis(parts), np.hstack(parts)
    q, F, dofs = rng.normal(size=(8, 3)), rng.normal(size=(N, 2)), np.array([3, 50, 4])
    assert basis.shape == whole.shape
    assert_allclose(basis.at(dofs), whole[dofs])
    assert_allclose(basis.combined(q), whole @ q)
    assert_allclose(basis.projected(F), whole.T @ F)
    assert_allclose(basis.projected(F[:9]), whole[:9].T @ F[:9])
    assert_allclose(basis.seen(A[:4]), A[:4] @ whole)
    assert_allclose(basis.reduced(A), whole.T @ (A @ whole), atol=1e-12)
    assert_allclose(basis.bordering(A), whole.T @ (A @ whole[:, -1:]), atol=1e-12)
    assert_allclose(basis.padded(4).combined(q), np.pad(whole @ q, ((0, 4), (0, 0))))


def test_what_a_block_adds_is_orthonormal_to_all_before():
    rng = np.random.default_rng(1)
    M = sp.diags_array(rng.uniform(0.5, 2.0, N)).tocsr()
    first = orthonormal(M, [rng.normal(size=(N, 4))])
    known = (first[:, :3], first[:, 3:])
    new = np.hstack([rng.normal(size=(N, 2)), first[:, :1]])  # two new ones and one that is there
    whole = np.hstack([first, beyond(M, known, new)])
    assert whole.shape == (N, 6)
    assert_allclose(whole.T @ (M @ whole), np.eye(6), atol=1e-10)


def test_what_little_is_left_of_a_block_is_as_orthogonal(monkeypatch):
    """A vector of which 1e-4 is new: its normalisation magnifies rounding errors by 1e4."""
    rng = np.random.default_rng(4)
    M = sp.diags_array(rng.uniform(0.5, 2.0, N)).tocsr()
    known = (orthonormal(M, [rng.normal(size=(N, 30))]),)
    block = known[0] @ rng.normal(size=(30, 3)) + rng.normal(size=(N, 3)) * [1e-4, 1e-4, 1.0]

    def error():
        return abs(known[0].T @ (M @ beyond(M, known, block))).max()

    assert error() < 1e-14
    monkeypatch.setattr(reduction, "LITTLE", 0.0)
    assert error() > 1e-13


def test_grown_bases_share_their_blocks():
    rng = np.random.default_rng(2)
    basis = Basis(blocks(rng))
    one, other = (basis.grown(rng.normal(size=(N, 2))) for _ in range(2))
    for a, b in zip(one.blocks[:-1], other.blocks[:-1], strict=True):
        assert np.shares_memory(a, b)


def test_an_operator_is_projected_without_another_array_as_large_as_the_basis():
    basis, A = Basis((np.ones((40_000, 24)),)), sp.eye_array(40_000, format="csr")
    tracemalloc.start()
    got = basis.reduced(A)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert_allclose(got, 40_000)
    assert most < basis.blocks[0].nbytes / 2
