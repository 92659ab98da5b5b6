import tracemalloc

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import structural_rank

from chladni.errors import AccuracyError, LabelError, ModelError, ShapeError
from chladni.sparse import dissection
from chladni.sparse.factor import backward_error, factorise, inertia
from chladni.sparse.multifrontal import Multifrontal, NotDefinite, counted


def grid(nx, ny, dofs=2):
    """Stiffness of a grid of points with coupled dofs, its points and nodes; positive definite."""
    one = [sp.diags_array([-np.ones(n - 1), -np.ones(n - 1)], offsets=[1, -1]) for n in (nx, ny)]
    A = sp.kron(one[0], sp.eye_array(ny)) + sp.kron(sp.eye_array(nx), one[1])
    A = A - sp.diags_array(A.sum(axis=1)) + 0.05 * sp.eye_array(nx * ny)
    coupling = np.eye(dofs) + 0.3 * np.ones((dofs, dofs))
    places = np.stack(np.meshgrid(np.arange(nx), np.arange(ny), [0.0], indexing="ij"), -1)
    rows = np.repeat(places.reshape(-1, 3), dofs, axis=0)
    return sp.csr_array(sp.kron(A, coupling)), rows, np.repeat(np.arange(nx * ny), dofs)


def random_symmetric(seed, n=150, hubs=0, groups=1):
    """Sparse symmetric, diagonally dominant, with rows coupled to everything and loose groups."""
    rng = np.random.default_rng(seed)
    A = sp.random_array((n, n), density=3 / n, rng=rng)
    A = sp.csr_array(A + A.T)
    group = np.arange(n) % groups
    row = np.repeat(np.arange(n), np.diff(A.indptr))
    A.data[group[row] != group[A.indices]] = 0
    A.eliminate_zeros()
    A = A.tolil()
    for h in range(hubs):
        A[h, :] = A[:, h] = 0.01
    A = sp.csr_array(A)
    return A + sp.diags_array(abs(A).sum(axis=1) + 0.1)


@pytest.mark.parametrize("backend", ["multifrontal", "cholmod", "superlu"])
def test_every_backend_solves_the_same(backend):
    if backend == "cholmod":
        pytest.importorskip("sksparse")
    A, points, nodes = grid(15, 11)
    B = np.random.default_rng(0).standard_normal((A.shape[0], 3))
    factor = factorise(A, points, nodes=nodes, backend=backend)
    np.testing.assert_allclose(factor.solve(B), np.linalg.solve(A.toarray(), B), rtol=1e-9)
    np.testing.assert_allclose(factor.solve(B[:, 0]), factor.solve(B)[:, 0], rtol=1e-12)
    assert factor.nnz >= sp.tril(A).nnz


@given(st.integers(0, 10**6), st.integers(0, 3), st.integers(1, 4), st.booleans())
@settings(max_examples=40, deadline=None)
def test_any_pattern_any_order(seed, hubs, groups, placed):
    """The order changes the work, never the answer; nodes of uneven size, hubs, loose groups."""
    A = random_symmetric(seed, hubs=hubs, groups=groups)
    rng = np.random.default_rng(seed)
    nodes = np.sort(rng.integers(0, 60, A.shape[0]))
    points = rng.standard_normal((60, 3))[nodes] if placed else None
    b = rng.standard_normal(A.shape[0])
    x = Multifrontal(A, points, nodes).solve(b)
    np.testing.assert_allclose(A @ x, b, atol=1e-10)


@given(st.integers(0, 10**6), st.floats(-2, 12))
@settings(max_examples=40, deadline=None)
def test_inertia_counts_eigenvalues(seed, shift):
    """Sylvester: as many negative pivots as negative eigenvalues, whatever the fronts."""
    A = random_symmetric(seed, hubs=1) - shift * sp.eye_array(150)
    lam = np.linalg.eigvalsh(A.toarray())
    if np.abs(lam).min() > 1e-9:
        assert inertia(A) == (np.sum(lam < 0), np.sum(lam > 0))


def test_indefinite_and_complex_matrices_are_solved():
    A, points, nodes = grid(16, 12)
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    for Z in (A - 1.7 * sp.eye_array(len(b)), A * (1 + 0.02j) - 1.7 * sp.eye_array(len(b))):
        factor = factorise(Z, points, nodes=nodes, definite=False)
        assert backward_error(Z, factor) < 1e-13
        np.testing.assert_allclose(Z @ factor.solve(b.astype(Z.dtype)), b, atol=1e-9)


