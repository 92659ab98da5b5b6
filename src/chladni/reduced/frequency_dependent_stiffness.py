"""Stiffness that rises with frequency and dissipates, in a model whose modes are real.

With equalised damping a mode shows the stiffness at its own frequency.  So the rising stiffness is
multiplied from both sides by a function of the model's own frequencies, Ĝ = g(M⁻¹K).  It is
diagonal in the modes without the rise.  Its derivative is that of a function of a matrix, by
divided differences of g (Daleckii and Krein; Higham 2008, Functions of Matrices, 3.11).

The loss is not in K but in N = Σ η φᵀ A φ.  Its diagonal gives the damping of the modes,
ζ_j = N_jj / 2λ_j (Ungar and Kerwin 1962).  Its other entries make modes complex,
ψ_j = φ_j + i Σ_i φ_i N_ij / (λ_j - λ_i), i ≠ j.

Complex residues remain after equalisation.  A mode of residue a + ib contributes
(a + b s/ω_j) / (s² + λ_j) there.  With D = 1 / (s² + Λ), all modes together contribute

    ΔH = -s φ_o [D P D + ½ (D Q + Q D)] φ_iᵀ,  P_ij = N_ij (1/ω_i + 1/ω_j) / 2,
                                               Q_ij = N_ij / (ω_i ω_j (ω_i + ω_j)).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from ..effects.effect import MatrixTerm, Rise
from .matrix_slopes import MatrixSlopes, Part

CLOSE = 1e-7  # relative distance of λ within which a divided difference is a derivative
RIGID = 1e-9  # of the highest λ: modes below have no strain
VISIBLE = 2.0  # of the highest spectral line: modes below follow the parameters in their damping
APART = 1e-4  # relative distance of λ within which two modes are one and do not mix


def applied(
    part: MatrixTerm, u: np.ndarray, lam: np.ndarray, modes: np.ndarray, M: sp.csr_array
) -> np.ndarray:
    """Gᵀ A G u on all dofs (n, k), λ and modes without the rise; it is constant beyond these."""
    assert part.rise is not None
    L = part.rise.log_frequency(lam)
    g, rest = np.exp(part.rise.power * L)[:, None], np.exp(part.rise.power * L.max())
    modes, M_modes = modes[: len(u)], M[: len(u), : len(u)] @ modes[: len(u)]
    v = part.operator @ (rest * u + modes @ ((g - rest) * (M_modes.T @ u)))
    return np.asarray(rest * v + M_modes @ ((g - rest) * (modes.T @ v)))


@dataclass(frozen=True, eq=False)
class Dissipated:
    """Dissipation of effects in the modes of a state."""

    # ratio, slopes: (m,), (n_p, m) ζ that effects add to each mode, ∂ζ/∂x
    ratio: np.ndarray
    slopes: np.ndarray
    # coupling, dcoupling: (m, m), (n_p, m, m) N off its diagonal, ∂N/∂x with the modes held
    coupling: np.ndarray
    dcoupling: np.ndarray
    omega: np.ndarray  # (m,) [rad/s] of the modes; infinite for rigid ones, which are not coupled
    unrisen: tuple[np.ndarray, np.ndarray]  # λ (m,) and φ (m, m) of the model without the rise

    @property
    def held(self) -> "Dissipated":
        """The dissipation without its slopes, so that no parameter moves it."""
        return self.of_last(0)

    def of_last(self, k: int) -> "Dissipated":
        """The dissipation with its slopes by the last k parameters alone."""
        first = len(self.slopes) - k
        return replace(self, slopes=self.slopes[first:], dcoupling=self.dcoupling[first:])

    def seen(
        self, s: np.ndarray, d: np.ndarray, phi_o: np.ndarray, phi_i: np.ndarray
    ) -> np.ndarray:
        """ΔH of the complex modes (n_f, n_out, n_in), from d = D (n_f, m) at s (n_f,)."""
        return self._of(self.coupling, s, d, phi_o, phi_i)

    def seen_slopes(
        self, s: np.ndarray, d: np.ndarray, phi_o: np.ndarray, phi_i: np.ndarray
    ) -> Iterator[tuple[int, np.ndarray]]:
        """Position and ∂(ΔH)/∂x of every parameter that moves N."""
        for p in np.flatnonzero(self.dcoupling.any(axis=(1, 2))):
            yield int(p), self._of(self.dcoupling[p], s, d, phi_o, phi_i)

    def _of(
        self, N: np.ndarray, s: np.ndarray, d: np.ndarray, phi_o: np.ndarray, phi_i: np.ndarray
    ) -> np.ndarray:
        slow = 1 / self.omega
        P = N * (slow + slow[:, None]) / 2
        Q = N * slow * slow[:, None] / (self.omega + self.omega[:, None])
        left, right = phi_o * d[:, None], phi_i * d[:, None]  # (n_f, ., m)
        both = (left @ P) @ right.swapaxes(1, 2)
        one = (left @ (Q @ phi_i.T) + (phi_o @ Q) @ right.swapaxes(1, 2)) / 2
        return np.asarray(-s[:, None, None] * (both + one))


class Risen(NamedTuple):
    """λ, φ (r, m), ∂K and ∂M over the basis, and the dissipation."""

    lam: np.ndarray
    phi: np.ndarray
    dK: MatrixSlopes
    dM: MatrixSlopes
    dissipated: Dissipated | None


class Rising:
    """Collector of rising stiffness; K first takes each part without its rise."""

    def __init__(self) -> None:
        """Start without any part."""
        self.parts: list[tuple[MatrixTerm, np.ndarray, slice]] = []

    def add(self, part: MatrixTerm, A: np.ndarray, at: slice) -> None:
        """Take an operator A (r, r); ``at``: its parameters in x."""
        self.parts.append((part, A, at))

    def add_plain(self, K: np.ndarray, dK: MatrixSlopes) -> None:
        """Add the parts without their rise to K (r, r) and its slopes."""
        for part, A, at in self.parts:
            K += part.coefficient * A
            gradient = np.zeros(dK.count)
            gradient[at] = part.gradient
            dK.add_operator(A, gradient)

    def over_basis(
        self, lam: np.ndarray, phi: np.ndarray, dK: MatrixSlopes, dM: MatrixSlopes, M: np.ndarray,
        gradient: bool,
    ) -> Risen:  # fmt: skip
        """The modes with the rise, from those without it; φ⁻ᵀ is M φ."""
        parts = [_RisenPart(part, at, phi.T @ A @ phi, lam) for part, A, at in self.parts]
        risen, V = np.linalg.eigh(np.diag(lam) + sum(one.stiffness - one.plain for one in parts))
        modes, slopes, mixing = phi @ V, [], tuple[np.ndarray, ...]()
        if gradient:
            slopes = [one.slopes(phi, dK, dM) for one in parts]
            more = [(dK.count - 1, each.over_basis(M @ phi)) for each in slopes]
            dK = replace(dK, parts=[*dK.parts, *more])
            mixing = _mixing(risen, modes, dK, dM, max(one.rise.band[1] for one in parts))
        lost = _dissipated(parts, slopes, (lam, phi), risen, V, mixing)
        return Risen(risen, modes, dK, dM, lost)


@dataclass(frozen=True, eq=False)
class _RisenPart:
    """A rising part in the modes λ (m,) without its rise; A (m, m) is its operator there."""

    part: MatrixTerm
    at: slice
    A: np.ndarray
    lam: np.ndarray

    @property
    def rise(self) -> Rise:
        """Its rise."""
        assert self.part.rise is not None
        return self.part.rise

    @cached_property
    def g(self) -> np.ndarray:
        """Factor of each mode (m,)."""
        return np.exp(self.rise.power * self.rise.log_frequency(self.lam))

    @property
    def stiffness(self) -> np.ndarray:
        """c G A G."""
        return self.part.coefficient * self.A * self.g * self.g[:, None]

    @property
    def plain(self) -> np.ndarray:
        """c A."""
        return self.part.coefficient * self.A

    def slopes(self, phi: np.ndarray, dK: MatrixSlopes, dM: MatrixSlopes) -> "_RisenSlopes":
        """Slopes of c G A G - c A; dK, dM are over the basis."""
        L, c, lam = self.rise.log_frequency(self.lam), self.part.coefficient, self.lam
        both = self.rise.gradient[:, None, None] * (L + L[:, None])
        gradient = self.part.gradient[:, None, None]
        risen = self.A * self.g * self.g[:, None]
        low = np.flatnonzero(lam < (2 * np.pi * self.rise.band[1]) ** 2)  # one factor above
        D = _divided(self.g, lam, self.rise)
        K, M = (each.between(phi, phi[:, low]).swapaxes(1, 2) for each in (dK, dM))
        flow = K.swapaxes(1, 2) - M.swapaxes(1, 2) * lam[low]
        flow[:, low] = 0.0
        return _RisenSlopes(
            self.at, c, self.g[:, None] * self.A, low, D[low] * (K - M * lam), D[:, low] * flow,
            (gradient + c * both) * risen, gradient * self.A,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _RisenSlopes:
    """∂(c G A G - c A)/∂x = c (H + Hᵀ) + own - plain in modes; the last two by own parameters.

    H = G A ∂G: its low modes change their factor, the high ones have one factor for all.
    """

    at: slice  # own parameters
    c: float
    GA: np.ndarray  # (m, m)
    low: np.ndarray  # (k,) modes below the upper end of the band
    # rows, columns: (n_p, k, m), (n_p, m, k) ∂G of low modes by all, and of high modes by low ones
    rows: np.ndarray
    columns: np.ndarray
    # own, plain: (n_own, m, m)
    own: np.ndarray
    plain: np.ndarray

    def over_basis(self, back: np.ndarray) -> Part:
        """The slopes over the basis, with φ⁻ᵀ (m, m)."""
        side, low = back @ self.GA, self.low

        def part(z: np.ndarray, out: np.ndarray, first: int) -> None:
            y, t = back.T @ z, side.T @ z
            out += self.c * (side[:, low] @ (self.rows @ y) + side @ (self.columns @ y[low]))
            out += self.c * (back @ (self.rows.swapaxes(1, 2) @ t[low]))
            out += self.c * (back[:, low] @ (self.columns.swapaxes(1, 2) @ t))
            out[self.at] += back @ ((self.own - self.plain) @ y)

        return part

    def diagonal(self, V: np.ndarray) -> np.ndarray:
        """∂(c G A G)/∂x along each of some vectors V (m, k): (n_p, k)."""
        side = V.T @ self.GA
        both = (side[:, self.low].T * (self.rows @ V)).sum(axis=1)
        both = both + (side.T * (self.columns @ V[self.low])).sum(axis=1)
        out = 2 * self.c * both
        out[self.at] += np.einsum("ik,pij,jk->pk", V, self.own, V, optimize=True)
        return np.asarray(out)

    def own_in(self, V: np.ndarray) -> np.ndarray:
        """∂(c G A G)/∂x by the own parameters in modes V (m, m): (n_own, m, m)."""
        side, p = V.T @ self.GA, self.at
        half = side[:, self.low] @ (self.rows[p] @ V) + (side @ self.columns[p]) @ V[self.low]
        return np.asarray(self.c * (half + half.swapaxes(1, 2)) + V.T @ self.own @ V)


def _divided(g: np.ndarray, lam: np.ndarray, rise: Rise) -> np.ndarray:
    """Divided differences (g_i - g_j) / (λ_i - λ_j), g' where the λ coincide (m, m)."""
    f = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
    inside = (f > rise.band[0]) & (f < rise.band[1])
    steep = np.where(inside, rise.power * g / (2 * np.where(inside, lam, 1.0)), 0.0)
    gap = lam[:, None] - lam
    close = np.abs(gap) < CLOSE * np.maximum(np.abs(lam[:, None]), np.abs(lam)) + 1e-300
    return np.where(close, steep[:, None], (g[:, None] - g) / np.where(close, 1.0, gap))


