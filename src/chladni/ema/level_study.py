"""Study of several excitation levels: is the object linear, and which element explains a change."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import chdtrc

from ..dynamics.frf import Quantity
from .identification import DERIVATIVES
from .level_fit import (
    FLOOR_DAMPING,
    FLOOR_FREQUENCY,
    ElementFit,
    HeldOutLevels,
    fitted_elements,
    foretold,
    weights,
)
from .level_modes import AtLevel, ModeLevels, chi2_about_mean, modes_over_levels
from .ring_down import RingDown

Signature = Literal[
    "linear",
    "runs differ",
    "overlapped",
    "friction",
    "clearance",
    "stiffening",
    "softening",
    "loss",
]
MEANING: dict[Signature, str] = {
    "linear": "frequency and damping stay as the level rises",
    "runs differ": "it changes by more than its noise, but not by more than repeats of one test "
    "differ",
    "overlapped": "another mode that changes overlaps with it, so its own behaviour is not known",
    "friction": "a joint slips: stiffness falls and damping rises with the level",
    "clearance": "parts touch when they move far enough: it stiffens above an amplitude",
    "stiffening": "it stiffens with amplitude at constant loss: sheets stretch, or contact closes",
    "softening": "it softens with amplitude at constant loss: contact opens, or the article "
    "warmed up",
    "loss": "its damping changes with the level, its stiffness does not: air, foam, or the exciter",
}
CALM: tuple[Signature, ...] = ("linear", "runs differ", "overlapped")  # no sign of anything
OVERLAP = 4.0  # sums of half-bandwidths: nearer modes ring into each other
EFFECT: dict[Signature, str] = {"friction": "joint-friction", "clearance": "rattle"}  # public names
REPEATED = 0.01  # chance of runs that differ so much, below which levels are why they do
ALIKE = 0.05  # of a drift: as near do modes follow it (E falls with warmth as rho does not)
POOR = 0.01  # chance of a right element's χ², below which an element explains nothing
AS_GOOD = 6.0  # of BIC (e^3): elements nearer than that are not separated (Kass and Raftery 1995)
SETTLED_BY = (
    "measure the lowest level again at the end: changed frequencies show a drift of the article "
    "(temperature, a bolt that settles), equal frequencies an effect of the level"
)


@dataclass(frozen=True, eq=False)
class ModeStudy:
    """One mode over levels and the nonlinearity that it indicates."""

    mode: ModeLevels
    signature: Signature
    # elements fitted to all levels, best first; none where they are fewer than three
    fits: tuple[ElementFit, ...] = ()
    # intermediate levels, predicted from the others; None for fewer than four levels
    held_out: HeldOutLevels | None = None

    @property
    def explained(self) -> ElementFit | None:
        """The best element, where it explains the levels."""
        best = self.fits[0] if self.fits else None
        return best if best is not None and not best.p < POOR else None

    @property
    def as_good(self) -> tuple[str, ...]:
        """Other elements that the levels cannot separate from the best one."""
        best = self.explained
        others = self.fits[1:] if best is not None else ()
        return tuple(f.element.name for f in others if best and f.bic < best.bic + AS_GOOD)


@dataclass(frozen=True, eq=False)
class LevelStudy:
    """All modes that were followed over levels."""

    modes: tuple[ModeStudy, ...] = ()
    drift: bool = False

    @property
    def moving(self) -> tuple[ModeStudy, ...]:
        """Modes whose frequency or damping changes with the level; none if all of them drifted."""
        return () if self.drift else tuple(m for m in self.modes if m.signature not in CALM)

    @property
    def nonlinear(self) -> bool:
        """True if any mode changes with the level."""
        return bool(self.moving)


def level_study(recordings: Sequence[AtLevel]) -> LevelStudy:
    """Follow the modes over levels, find those that change, and fit elements to them.

    Parameters
    ----------
    recordings : of one object; a study of fewer than two levels is empty
    """
    modes = modes_over_levels(recordings)
    found = [_studied(m) for m in modes]
    known = [ModeStudy(m.mode, "overlapped") if _overlapped(m, found) else m for m in found]
    return LevelStudy(tuple(known), _drifts(modes))


def _overlapped(one: ModeStudy, every: Sequence[ModeStudy]) -> bool:
    """Return True if a changing mode overlaps a changing one that is better explained or larger."""
    return one.signature not in CALM and any(
        other is not one
        and other.signature not in CALM
        and abs(_hertz(one)[0] - _hertz(other)[0]) < OVERLAP * (_hertz(one)[1] + _hertz(other)[1])
        and _weight(other) > _weight(one)
        for other in every
    )


def _hertz(one: ModeStudy) -> tuple[float, float]:
    """Frequency and half-bandwidth at the lowest level [Hz]."""
    f = float(one.mode.frequency[0])
    return f, float(one.mode.damping[0]) * f


def _weight(one: ModeStudy) -> tuple[bool, int, float]:
    """Return (explained by an element, number of levels, amplitude at the lowest) for ranking."""
    return one.explained is not None, len(one.mode.level), float(one.mode.amplitude[0])


def decay_study(decays: Sequence[RingDown], quantity: Quantity) -> LevelStudy:
    """Study free decays as levels: the levels of each are its own falling amplitudes [m].

    Each stretch of a decay has the uncertainty of the repeatability between runs. Beating with a
    neighbour also changes it. Therefore a change counts only if an element explains it.

    Parameters
    ----------
    quantity : of the responses
    """
    found = [_studied(_falling(d, quantity)) for d in decays]
    return LevelStudy(
        tuple(m if m.explained is not None or m.signature == "linear"
              else ModeStudy(m.mode, "runs differ") for m in found)
    )  # fmt: skip


def _falling(decay: RingDown, quantity: Quantity) -> ModeLevels:
    """Convert a decay to rising levels."""
    rise = np.argsort(decay.amplitude)
    f, zeta = decay.frequency_at[rise], decay.damping_at[rise]
    A = decay.amplitude[rise] / (2 * np.pi * decay.frequency) ** DERIVATIVES[quantity]
    own = FLOOR_FREQUENCY * f, FLOOR_DAMPING * zeta
    return ModeLevels(decay.output, A, A, f, own[0], zeta, own[1], *own, 0 * A)


def _studied(mode: ModeLevels) -> ModeStudy:
    if not mode.moves:
        return ModeStudy(mode, "linear")
    if _p_of_runs(mode) > REPEATED:
        return ModeStudy(mode, "runs differ")
    found = ModeStudy(mode, _trend(mode), fitted_elements(mode), foretold(mode))
    best = found.explained
    return found if best is None else ModeStudy(mode, _of(best), found.fits, found.held_out)


def _p_of_runs(mode: ModeLevels) -> float:
    """Chance of such differences between runs at one level."""
    s_f, s_z = weights(mode)
    total = chi2_about_mean(np.log(mode.frequency), s_f) + chi2_about_mean(
        np.log(mode.damping), s_z
    )
    free = 2 * (len(mode.level) - 1)
    return float(chdtrc(free, total)) if free else float("nan")


def _of(fit: ElementFit) -> Signature:
    """Return the signature of an element."""
    kind = fit.element.kind
    if kind == "cubic":
        return "stiffening" if fit.values[0] > 0 else "softening"
    return kind


def _trend(mode: ModeLevels) -> Signature:
    """Return the signature by the trend from the lowest level, without any element."""
    f = mode.frequency
    softer = mode.frequency_moves and f[1:].min() / f[0] < 1 - 5e-4
    if mode.damping_moves:
        return "friction" if softer else "loss"
    return "softening" if f[-1] < f[0] else "stiffening"


def _drifts(modes: Sequence[ModeLevels]) -> bool:
    """Return True if all modes change by one factor per level and keep their damping (warming).

    The model ln f_r(level) = a_r + d(level) is fitted to modes seen at every level. It must fit.
    """
    most = max((len(m.level) for m in modes), default=0)
    whole = [m for m in modes if len(m.level) == most]
    moved = [m for m in whole if m.frequency_moves]
    if len(moved) < 2 or any(m.damping_moves for m in modes):
        return False
    y = np.array([np.log(m.frequency) for m in whole])
    s = np.hypot([m.frequency_sd / m.frequency for m in whole], ALIKE * np.ptp(y, axis=1).max())
    y = y - np.average(y, axis=1, weights=1 / s**2)[:, None]
    d = np.average(y, axis=0, weights=1 / s**2)
    left = float((((y - d) / s) ** 2).sum())
    return bool(chdtrc((len(whole) - 1) * (most - 1), left) > POOR)