def test_renewed_keeps_the_order_and_changes_the_values():
    A, points, nodes = grid(12, 12)
    old = Multifrontal(A, points, nodes)
    new = old.renewed(3 * A)
    assert new.fronts is old.fronts
    b = np.ones(A.shape[0])
    np.testing.assert_allclose(3 * new.solve(b), old.solve(b), rtol=1e-12)


def test_dissection_is_an_elimination_order():
    """Each row once; entries of the lower factor lie within the fronts."""
    A, points, nodes = grid(20, 20)
    fronts = dissection.analyse(A, points, nodes)
    assert sorted(fronts.order) == list(range(A.shape[0]))
    position = np.argsort(fronts.order)
    for i in range(len(fronts.boundary)):
        pivots = fronts.order[fronts.start[i] : fronts.start[i + 1]]
        later = position[A[pivots].indices]
        later = later[later >= fronts.start[i + 1]]
        assert np.isin(later, fronts.boundary[i]).all()


@given(st.integers(0, 10**6), st.integers(1, 40))
@settings(max_examples=40, deadline=None)
def test_separator_is_the_smallest_cover(seed, edges):
    """It touches every edge of the cut, and is as large as a matching (König): none is smaller."""
    rng = np.random.default_rng(seed)
    u, v = rng.integers(0, 10, edges), rng.integers(10, 20, edges)
    cover = dissection._cover(u, v, 20)
    assert np.all(cover[u] | cover[v])
    cut = sp.csr_array((np.ones(edges), (u, v - 10)), shape=(10, 10))
    assert cover.sum() == structural_rank(cut)


def test_fill_grows_like_n_log_n():
    """George 1973: nnz(L) = O(n log n) on a square grid; a band order has n^1.5."""
    sizes = np.array([20, 40, 80])
    for placed in (True, False):
        fill = [
            dissection.analyse(A, points if placed else None, nodes).nnz
            for A, points, nodes in (grid(n, n, 1) for n in sizes)
        ]
        n = sizes**2
        rate = np.diff(np.log(fill)) / np.diff(np.log(n))
        assert rate[-1] < 1.35


def test_not_definite_names_the_row():
    A, points, nodes = grid(8, 8)
    A = sp.csr_array(A - 100 * sp.csr_array(([1.0], ([17], [17])), shape=A.shape))
    for backend in ("multifrontal", "superlu"):
        with pytest.raises(NotDefinite) as caught:
            factorise(A, points, nodes=nodes, backend=backend)
        assert isinstance(caught.value, ModelError)
    with pytest.raises(ModelError):
        factorise(sp.csr_array((4, 4)), backend="superlu")


def test_misuse_is_named():
    A, points, nodes = grid(4, 4)
    with pytest.raises(LabelError, match=r"mumps.*multifrontal"):
        factorise(A, backend="mumps")
    with pytest.raises(ShapeError, match=r"5 points.*32 rows"):
        factorise(A, points[:5], nodes=nodes)


def test_what_a_count_lets_go_of_still_makes_the_matrix():
    """Its fronts multiplied out are A, definite ones and indefinite ones."""
    A, points, nodes = grid(20, 14, dofs=3)
    for shift in (0.0, 1.3, 4.1):
        S = sp.csr_array(A - shift * sp.eye_array(A.shape[0]))
        negative, error = counted(S, points, nodes)
        assert negative == np.sum(np.linalg.eigvalsh(S.toarray()) < 0)
        assert error < 1e-12  # a tenth of what proves a count


def test_a_count_whose_pivots_grow_proves_nothing():
    """With an eigenvalue of the first front's own block at zero, its inverse is rounding alone."""
    A, points, nodes = grid(20, 14)
    fronts = dissection.analyse(A, points, nodes)
    first = fronts.order[: fronts.start[1]]
    own = np.linalg.eigvalsh(A.toarray()[np.ix_(first, first)])[1]
    with pytest.raises(AccuracyError, match="prove no inertia"):
        inertia(A - own * sp.eye_array(A.shape[0]), points, nodes=nodes)


def test_a_count_takes_less_memory_than_the_factor():
    """Only fronts that wait for their parents are held, O(n) of O(n log n)."""
    A, points, nodes = grid(60, 60)
    fronts, peaks = dissection.analyse(A, points, nodes), []
    for run in (factorise, inertia):
        tracemalloc.start()
        kept = run(A, fronts=fronts)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        del kept
    assert peaks[1] < 0.7 * peaks[0]