def _mixing(
    lam: np.ndarray, phi: np.ndarray, dK: MatrixSlopes, dM: MatrixSlopes, top: float
) -> tuple[np.ndarray, ...]:
    """How the modes that a test sees follow the parameters.

    They lie below ``VISIBLE`` times the ``top`` of the band [Hz]. Returned are their positions
    (k,), ∂φ/∂x in modes without the change of length (n_p, m, k), ∂λ and φᵀ∂Mφ (n_p, k). Modes
    nearer than ``APART`` do not mix: any mixture of them is a mode.
    """
    seen = np.flatnonzero(lam <= (2 * np.pi * VISIBLE * top) ** 2)
    gap = lam[seen] - lam[:, None]
    inverse = gap / (gap**2 + (APART * np.maximum(np.abs(lam[seen]), RIGID * lam[-1])) ** 2)
    K, M = (each.between(phi, phi[:, seen]) for each in (dK, dM))
    k = np.arange(len(seen))
    scaled = M[:, seen, k]
    growth = K[:, seen, k] - lam[seen] * scaled
    return seen, (K - M * lam[seen]) * inverse, growth, scaled


def _dissipated(
    parts: Sequence[_RisenPart], slopes: Sequence[_RisenSlopes],
    unrisen: tuple[np.ndarray, np.ndarray], lam: np.ndarray, V: np.ndarray,
    mixing: tuple[np.ndarray, ...],
) -> Dissipated:  # fmt: skip
    """Dissipation of the rising parts in the modes of λ (m,), V (m, m) in those without the rise.

    Modes beyond those that are seen have no slopes.
    """
    count = len(mixing[1]) if mixing else 0
    m, strained = len(lam), np.where(lam > RIGID * lam[-1], lam, np.inf)
    N, dN, ratios = np.zeros((m, m)), np.zeros((count, m, m)), np.zeros((count, m))
    off_diagonal = 1 - np.eye(m)
    for one, slope in zip_longest(parts, slopes):
        rise, B = one.rise, V.T @ one.stiffness @ V
        N += rise.loss * B
        if slope is None:
            continue
        seen, turned, growth, scaled = mixing
        share = np.diag(B)[seen] / strained[seen]
        change = 2 * np.einsum("ij,pij->pj", B[:, seen], turned) - scaled * np.diag(B)[seen]
        change += slope.diagonal(V[:, seen])
        ratios[:, seen] += rise.loss / 2 * (change - share * growth) / strained[seen]
        ratios[one.at, seen] += rise.loss_gradient[:, None] / 2 * share
        gained = rise.loss * slope.own_in(V) + rise.loss_gradient[:, None, None] * B
        dN[one.at] += gained * off_diagonal
    ratio = np.diag(N) / 2 / strained
    return Dissipated(ratio, ratios, N * off_diagonal, dN, np.sqrt(strained), unrisen)
