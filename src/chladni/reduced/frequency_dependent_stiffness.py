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
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from ..effects.effect import MatrixTerm, Rise
from .real_modes import in_modes

CLOSE = 1e-7  # relative distance of λ within which a divided difference is a derivative
RIGID = 1e-9  # of the highest λ: modes below have no strain
APART = 1e-4  # relative distance of λ within which two modes are one and do not mix


class UnrisenModes(NamedTuple):
    """λ (m,) of the model without the rise and its modes on all dofs (n, m)."""

    lam: np.ndarray
    modes: np.ndarray


def applied(part: MatrixTerm, u: np.ndarray, frame: UnrisenModes, M: sp.csr_array) -> np.ndarray:
    """A u on all dofs, or Gᵀ A G u (n, k); the rise is constant beyond the modes of the frame."""
    if part.rise is None:
        return np.asarray(part.operator @ u)
    L = part.rise.log_frequency(frame.lam)
    g, rest = np.exp(part.rise.power * L)[:, None], np.exp(part.rise.power * L.max())
    modes, M_modes = frame.modes[: len(u)], M[: len(u), : len(u)] @ frame.modes[: len(u)]
    v = part.operator @ (rest * u + modes @ ((g - rest) * (M_modes.T @ u)))
    return np.asarray(rest * v + M_modes @ ((g - rest) * (modes.T @ v)))


@dataclass(frozen=True, eq=False)
class Dissipated:
    """Dissipation of effects in the modes of a state.

    Attributes
    ----------
    ratio, slopes : (m,), (n_p, m)           ζ that effects add to each mode, ∂ζ/∂x
    coupling, dcoupling : (m, m), (n_p, m, m)   N off its diagonal, ∂N/∂x with the modes held
    omega : (m,) [rad/s]    of the modes; infinite for rigid ones, which are not coupled
    """

    ratio: np.ndarray
    slopes: np.ndarray
    coupling: np.ndarray
    dcoupling: np.ndarray
    omega: np.ndarray

    @property
    def held(self) -> "Dissipated":
        """The dissipation without its slopes, so that no parameter moves it."""
        return replace(self, slopes=self.slopes[:0], dcoupling=self.dcoupling[:0])

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
    """λ, φ (r, m), dK, dM (n_p, m, m) in these modes, and their dissipation."""

    lam: np.ndarray
    phi: np.ndarray
    dK: np.ndarray
    dM: np.ndarray
    dissipated: Dissipated | None


class Rising:
    """Collector of rising stiffness; K first takes each part without its rise."""

    def __init__(self) -> None:
        """Start without any part."""
        self.parts: list[tuple[MatrixTerm, np.ndarray, slice]] = []

    def add(self, part: MatrixTerm, A: np.ndarray, at: slice) -> None:
        """Add an operator A (r, r), in K with its coefficient; ``at``: its parameters in x."""
        if part.rise is not None:
            self.parts.append((part, A, at))

    def over_basis(
        self, lam: np.ndarray, phi: np.ndarray, dK: np.ndarray, dM: np.ndarray, M: np.ndarray,
        gradient: bool,
    ) -> Risen:  # fmt: skip
        """Apply :meth:`risen` with slopes over the basis, as in a state: φ⁻ᵀ is M φ."""
        found = self.risen(lam, phi, in_modes(dK.copy(), phi), in_modes(dM.copy(), phi), gradient)
        back = (M @ found.phi).T
        return found._replace(dK=in_modes(found.dK, back), dM=in_modes(found.dM, back))

    def risen(
        self, lam: np.ndarray, phi: np.ndarray, dK: np.ndarray, dM: np.ndarray, gradient: bool
    ) -> Risen:
        """The modes with the rise, from those without it."""
        if not self.parts:
            return Risen(lam, phi, dK, dM, None)
        K, flow = np.diag(lam), dK - dM * lam  # of M⁻¹K in modes
        found = []
        for part, A, at in self.parts:
            B, slope, plain = _risen_part(
                part, phi.T @ A @ phi, at, lam, flow if gradient else None
            )
            K = K + B - plain
            found.append((part, B, slope, at))
        lam, V = np.linalg.eigh(K)
        if gradient:
            dK = dK + sum(slope - plain for _, _, (slope, plain), _ in found)
            dK, dM = in_modes(dK, V), in_modes(dM, V)
        turned = [
            (part, V.T @ B @ V, in_modes(slope[0].copy(), V) if gradient else slope[0], at)
            for part, B, slope, at in found
        ]
        return Risen(lam, phi @ V, dK, dM, _dissipated(turned, lam, dK, dM, gradient))


