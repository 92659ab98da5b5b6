import tracemalloc

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.builders.refusals import says

from chladni.errors import AccuracyError, ModelError
from chladni.sparse import elimination_fronts
from chladni.sparse.factor import backward_error, factorise, inertia
from chladni.sparse.multifrontal import Multifrontal, NotDefinite, counted


def grid(nx, ny, dofs=2):
    """Stiffness of a grid of points with coupled dofs, and its nodes; positive definite."""
    one = [sp.diags_array([-np.ones(n - 1), -np.ones(n - 1)], offsets=[1, -1]) for n in (nx, ny)]
    A = sp.kron(one[0], sp.eye_array(ny)) + sp.kron(sp.eye_array(nx), one[1])
    A = A - sp.diags_array(A.sum(axis=1)) + 0.05 * sp.eye_array(nx * ny)
    coupling = np.eye(dofs) + 0.3 * np.ones((dofs, dofs))
    return sp.csr_array(sp.kron(A, coupling)), np.repeat(np.arange(nx * ny), dofs)


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
    A, nodes = grid(15, 11)
    B = np.random.default_rng(0).standard_normal((A.shape[0], 3))
    factor = factorise(A, nodes=nodes, backend=backend)
    np.testing.assert_allclose(factor.solve(B), np.linalg.solve(A.toarray(), B), rtol=1e-9)
    np.testing.assert_allclose(factor.solve(B[:, 0]), factor.solve(B)[:, 0], rtol=1e-12)
    assert factor.nnz >= sp.tril(A).nnz


def test_a_factor_stores_its_lower_triangle_alone():
    A, nodes = grid(23, 19, dofs=3)
    factor = Multifrontal(A, nodes)
    assert sum(part.L11.size + part.L21.size for part in factor._parts) == factor.nnz


@pytest.mark.parametrize("backend", ["multifrontal", "superlu"])
def test_flexibility_between_few_loads_is_that_of_the_solution(backend):
    """Bᵀ A⁻¹ B, with fronts left out that no load reaches."""
    A, nodes = grid(23, 19)
    factor = factorise(A, nodes=nodes, backend=backend)
    for at in ([3, 4, 5], [0, 150, 151, A.shape[0] - 1], []):
        B = sp.csr_array(sp.eye_array(A.shape[0], format="csr")[:, at])
        B = sp.csr_array(B @ (np.eye(len(at)) + 0.5)) if at else B
        due = B.T @ np.linalg.solve(A.toarray(), B.toarray())
        np.testing.assert_allclose(factor.between(B), due, rtol=1e-9)


def test_flexibility_of_an_indefinite_matrix_is_that_of_the_solution():
    A, nodes = grid(9, 8)
    A = sp.csr_array(A - 2.0 * sp.eye_array(A.shape[0]))
    factor = factorise(A, nodes=nodes, definite=False)
    B = sp.csr_array(sp.eye_array(A.shape[0], format="csr")[:, [5, 40]])
    due = np.linalg.inv(A.toarray())[np.ix_([5, 40], [5, 40])]
    np.testing.assert_allclose(factor.between(B), due, rtol=1e-8)


@given(st.integers(0, 10**6), st.integers(0, 3), st.integers(1, 4), st.booleans())
@settings(max_examples=40, deadline=None)
def test_any_pattern_any_order(seed, hubs, groups, metis):
    """The order changes the work, never the answer; nodes of uneven size, hubs, loose groups."""
    A = random_symmetric(seed, hubs=hubs, groups=groups)
    rng = np.random.default_rng(seed)
    nodes = np.sort(rng.integers(0, 60, A.shape[0]))
    b = rng.standard_normal(A.shape[0])
    with pytest.MonkeyPatch.context() as patch:
        if not metis:
            patch.setattr(elimination_fronts, "pymetis", None)
        x = Multifrontal(A, nodes).solve(b)
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
    A, nodes = grid(16, 12)
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    for Z in (A - 1.7 * sp.eye_array(len(b)), A * (1 + 0.02j) - 1.7 * sp.eye_array(len(b))):
        factor = factorise(Z, nodes=nodes, definite=False)
        assert backward_error(Z, factor) < 1e-13
        np.testing.assert_allclose(Z @ factor.solve(b.astype(Z.dtype)), b, atol=1e-9)


def test_dissection_is_an_elimination_order():
    """Each row once; entries of the lower factor lie within the fronts."""
    A, nodes = grid(20, 20)
    fronts = elimination_fronts.analyse(A, nodes)
    assert sorted(fronts.order) == list(range(A.shape[0]))
    position = np.argsort(fronts.order)
    for i in range(len(fronts.boundary)):
        pivots = fronts.order[fronts.start[i] : fronts.start[i + 1]]
        later = position[A[pivots].indices]
        later = later[later >= fronts.start[i + 1]]
        assert np.isin(later, fronts.boundary[i]).all()


