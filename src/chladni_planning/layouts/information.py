"""Fisher information of sensors on modes or parameters, and its measures.

A candidate is a place (and direction) where a sensor may sit. It contributes k rows to the
information F = F_0 + Σ_i A_iᵀ A_i.  A uniaxial sensor and target modes give one row φ_i, a triaxial
one gives three, the sensitivities of an FRF give many. Several *draws* of the model (an ensemble
over uncertain parameters) are judged by the mean over the draws, so one layout serves them all.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from chladni.arrays import readonly
from chladni.errors import LabelError, ShapeError, named

Criterion = Literal["D", "A", "E", "S"]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Information of each candidate on the unknowns; made by :func:`candidates`.

    Attributes
    ----------
    rows : (n_draws, n, k, p)
        Sensitivity of the k readings of a candidate to the p unknowns, over its noise's standard
        deviation (where ``noise`` is None).
    prior : (p, p)
        Information F_0 before the test.
    noise : (n, n) or None
        Covariance of the noise between candidates, where it is correlated (k = 1).
    """

    rows: np.ndarray
    prior: np.ndarray
    noise: np.ndarray | None = None

    def __len__(self) -> int:
        return self.rows.shape[1]

    @property
    def unknowns(self) -> int:
        """Number p of modes or parameters."""
        return self.rows.shape[3]

    @property
    def informed(self) -> bool:
        """True where the prior alone determines every unknown."""
        return bool(np.linalg.matrix_rank(self.prior, hermitian=True) == self.unknowns)

    @property
    def fewest(self) -> int:
        """Least number of sensors for a regular F: at least as many rows as unknowns."""
        return 0 if self.informed else -(-self.unknowns // self.rows.shape[2])

    def fisher(self, kept: np.ndarray) -> np.ndarray:
        """F = F_0 + A_Sᵀ Σ_SS⁻¹ A_S of the kept sensors, one for each draw (n_draws, p, p)."""
        A = self.rows[:, kept].reshape(len(self.rows), -1, self.unknowns)
        if self.noise is None:
            return self.prior + A.mT @ A
        return self.prior + A.mT @ np.linalg.solve(self.noise[np.ix_(kept, kept)], A)

    def leaving(self, kept: np.ndarray) -> np.ndarray:
        """Rows g with which F shrinks to F - gᵀg when one of the kept leaves (d, len(kept), k, p).

        For correlated noise g_i = e_iᵀ Σ⁻¹ A / √(Σ⁻¹)_ii (inverse of a principal submatrix).
        """
        if self.noise is None:
            return self.rows[:, kept]
        P = np.linalg.inv(self.noise[np.ix_(kept, kept)])
        g = P @ self.rows[:, kept, 0] / np.sqrt(np.diag(P))[:, None]
        return g[:, :, None]

    def joining(self, kept: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Rows g with which F grows to F + gᵀg when one of the others joins (d, len(others), k, p).

        For correlated noise it is the part of the reading that the kept sensors do not predict:
        g_j = (a_j - Σ_jS Σ_SS⁻¹ A_S) / √(Σ_jj - Σ_jS Σ_SS⁻¹ Σ_Sj).
        """
        if self.noise is None:
            return self.rows[:, others]
        new, gamma = self.innovations(kept, others)
        return (new / np.sqrt(np.diag(gamma))[:, None])[:, :, None]

    def innovations(self, kept: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Readings (d, n_others, p) and noise covariance of the others, given the kept sensors."""
        if self.noise is None:
            raise ShapeError("innovations are for correlated noise; none was given")
        B = np.linalg.solve(self.noise[np.ix_(kept, kept)], self.noise[np.ix_(kept, others)]).T
        new = self.rows[:, others, 0] - B @ self.rows[:, kept, 0]
        return new, self.noise[np.ix_(others, others)] - B @ self.noise[np.ix_(kept, others)]


def candidates(
    phi: np.ndarray | Candidates,
    noise: np.ndarray | None = None,
    prior: np.ndarray | None = None,
) -> Candidates:
    """Candidates from mode shapes or sensitivities.

    Parameters
    ----------
    phi : (n, p), (n_draws, n, p) or (n_draws, n, k, p)
        Target shapes at the candidates, or sensitivities to p parameters.
    noise : (n,) or (n, n)
        Variance of each candidate's noise, or its covariance between candidates; all 1 by default.
    prior : (p,) or (p, p)
        Information before the test: the inverse covariance of the unknowns.
    """
    if isinstance(phi, Candidates):
        return phi
    rows = _stacked(np.asarray(phi, dtype=float))
    _, n, k, p = rows.shape
    F_0 = np.zeros((p, p)) if prior is None else _square(np.asarray(prior, float), p, "prior")
    if noise is None:
        return Candidates(readonly(rows), readonly(F_0))
    noise = np.asarray(noise, dtype=float)
    if noise.shape == (n,):
        if np.any(noise <= 0):
            raise ShapeError(f"the noise variance of candidate {noise.argmin()} is not positive")
        return Candidates(readonly(rows / np.sqrt(noise)[:, None, None]), readonly(F_0))
    if k > 1:
        raise ShapeError(f"correlated noise needs one reading a candidate, there are {k}")
    return Candidates(readonly(rows), readonly(F_0), readonly(_positive(noise, n)))


def _stacked(phi: np.ndarray) -> np.ndarray:
    """Rows (n_draws, n, k, p) from any of the accepted shapes."""
    if phi.ndim == 2:
        phi = phi[None]
    if phi.ndim == 3:
        phi = phi[:, :, None]
    if phi.ndim != 4 or 0 in phi.shape:
        raise ShapeError(f"shapes are {phi.shape}; give (candidates, modes), with draws in front")
    if not np.isfinite(phi).all():
        raise ShapeError("the shapes contain values that are not finite")
    return phi


def _square(a: np.ndarray, n: int, what: str) -> np.ndarray:
    """A diagonal as a matrix; shapes other than (n,) and (n, n) raise ShapeError."""
    a = np.diag(a) if a.ndim == 1 else a
    if a.shape != (n, n):
        raise ShapeError(f"the {what} is {a.shape}, it should be {(n, n)}")
    return a


def _positive(noise: np.ndarray, n: int) -> np.ndarray:
    """The noise as a covariance (n, n), checked to be symmetric and positive definite."""
    noise = _square(noise, n, "noise covariance")
    if np.abs(noise - noise.T).max() > 1e-12 * np.abs(noise).max():
        raise ShapeError("the noise covariance is not symmetric")
    if np.linalg.eigvalsh(noise)[0] <= 0:
        raise ShapeError("the noise covariance is not positive definite: no such noise exists")
    return noise


def positions_of(kept: np.ndarray, n: int) -> np.ndarray:
    """Positions (m,) int of a mask or a list of positions."""
    kept = np.asarray(kept)
    if kept.dtype == bool:
        if kept.shape != (n,):
            raise ShapeError(f"the mask is {kept.shape}, there are {n} candidates")
        return np.flatnonzero(kept)
    kept = kept.astype(np.int64).ravel()
    if len(wrong := kept[(kept < 0) | (kept >= n)]):
        raise LabelError(f"no candidate {named(wrong, 3)}; they are numbered 0 to {n - 1}")
    return kept


def value(criterion: Criterion, F: np.ndarray) -> float:
    """Mean over the draws of log det F (D), -trace F⁻¹ (A) or the lowest eigenvalue (E) of F.

    S is -ln (F⁻¹)_11: the information on the first unknown, the others unknown too.
    """
    if criterion == "S":
        return value("D", F) - value("D", F[..., 1:, 1:])
    if criterion == "D":
        sign, log_det = np.linalg.slogdet(F)
        return float(np.mean(np.where(sign > 0, log_det, -np.inf)))
    eigenvalues = np.linalg.eigvalsh(F)
    if criterion == "E":
        return float(eigenvalues[..., 0].mean())
    if np.any(eigenvalues[..., 0] <= 1e-14 * eigenvalues[..., -1]):
        return -np.inf
    return float(-(1 / eigenvalues).sum(axis=-1).mean())


def changed(criterion: Criterion, F: np.ndarray, U: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """The criterion of F + Uᵀ diag(sign) U for many changes U at once (matrix inversion lemma).

    Parameters
    ----------
    F : (d, p, p)
    U : (d, m, q, p)    rows that join (sign +1) or leave (-1)
    sign : (q,)

    Returns
    -------
    (m,)                -inf where the changed information is singular
    """
    if criterion == "S":
        others = changed("D", F[..., 1:, 1:], U[..., 1:], sign)
        return changed("D", F, U, sign) - others
    if criterion == "E":
        change = np.einsum("dmqi,q,dmqj->dmij", U, sign, U, optimize=True)
        return np.linalg.eigvalsh(F[:, None] + change)[..., 0].mean(axis=0)
    C = np.linalg.inv(F)
    UC = U @ C[:, None]
    K = UC @ U.mT  # (d, m, q, q)
    signs, log_det = np.linalg.slogdet(np.eye(len(sign)) + sign[:, None] * K)
    alive = (signs > 0) & (log_det > -25)
    if criterion == "D":
        gain = np.where(alive, log_det, -np.inf)
        return (np.linalg.slogdet(F)[1][:, None] + gain).mean(axis=0)
    K = np.where(alive[..., None, None], np.diag(sign) + K, np.eye(len(sign)))
    less = np.trace(np.linalg.solve(K, UC @ UC.mT), axis1=-2, axis2=-1)
    trace = np.trace(C, axis1=-2, axis2=-1)[:, None] - less
    return np.where(alive, -trace, -np.inf).mean(axis=0)


def log_det_fisher(
    phi: np.ndarray, noise: np.ndarray | None = None, prior: np.ndarray | None = None
) -> float:
    """log det(ΦᵀΣ⁻¹Φ): the information all rows (sensors) carry about the columns (modes)."""
    c = candidates(phi, noise, prior)
    return value("D", c.fisher(np.arange(len(c))))


def independence(
    phi: np.ndarray | Candidates, noise: np.ndarray | None = None, prior: np.ndarray | None = None
) -> np.ndarray:
    """Effective independence E = diag(Φ (ΦᵀΦ)⁻¹ Φᵀ) of every candidate, in [0, 1].

    Deleting candidate i multiplies det F by 1 - E_i; over draws 1 - E is the geometric mean.
    Kammer (1991), J. Guidance, Control and Dynamics 14(2), 251-259.

    Examples
    --------
    >>> independence(np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    array([0.5, 0.5, 1. ])
    """
    c = candidates(phi, noise, prior)
    Q = whitened(c, np.arange(len(c)))
    return combined(np.clip(1 - np.linalg.det(np.eye(Q.shape[2]) - Q @ Q.mT), 0.0, 1.0))


def whitened(c: Candidates, kept: np.ndarray) -> np.ndarray:
    """Rows Q = G R⁻¹ with RᵀR = F, so that E is their squared norm (d, len(kept), k, p).

    Raises
    ------
    ShapeError
        If the kept candidates cannot distinguish the unknowns: F is singular.
    """
    if c.noise is not None:
        R = np.linalg.cholesky(_regular(c.fisher(kept))).mT
        return np.linalg.solve(R.mT[:, None], c.leaving(kept).mT).mT
    rows = c.rows[:, kept].reshape(len(c.rows), -1, c.unknowns)
    root = _root(c.prior)
    stack = np.concatenate([rows, np.broadcast_to(root, (len(rows), *root.shape))], axis=1)
    Q, R = np.linalg.qr(stack)
    pivots = np.abs(np.diagonal(R, axis1=1, axis2=2))
    if stack.shape[1] < c.unknowns or np.any(pivots.min(axis=1) <= 1e-12 * pivots.max(axis=1)):
        _regular(np.zeros((1, c.unknowns, c.unknowns)))
    return Q[:, : rows.shape[1]].reshape(len(rows), len(kept), -1, c.unknowns)


def _root(prior: np.ndarray) -> np.ndarray:
    """S (rank, p) with SᵀS = F_0; no rows where there is no prior."""
    if not prior.any():
        return np.zeros((0, len(prior)))
    lam, X = np.linalg.eigh(prior)
    good = lam > 1e-14 * lam[-1]
    return np.sqrt(lam[good])[:, None] * X[:, good].T


def _regular(F: np.ndarray) -> np.ndarray:
    """The information F, checked to be regular."""
    eigenvalues = np.linalg.eigvalsh(F)
    if np.any(eigenvalues[..., 0] <= 1e-14 * eigenvalues[..., -1]):
        raise ShapeError(
            f"the candidates cannot distinguish the {F.shape[-1]} modes: the information matrix "
            "is singular (two modes are equal there, or one is invisible); request fewer modes, "
            "or give more places"
        )
    return F


def combined(E: np.ndarray) -> np.ndarray:
    """One independence for all draws: 1 - geometric mean of 1 - E over the first axis."""
    if len(E) == 1:
        return E[0]
    with np.errstate(divide="ignore"):
        return -np.expm1(np.log1p(-np.minimum(E, 1.0)).mean(axis=0))


def information_entropy(F: np.ndarray) -> float:
    """Entropy h = p/2 ln(2πe) - 1/2 ln det F: the remaining uncertainty of p unknowns [nat].

    Papadimitriou (2004), J. Sound and Vibration 278, 923-947.
    """
    p = F.shape[-1]
    return p / 2 * np.log(2 * np.pi * np.e) - value("D", F.reshape(-1, p, p)) / 2


def expected_posterior(c: Candidates, kept: np.ndarray) -> np.ndarray:
    """Standard deviation √diag(F⁻¹) the unknowns will have after the test, worst draw (p,)."""
    C = np.linalg.inv(_regular(c.fisher(positions_of(kept, len(c)))))
    return np.sqrt(np.diagonal(C, axis1=1, axis2=2)).max(axis=0)


def sensitivity_rows(jacobian: np.ndarray, noise: np.ndarray | float = 1.0) -> np.ndarray:
    """Rows (1, n_out, min(rows, p), p) of parameter information A_iᵀA_i = Σ Re(Jᴴ Σ⁻¹ J).

    Parameters
    ----------
    jacobian : (n_freq, n_out, ..., p) complex or real
        Sensitivity of the response at each output to each parameter (the parameters scaled by
        their prior spread, so that they may be compared).
    noise : standard deviation of real and imaginary part; broadcasts to (n_freq, n_out, ...)

    Notes
    -----
    Every block is shrunk to p rows by QR, which keeps A_iᵀA_i.
    """
    J = np.moveaxis(jacobian / np.expand_dims(noise, -1), 1, 0)
    J = J.reshape(J.shape[0], -1, J.shape[-1])
    J = np.concatenate([J.real, J.imag], axis=1) if np.iscomplexobj(J) else J
    return np.asarray(np.linalg.qr(J, mode="r") if J.shape[1] > J.shape[2] else J)[None]
