"""Undamped modes K φ = ω² M φ of large sparse systems, proved complete by a Sturm count."""

import numpy as np
import scipy.sparse as sp
from scipy.linalg import LinAlgError, eigh

from ..dofs import label
from ..errors import AccuracyError, ModelError
from .factor import Backend, Factor, factorise, inertia
from .lanczos import Ritz, block_lanczos
from .modes import ModalModel
from .system import System

_DENSE = 300  # dofs; below, LAPACK is as fast
_GUESS = 1e-8  # of the median K_ii/M_ii: where a shift lies well for 10³ to 10⁶ dofs
_ORTHONORMAL = 1e-8
_RESIDUAL = 1e-5


def normal_modes(
    system: System,
    count: int | None = None,
    *,
    band: float | None = None,
    shift: float | None = None,
    points: np.ndarray | None = None,
    backend: Backend | None = None,
    proof: bool = True,
) -> ModalModel:
    """The lowest modes, K φ_r = ω_r² M φ_r with Φᵀ M Φ = I, undamped.

    Block Lanczos on (K - σM)⁻¹M with σ < 0, so that free structures and rigid modes need no special
    care; the number of eigenvalues below a value just above the last mode, by the inertia of
    K - s M (Sylvester), proves that none is missing.

    Parameters
    ----------
    count : int, optional       how many; default all of a small system, else 20
    band : float, optional      or all up to this frequency [Hz] (both: the fewer)
    shift : float, optional     σ [rad²/s²], negative; default from the scale of the problem
    points : (n, 3), optional   place of each row's node [m]: a better elimination order
    backend : str, optional     of :func:`factorise`
    proof : bool                False leaves the Sturm count out (a third of the time)

    Raises
    ------
    ModelError
        If the shifted stiffness is not positive definite; the sentence names a dof.
    AccuracyError
        If modes are missing, not mass-orthonormal, or no eigenvectors.
    """
    problem = _Problem(system, points, backend)
    n = len(system.dofs)
    if n <= _DENSE or (count is not None and 3 * count > n):
        lam, phi = _dense(problem, count, band)
    else:
        lam, phi = _sparse(problem, count, band, shift, proof)
    if (gap := _gap(phi, problem.M)) > _ORTHONORMAL:
        raise AccuracyError(f"modes are not mass-orthonormal: |ΦᵀMΦ - I| = {gap:.1e}")
    frequency = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
    return ModalModel(frequency, np.zeros(len(lam)), phi, system.dofs)


class _Problem:
    """K, M real and compressed, with the order information that goes along."""

    def __init__(self, system: System, points: np.ndarray | None, backend: Backend | None) -> None:
        self.K, self.M = (sp.csr_array(A.real).astype(float) for A in (system.K, system.M))
        self.dofs, self.points, self.backend = system.dofs, points, backend

    def shifted(self, sigma: float) -> sp.csr_array:
        """K - σ M."""
        return self.K - sigma * self.M

    def factor(self, sigma: float) -> Factor:
        """Positive definite factorisation of K - σ M.

        Raises
        ------
        ModelError
            Naming a dof with neither stiffness nor mass, if that is the reason.
        """
        A = self.shifted(sigma)
        empty = np.flatnonzero(A.diagonal() <= 0)
        if len(empty):
            names = ", ".join(label(*self.dofs[r]) for r in empty[:3])
            raise ModelError(f"no stiffness and no mass at {len(empty)} dofs: {names} ...")
        return factorise(A, self.points, nodes=self.dofs[:, 0], backend=self.backend)

    def below(self, s: float) -> int:
        """How many eigenvalues are below s: the negative ones of K - s M (Sylvester)."""
        return inertia(self.shifted(s), self.points, nodes=self.dofs[:, 0])[0]


def _guess(problem: _Problem) -> float:
    """σ = -1e-8 median(K_ii/M_ii) over translations: one unit everywhere, blind to the scale."""
    k, m = problem.K.diagonal(), problem.M.diagonal()
    translation = (problem.dofs[:, 1] <= 3) & (m > 0) & (k > 0)
    use = translation if translation.any() else (m > 0) & (k > 0)
    if not use.any():
        raise ModelError("no degree of freedom has both stiffness and mass")
    return -_GUESS * float(np.median(k[use] / m[use]))


def _dense(
    problem: _Problem, count: int | None, band: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """LAPACK; massless dofs through M φ = θ (K - σM) φ, θ = 1/(λ - σ), where λ = ∞ is θ = 0."""
    K, M = problem.K.toarray(), problem.M.toarray()
    try:
        lam, phi = eigh(K, M)
    except LinAlgError:
        lam, phi = _dense_massless(K, M, _guess(problem) / _GUESS * 1e-4)
    keep = np.arange(len(lam)) < (len(lam) if count is None else count)
    if band is not None:
        keep &= lam <= (2 * np.pi * band) ** 2
    return lam[keep], phi[:, keep]


def _dense_massless(K: np.ndarray, M: np.ndarray, sigma: float) -> tuple[np.ndarray, np.ndarray]:
    try:
        theta, X = eigh(M, K - sigma * M)
    except LinAlgError as error:
        raise ModelError("a motion has neither stiffness nor mass") from error
    theta, X = theta[::-1], X[:, ::-1]
    finite = theta > 1e-11 * theta[0]
    return sigma + 1 / theta[finite], X[:, finite] / np.sqrt(theta[finite])


def _sparse(
    problem: _Problem, count: int | None, band: float | None, shift: float | None, proof: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Lanczos, then the proof; modes the proof finds missing are looked for among the rest."""
    limit = np.inf if band is None else (2 * np.pi * band) ** 2
    if band is not None:
        count = min(problem.below(limit), count or len(problem.dofs))
        shift = -1e-3 * limit if shift is None else shift
    k = min(20 if count is None else count, len(problem.dofs))
    if k == 0:
        return np.zeros(0), np.zeros((len(problem.dofs), 0))
    sigma, factor, ritz = _converged(problem, k, shift)
    lam, phi = sigma + 1 / ritz.theta[:k], ritz.vectors(k)
    _check_residual(problem, factor, sigma, lam, phi)
    return lam, phi


def _converged(problem: _Problem, k: int, shift: float | None) -> tuple[float, Factor, Ritz]:
    """Lanczos from a shift that suits: a guess is renewed when it proves far from λ_k."""
    sigma = _guess(problem) if shift is None else shift
    factor = problem.factor(sigma)
    ritz = block_lanczos(factor.solve, problem.M, k)
    return sigma, factor, ritz


def _check_residual(
    problem: _Problem, factor: Factor, sigma: float, lam: np.ndarray, phi: np.ndarray
) -> None:
    """|(K - σM)⁻¹ M Φ θ⁻¹ g - Φ g|_M / |Φ g|_M for random g: all modes in one solve."""
    g = np.random.default_rng(1).standard_normal((len(lam), 4))
    r = factor.solve(problem.M @ (phi @ (g * (lam - sigma)[:, None]))) - phi @ g
    size = np.sqrt(np.einsum("ij,ij->j", r, problem.M @ r) / np.einsum("ij,ij->j", g, g)).max()
    if size > _RESIDUAL:
        raise AccuracyError(f"modes do not solve K φ = λ M φ: relative residual {size:.1e}")


def _gap(phi: np.ndarray, M: sp.csr_array) -> float:
    """|ΦᵀMΦ - I|."""
    return float(np.abs(phi.T @ (M @ phi) - np.eye(phi.shape[1])).max(initial=0.0))