@pytest.mark.parametrize("metis", [True, False])
def test_fill_grows_like_n_log_n(metis, monkeypatch):
    """George 1973: nnz(L) = O(n log n) on a square grid; a band order has n^1.5."""
    if not metis:
        monkeypatch.setattr(elimination_fronts, "pymetis", None)
    sizes = np.array([20, 40, 80])
    fill = [elimination_fronts.analyse(*grid(n, n, 1)).nnz for n in sizes]
    rate = np.diff(np.log(fill)) / np.diff(np.log(sizes**2))
    assert rate[-1] < 1.35


def test_rows_of_a_node_that_nothing_couples_are_apart(monkeypatch):
    """Two fields on one grid, each alone: half the fill of both together, and the same solution."""
    monkeypatch.setattr(elimination_fronts, "_LEAF", 1)  # no zeros are stored
    monkeypatch.setattr(elimination_fronts, "_ZEROS", 0.0)
    A, nodes = grid(24, 24, dofs=3)
    n, rng = A.shape[0], np.random.default_rng(0)
    both = sp.csr_array(sp.block_diag([A, A]))
    at = np.argsort(np.tile(nodes, 2), kind="stable")
    fields, nodes = sp.csr_array(both[at][:, at]), np.tile(nodes, 2)[at]
    vertex = elimination_fronts.coupled(fields, np.unique(nodes, return_inverse=True)[1])
    assert len(np.unique(vertex)) == 2 * len(np.unique(nodes))
    apart = Multifrontal(fields, nodes)
    joined = elimination_fronts.analyse(sp.csr_array(sp.kron(A[::3, ::3], np.ones((6, 6)))),
                                        np.repeat(np.arange(24 * 24), 6))  # fmt: skip
    assert apart.nnz < 0.6 * joined.nnz
    b = rng.standard_normal(2 * n)
    np.testing.assert_allclose(fields @ apart.solve(b), b, atol=1e-10)


def test_rows_that_only_a_third_one_couples_stay_together():
    """A chain 0-2-1 within a node; row 3 is alone."""
    A = sp.csr_array(np.eye(4) + np.array([[0, 0, 1, 0], [0, 0, 1, 0], [1, 1, 0, 0], [0] * 4]))
    assert elimination_fronts.coupled(A, np.zeros(4, int)).tolist() == [0, 0, 0, 1]


@given(st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_parent_is_the_first_row_below_the_diagonal_of_the_factor(seed):
    """Liu 1990: in the column of each vertex of L, without accidental zeros."""
    A = random_symmetric(seed, n=40)
    filled = (abs(A) > 0).toarray()
    for k in range(40):
        below = np.flatnonzero(filled[k + 1 :, k]) + k + 1
        filled[np.ix_(below, below)] = True
    due = [int(np.argmax(c)) + k + 1 if c.any() else -1
           for k, c in enumerate(filled[k + 1 :, k] for k in range(40))]  # fmt: skip
    assert elimination_fronts.elimination_tree(A).tolist() == due


def test_not_definite_names_the_row():
    A, nodes = grid(8, 8)
    A = sp.csr_array(A - 100 * sp.csr_array(([1.0], ([17], [17])), shape=A.shape))
    for backend in ("multifrontal", "superlu"):
        with pytest.raises(NotDefinite) as caught:
            factorise(A, nodes=nodes, backend=backend)
        assert isinstance(caught.value, ModelError)
    with pytest.raises(ModelError):
        factorise(sp.csr_array((4, 4)), backend="superlu")


def test_misuse_is_named():
    A, nodes = grid(4, 4)
    says(r"mumps.*multifrontal", factorise, A, backend="mumps")
    says(r"5 nodes.*32 rows", factorise, A, nodes=nodes[:5])


def test_what_a_count_lets_go_of_still_makes_the_matrix():
    """Its fronts multiplied out are A, definite ones and indefinite ones."""
    A, nodes = grid(20, 14, dofs=3)
    for shift in (0.0, 1.3, 4.1):
        S = sp.csr_array(A - shift * sp.eye_array(A.shape[0]))
        negative, error = counted(S, nodes)
        assert negative == np.sum(np.linalg.eigvalsh(S.toarray()) < 0)
        assert error < 1e-12  # a tenth of what proves a count


def test_a_count_whose_pivots_grow_proves_nothing():
    """With an eigenvalue of the first front's own block at zero, its inverse is rounding alone."""
    A, nodes = grid(20, 14)
    fronts = elimination_fronts.analyse(A, nodes)
    first = fronts.order[: fronts.start[1]]
    own = np.linalg.eigvalsh(A.toarray()[np.ix_(first, first)])[1]
    singular = A - own * sp.eye_array(A.shape[0])
    says("prove no inertia", inertia, singular, nodes=nodes, error=AccuracyError)


def test_a_count_takes_less_memory_than_the_factor():
    """Only fronts that wait for their parents are held, O(n) of O(n log n)."""
    A, nodes = grid(60, 60)
    fronts, peaks = elimination_fronts.analyse(A, nodes), []
    for run in (factorise, inertia):
        tracemalloc.start()
        kept = run(A, fronts=fronts)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        del kept
    assert peaks[1] < 0.7 * peaks[0]
