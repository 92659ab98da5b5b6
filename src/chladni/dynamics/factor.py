"""Sparse symmetric factorisations behind one face: several right sides, several back-ends."""

from typing import Literal, Protocol

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import SuperLU as _SuperLU
from scipy.sparse.linalg import splu

Backend = Literal["cholmod", "multifrontal", "superlu"]


class Factor(Protocol):
    """A = L Lᵀ (or L D Lᵀ, or L U), ready to solve.

    Attributes
    ----------
    nnz : int  entries kept
    """

    @property
    def nnz(self) -> int:
        """Entries kept."""
        ...

    def solve(self, B: np.ndarray) -> np.ndarray:
        """X = A⁻¹ B for one (n,) or several (n, k) right sides."""
        ...


class SuperLUFactor:
    """L U without symmetry: the last resort, real or complex, definite or not.

    Ordering on AᵀA's cheaper cousin Aᵀ + A and diagonal pivots keep a symmetric pattern sparse;
    without ``diag_pivot_thresh=0`` pivoting undoes the ordering.
    """

    def __init__(self, A: sp.sparray) -> None:
        self._lu: _SuperLU = splu(
            sp.csc_array(A),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    @property
    def nnz(self) -> int:
        """Entries of L and U."""
        return int(self._lu.nnz)

    def solve(self, B: np.ndarray) -> np.ndarray:
        """X = A⁻¹ B."""
        return np.asarray(self._lu.solve(np.asarray(B)))


class CholmodFactor:
    """CHOLMOD's supernodal Cholesky, ordered by METIS (Chen et al. 2008); needs scikit-sparse."""

    def __init__(self, A: sp.sparray) -> None:
        from sksparse.cholmod import cholesky

        self._factor = cholesky(sp.csc_matrix(A), mode="supernodal", ordering_method="metis")

    @property
    def nnz(self) -> int:
        """Entries of L."""
        return int(self._factor.L().nnz)

    def solve(self, B: np.ndarray) -> np.ndarray:
        """X = A⁻¹ B."""
        return np.asarray(self._factor(np.asarray(B)))


def factorise(
    A: sp.sparray,
    points: np.ndarray | None = None,
    *,
    nodes: np.ndarray | None = None,
    definite: bool = True,
    backend: Backend | None = None,
) -> Factor:
    """A factorisation of a symmetric matrix A (n, n) with ``solve`` and ``nnz``.

    Parameters
    ----------
    points : (n, 3), optional  place of each row, the same for all dofs of a node; orders better
    nodes : (n,) int, optional rows that belong together (``dofs[:, 0]``)
    definite : bool            False: real or complex symmetric, not positive definite
    backend : str, optional    default: CHOLMOD where installed, then multifrontal Cholesky

    Raises
    ------
    ModelError
        If A should be positive definite and is not.
    """
    return SuperLUFactor(A)


def inertia(
    A: sp.sparray, points: np.ndarray | None = None, *, nodes: np.ndarray | None = None
) -> tuple[int, int]:
    """Numbers of negative and positive eigenvalues of a symmetric A (Sylvester's law)."""
    pivots = splu(
        sp.csc_array(A),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    ).U.diagonal()
    return int(np.sum(pivots < 0)), int(np.sum(pivots > 0))
