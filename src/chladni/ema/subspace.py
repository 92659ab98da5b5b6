"""Poles by a frequency-domain subspace method, on any grid: one factorisation, every order.

McKelvey, Akçay and Ljung (1996), IEEE Trans. Automatic Control 41(7), 960-979, algorithm 2. With
z = e^{iθ} and G(z) = D + C (z - A)⁻¹ B, the rows z^k G, k = 0 ... q-1, are O X + Γ W. The rows z^k
of the input, W, are projected out. The columns of O = [C; CA; ...; CA^{q-1}] span the rest.
The map z = (α + s) / (α - s) carries the band to the unit circle. It is exact and permits any
spacing of the lines. α is the geometric mean of the ends of the band, so that it covers the arc
evenly.
"""

from dataclasses import dataclass

import numpy as np

from .pole_fitting import PoleData, stacked

_SURPLUS = 2.0  # rows of O over the states sought: the rest is noise that the SVD parts with


@dataclass(frozen=True, eq=False)
class Subspace:
    """O of the largest order; a smaller order uses its first columns."""

    O: np.ndarray  # (n_o q, n) extended observability matrix, columns by falling singular value
    sigma: np.ndarray  # (n,) singular values: a step down is the number of states
    outputs: int  # n_o
    alpha: float  # of the bilinear map, in the units of s

    def modes(self, order: int) -> tuple[np.ndarray, np.ndarray]:
        """Upper poles (r,) of the system of that many states and their shapes (n_o, r).

        Poles are mirrored into the left half plane and sorted by modulus. Real
        poles, s and 1/s of a real system, are not modes.
        """
        O = self.O[:, :order]
        A, *_ = np.linalg.lstsq(O[: -self.outputs], O[self.outputs :], rcond=None)
        z, X = np.linalg.eig(A)
        s = self.alpha * (z - 1) / np.where(np.abs(z + 1) > 1e-12, z + 1, 1e-12)
        up = np.flatnonzero(s.imag > 1e-9 * np.abs(s))
        up = up[np.argsort(np.abs(s[up]), kind="stable")]
        return -np.abs(s[up].real) + 1j * s[up].imag, O[: self.outputs] @ X[:, up]


def subspace(data: PoleData, order: int) -> Subspace:
    """O for up to ``order`` states, lines weighted by the common weight of the samples.

    ``data`` may be combinations of channels (``few_channels``): poles are common to all.
    """
    w = np.sqrt((data.w**2).mean(axis=0))  # gives every channel the same noise
    s, y = data.s, np.where(data.w > 0, data.y, 0) * (w / max(float(w.max(initial=0.0)), 1e-300))
    f = np.abs(s)
    alpha = float(np.sqrt(f.min() * f.max()))
    g = data.common / np.sqrt((data.common**2).mean())
    n_o = y.shape[1]
    q = int(min(np.ceil(_SURPLUS * order / n_o) + 2, (2 * len(s) - 1) // (n_o + 1)))
    q = max(q, int(np.ceil(order / n_o)) + 1)
    z = ((alpha + s) / (alpha - s))[:, None] ** np.arange(q)
    W = stacked(g[:, None] * z)
    G = stacked((g[:, None] * z)[:, :, None] * y[:, None, :]).reshape(len(W), -1)
    R = np.asarray(np.linalg.qr(np.concatenate([W, G], axis=1), mode="r"))
    U, sigma, _ = np.linalg.svd(R[q:, q:].T, full_matrices=False)
    return Subspace(U[:, :order], sigma[:order], n_o, alpha)
