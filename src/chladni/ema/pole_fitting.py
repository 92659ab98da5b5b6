"""Common poles of many responses, on any frequency grid.

H(s) = s^q [Σ_r R_r / (s - p_r) + R̄_r / (s - p̄_r) + L / s² + U], s = iω. The number of derivatives
is q (0 receptance, 1 mobility, 2 accelerance). The residues and the residual terms L, U (modes
below and above the band) are linear and are eliminated (Golub and Pereyra 1973, variable
projection; Jacobian of Kaufman 1975). The poles are found by relaxed vector fitting (Gustavsen and
Semlyen 1999, Gustavsen 2006) and polished by Levenberg-Marquardt.

Nothing here assumes evenly spaced lines. Frequencies are scaled to the top of the band.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

_TINY = 1e-300
_RIDGE = 1e-12  # of the orthonormal basis: a channel that is dead stays solvable
_TOGETHER = 4_000_000  # entries of normal matrices held at once
_PRODUCTS = 1_000_000  # products of columns held at once: what a cache takes
_ONE_BY_ONE = 12  # channels for which products of columns are not worth forming


@dataclass(frozen=True, eq=False)
class PoleData:
    """Responses ready to be fitted.

    Attributes
    ----------
    s : (n_f,) complex      iω over the top of the band
    y : (n_f, n_c) complex  one column a channel
    w : (n_f, n_c)          √2 / σ, zero where a sample does not count
    q : int                 derivatives
    """

    s: np.ndarray
    y: np.ndarray
    w: np.ndarray
    q: int

    @property
    def common(self) -> np.ndarray:
        """Root mean square weight of every line (n_f,)."""
        return np.sqrt(np.maximum((self.w**2).mean(axis=1), _TINY))

    @property
    def samples(self) -> int:
        """Real numbers that count."""
        return 2 * int(np.count_nonzero(self.w))


def stacked(z: np.ndarray) -> np.ndarray:
    """Real over imaginary part (2 n_f, ...)."""
    return np.concatenate([z.real, z.imag])


def basis(s: np.ndarray, p: np.ndarray, q: int, power: int = 1) -> np.ndarray:
    """Columns s^q [1/(s-p)^k + 1/(s-p̄)^k] and s^q [i/(s-p)^k - i/(s-p̄)^k], pair by pair.

    (n_f, 2 r) complex; their real coefficients are real and imaginary part of the residue.
    """
    a, b = (s[:, None] - p) ** -power, (s[:, None] - p.conj()) ** -power
    columns = np.stack([a + b, 1j * (a - b)], axis=-1).reshape(len(s), -1)
    return s[:, None] ** q * columns


def residual_terms(s: np.ndarray, q: int) -> np.ndarray:
    """Columns s^q / s² and s^q: what lies below and above the band (n_f, 2)."""
    return np.stack([s ** (q - 2.0), s ** float(q)], axis=-1)


def linear(s: np.ndarray, p: np.ndarray, q: int) -> np.ndarray:
    """All linear columns: residues, then the residual terms (n_f, 2 r + 2)."""
    return np.concatenate([basis(s, p, q), residual_terms(s, q)], axis=1)


@dataclass(frozen=True, eq=False)
class PoleFit:
    """Best residues for given poles.

    Attributes
    ----------
    p : (r,) complex
    x : (2 r + 2, n_c)    real coefficients of `linear`
    e : (n_f, n_c)        weighted complex residual w (y - Φ x)
    delta_chi2 : (r,)     how much χ² would rise without each pole, the other poles fixed
    """

    p: np.ndarray
    x: np.ndarray
    e: np.ndarray
    delta_chi2: np.ndarray

    @property
    def chi2(self) -> float:
        """Sum of squares of the whitened residual."""
        return float(np.vdot(self.e, self.e).real)

    @property
    def residues(self) -> np.ndarray:
        """(r, n_c) complex."""
        pairs = self.x[:-2].reshape(len(self.p), 2, self.x.shape[1])
        return pairs[:, 0] + 1j * pairs[:, 1]


@dataclass(frozen=True, eq=False)
class PoleSystem:
    """Gauss-Newton system of the poles, residues eliminated: JᵀJ and Jᵀr over (Re p, Im p)."""

    H: np.ndarray
    g: np.ndarray


def orthonormal(data: PoleData, A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Q R of the columns under the common weight, columns scaled to one beforehand."""
    B = stacked(data.common[:, None] * A)
    scale = np.maximum(np.linalg.norm(B, axis=0), _TINY)
    Q, R = np.linalg.qr(B / scale)
    return Q, R * scale


