"""Identified damping of the modes of a test, and its likelihood under a dissipating effect."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

SCATTER = 0.33  # sd of ln ζ among modes of one structure, see inference/damping_scatter.py
TAILS = 5.0  # degrees of freedom of Student's t: ln of that sd is itself known to 0.3 only
LEVEL_SD = 1.0  # of ln of the damping common to all modes over the median of the identified ratios
SAME = 0.01  # relative width in natural frequency for pairing a model mode with an identified one
LEVELS = np.linspace(-3.0, 2.0, 101)  # values of that ln that are searched


@dataclass(frozen=True, eq=False)
class AuxiliaryResidual:
    """Whitened residuals r (k,) of an effect in addition to the data that are compared.

    ``gradient`` (k, n_parameters) are the slopes by its own parameters. ``by_lam`` and
    ``by_dissipated`` (k, modes) are those by λ and by the damping ratio that effects add to a mode.
    """

    r: np.ndarray
    gradient: np.ndarray
    by_lam: np.ndarray
    by_dissipated: np.ndarray


@dataclass(frozen=True, eq=False)
class IdentifiedDamping:
    """Identified damping of the modes that are compared."""

    frequency: np.ndarray  # (n,) Hz
    ratio: np.ndarray  # (n,) ζ
    sd: np.ndarray  # (n,) of ln ζ, from the identification

    def of(self, keep: np.ndarray) -> Self:
        """A selection of the modes by a mask (n,)."""
        return replace(
            self, frequency=self.frequency[keep], ratio=self.ratio[keep], sd=self.sd[keep]
        )

    def above(self, frequency: float) -> Self:
        """The modes above a frequency [Hz]; rigid modes on bungee cords are damped by the cords."""
        return self.of(self.frequency > frequency)

    @property
    def usual(self) -> float:
        """Median of ζ."""
        return float(np.median(self.ratio))

    def misfit(self, level: np.ndarray, more: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals of ln ζ against ln(ζ_usual e^level + more), and their slopes by that ln.

        r² is -2 ln of Student's t, so that one mode with another source of damping has little
        weight.

        Parameters
        ----------
        level : (..., 1)    ln of the damping common to all modes, over ``usual``
        more : (n,)         additional ζ of each mode
        """
        width = np.hypot(SCATTER, self.sd)
        z = (np.log(self.ratio) - np.log(self.usual * np.exp(level) + more)) / width
        r = np.sign(z) * np.sqrt((TAILS + 1) * np.log1p(z**2 / TAILS))
        flat = np.sqrt((TAILS + 1) / TAILS)
        steep = np.divide((TAILS + 1) * z / (TAILS + z**2), r, out=flat + 0 * r, where=r != 0)
        return r, -steep / width

    def residual(
        self, x: np.ndarray, level: int, lam: np.ndarray, dissipated: np.ndarray
    ) -> AuxiliaryResidual:
        """Residuals against the damping common to all modes plus that of an effect.

        Parameters
        ----------
        x : (n_p,)              parameters of the effect; that at ``level`` is the common damping
        lam, dissipated : (m,)  λ of the modes, and the damping ratio that effects add to them
        """
        f = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
        w, steep = paired_with(self.frequency, f)
        more = w @ dissipated
        r, slope = self.misfit(x[level], more)
        own = self.usual * np.exp(x[level])
        by_more = (slope / (own + more))[:, None]
        by_own = np.outer(slope * own / (own + more), np.eye(len(x))[level])
        moved = w * steep * (dissipated - more[:, None]) / (2 * np.maximum(lam, 1e-9 * lam[-1]))
        return AuxiliaryResidual(r, by_own, by_more * moved, by_more * w)

    def neg2_log_likely(self, more: np.ndarray) -> float:
        """-2 ln p at the most probable level, its prior included."""
        return float(self._by_level(more).min())

    def neg2_log_evidence(self) -> float:
        """-2 ln p of damping that scatters about one level, with the level integrated (Laplace)."""
        even = np.zeros_like(self.ratio)
        best = LEVELS[[np.argmin(self._by_level(even))]]
        _, slope = self.misfit(best, even)
        curved = float((slope**2).sum()) + 1 / LEVEL_SD**2
        return self.neg2_log_likely(even) + float(np.log(curved)) + 2 * float(np.log(LEVEL_SD))

    def _by_level(self, more: np.ndarray) -> np.ndarray:
        r, _ = self.misfit(LEVELS[:, None], more)
        return np.asarray((r**2).sum(axis=1) + (LEVELS / LEVEL_SD) ** 2)


def paired_with(
    frequency: np.ndarray, model: np.ndarray, same: float = SAME
) -> tuple[np.ndarray, np.ndarray]:
    """Weight of each model mode i in each identified mode j, and its slope.

    w_ji ∝ exp(-½ (ln f_i/f_j)² / same²), with sum one over i. The nearest mode dominates; several
    equally near modes are averaged. The slope is ∂ ln w_ji / ∂ ln f_i before normalisation.

    Parameters
    ----------
    frequency : (n,) [Hz]    identified
    model : (m,) [Hz]        of the model, zero for rigid modes

    Returns
    -------
    (n, m), (n, m)
    """
    away = np.log(np.maximum(model, 1e-6 * frequency.max()) / frequency[:, None])
    exponent = -0.5 * (away / same) ** 2
    w = np.exp(exponent - exponent.max(axis=1, keepdims=True))
    return w / w.sum(axis=1, keepdims=True), -away / same**2
