"""Test of whether damping explains the complexity of modes, or gyroscopic forces must act.

Forces B proportional to velocity couple the modes φ of a structure (Woodhouse 1998, J. Sound Vib.
215, 547-569, to first order):

    ψ_j = φ_j + i Σ_k a_jk φ_k,   a_jk = ω_j B_jk / (λ_j - λ_k).

Damping is symmetric and takes energy: a_jk and a_kj have opposite signs, and B_jk² <= B_jj B_kk =
4 ζ_j ω_j ζ_k ω_k. Gyroscopic forces of a spinning part are skew (Meirovitch 1980, Computational
Methods in Structural Dynamics, 2.10): the signs are equal, and no such bound holds. Stiffness and
mass make no mode complex, so an effect of stiffness or mass alone cannot explain the finding.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import bdtr, bdtrc

from ..ema.identification import Identified
from ..ema.propagation import standard_deviations
from ..ema.shapes import driven_shapes
from ..errors import named
from .result import FitStatistic

FEWEST = 5  # modes or outputs below which the test is not made
REACH = 0.05  # prior sd of B_jk over the geometric mean of ω_j and ω_k
FLOOR = 1e-3  # of a unit shape: smallest standard deviation of a channel
SURE = 3.0  # standard deviations
APART = 3.0  # half-bandwidths between modes that are distinguished
MARGIN = 1.5  # times the bound: unit shapes are not quite mass-normalised ones
UNLIKELY = 0.05  # p below which pairs of equal signs speak of spin alone
MOST_NAMED = 4  # modes in a sentence
EXCUSED = 0.05  # of the modes may exceed it, where the first order fails


@dataclass(frozen=True, eq=False)
class ModeCoupling:
    """Complexity of identified modes."""

    frequency: np.ndarray  # (r,) [Hz]
    # (r,) norm of the imaginary part of the unit shape that noise does not explain
    complexity: np.ndarray
    bound: np.ndarray  # (r,) the largest complexity that damping, all of it in one place, can cause
    # numbers of pairs of modes that are significantly coupled both ways: of equal signs, and all
    alike: int
    coupled: int

    @property
    def skew(self) -> float:
        """P-value of as many pairs with equal signs, which are as likely as opposite ones."""
        return float(bdtrc(self.alike - 1, self.coupled, 0.5)) if self.coupled else 1.0

    @property
    def step(self) -> str:
        """The next measurement, if a spinning part or damping couples modes; else ""."""
        order = np.argsort(-self.complexity)[:MOST_NAMED]
        near = np.sort(self.frequency[order[self.complexity[order] > FLOOR]])
        if not len(near) or not self.coupled:
            return ""
        modes = f"modes near {named(f'{f:.4g}' for f in near)} Hz are coupled"
        if self.skew < UNLIKELY:
            return (
                f"Stop every rotating part and measure again, as a state of its own: {modes} as "
                "by spin, not as by damping."
            )
        return (
            "Look for damping in one place (a damper, foam, a loose joint) or for a rotating part, "
            f"and measure again without it: {modes} through their velocities."
        )

    def tested(self) -> tuple[float, FitStatistic, str, tuple[float, ...]]:
        """P-value if only damping couples modes, its statistic, a description, the modes [Hz].

        The p-value is twice the smaller of two: of as many modes beyond the bound, and of as many
        pairs with equal signs.  Equal signs are as likely as opposite ones where close poles make
        shapes complex without coupling.  They are less likely where damping couples the modes.
        """
        n = len(self.frequency)
        ratio = self.complexity / self.bound
        over = np.flatnonzero(ratio > MARGIN)
        most = float(bdtrc(len(over) - 1, n, EXCUSED))
        skew = self.skew
        allowed = float(np.searchsorted(bdtr(np.arange(n + 1), n, EXCUSED), 0.995))
        row = FitStatistic("complex modes", float(len(over)), n * EXCUSED, 0.0, allowed)
        if most <= skew:
            what = f"{len(over)} of {n} modes are more complex than their damping explains"
        else:
            over = np.argsort(-ratio)[:1]
            what = (
                f"{self.alike} of {self.coupled} pairs of modes are coupled as by a rotating "
                "part, not as by damping"
            )
        return min(1.0, 2 * min(most, skew)), row, what, tuple(self.frequency[over].tolist())


def mode_coupling(identified: Identified, low: float, high: float) -> ModeCoupling | None:
    """Complexity of the modes between two frequencies [Hz]; None where too few are known.

    Modes outside the band count as partners that a mode may be coupled with.
    """
    inside = (identified.frequency >= low) & (identified.frequency <= high)
    known = identified.covariance is not None and len(identified.outputs) >= FEWEST
    if inside.sum() < FEWEST or not known:
        return None
    omega, zeta = np.abs(identified.poles), -identified.poles.real / np.abs(identified.poles)
    half = np.abs(zeta) * omega
    psi = _turned(identified)
    noise = standard_deviations(identified, lambda moved: _turned(moved).imag.T).T
    away = omega[:, None] ** 2 - omega**2
    np.fill_diagonal(away, np.inf)
    each = 2 * np.sqrt(half[:, None] * half) * omega[:, None] / np.abs(away)
    sure = SURE * np.linalg.norm(noise, axis=0)
    complexity = np.maximum(np.linalg.norm(psi.imag, axis=0) - sure, 0.0)
    t = _significance(psi, np.maximum(noise, FLOOR), omega, away)
    pairs = np.triu(np.minimum(np.abs(t), np.abs(t.T)) > SURE, 1) & inside & inside[:, None]
    pairs &= np.abs(omega[:, None] - omega) > APART * (half[:, None] + half)
    return ModeCoupling(
        identified.frequency[inside], complexity[inside],
        np.maximum(np.linalg.norm(each, axis=1), FLOOR)[inside],
        int((t * t.T > 0)[pairs].sum()), int(pairs.sum()),
    )  # fmt: skip


def _turned(identified: Identified) -> np.ndarray:
    """Unit shapes (n_out, r), each turned in phase so that its real part is largest."""
    psi = driven_shapes(identified)
    psi = psi / np.maximum(np.linalg.norm(psi, axis=0), 1e-300)
    return psi * np.exp(-0.5j * np.angle((psi**2).sum(axis=0)))


def _significance(
    psi: np.ndarray, noise: np.ndarray, omega: np.ndarray, away: np.ndarray
) -> np.ndarray:
    """a_jk over its standard deviation (r, r), from imaginary parts as sums of real shapes."""
    r = len(omega)
    t = np.zeros((r, r))
    for j in range(r):
        k = np.delete(np.arange(r), j)
        prior = REACH * omega[j] * omega[k] / np.abs(away[j, k])
        M = psi.real[:, k] / noise[:, j : j + 1]
        P = np.linalg.inv(M.T @ M + np.diag(1 / prior**2))
        t[j, k] = P @ (M.T @ (psi.imag[:, j] / noise[:, j])) / np.sqrt(np.diag(P))
    return t
