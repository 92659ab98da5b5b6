"""Spinning parts in a reduced model: exact responses over the modes of the structure at rest.

The dynamic stiffness is A = Λ + s² + s βᵀ S β. β (3 rows for each part) are rotations over the
modes, S = -[h]× is skew, h the angular momentum. With D = 1 / (Λ + s²) and C = β D βᵀ (Woodbury):

    A⁻¹ = D - s D βᵀ S (I + s C S)⁻¹ β D.

A is not symmetric. Force and response may change places if all parts spin the other way. Poles of
the undamped A lie on the imaginary axis, so damping-equalised data compare with it as they do
without spin.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.linalg import block_diag

from ..effects.effect import SpinTerm


def skew(h: np.ndarray) -> np.ndarray:
    """-[h]× of vectors h (..., 3): (..., 3, 3).

    >>> skew(np.array([0.0, 0.0, 2.0])).tolist()[0]
    [0.0, 2.0, 0.0]
    """
    return np.cross(np.asarray(h)[..., None, :], np.eye(3))


@dataclass(frozen=True, eq=False)
class Spin:
    """All spinning parts of a state."""

    rows: np.ndarray  # β (k, m), rotations over the modes
    matrix: np.ndarray  # S (k, k), skew
    # L (j, m) and R (j, m) with ∂(βᵀSβ)/∂x = LᵀR, by position of the parameter
    slopes: Mapping[int, tuple[np.ndarray, np.ndarray]]

    def of_last(self, first: int) -> Self:
        """The parts with their slopes by the parameters from the first on alone."""
        own = {p - first: pair for p, pair in self.slopes.items() if p >= first}
        return replace(self, slopes=own)

    @property
    def reverse(self) -> Self:
        """All parts spinning the other way."""
        return replace(self, matrix=self.matrix.T)

    def passed(self, s: np.ndarray, d: np.ndarray, phi: np.ndarray) -> np.ndarray:
        """φ A⁻¹ of places φ (n, m) from d = D (n_f, m) at s (n_f,): (n_f, n, m)."""
        return phi * d[:, None] + self.seen(s, d, phi, np.eye(phi.shape[1]))

    def seen(self, s: np.ndarray, d: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Change of the responses at places left to forces at places right (n_f, n_l, n_r)."""
        b, s = d[:, None] * self.rows, s[:, None, None]
        inner = np.linalg.solve(
            np.eye(len(self.matrix)) + s * (b @ self.rows.T) @ self.matrix, b @ right.T
        )
        return np.asarray(-s * ((left @ b.swapaxes(1, 2)) @ self.matrix) @ inner)

    def seen_slopes(
        self, s: np.ndarray, left: np.ndarray, right: np.ndarray
    ) -> Iterator[tuple[int, np.ndarray]]:
        """Position and ∂H/∂x of every own parameter, from φ_o A⁻¹ and φ_i A⁻ᵀ (n_f, ., m)."""
        for p, (L, R) in self.slopes.items():
            yield p, -s[:, None, None] * (left @ L.T) @ (right @ R.T).swapaxes(1, 2)


def spin(parts: Sequence[tuple[SpinTerm, slice, np.ndarray, Mapping[int, np.ndarray]]]) -> Spin:
    """All parts as one, from each term, its parameters in x, its rows β and ∂β/∂x (3, m)."""
    slopes = {}
    for term, at, own, moved in parts:
        S = skew(term.momentum)
        for p, dh in enumerate(term.gradient.T):
            left, right = [own], [skew(dh) @ own]
            if p in moved:
                left, right = [*left, moved[p], own], [*right, S @ own, S @ moved[p]]
            slopes[at.start + p] = np.concatenate(left), np.concatenate(right)
    rows = np.concatenate([own for _, _, own, _ in parts])
    return Spin(rows, block_diag(*(skew(term.momentum) for term, *_ in parts)), slopes)


def whirling(lam: np.ndarray, G: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ω (m,) [rad/s] and complex modes (m, m) of Λ + iω G - ω² over real modes, G skew.

    In (Ω q, q') the generator [[0, Ω], [-Ω, -G]] is skew, so its eigenvalues are ± iω.
    """
    omega, m = np.sqrt(np.maximum(lam, 0.0)), len(lam)
    zero = np.zeros((m, m))
    turn = np.block([[zero, np.diag(omega)], [-np.diag(omega), -G]])
    value, vector = np.linalg.eigh(-1j * turn)
    return value[m:], vector[m:, m:]
