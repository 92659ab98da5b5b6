"""Check the numbers of a recording: FRFs without a phase, magnitudes cut off."""

from dataclasses import replace

import numpy as np

from ..dynamics.frf import FRF
from ..errors import named
from ..units import number
from .finding import Check, Finding
from .screening import roughness

LEVEL = 2e-6  # of the largest magnitude: equal in six digits, as noise seldom makes three lines
BENT = 10.0  # times the phase that so small a change of magnitude leaves near a maximum
LEAST_CUT = 3  # lines of one level
JUMPING = 0.1  # roughness of magnitudes over that of the FRFs; of noise it is a fifth and more


def without_phase(frf: FRF) -> tuple[list[Finding], Check]:
    """Numbers of which a whole part is zero: a damped structure answers with both.

    The two parts of a causal FRF are each other's Hilbert transform; neither can vanish alone.
    """
    v = frf.values
    found = []
    if v.any() and not (v.imag.any() and v.real.any()):
        part = "imaginary" if v.real.any() else "real"
        if part == "real":
            cause = "only imaginary parts were stored"
        elif (v.real >= 0).all():
            cause = "only magnitudes were stored"
        else:
            cause = "only real parts, only imaginary parts or decibels were stored"
        text = (
            f"the {part} part of every FRF is exactly zero, which no structure with damping shows: "
            f"{cause}, so the phase is lost."
        )
        found = [Finding("no phase", text, "fault", (), "export complex FRFs again")]
    said = "one part is zero" if found else "real and imaginary parts"
    return found, Check("phase", said, not found)


def jumping_phase(frf: FRF, rough: float) -> tuple[list[Finding], Check]:
    """Magnitudes that are smooth over frequency while phases jump from line to line.

    The magnitude of noise is as rough as its parts: noise over power of |H| is then as large.

    Parameters
    ----------
    rough : noise over power of the median line, beyond which FRFs are nothing but noise
    """
    noisy = [
        float(np.median(roughness(one) / np.maximum(np.abs(one.values) ** 2, 1e-300)))
        for one in (frf, replace(frf, values=np.abs(frf.values) + 0j))
    ]
    if noisy[0] <= rough or noisy[1] > JUMPING * noisy[0]:
        return [], Check("phase over frequency", f"noise over power {number(noisy[0], 2)}")
    text = (
        "the magnitudes of the FRFs are smooth over frequency, but their phases jump from line to "
        "line: phases in degrees that were read in radians look like this."
    )
    mend = "export the phases again, or real and imaginary parts"
    found = Finding("jumping phase", text, "fault", (), mend)
    return [found], Check("phase over frequency", "jumps from line to line", False)


def cut_off(frf: FRF) -> tuple[list[Finding], Check]:
    """Channels whose largest values are one value on several lines.

    Near a maximum |H| falls by φ²/2 of it, φ the change of phase. So two lines whose magnitudes
    agree to ε differ in phase by 2 √(2ε) at most. A real or imaginary part at its maximum likewise.
    """
    names, limit = [], np.inf
    for k, label in enumerate(frf.outputs):
        cut = [_level(z) for z in frf.values[:, k].T]
        if any(c is not None for c in cut):
            names.append(label)
            limit = min(limit, *(c for c in cut if c is not None))
    if not names:
        return [], Check("cut off", "no largest value repeats itself")
    text = (
        f"the largest values of {len(names)} of {len(frf.outputs)} outputs ({named(names, 4)}) are "
        f"one value, from {number(limit, 4)}, on {LEAST_CUT} lines and more while the phase "
        "changes: the FRFs are cut off."
    )
    mend = "export without a limit, or measure in a larger range"
    found = Finding("cut off", text, "fault", tuple(names), mend, limit)
    return [found], Check("cut off", f"{len(names)} outputs", False)


def _level(z: np.ndarray) -> float | None:
    """Value at which magnitude, real or imaginary part (n_f,) is cut off, or None."""
    for size, other in (
        (np.abs(z), np.unwrap(np.angle(z))),
        (np.abs(z.real), z.imag / np.maximum(np.abs(z).max(), 1e-300)),
        (np.abs(z.imag), z.real / np.maximum(np.abs(z).max(), 1e-300)),
    ):
        at = size >= (1 - LEVEL) * size.max()
        if size.max() > 0 and at.sum() >= LEAST_CUT and np.ptp(other[at]) > BENT * LEVEL**0.5:
            return float(size.max())
    return None
