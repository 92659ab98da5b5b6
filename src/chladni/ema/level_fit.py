"""One mode's frequency and damping against amplitude, explained by a nonlinear element.

Single-nonlinear-mode method: near resonance the mode is one oscillator of stiffness k (1 + κ(A)).
κ is the describing function of the element. Sources: Szemplińska-Stupnicka (1979); Göge, Sinapius,
Füllekrug and Link (2005), for modal tests at several levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc

from .level_elements import ELEMENTS, Element
from .level_modes import ModeLevels

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

FLOOR_FREQUENCY = 5e-4  # ln f between runs: what 4 K of temperature do to steel
FLOOR_DAMPING = 0.05  # ln ζ between runs: what damping of clamped objects repeats to
STARTS = 4  # fits of an element, from the best of its starts
LEAST_LEVELS = 3  # levels an element is fitted to


@dataclass(frozen=True, eq=False)
class ElementFit:
    """An element fitted to levels of one mode."""

    element: Element
    # frequency, damping: of the mode without it [Hz], of critical
    frequency: float
    damping: float
    # values, sd: (n,) its numbers, and the standard deviation of their logarithm (signed: of them)
    values: np.ndarray
    sd: np.ndarray
    largest: float  # amplitude they refer to [m]
    # chi2, data: weighted squares left, and the count of data
    chi2: float
    data: int

    @property
    def count(self) -> int:
        """Numbers that were fitted."""
        return 2 + len(self.values)

    @property
    def bic(self) -> float:
        """χ² + n ln N (Schwarz 1978): smaller is better."""
        return self.chi2 + self.count * float(np.log(self.data))

    @property
    def p(self) -> float:
        """Chance of so large a χ² of the right element; nan where nothing could contradict it."""
        free = self.data - self.count
        return float(chdtrc(free, self.chi2)) if free > 0 else float("nan")

    def at(
        self, amplitude: np.ndarray, amplitude_sd: np.ndarray | float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Natural frequency [Hz] and damping at amplitudes (k,) [m], or about them on average."""
        a, s = amplitude / self.largest, amplitude_sd / self.largest
        f, zeta = _with(self.element, a, s, self.values, self.damping)
        return self.frequency * f, zeta


def _with(
    element: Element, a: np.ndarray, s: np.ndarray | float, values: np.ndarray, damping: float
) -> tuple[np.ndarray, np.ndarray]:
    """f/f_0 = √(1 + κ') and ζ = ζ_0 f_0/f + κ''/2 (f_0/f)²; the viscous part is constant.

    Relative amplitudes have mean a and standard deviation s; the mean of f and ζ uses the two
    points a ± s. It approximates the average over the spectral lines of one peak. Among these
    lines a slider may begin to slide, or a gap may close.
    """
    kappa = element.kappa(np.maximum([a - s, a + s], 1e-9), values)
    f = np.sqrt(np.maximum(1 + kappa.real, 1e-6))
    return f.mean(axis=0), (damping / f + kappa.imag / (2 * f**2)).mean(axis=0)