def solve(data: PoleData, p: np.ndarray, slope: bool = False) -> tuple[PoleFit, PoleSystem | None]:
    """Residues by weighted least squares, channel by channel, in one orthonormal basis.

    With Q R = g Φ for the common weight g, the normal matrix Qᵀ v² Q (v = w / g) of every channel
    is close to the identity. The normal equations are then well conditioned.
    """
    A = linear(data.s, p, data.q)
    n = A.shape[1]
    both = np.concatenate([A, basis(data.s, p, data.q, 2)], axis=1) if slope else A
    Q, R = orthonormal(data, both)
    R1, R2 = R[:n, :n], R[n:, n:]
    n_c, r = data.y.shape[1], len(p)
    x, delta_chi2 = np.empty((n, n_c)), np.zeros(r)
    H, g = np.zeros((2 * r, 2 * r)), np.zeros(2 * r)
    inverse = solve_triangular(R1, np.eye(n))
    for at in channel_blocks(n_c, Q.shape[1]):
        G, b = normal_matrices(Q, data, at)
        G[:, range(n), range(n)] += _RIDGE
        root = np.linalg.solve(np.linalg.cholesky(G[:, :n, :n]), inverse[: 2 * r].T)
        known = np.concatenate([b[:, :n, None], G[:, :n, n:]], axis=2)
        known = np.linalg.solve(G[:, :n, :n], known)
        a, tied = known[:, :, 0], known[:, :, 1:]
        x[:, at] = inverse @ a.T
        delta_chi2 += _delta_chi2(root, x[: 2 * r, at].T).sum(axis=0)
        if slope:
            rest = (b[:, n:] - np.einsum("cij,cj->ci", G[:, n:, :n], a)) @ R2
            S = R2.T @ (G[:, n:, n:] - G[:, n:, :n] @ tied) @ R2
            T = turned(x[: 2 * r, at].T)
            M = np.einsum("ckma,ckmln->ckaln", T, S.reshape(len(T), r, 2, r, 2))
            H += np.einsum("ckaln,clnb->kalb", M, T).reshape(2 * r, 2 * r)
            g += np.einsum("ckma,ckm->ka", T, rest.reshape(len(T), r, 2)).ravel()
    e = data.w * (data.y - A @ x)
    return PoleFit(p, x, e, delta_chi2), PoleSystem(H, g) if slope else None


def solved(data: PoleData, p: np.ndarray) -> tuple[PoleFit, PoleSystem]:
    """Best residues for given poles, and how χ² changes with these."""
    fit, slope = solve(data, p, slope=True)
    assert slope is not None
    return fit, slope


def noise_left(data: PoleData, fit: PoleFit) -> float:
    """χ² per degree of freedom: 1 where the weights know the noise and it is all that is left."""
    return fit.chi2 / max(data.samples - fit.x.size - 2 * len(fit.p), 1)


