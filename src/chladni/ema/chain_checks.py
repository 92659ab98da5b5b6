"""Check the measuring chain by the identified modes: delay, quantity, units, polarity.

The modal constants A_r = 2i Im(p_r) R_r of a normal mode are real. A delay τ turns them by -ω_r τ.
A derivative too many or too few turns them by 90 degrees and scales them by a power of ω_r. A wrong
unit multiplies all of them by one factor.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from ..units import number
from .finding import Check, Finding
from .frf_maps import Misreading
from .identification import Identified
from .shapes import constants

LEAST_MODES = 4
TURNED = 0.1  # rad at the highest mode: a smaller delay bends nothing
SURE, HINT = 6.0, 3.0  # standard deviations of a delay, to be named and to be looked at
BETTER, HINTED = 3.0, 1.5  # times less scatter (of phases, of what is left), the same
QUARTER = 0.35  # rms of the sine of the phases that a quarter turn may leave
LOUD = 2.5  # factor between recording and model beyond which a unit is wrong
NEAR_FACTOR = 0.3  # ln: how near a named factor has to be
ALIKE = 0.6  # MAC from which a mode of the model is the one of the test
FACTORS = {  # what multiplies the recording to mend it: how it comes about
    9.80665: "responses in g read as m/s²",
    1 / 9.80665: "responses in m/s² read as g",
    1 / 4.4482216: "forces in lbf read as N",
    4.4482216: "forces in N read as lbf",
    1e-3: "responses in mm read as m",
    1e3: "responses in m read as mm",
    0.0254: "responses in inches read as m",
    1 / 0.0254: "responses in m read as inches",
    9.80665 / 4.4482216: "responses in g and forces in lbf read as m/s² and N",
}
QUANTITIES = ("receptance", "mobility", "accelerance")


def phases(identified: Identified) -> np.ndarray:
    """Mean phase of each mode's constants, modulo π (r,) [rad]."""
    A = constants(identified)
    return 0.5 * np.angle((A**2).sum(axis=(1, 2)))


@dataclass(frozen=True)
class DelayFit:
    """Delay [s] with its standard deviation, quarter turns (0, 1), rms of phases before, after."""

    delay: float
    sd: float
    quarter: int
    before: float
    after: float


def fitted_delay(omega: np.ndarray, theta: np.ndarray) -> DelayFit:
    """τ and c of θ_r = c π/2 - ω_r τ (mod π) with the least scatter (rms of sin, [rad]).

    Within one turn of the highest mode; a line of more turns would fit any few phases.
    """
    top = float(omega.max())
    trial = np.linspace(-np.pi, np.pi, 2001) / top
    best = (np.inf, 0.0, 0)
    for quarter in (0, 1):
        e = np.sin(theta + omega * trial[:, None] - quarter * np.pi / 2)
        scatter = (e**2).mean(axis=1)
        k = int(scatter.argmin())
        if scatter[k] < 0.5 * best[0] or (quarter == 0):
            best = (float(scatter[k]), float(trial[k]), quarter)
    scatter, delay, quarter = best
    free = max(len(omega) - 1, 1)
    sd = np.sqrt(max(scatter, 1e-12) * len(omega) / free / (omega**2).sum())
    before = float(np.sqrt((np.sin(theta - quarter * np.pi / 2) ** 2).mean()))
    return DelayFit(delay, float(sd), quarter, before, float(np.sqrt(scatter)))


def hinted_delay(identified: Identified) -> float:
    """Return the delay that the phases of the modes suggest [s], 0 if they suggest none.

    A delay distorts the identified poles too. The value is a start for a second identification.
    """
    if identified.order <= LEAST_MODES:
        return 0.0
    omega = np.abs(identified.poles)
    fit = fitted_delay(omega, phases(identified))
    turn = abs(fit.delay) * float(omega.max())
    hint = abs(fit.delay) > HINT * fit.sd and turn > TURNED and fit.quarter == 0
    return fit.delay if hint and fit.before > HINTED * fit.after else 0.0


