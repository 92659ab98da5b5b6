"""Check that the frequency axis of a recording begins at 0 Hz.

H(s) = s^q [Σ_r R_r/(s-p_r) + R̄_r/(s-p̄_r) + L/s² + U]. The factor s^q, the poles p̄_r below zero and
the inertia line L/s² tie the axis to zero. An axis that is off by δ fits none at
s = iω, but all at s = i(ω - 2π δ). The sum of squares as a function of δ gives the shift with its
standard deviation. A factor on the axis leaves H of this form: no recording shows it by itself, and
no model whose stiffness is free.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..dynamics.frf import FRF
from .finding import Check, Finding
from .identification import Identified, kept_lines, pole_data
from .pole_fitting import PoleData, polish
from .pole_search import chi_of
from .pole_selection import Rule

SURE = 5.0  # standard deviations of a shift that is named, and root of the fall of χ²
POOR = 3.0  # times the noise: an identification that leaves more does not hold the axis
REACH = 0.9  # of the lowest line: the greatest shift that is tried
TRIALS = 11
LINES, CHANNELS = 500, 16  # to compare on: they show a shift of a few lines as well as all


@dataclass(frozen=True)
class AxisShift:
    """Recorded less true frequency [Hz], its standard deviation, the fall of χ² over the noise."""

    shift: float
    sd: float
    gain: float


def axis_shift(frf: FRF, found: Identified, use: np.ndarray | None = None) -> AxisShift | None:
    """Estimate the shift of the axis; None where the poles do not fit the recording.

    Poles below half of the lowest line may stand for a shift, so each shift is tried with them and
    without, at the price of a pole.
    """
    keep = np.flatnonzero(kept_lines(frf, found.band, use))
    keep = keep[:: max(1, len(keep) // LINES)]
    loud = np.sort(np.argsort(-np.linalg.norm(frf.values[keep], axis=(0, 2)))[:CHANNELS])
    some = frf.sel(outputs=[frf.outputs[k] for k in loud])
    lines = np.isin(np.arange(len(frf.frequency)), keep)
    lowest = float(frf.frequency[keep[0]])
    sets = [found.poles]
    if (found.frequency < lowest / 2).any():
        sets.append(found.poles[found.frequency >= lowest / 2])

    def fitted(shift: float, p: np.ndarray) -> tuple[float, float]:
        """χ² with the price of its poles, and χ of a fit on the axis less a shift [Hz]."""
        data, top = pole_data(replace(some, frequency=some.frequency - shift), lines)
        fit, _ = polish(data, (p - 2j * np.pi * shift) / top)
        return fit.chi2 + _price(data) * len(p), chi_of(data, fit)

    def cost(shift: float) -> float:
        return min(fitted(shift, p)[0] for p in sets)

    trials = np.linspace(-REACH, REACH, TRIALS) * lowest
    costs = [cost(t) for t in trials]
    k, step = int(np.argmin(costs)), float(trials[1] - trials[0])
    ends = max(trials[k] - step, trials[0]), min(trials[k] + step, trials[-1])
    from scipy.optimize import minimize_scalar

    found_by = minimize_scalar(cost, bounds=ends, method="bounded", options={"xatol": step / 50})
    best = float(found_by.x)
    p = min(sets, key=lambda p: fitted(best, p)[0])
    chi = fitted(best, p)[1]
    if chi > POOR:
        return None
    noise, h = max(1.0, chi**2), 0.1 * step
    rise = fitted(best + h, p)[0] + fitted(best - h, p)[0] - 2 * fitted(best, p)[0]
    sd = float(np.sqrt(2 * noise / rise)) * h if rise > 0 else np.inf
    return AxisShift(best, sd, (cost(0.0) - cost(best)) / noise)


def _price(data: PoleData) -> float:
    return Rule(data.y.shape[1], len(data.s)).price


def axis_check(
    frf: FRF, found: Identified, use: np.ndarray | None = None
) -> tuple[list[Finding], Check]:
    """Report a shift of the axis by a spectral line or more, beyond ``SURE``."""
    name = "frequency axis"
    if not found.order or found.chi > POOR:
        return [], Check(name, "the identified modes do not fit the recording", None)
    off = axis_shift(frf, found, use)
    if off is None:
        return [], Check(name, "the identified modes do not fit the recording", None)
    said = f"{off.shift:.2g} Hz from zero, ± {1.96 * off.sd:.2g}"
    spacing = float(np.diff(frf.frequency).min())
    if abs(off.shift) < max(SURE * off.sd, spacing) or off.gain < SURE**2:
        return [], Check(name, said)
    size, sd = abs(off.shift), 1.96 * off.sd
    way, mend = ("high", "subtract {} from") if off.shift > 0 else ("low", "add {} to")
    text = (
        f"the frequency axis is {size:.3g} Hz too {way} (95 % interval {size - sd:.3g} to "
        f"{size + sd:.3g}): without it χ² of the identified modes falls by {off.gain:.3g}."
    )
    repair = f"{mend.format(f'{size:.3g} Hz')} all frequencies, or find why the axis is off"
    return [Finding("frequency offset", text, "fault", (), repair, off.shift)], Check(
        name, said, False
    )