def _risen_part(
    part: MatrixTerm, A: np.ndarray, at: slice, lam: np.ndarray, flow: np.ndarray | None
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray], np.ndarray]:
    """c G A G in modes, its slopes and those of c A (n_p, m, m), and c A.

    Parameters
    ----------
    A : (m, m)           in modes
    flow : (n_p, m, m)   ∂(M⁻¹K)/∂x in modes; None where no slopes are requested
    """
    rise, c = part.rise, part.coefficient
    assert rise is not None
    L = rise.log_frequency(lam)
    g = np.exp(rise.power * L)
    B = A * g * g[:, None]
    if flow is None:
        return c * B, (np.zeros((0, *A.shape)),) * 2, c * A
    half = (g[:, None] * A) @ (_divided(g, lam, rise) * flow)
    slope, plain = c * (half + half.swapaxes(1, 2)), np.zeros_like(flow)
    both = rise.gradient[:, None, None] * (L + L[:, None])
    slope[at] += (part.gradient[:, None, None] + c * both) * B
    plain[at] = part.gradient[:, None, None] * A
    return c * B, (slope, plain), c * A


def _divided(g: np.ndarray, lam: np.ndarray, rise: Rise) -> np.ndarray:
    """Divided differences (g_i - g_j) / (λ_i - λ_j), g' where the λ coincide (m, m)."""
    f = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
    inside = (f > rise.band[0]) & (f < rise.band[1])
    steep = np.where(inside, rise.power * g / (2 * np.where(inside, lam, 1.0)), 0.0)
    gap = lam[:, None] - lam
    close = np.abs(gap) < CLOSE * np.maximum(np.abs(lam[:, None]), np.abs(lam)) + 1e-300
    return np.where(close, steep[:, None], (g[:, None] - g) / np.where(close, 1.0, gap))


def _dissipated(
    parts: Sequence[tuple[MatrixTerm, np.ndarray, np.ndarray, slice]], lam: np.ndarray,
    dK: np.ndarray, dM: np.ndarray, gradient: bool,
) -> Dissipated:  # fmt: skip
    """Dissipation of the rising parts, from c G A G and its slopes in the modes of λ (m,)."""
    m, strained = len(lam), np.where(lam > RIGID * lam[-1], lam, np.inf)
    N, dN, slopes = np.zeros((m, m)), np.zeros((len(dK), m, m)), np.zeros((len(dK), m))
    mixing = _mixing(lam, dK, dM) if gradient else None
    for part, B, slope, at in parts:
        rise = part.rise
        assert rise is not None
        N += rise.loss * B
        if mixing is None:
            continue
        mixed, growth, scaled = mixing
        share = np.diag(B) / strained
        change = 2 * np.einsum("ij,pij->pj", B, mixed) - scaled * np.diag(B)
        change += np.einsum("pjj->pj", slope)
        slopes += rise.loss / 2 * (change - share * growth) / strained
        slopes[at] += rise.loss_gradient[:, None] / 2 * share
        dN[at] += rise.loss * slope[at] + rise.loss_gradient[:, None, None] * B
    off_diagonal = 1 - np.eye(m)
    return Dissipated(
        np.diag(N) / 2 / strained, slopes, N * off_diagonal, dN * off_diagonal, np.sqrt(strained)
    )


def _mixing(
    lam: np.ndarray, dK: np.ndarray, dM: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """∂φ_j/∂x in modes (n_p, m, m) without its change of length, ∂λ and φᵀ∂Mφ of each (n_p, m).

    Modes nearer than ``APART`` do not mix with each other: any mixture of them is a mode.
    """
    gap = lam[None, :] - lam[:, None]
    inverse = gap / (gap**2 + (APART * np.maximum(np.abs(lam), RIGID * lam[-1])) ** 2)
    scaled = np.einsum("pjj->pj", dM)
    growth = np.einsum("pjj->pj", dK) - lam * scaled
    return (dK - dM * lam) * inverse, growth, scaled