def phase_checks(
    identified: Identified, corrected: Identified | None = None, delay: float = 0.0
) -> tuple[list[Finding], Check]:
    """Delay and odd derivatives, from the phases of the modal constants alone.

    Parameters
    ----------
    corrected : of the recording with ``delay`` [s] taken off
    """
    if identified.order < LEAST_MODES:
        return [], Check("phase of the modes", f"needs {LEAST_MODES} modes", None)
    before = float(np.sqrt((np.sin(phases(identified)) ** 2).mean()))
    said = f"the rms phase error of the modal constants is {np.degrees(before):.2g} degrees"
    found: list[Finding] = []
    if corrected is not None and corrected.order > LEAST_MODES:
        rest = fitted_delay(np.abs(corrected.poles), phases(corrected))
        whole = delay + rest.delay
        top = float(np.abs(corrected.poles).max())
        better = BETTER * max(rest.after, 1e-3) < before and corrected.chi < identified.chi
        if better and abs(whole) > SURE * rest.sd and abs(whole) * top > TURNED:
            found.append(_late(whole, rest.sd, top))
    else:
        fit = fitted_delay(np.abs(identified.poles), phases(identified))
        if fit.quarter and fit.after < QUARTER:
            found.append(_quarter(identified.quantity))
    return found, Check("phase of the modes", said, not found)


def _late(delay: float, sd: float, top: float) -> Finding:
    text = (
        f"all responses {'lag' if delay > 0 else 'lead'} by {1e3 * abs(delay):.3g} ms (± "
        f"{1e3 * sd:.2g}): the phase of the modal constants increases with frequency, to "
        f"{np.degrees(abs(delay) * top):.0f} degrees at {top / 2 / np.pi:.4g} Hz."
    )
    mend = f"in case.toml, [test]: delay = {delay:.4g}"
    return Finding("delay", text, "fault", (), mend, delay)


def _quarter(quantity: str) -> Finding:
    k = QUANTITIES.index(quantity) if quantity in QUANTITIES else -1
    others = [QUANTITIES[n] for n in (k - 1, k + 1) if 0 <= n < 3 and k >= 0]
    text = (
        f"the modes of the declared {quantity} are 90 degrees out of phase: the responses are "
        f"another quantity ({' or '.join(others) or 'unknown'})."
    )
    mend = f'in case.toml, [test]: quantity = "{others[-1]}"' if others else ""
    return Finding("wrong quantity", text, "fault", (), mend, 1.0)


def other_reading(identified: Identified, others: dict[Misreading, Identified]) -> list[Finding]:
    """Find the reading under which a recording that has no clear modes, or other ones, has them.

    Parameters
    ----------
    others : {error: the modes of the same numbers, read as this error says}
    """
    few = identified.order < LEAST_MODES
    least, much = (identified.order + LEAST_MODES, HINTED) if few else (identified.order, BETTER)
    able = {e: o for e, o in others.items() if o.order >= least and much * o.chi < identified.chi}
    if not able:
        return []
    best = min(able, key=lambda error: able[error].chi)
    text = (
        f"read as {identified.quantity} the recording has {identified.order} modes and a residual "
        f"of {number(identified.chi, 3)} times its noise; read as if {best.text}, it has "
        f"{able[best].order} modes and a residual of {number(able[best].chi, 3)}."
    )
    next_best = min((o.chi for e, o in others.items() if e != best), default=np.inf)
    undo = best.mend if BETTER * able[best].chi < next_best else ()
    return [Finding(best.kind, text, "fault", (), best.repair, mend=undo)]


