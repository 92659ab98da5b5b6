"""Undamped modes K φ = ω² M φ of large sparse systems, proved complete by a Sturm count."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import scipy.sparse as sp
from scipy.linalg import LinAlgError, cholesky, eigh, solve_triangular

from ..dofs import label
from ..errors import AccuracyError, ModelError
from ..parallel import one_blas_thread
from ..sparse.elimination_fronts import Fronts, analyse, pattern
from ..sparse.factor import Backend, Factor, factorise, inertia
from ..sparse.lanczos import Ritz, block_lanczos
from ..sparse.multifrontal import NotDefinite
from .massless import stiffened
from .modes import ModalModel
from .system import System

_DENSE = 300  # dofs; below, LAPACK is as fast
_GUESS = 1e-8  # of the median K_ii/M_ii: a good shift for 10³ to 10⁶ dofs
_FAR, _NEAR = 1.0, 1e-7  # limits of σ/λ_k for a usable shift
_SHARP = 1e-4  # error of a Ritz value that is small enough to identify a gap
_ORTHONORMAL = 1e-8
_RESIDUAL = 1e-5
_LOOSE = 1e-6  # largest Ritz error of a returned mode (the error of frequencies is its square)
_SHARP_SHARE = 1e-6  # of -1/σ: θ that one shift gives to ten digits
_ROUNDING_OF_THETA = 1e-13  # of it: θ below this are rounding
_FIRM = 1e-6  # of the median K_ii/M_ii: first shift of small systems
_ROUNDING = 1e-12  # of the largest K_ii/M_ii: λ of a rigid motion due to rounding of K
_EXTREME = 1e-2  # of the median K_ii/M_ii: upper limit of λ that counts as rounding
Modes = tuple[np.ndarray, np.ndarray]  # λ (k,), Φ (n, k)
_JUST_ABOVE = 1 + 1e-6  # a band that ends at a mode includes it, whatever the rounding


@one_blas_thread()
def normal_modes(
    system: System,
    count: int | None = None,
    *,
    band: float | None = None,
    shift: float | None = None,
    backend: Backend = "multifrontal",
    proof: bool = True,
) -> ModalModel:
    """The lowest modes, K φ_r = ω_r² M φ_r with Φᵀ M Φ = I, undamped.

    Block Lanczos on (K - σM)⁻¹M with σ < 0, so that free structures and rigid modes need no special
    treatment. The inertia of K - s M (Sylvester) gives the number of eigenvalues below s, a value
    just above the last mode. It proves that no mode is missing.

    Parameters
    ----------
    count : int, optional       number of modes; default all of a small system (or of one with few
                                dofs with mass), else 20
    band : float, optional      all modes up to this frequency [Hz] (with ``count``: the fewer)
    shift : float, optional     σ [rad²/s²], negative; default from the scale of the problem
    backend : str               of :func:`factorise`
    proof : bool                False omits the Sturm count (a quarter of the time)

    Raises
    ------
    ModelError
        If the shifted stiffness is not positive definite; the message names a dof.
    AccuracyError
        If modes are missing, not mass-orthonormal, or no eigenvectors.
    """
    n = len(system.dofs)
    limit = np.inf if band is None else (2 * np.pi * band) ** 2 * _JUST_ABOVE
    K, M = (sp.csr_array(A).astype(float, copy=False) for A in (system.elastic, system.M))
    massive = np.abs(M).sum(axis=1) > 0
    if n <= _DENSE or (count is not None and 3 * count > n):
        lam, phi = _dense(K, M, system.dofs, count, limit)
    elif massive.sum() <= _DENSE:
        lam, phi = _condensed(K, M, system.dofs, massive, count, limit)
    else:
        fronts = analyse(pattern(K, M), system.dofs[:, 0])
        order = fronts.order  # Lanczos runs in the order of elimination
        problem = _Problem(K, M, M[order][:, order], system.dofs, backend, fronts)
        lam, phi = _held(lambda p: _sparse(p, count, limit, shift, proof), problem)
        phi = phi[np.argsort(order)]
    keep = (lam <= limit) & (np.arange(len(lam)) < (len(lam) if count is None else count))
    lam, phi = lam[keep], np.asfortranarray(phi[:, keep])
    if (gap := _gap(phi, M)) > _ORTHONORMAL:
        raise AccuracyError(f"modes are not mass-orthonormal: |ΦᵀMΦ - I| = {gap:.1e}")
    frequency = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
    return ModalModel(frequency, np.zeros(len(lam)), phi, system.dofs)


@dataclass(frozen=True, eq=False)
class _Problem:
    """Real K and M, the elimination order for every K - σM, and M in that order."""

    K: sp.csr_array
    M: sp.csr_array
    M_o: sp.csr_array
    dofs: np.ndarray
    backend: Backend
    fronts: Fronts

    def shifted(self, K: sp.csr_array, sigma: float) -> sp.csr_array:
        """K - σM in the order of elimination; columns of a row in any order."""
        new, A = np.argsort(self.fronts.order), sp.csr_array(K - sigma * self.M)
        A = A[self.fronts.order]
        at = new.astype(A.indices.dtype)[A.indices]
        return sp.csr_array((A.data, at, A.indptr), shape=A.shape)

    def factor(self, sigma: float) -> Factor:
        """Positive definite factorisation of K - σM in that order; an error names the dof."""
        A = self.shifted(self.K, sigma)
        try:
            return factorise(A, backend=self.backend, fronts=self.fronts.ordered())
        except NotDefinite as error:
            at = label(*self.dofs[self.fronts.order[error.row]])
            raise ModelError(
                f"K - σM is not positive definite at σ = {sigma:.2e} (seen at {at}): a part is "
                "not connected, or a stiffness is negative"
            ) from error

    def below(self, s: float) -> int:
        """Number of eigenvalues below s: the negative ones of K - s M (Sylvester)."""
        for firm, nudge in product((False, True), (0.0, 1e-7, -1e-7)):
            K = stiffened(self.K) if firm else self.K
            try:
                return inertia(self.shifted(K, s * (1 + nudge)), fronts=self.fronts.ordered())[0]
            except AccuracyError:
                continue
        raise AccuracyError(f"no Sturm count at {np.sqrt(abs(s)) / (2 * np.pi):.6g} Hz")


@dataclass(frozen=True)
class _Scale:
    """Scale of λ [rad²/s²]: median K_ii/M_ii of the translations, and the λ due to rounding."""

    typical: float
    rounding: float

    @property
    def first_shift(self) -> float:
        """-σ for small systems."""
        return max(_FIRM * self.typical, 10 * self.rounding)


def _scale(K: sp.csr_array, M: sp.csr_array, dofs: np.ndarray) -> _Scale:
    """Scale of λ from K_ii/M_ii of dofs with mass: in rad²/s² for every dof, in any units.

    The median of the translations does not depend on the unit of length. Rounding of K gives a
    rigid motion λ ~ ε max K_ii/M_ii, which is large with a node of small inertia.

    Raises
    ------
    ModelError
        If a degree of freedom has neither stiffness nor mass; the message names some.
    """
    k, m = K.diagonal(), M.diagonal()
    if len(empty := np.flatnonzero((k <= 0) & (m <= 0))):
        names = ", ".join(label(*dofs[r]) for r in empty[:3])
        raise ModelError(f"{len(empty)} dofs have neither stiffness nor mass: {names}, ...")
    both = (m > 0) & (k > 0)
    use = both & (dofs[:, 1] <= 3)
    use = use if use.any() else both
    if not use.any():
        raise ModelError("no degree of freedom has both stiffness and mass: there are no modes")
    typical = float(np.median(k[use] / m[use]))
    rounding = _ROUNDING * float((k[both] / m[both]).max())
    return _Scale(typical, min(rounding, _EXTREME * typical))


def _dense(
    K: sp.csr_array, M: sp.csr_array, dofs: np.ndarray, count: int | None, limit: float
) -> Modes:
    """Modes by LAPACK: ``count`` of them, or up to the first beyond ``limit``.

    Massless motions have no modes.
    """
    return _small(K, M, _scale(K, M, dofs), count, limit)


def _small(
    K: sp.csr_array, M: sp.csr_array, scale: _Scale, count: int | None, limit: float
) -> Modes:
    """Modes by LAPACK for a known scale of λ."""
    count = K.shape[0] if count is None else count
    for A in (K, stiffened(K)):
        try:
            lam, phi = _by_shifts(A.toarray(), M.toarray(), -scale.first_shift, count, limit)
            break
        except LinAlgError as error:
            fault = error
    else:
        raise ModelError("K - σM is not positive definite: a part is not connected") from fault
    if len(lam) and lam[0] < -max(_GUESS * scale.typical, scale.rounding):
        raise ModelError(f"a stiffness is negative: the lowest λ is {lam[0]:.2e} rad²/s²")
    return lam, phi


def _condensed(
    K: sp.csr_array,
    M: sp.csr_array,
    dofs: np.ndarray,
    massive: np.ndarray,
    count: int | None,
    limit: float,
) -> Modes:
    """Modes of the few dofs with mass; the others follow by φ_s = -K_ss⁻¹ K_sm φ_m."""
    K_ss, K_sm = K[~massive][:, ~massive], K[~massive][:, massive]
    try:
        factor = factorise(K_ss, nodes=dofs[~massive, 0])
    except ModelError:
        factor = factorise(stiffened(K_ss), nodes=dofs[~massive, 0])
    follow = -factor.solve(K_sm.toarray())
    k = K[massive][:, massive].toarray() + K_sm.T @ follow
    k, m = sp.csr_array((k + k.T) / 2), M[massive][:, massive]
    lam, phi_m = _small(k, m, _scale(K, M, dofs), count, limit)
    phi = np.empty((len(dofs), len(lam)))
    phi[massive], phi[~massive] = phi_m, follow @ phi_m
    return lam, phi


def _by_shifts(K: np.ndarray, M: np.ndarray, sigma: float, count: int, limit: float) -> Modes:
    """Modes from M' φ = θ (K - σM) φ, θ = 1/(λ - σ); M' = M - M Φ Φᵀ M excludes known modes.

    M may be singular: then λ = ∞ is θ = 0. A shift gives λ up to 10⁶ times its size to ten digits.
    It is changed until ``count`` modes, one beyond ``limit``, or all finite ones are found.
    """
    lam, phi, n = np.zeros(0), np.zeros((len(K), 0)), len(K)
    k, m = K.diagonal(), M.diagonal()
    top = n * (k[m > 0] / m[m > 0]).max()
    while len(lam) < min(count, n) and (not len(lam) or lam[-1] <= limit) and -sigma < top:
        found, rest = M @ phi, min(count, n) - len(lam)
        theta, X = eigh(M - found @ found.T, K - sigma * M, subset_by_index=(n - rest, n - 1))
        theta, X = -sigma * theta[::-1], X[:, ::-1]  # 1 of a rigid motion
        sharp = int(np.sum(theta > _SHARP_SHARE))
        phi = _orthonormal(np.hstack([phi, X[:, :sharp] / np.sqrt(theta[:sharp])]), M)
        lam = np.r_[lam, sigma - sigma / theta[:sharp]]
        sigma *= 1e-3 / max([_ROUNDING_OF_THETA, *theta[sharp : sharp + 1]])
    return lam, phi


def _orthonormal(phi: np.ndarray, M: np.ndarray) -> np.ndarray:
    """Φ L⁻ᵀ with L Lᵀ = Φᵀ M Φ: each mode is made orthogonal to the previous ones."""
    if not phi.shape[1]:
        return phi
    L = cholesky(phi.T @ M @ phi, lower=True)
    return np.asarray(solve_triangular(L, phi.T, lower=True).T)


def _held(solved: Callable[[_Problem], Modes], problem: _Problem) -> Modes:
    """Modes of the problem; if it is singular, with its massless motions held."""
    try:
        return solved(problem)
    except (ModelError, LinAlgError) as fault:
        try:
            return solved(replace(problem, K=stiffened(problem.K)))
        except LinAlgError as error:
            raise AccuracyError(f"Lanczos broke down: {error}") from error
        except ModelError:
            raise fault from None


def _sparse(
    problem: _Problem, count: int | None, limit: float, shift: float | None, proof: bool
) -> Modes:
    """The ``count`` lowest modes, default 20; modes beyond ``limit`` may be inaccurate."""
    due = problem.below(limit) if count is None and np.isfinite(limit) else None
    k = count or 20 if due is None else due
    if k == 0:
        return np.zeros(0), np.zeros((len(problem.dofs), 0))
    sigma = -1e-3 * limit if shift is None and np.isfinite(limit) else shift
    sigma, factor, ritz = _converged(problem, k, sigma)
    theta, error = ritz.theta, ritz.error
    k = min(k, len(theta))
    lam, phi = sigma + 1 / theta[:k], ritz.vectors(k)
    del ritz  # half as large as the factor
    _check_residual(problem, factor, sigma, lam, phi)
    if proof and len(theta) > k:
        del factor  # a count takes as much memory
        s, known = _gap_above(sigma + 1 / theta, error, k)
        if due is not None:  # the k modes are those below the limit, or some are missing
            s, known = limit, int(np.sum(lam < limit))
        due = problem.below(s) if due is None else due
        if due != known:
            factor = problem.factor(sigma)
            lam, phi = _completed(problem, factor, sigma, lam, phi, s, due)
            _check_residual(problem, factor, sigma, lam, phi)
    return lam[:k], phi[:, :k]


def _converged(problem: _Problem, k: int, shift: float | None) -> tuple[float, Factor, Ritz]:
    """Lanczos from a suitable shift; a guessed shift is replaced if it is far from the modes."""
    sigma = shift
    if sigma is None:
        sigma = -_GUESS * _scale(problem.K, problem.M, problem.dofs).typical
    for again in (False, True):
        factor = problem.factor(sigma)
        ritz = block_lanczos(factor.solve, problem.M_o, k)
        known = ritz.theta[ritz.error < 1e-2]
        top = sigma + 1 / known[-1] if len(known) else 0.0
        if again or shift is not None or _NEAR * top < -sigma < _FAR * top:
            break
        sigma = -1e-3 * top if top > 0 else 1e3 * sigma
    if np.any(ritz.error[:k] > _LOOSE):
        raise AccuracyError(
            f"{np.sum(ritz.error[:k] > _LOOSE)} of {k} modes did not converge from the shift "
            f"{sigma:.2e} rad²/s²; "
            + (
                "give one nearer to the modes (negative, about -λ/1000)"
                if shift is not None
                else _heaviest(problem)
            )
        )
    return sigma, factor, ritz


def _heaviest(problem: _Problem) -> str:
    """Sentence on the translation with the largest mass relative to the median."""
    d = np.where(problem.dofs[:, 1] <= 3, problem.M.diagonal(), 0.0)
    k, usual = int(np.argmax(d)), np.median(d[d > 0]) if np.any(d > 0) else np.inf
    return (
        f"a mass or a stiffness may be wrong: {label(*problem.dofs[k])} has {d[k] / usual:.2g} "
        "times the usual mass"
    )


def _gap_above(lam: np.ndarray, error: np.ndarray, k: int) -> tuple[float, int]:
    """A value in the widest gap of sharp Ritz values above the k-th mode, number of modes below."""
    sharp = np.flatnonzero(error > _SHARP)
    last = max(int(sharp[0]) if len(sharp) else len(lam), k + 1)
    gaps = np.diff(lam[k - 1 : last]) / np.abs(lam[k:last])
    i = k + int(np.argmax(gaps))
    return float(lam[i - 1] + lam[i]) / 2, i


def _completed(
    problem: _Problem,
    factor: Factor,
    sigma: float,
    lam: np.ndarray,
    phi: np.ndarray,
    s: float,
    due: int,
) -> Modes:
    """All ``due`` modes below s: missing modes are searched with the known ones locked.

    A block finds at most as many copies of a multiple eigenvalue as it has columns; the next round
    finds the next ones.
    """
    for attempt in range(1, 5):
        if (missing := due - int(np.sum(lam < s))) <= 0:
            break
        ritz = block_lanczos(factor.solve, problem.M_o, missing, locked=phi, seed=attempt)
        good = np.flatnonzero(ritz.error[:missing] < _LOOSE)
        lam = np.r_[lam, sigma + 1 / ritz.theta[good]]
        phi = np.hstack([phi, ritz.vectors(missing)[:, good]])
        order = np.argsort(lam, kind="stable")
        lam, phi = lam[order], phi[:, order]
    if missing:
        hz = np.sqrt(max(s, 0.0)) / (2 * np.pi)
        raise AccuracyError(f"{due} modes lie below {hz:.6g} Hz, {due - missing} were found")
    return lam, phi


def _check_residual(
    problem: _Problem, factor: Factor, sigma: float, lam: np.ndarray, phi: np.ndarray
) -> None:
    """|A⁻¹M Φ θ⁻¹ g - Φ g|_M / |g| for random g, A = K - σM, θ = 1/(λ - σ): all modes at once."""
    g = np.random.default_rng(1).standard_normal((len(lam), 4))
    M = problem.M_o
    r = factor.solve(M @ (phi @ (g * (lam - sigma)[:, None]))) - phi @ g
    size = np.sqrt(np.einsum("ij,ij->j", r, M @ r) / np.einsum("ij,ij->j", g, g)).max()
    if size > _RESIDUAL:
        raise AccuracyError(f"modes do not solve K φ = λ M φ: relative residual {size:.1e}")


def _gap(phi: np.ndarray, M: sp.csr_array) -> float:
    """|ΦᵀMΦ - I|."""
    return float(np.abs(phi.T @ (M @ phi) - np.eye(phi.shape[1])).max(initial=0.0))