def weights(mode: ModeLevels) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations of ln f and ln ζ (k,), no smaller than runs repeat to."""
    return (
        np.hypot(mode.frequency_sd / mode.frequency, FLOOR_FREQUENCY),
        np.hypot(mode.damping_sd / mode.damping, FLOOR_DAMPING),
    )


def fitted_elements(mode: ModeLevels) -> tuple[ElementFit, ...]:
    """Fit every element for which there are enough levels; return the best (by BIC) first.

    Elements that dissipate are fitted only if the damping changes.
    """
    if len(set(mode.level)) < LEAST_LEVELS:
        return ()
    count = 2 * len(mode.level)
    tried = [e for e in ELEMENTS if 2 + len(e.numbers) < count]
    tried = [e for e in tried if mode.damping_moves or e.kind not in ("friction", "loss")]
    return tuple(sorted((_fitted(e, mode) for e in tried), key=lambda f: f.bic))


def _fitted(element: Element, mode: ModeLevels) -> ElementFit:
    """Fit an element from its best starting values and keep the best fit."""
    from scipy.optimize import least_squares

    largest = float(mode.amplitude.max())
    s_f, s_z = weights(mode)
    a, s = mode.amplitude / largest, mode.amplitude_sd / largest
    f, z = mode.frequency, mode.damping
    signed = np.array([n.signed for n in element.numbers], bool)

    def values(theta: np.ndarray) -> np.ndarray:
        return np.where(signed, theta, np.exp(np.where(signed, 0.0, theta)))

    def residual(x: np.ndarray) -> np.ndarray:
        ratio, zeta = _with(element, a, s, values(x[2:]), np.exp(x[1]))
        return np.concatenate(
            [(x[0] + np.log(ratio / f)) / s_f, np.log(np.maximum(zeta, 1e-9) / z) / s_z]
        )

    # bounds of θ: logarithms of positive parameters; signed ones without a logarithm
    ends = np.array([n.bounds for n in element.numbers]).reshape(-1, 2)
    low = np.where(signed, -ends[:, 1] / 2, np.log(np.where(signed, 1.0, ends[:, 0])))
    high = np.where(signed, ends[:, 1], np.log(ends[:, 1]))
    head = [float(np.log(f[0])), float(np.log(z.min()))]
    starts = [np.where(signed, x, np.log(np.abs(x))) if x else np.zeros(0)
              for x in element.starts()]  # fmt: skip
    starts.sort(key=lambda theta: float((residual(np.array([*head, *theta])) ** 2).sum()))
    scale = np.concatenate([[1e-3, 0.1], np.where(signed, 0.01, 0.3)])
    best: OptimizeResult | None = None
    for theta in starts[:STARTS]:
        found = least_squares(
            residual, [*head, *theta], x_scale=scale,
            bounds=([-np.inf, -np.inf, *low], [np.inf, np.inf, *high]),
        )  # fmt: skip
        best = found if best is None or found.cost < best.cost else best
    assert best is not None
    J = best.jac
    sd = np.sqrt(np.maximum(np.diag(np.linalg.pinv(J.T @ J)), 0.0))[2:]
    return ElementFit(
        element, float(np.exp(best.x[0])), float(np.exp(best.x[1])), values(best.x[2:]), sd,
        largest, float(2 * best.cost), 2 * len(a),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class HeldOutLevels:
    """Held-out levels: predictions at their measured amplitudes."""

    rows: np.ndarray  # (m,) positions among the levels of the mode
    fit: ElementFit  # the best element by the fitted levels
    # frequency, damping: (m,) predicted at the measured amplitude [Hz], of critical
    frequency: np.ndarray
    damping: np.ndarray
    mean: tuple[float, float]  # (f, ζ) of the fitted levels: the prediction of one linear model

    def misses(self, mode: ModeLevels) -> tuple[float, float, float, float]:
        """Rms of ln (predicted / measured) of f and ζ, then of ln (mean / measured)."""
        f, z = mode.frequency[self.rows], mode.damping[self.rows]
        off = (self.frequency / f, self.damping / z, self.mean[0] / f, self.mean[1] / z)
        a, b, c, d = (float(np.sqrt((np.log(x) ** 2).mean())) for x in off)
        return a, b, c, d


def foretold(mode: ModeLevels, held: Sequence[int] | None = None) -> HeldOutLevels | None:
    """Predict held-out levels by an element chosen and fitted on the others.

    Parameters
    ----------
    held : positions of the levels to hold out; default every second of those between the lowest and
        the highest, as long as three are left to fit; None where there are fewer than four
    """
    n = len(mode.level)
    if held is None:
        held = [*range(1, n - 1, 2)][: max(n - LEAST_LEVELS, 0)]
    rows = np.array(held, int)
    seen = np.ones(n, bool)
    seen[rows] = False
    fits = fitted_elements(mode.sel(seen)) if len(rows) else ()
    if not fits:
        return None
    f, zeta = fits[0].at(mode.amplitude[rows], mode.amplitude_sd[rows])
    s_f, s_z = (1 / s[seen] ** 2 for s in weights(mode))
    mean = (
        float(np.exp(np.average(np.log(mode.frequency[seen]), weights=s_f))),
        float(np.exp(np.average(np.log(mode.damping[seen]), weights=s_z))),
    )
    return HeldOutLevels(rows, fits[0], f, zeta, mean)