def channel_blocks(n_c: int, m: int) -> list[slice]:
    """Channels whose normal matrices (m, m) fit into memory together."""
    step = max(1, _TOGETHER // m**2)
    return [slice(k, min(k + step, n_c)) for k in range(0, n_c, step)]


def normal_matrices(Q: np.ndarray, data: PoleData, at: slice) -> tuple[np.ndarray, np.ndarray]:
    """Qᵀ v² Q (n_c, m, m) and Qᵀ v² g y (n_c, m) of some channels, v = w / g; Q (2 n_f, m)."""
    n, g, w = len(data.s), data.common[:, None], data.w[:, at]
    z = w**2 / g * data.y[:, at]
    b = (Q[:n].T @ z.real + Q[n:].T @ z.imag).T
    if w.shape[1] > _ONE_BY_ONE:
        return _weighted_squares(Q, (w / g) ** 2), b
    G = np.empty((w.shape[1], Q.shape[1], Q.shape[1]))
    for c, v in enumerate((w / g).T):
        V = np.concatenate([v, v])[:, None] * Q
        G[c] = V.T @ V
    return G, b


def _weighted_squares(Q: np.ndarray, square: np.ndarray) -> np.ndarray:
    """Σ_k v_kc² q_k q_kᵀ over lines k of every channel (n_c, m, m), ``square`` v² (n_f, n_c).

    Products of columns are formed once for all channels, real and imaginary part together for they
    have one weight; one product of matrices then does all sums.
    """
    n, n_c, m = len(square), square.shape[1], Q.shape[1]
    columns = np.ascontiguousarray(Q.T)
    i, j = np.triu_indices(m)
    upper = np.zeros((len(i), n_c))
    step = max(1, _PRODUCTS // len(i))
    for k in range(0, n, step):
        lines = slice(k, min(k + step, n))
        upper += _products(columns[:, :n][:, lines], columns[:, n:][:, lines]) @ square[lines]
    G = np.empty((n_c, m, m))
    G[:, i, j] = G[:, j, i] = upper.T
    return G


def _products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a_i a_j + b_i b_j, i <= j, row by row of the upper triangle (m (m + 1) / 2, n)."""
    m = len(a)
    rows = np.empty((m * (m + 1) // 2, a.shape[1]))
    begin = 0
    for i in range(m):
        own = rows[begin : begin + m - i]
        np.multiply(a[i], a[i:], out=own)
        own += b[i] * b[i:]
        begin += m - i
    return rows


def turned(x: np.ndarray) -> np.ndarray:
    """(n_c, r, 2, 2): coefficients of the derivative columns for dp = 1 and dp = i, R = a + ib."""
    a, b = x[:, 0::2], x[:, 1::2]
    return np.stack([np.stack([a, -b], -1), np.stack([b, a], -1)], axis=2)


def _delta_chi2(root: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Wald's xᵀ C⁻¹ x of every residue: rise of χ² when its pole is left out (n_c, r).

    ``root`` (n_c, n, 2 r) is a root of the covariance C of ``x`` (n_c, 2 r), by column.
    """
    p, q = root[:, :, 0::2], root[:, :, 1::2]
    a, b, d = (p**2).sum(1), (p * q).sum(1), (q**2).sum(1)
    u, v = x[:, 0::2], x[:, 1::2]
    return (d * u**2 - 2 * b * u * v + a * v**2) / np.maximum(a * d - b * b, _TINY)


def polish(
    data: PoleData, p: np.ndarray, largest: float = 0.1, iterations: int = 20, tol: float = 0.1
) -> tuple[PoleFit, PoleSystem]:
    """Levenberg-Marquardt on the poles until a step lets χ² fall by less than ``tol``.

    ``largest`` is the highest damping ratio a pole may take.
    """
    fit, slope = solved(data, bounded(p, largest))
    damping, taken = 1e-3, 0
    while taken < iterations and damping < 1e5:
        trial, its_slope = solved(data, bounded(fit.p + _step(slope, damping), largest))
        if trial.chi2 > fit.chi2:
            damping *= 30
            continue
        fall = fit.chi2 - trial.chi2
        damping, taken = max(damping / 10, 1e-7), taken + 1
        fit, slope = trial, its_slope
        if fall < tol:
            break
    return fit, slope


def _step(slope: PoleSystem, damping: float) -> np.ndarray:
    """Marquardt's step of every pole, complex (r,)."""
    d = np.maximum(np.diag(slope.H), 1e-12 * np.diag(slope.H).max(initial=_TINY))
    dp = np.linalg.solve(slope.H + damping * np.diag(d), slope.g)
    return dp[0::2] + 1j * dp[1::2]


def bounded(p: np.ndarray, largest: float) -> np.ndarray:
    """Poles in the upper left quadrant with 1e-6 <= ζ <= largest."""
    size = np.abs(p)
    zeta = np.clip(np.abs(p.real) / np.maximum(size, _TINY), 1e-6, largest)
    return size * (-zeta + 1j * np.sqrt(1 - zeta**2))


def relocated(data: PoleData, p: np.ndarray) -> np.ndarray:
    """One relaxed vector-fitting step: the zeros of σ(s), (σ H)(s) and σ with the poles p.

    Gustavsen (2006), IEEE Trans. Power Delivery 21(3), eqs. 5-11.
    """
    g = data.common[:, None]
    ramp = data.s[:, None] ** (data.q - 1.0)  # σ(s) L / s² has a term in 1 / s too
    Q, _ = orthonormal(data, np.concatenate([linear(data.s, p, data.q), ramp], axis=1))
    sigma = np.concatenate([basis(data.s, p, 0), np.ones((len(data.s), 1))], axis=1)
    scale = np.linalg.norm(stacked(sigma), axis=0)
    sigma = sigma / scale
    n = sigma.shape[1]
    rows, weight = [], 0.0
    for c in range(data.y.shape[1]):
        B = stacked(g * data.y[:, c, None] * sigma)
        B -= Q @ (Q.T @ B)
        rows.append(np.linalg.qr(B, mode="r"))
        weight += float((np.abs(g[:, 0] * data.y[:, c]) ** 2).sum())
    relax = sigma.real.sum(axis=0) * np.sqrt(weight) / len(data.s)
    due = np.zeros(n * len(rows) + 1)
    due[-1] = np.sqrt(weight)
    x, *_ = np.linalg.lstsq(np.vstack([*rows, relax]), due, rcond=1e-13)
    return _zeros(p, x[:-1] / scale[:-1], x[-1] / scale[-1])


def _zeros(p: np.ndarray, c: np.ndarray, d: float) -> np.ndarray:
    """Zeros of d + Σ C/(s-p) + C̄/(s-p̄), upper half plane, reflected into the left half."""
    r = len(p)
    A = np.zeros((2 * r, 2 * r))
    k = 2 * np.arange(r)
    A[k, k] = A[k + 1, k + 1] = p.real
    A[k, k + 1], A[k + 1, k] = p.imag, -p.imag
    b = np.zeros(2 * r)
    b[k] = 2.0
    d = d if abs(d) > 1e-8 else 1e-8
    z = np.linalg.eigvals(A - np.outer(b, c) / d)
    z = z[z.imag > 0]
    return -np.abs(z.real) + 1j * z.imag
