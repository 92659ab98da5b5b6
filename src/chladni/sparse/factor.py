"""Sparse symmetric factorisations with one interface, several right sides and back-ends."""

from typing import Literal, Protocol, get_args

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from ..errors import AccuracyError, LabelError, ModelError
from .elimination_fronts import Fronts
from .multifrontal import Multifrontal, NotDefinite, counted

Backend = Literal["multifrontal", "cholmod", "superlu"]
_BACKWARD = 1e-11  # limit of |A x - b| / (|A| |x| + |b|) without global pivoting


class Factor(Protocol):
    """A factorised matrix A."""

    @property
    def nnz(self) -> int:
        """Number of stored entries."""
        ...

    def solve(self, B: np.ndarray) -> np.ndarray:
        """X = A⁻¹ B for one (n,) or several (n, k) right sides."""
        ...

    def between(self, B: sp.csr_array) -> np.ndarray:
        """Bᵀ A⁻¹ B (k, k) of sparse columns (n, k)."""
        return np.asarray(B.T @ self.solve(B.toarray()))


class SuperLUFactor(Factor):
    """L U without symmetry, real or complex, definite or not: the last resort.

    Minimum degree on Aᵀ + A and diagonal pivots keep a symmetric pattern sparse. Without
    ``diag_pivot_thresh=0`` pivoting destroys the order
    (Demmel et al. 1999, SIAM J. Matrix Anal. 20).
    """

    def __init__(self, A: sp.sparray, threshold: float = 0.0) -> None:
        try:
            self._lu = splu(
                sp.csc_array(A),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=threshold,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise ModelError(f"the matrix cannot be factorised: {error}") from error

    @property
    def nnz(self) -> int:
        """Entries of L and U."""
        return int(self._lu.nnz)

    @property
    def positive(self) -> bool:
        """True if all pivots are positive."""
        return bool(np.all(self._lu.U.diagonal() > 0))

    def solve(self, B: np.ndarray) -> np.ndarray:
        """X = A⁻¹ B."""
        return self._lu.solve(np.asarray(B))


class CholmodFactor(Factor):
    """CHOLMOD's supernodal Cholesky, ordered by METIS (Chen et al. 2008); needs scikit-sparse."""

    def __init__(self, A: sp.sparray) -> None:
        from sksparse.cholmod import CholmodNotPositiveDefiniteError, cholesky

        try:
            self._factor = cholesky(sp.csc_matrix(A), mode="supernodal", ordering_method="metis")
        except CholmodNotPositiveDefiniteError as error:
            raise NotDefinite(int(np.argmin(A.diagonal()))) from error

    @property
    def nnz(self) -> int:
        """Entries of L."""
        return int(self._factor.L().nnz)

    def solve(self, B: np.ndarray) -> np.ndarray:
        """X = A⁻¹ B."""
        return self._factor(np.asarray(B))


def factorise(
    A: sp.sparray,
    *,
    nodes: np.ndarray | None = None,
    definite: bool = True,
    backend: Backend = "multifrontal",
    fronts: Fronts | None = None,
) -> Factor:
    """A factorisation of a symmetric matrix A (n, n) with ``solve`` and ``nnz``.

    Multifrontal Cholesky needs only SciPy. It is the fastest if CHOLMOD uses a reference BLAS, as
    in Debian (benchmarks/README.md); "cholmod" needs scikit-sparse.

    Parameters
    ----------
    nodes : (n,) int, optional rows that belong together (``dofs[:, 0]``)
    definite : bool            False: real or complex symmetric, not positive definite
    fronts : Fronts, optional  the order, known from a matrix of the same pattern

    Raises
    ------
    ModelError
        If A should be positive definite and is not, or is singular.
    LabelError
        If there is no such back-end, or it is not installed.
    """
    if backend not in get_args(Backend):
        raise LabelError(f"no back-end {backend!r}; there are {', '.join(get_args(Backend))}")
    if not definite:
        return SuperLUFactor(A) if backend == "superlu" else _indefinite(A, nodes, fronts)
    if backend == "multifrontal":
        return Multifrontal(A, nodes, fronts=fronts)
    return _cholmod(A) if backend == "cholmod" else _superlu(A)


def _cholmod(A: sp.sparray) -> CholmodFactor:
    try:
        return CholmodFactor(A)
    except ImportError as error:
        raise LabelError('back-end "cholmod" needs scikit-sparse: chladni[cholmod]') from error


def _superlu(A: sp.sparray) -> SuperLUFactor:
    factor = SuperLUFactor(A)
    if not factor.positive:
        raise NotDefinite(int(np.argmin(A.diagonal())))
    return factor


def _indefinite(A: sp.sparray, nodes: np.ndarray | None, fronts: Fronts | None) -> Factor:
    """Fronts with pivoting inside them; if that is not accurate enough, global pivoting."""
    factor = Multifrontal(A, nodes, definite=False, fronts=fronts)
    return factor if backward_error(A, factor) < _BACKWARD else SuperLUFactor(A, threshold=0.1)


def backward_error(A: sp.sparray, factor: Factor) -> float:
    """|A x - b| / (|A| |x| + |b|) in the maximum norm for x = A⁻¹ b with a random b."""
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    x = factor.solve(b.astype(A.dtype))
    size = np.abs(A).sum(axis=1).max() * np.abs(x).max() + np.abs(b).max()
    error = np.abs(A @ x - b).max() / size
    return float(error) if np.isfinite(error) else np.inf


def inertia(
    A: sp.sparray,
    *,
    nodes: np.ndarray | None = None,
    fronts: Fronts | None = None,
) -> tuple[int, int]:
    """Numbers of negative and positive eigenvalues of a real symmetric A (Sylvester's law).

    Raises
    ------
    AccuracyError
        If A is so close to singular that the signs of its pivots are not reliable.
    """
    negative, error = counted(A, nodes, fronts)
    if error > _BACKWARD:
        raise AccuracyError(f"pivots prove no inertia: backward error {error:.1e}")
    return negative, A.shape[0] - negative
