"""Check that the frequency axis of a recording begins at 0 Hz.

H(s) = s^q [Σ_r R_r/(s-p_r) + R̄_r/(s-p̄_r) + L/s² + U]. The factor s^q, the poles p̄_r below zero and
the inertia line L/s² tie the axis to zero. An axis that is off by δ fits none at
s = iω, but all at s = i(ω - 2π δ). The sum of squares as a function of δ gives the shift with its
standard deviation. A factor on the axis leaves H of this form: no recording shows it by itself, and
no model whose stiffness is free.
"""

from dataclasses import replace

import numpy as np

from ..dynamics.frf import FRF
from ..units import number
from .finding import Check, Finding
from .identification import Identified, kept_lines, pole_data
from .pole_fitting import PoleData, bounded, polish, solve
from .pole_search import chi_of
from .pole_selection import Rule

SURE = 5.0  # standard deviations of a shift that is named, and root of the fall of χ²
POOR = 3.0  # times the noise: an identification that leaves more does not hold the axis
REACH = 0.9  # of the lowest line: the greatest shift that is tried
BELOW = 0.3, 0.6, 0.85  # of the lowest line: where a mode below the band is begun
TRIALS, STEPS = 37, 10  # shifts, and steps of a fit
DAMPED, RELAXED = 0.1, 0.99  # largest damping ratio of a mode, and of foam below the modes
LINES, CHANNELS = 500, 16  # to compare on: they show a shift of a few lines as well as all


def axis_shift(
    frf: FRF, found: Identified, use: np.ndarray | None = None
) -> tuple[float, float, float] | None:
    """Estimate the shift of the axis; None where the poles do not fit the recording.

    It is recorded less true frequency [Hz], with its standard deviation and the fall of χ² over the
    noise.

    Poles move with the axis, and residues are fitted again. This profile is smooth, and its fall
    is at most that of a whole fit, which is made at its lowest value. Poles below half of the
    lowest line may stand for a shift, so each shift is tried with them and without, at the price of
    a pole. A structure on foam or rubber has poles that relax, and one on cords has modes below the
    band, whose pull a shift would imitate; so they compete with it.
    """
    keep = np.flatnonzero(kept_lines(frf, found.band, use))
    keep = keep[:: max(1, len(keep) // LINES)]
    loud = np.sort(np.argsort(-np.linalg.norm(frf.values[keep], axis=(0, 2)))[:CHANNELS])
    some = frf.sel(outputs=[frf.outputs[k] for k in loud])
    lines = np.isin(np.arange(len(frf.frequency)), keep)
    lowest = float(frf.frequency[keep[0]])

    def fitted(
        shift: float, p: np.ndarray, steps: int, most: float = DAMPED
    ) -> tuple[float, float, np.ndarray]:
        """χ² with the price of its poles, χ, and the poles on the recorded axis."""
        data, top = pole_data(replace(some, frequency=some.frequency - shift), lines)
        q = bounded((p - 2j * np.pi * shift) / top, most)
        fit = (polish(data, q, most, steps) if steps else solve(data, q))[0]
        return fit.chi2 + _price(data) * len(p), chi_of(data, fit), fit.p * top + 2j * np.pi * shift

    low = found.frequency < lowest / 2
    sets = [fitted(0.0, p, STEPS)[2] for p in ([found.poles, found.poles[~low]] if low.any() else
                                               [found.poles])]  # fmt: skip
    trials = np.linspace(-REACH, REACH, TRIALS) * lowest
    profiles = [[fitted(t, p, 0)[0] for t in trials] for p in sets]
    p = sets[int(np.argmin([min(profile) for profile in profiles]))]
    k, h = int(np.argmin(np.min(profiles, axis=0))), float(trials[1] - trials[0])
    whole = [fitted(float(t), p, STEPS) for t in trials[k] + h * np.arange(-1, 2)]
    below, here, above = (cost for cost, _, _ in whole)
    slope, rise = (above - below) / 2, above + below - 2 * here
    if rise <= 0 or whole[1][1] > POOR:
        return None
    best = float(trials[k] + np.clip(-slope / rise, -1, 1) * h)
    noise = max(1.0, whole[1][1] ** 2)
    cords = [np.append(sets[-1], 2j * np.pi * lowest * x) for x in BELOW]
    zero = min(
        fitted(0.0, each, steps, most)[0]
        for each in (*sets, *cords)
        for steps, most in ((STEPS, DAMPED), (3 * STEPS, RELAXED))
    )
    gain = (zero - fitted(best, p, STEPS)[0]) / noise
    return best, float(np.sqrt(2 * noise / rise)) * h, gain


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
    shift, sd, gain = off
    size, half = abs(shift), 1.96 * sd
    said = f"{shift:.2g} Hz from zero, ± {half:.2g}"
    if size < max(SURE * sd, float(np.diff(frf.frequency).min())) or gain < SURE**2:
        return [], Check(name, said)
    way, mend = ("high", "subtract {} from") if shift > 0 else ("low", "add {} to")
    text = (
        f"the frequency axis is {size:.3g} Hz too {way} (95 % interval {size - half:.3g} to "
        f"{size + half:.3g}): without it χ² of the identified modes falls by {number(gain, 3)}."
    )
    repair = f"{mend.format(f'{size:.3g} Hz')} all frequencies, or find why the axis is off"
    return [Finding("frequency offset", text, "fault", (), repair, shift)], Check(name, said, False)