def modal_gains(
    identified: Identified, phi_out: np.ndarray, phi_in: np.ndarray, frequency: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """g_r = <A_model, A_r>/<A_model, A_model> of the modes that have a partner, and their ω_r.

    Parameters
    ----------
    phi_out, phi_in : (n_out, m), (n_in, m)   shapes of the model [1/√kg]
    frequency : (m,)                          [Hz], within which a factor of 1.3 is looked for
    """
    A = constants(identified).reshape(identified.order, identified.lower.size)
    model = np.einsum("om,im->moi", phi_out, phi_in).reshape(len(frequency), A.shape[1])
    cross = A @ model.T
    own, theirs = (np.abs(A) ** 2).sum(axis=1), (model**2).sum(axis=1)
    mac = np.abs(cross) ** 2 / np.maximum(own[:, None] * theirs, 1e-300)
    mac[np.abs(np.log(identified.frequency[:, None] / frequency)) > np.log(1.3)] = 0
    at = mac.argmax(axis=1)
    rows = np.flatnonzero(mac[np.arange(len(A)), at] > ALIKE)
    gains = cross[rows, at[rows]] / np.maximum(theirs[at[rows]], 1e-300)
    return gains, np.abs(identified.poles[rows])


def level_checks(
    identified: Identified,
    gains: np.ndarray,
    omega: np.ndarray,
    known_gain: bool = True,
    outputs: int = 3,
) -> tuple[list[Finding], Check]:
    """Quantity, unit and polarity, from the modal constants over those of the model.

    Parameters
    ----------
    gains, omega : (r,)   of :func:`modal_gains`
    known_gain : whether the level itself may be compared
    """
    if len(gains) < LEAST_MODES or outputs < 3:
        return [], Check("level and units", f"{len(gains)} modes have a partner in the model", None)
    size, w = np.log(np.abs(gains)), np.log(omega)
    positive = float((gains.real > 0).mean())
    order, rest = _derivative(size, w, known_gain)
    found = []
    if order:
        found.append(_quantity(identified, order))
    level = float(np.median(rest))
    opposite = positive if abs(order) == 2 else 1 - positive  # two derivatives turn every sign
    if known_gain and opposite > 0.8 and abs(order) != 1:
        text = (
            f"{100 * opposite:.0f} % of the modes have the sign opposite to the model's: the force "
            "gauge (or every sensor) is reversed."
        )
        mend = f"in sensors.csv reverse the direction of input {identified.inputs[0]}"
        undo = ("factor", "-1")
        found.append(Finding("reversed force", text, "fault", (), mend, -1.0, undo))
    if known_gain and abs(level) > np.log(LOUD):
        found.append(_unit(level))
    said = f"{number(np.exp(np.median(size)), 3)} times the model, over {len(gains)} modes"
    return found, Check("level and units", said, not found)


def _derivative(size: np.ndarray, w: np.ndarray, known_gain: bool) -> tuple[int, np.ndarray]:
    """Return the surplus derivatives of the recording (negative: missing) and the rest of ln|g|.

    A known level shows them clearly, because ω is hundreds of radians per second.
    """
    if len(size) < LEAST_MODES + 1:
        return 0, size
    slope, low, high = median_slope(size, w)
    order = int(np.clip(round(slope), -2, 2))
    if order == 0:
        return 0, size
    left = size - order * w
    sure = low > 0.3 or high < -0.3
    if known_gain:  # the level says it as well
        sure = abs(np.median(left)) < min(abs(np.median(size)), NEAR_FACTOR if not sure else np.inf)
    return (order, left) if sure else (0, size)


def median_slope(y: np.ndarray, x: np.ndarray) -> tuple[float, float, float]:
    """Median slope of all pairs of points, and its 99.9 % interval (Sen 1968, JASA 63, 1379)."""
    i, j = np.triu_indices(len(x), 1)
    apart = x[i] != x[j]
    each = np.sort((y[j] - y[i])[apart] / (x[j] - x[i])[apart])
    n, pairs = len(x), len(each)
    half = float(ndtri(0.9995)) * np.sqrt(n * (n - 1) * (2 * n + 5) / 18)
    low = max(round((pairs - half) / 2) - 1, 0)
    high = min(round((pairs + half) / 2), pairs - 1)
    return float(np.median(each)), float(each[low]), float(each[high])


def _quantity(identified: Identified, order: int) -> Finding:
    k = QUANTITIES.index(identified.quantity) if identified.quantity in QUANTITIES else None
    n = None if k is None else k + order
    what = QUANTITIES[n] if n is not None and 0 <= n < 3 else "another quantity"
    text = (
        f"relative to the model the modes {'fall' if order < 0 else 'rise'} as ω^{abs(order)}: "
        f"the declared {identified.quantity} is {what}."
    )
    mend = f'in case.toml, [test]: quantity = "{what}"'
    return Finding("wrong quantity", text, "fault", (), mend, float(order))


def _unit(level: float) -> Finding:
    factor, why = min(FACTORS.items(), key=lambda item: abs(level + np.log(item[0])))
    said = f"the recording is {number(np.exp(level), 3)} times the model"
    if abs(level + np.log(factor)) < NEAR_FACTOR:
        mend = f"in case.toml, [test]: factor = {factor:.7g}"
        undo = ("factor", f"{factor:.7g}")
        return Finding("wrong units", f"{said}: {why}.", "fault", (), mend, factor, undo)
    mend = 'check the calibration, or in case.toml, [test]: gain = "unknown"'
    return Finding("level", f"{said}, which no unit explains.", "warning", (), mend, np.exp(level))
