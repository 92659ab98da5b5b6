"""Check the channels of a recording: dead, doubled, incoherent, reversed, reciprocal.

Ewins (2000), Modal Testing, sections 3.10 and 4.2 (checks of measured FRFs).
"""

import re
from collections.abc import Collection
from itertools import combinations

import numpy as np

from ..dynamics.frf import FRF
from ..units import number
from .finding import Check, Finding
from .screening import noise_of
from .value_checks import cut_off, jumping_phase, without_phase

LEAST_LINES = 12
NOISE_ONLY = 0.3  # noise over power of the median line: nothing but noise has more
COHERENT = 0.8  # median coherence a channel should reach
COPIED = 0.3  # |H_a - H_b|² over the noise of both: no two sensors share their noise
COPY_APART = 0.002  # ... and rms difference over rms of a copy: two front ends differ by more
ALIKE = 2.0  # the same ratio: no more apart than their noise, which may be known to a factor
SILENT_NOISE = 1e-6  # noise over power: less is a computed FRF, of which nothing can be said so
DRIVEN = -0.5  # share of the imaginary part at the drive point: 1 all as it must be, -1 none
RECIPROCAL = 0.1  # |H_ij - H_ji| over |H_ij|, rms: more is no place and no noise


def channel_checks(
    frf: FRF, places: dict[str, np.ndarray] | None = None, alive: Collection[str] = ()
) -> tuple[list[Finding], list[Check]]:
    """All checks of one FRF matrix that need neither modes nor a model.

    Parameters
    ----------
    places : {output: (3,)} [m], where known, to say how far two channels are apart
    alive : outputs that are known not to be dead
    """
    frf = frf.sel(band=(1e-9, np.inf))
    if len(frf.frequency) < LEAST_LINES:
        few = f"{len(frf.frequency)} lines are too few for checks"
        return [], [Check("channels", few, None)]
    findings: list[Finding] = []
    checks: list[Check] = []
    for found, check in (
        jumping_phase(frf, NOISE_ONLY), dead(frf, alive), incoherent(frf), reversed_drive(frf),
        reciprocity(frf), without_phase(frf), cut_off(frf),
    ):  # fmt: skip
        findings += found
        checks.append(check)
    if findings and findings[0].kind == "jumping phase":
        findings = [f for f in findings if f.kind != "dead channel"]
    silent = {c for f in findings if f.kind == "dead channel" for c in f.channels}
    alive = [o for o in frf.outputs if o not in silent]
    if alive:
        found, check = doubled(frf.sel(outputs=alive), places or {})
        findings += found
        checks.append(check)
    return findings, checks


def dead(frf: FRF, alive: Collection[str] = ()) -> tuple[list[Finding], Check]:
    """Channels far below the others, or that hold noise alone.

    The noise is the variance stored with the recording, otherwise the roughness of the FRF over
    frequency. The response of a nonlinear structure is rough as well.
    """
    rms = np.sqrt((np.abs(frf.values) ** 2).mean(axis=(0, 2)))
    typical = np.median(rms)
    noisy = np.median(noise_of(frf) / np.maximum(np.abs(frf.values) ** 2, 1e-300), axis=(0, 2))
    found = []
    for k, label in enumerate(frf.outputs):
        if label in alive:
            continue
        if rms[k] <= 1e-4 * typical:
            text = f"output {label} is dead: its level is {rms[k] / typical:.1e} of the others'"
        elif noisy[k] > NOISE_ONLY:
            text = f"output {label} is dead: its lines contain only noise"
        else:
            continue
        found.append(
            Finding("dead channel", text + ".", "fault", (label,), left_out(label), rms[k])
        )
    lowest = float(rms.min() / max(typical, 1e-300))
    return found, Check("dead channels", f"lowest level {lowest:.2g} of the median", not found)


def left_out(label: str) -> str:
    """Return the repair that excludes a useless channel."""
    return f'in sensors.csv give {label} the cell use = "no"'


def incoherent(frf: FRF) -> tuple[list[Finding], Check]:
    """Channels and lines whose coherence is low."""
    if frf.coherence is None:
        return [], Check("coherence", "the recording has none", None)
    each = np.median(frf.coherence, axis=(0, 2))
    found = [
        Finding(
            "low coherence",
            f"output {label} has a median coherence of {c:.2f}, so its noise is large.",
            "warning", (label,), "check its cable and mounting, or average longer", float(c),
        )
        for label, c in zip(frf.outputs, each, strict=True)
        if c < COHERENT
    ]  # fmt: skip
    line = np.median(frf.coherence, axis=(1, 2))
    poor = float((line < COHERENT).mean())
    said = f"median {np.median(each):.3f}; {100 * poor:.0f} % of the lines below {COHERENT}"
    return found, Check("coherence", said, not found)


def drive_points(frf: FRF) -> list[tuple[int, int, int]]:
    """(output, input, sign) of dofs that are both, by their labels; node 0 is no place."""
    bare = {label: re.sub(r":[+-]", ":", label) for label in (*frf.outputs, *frf.inputs)}
    return [
        (i, j, 1 if (":-" in o) == (":-" in p) else -1)
        for i, o in enumerate(frf.outputs)
        for j, p in enumerate(frf.inputs)
        if bare[o] == bare[p] and not p.startswith(("base", "0:"))
    ]


def driving_share(frf: FRF, i: int, j: int, sign: int) -> float:
    """Σ y|y| / Σ y² of y = ω Re(mobility), which no passive structure has below zero."""
    power = {"receptance": 1, "mobility": 0, "accelerance": -1}.get(frf.quantity, 0)
    y = sign * (frf.values[:, i, j] * 1j**power).real
    return float((y * np.abs(y)).sum() / max((y**2).sum(), 1e-300))


def reversed_drive(frf: FRF) -> tuple[list[Finding], Check]:
    """Check that the input power is positive at every spectral line, Re(mobility) > 0."""
    points = drive_points(frf)
    if not points:
        return [], Check("drive point", "no output is at the drive point", None)
    found, shares = [], []
    for i, j, sign in points:
        share = driving_share(frf, i, j, sign)
        shares.append(share)
        if share < DRIVEN:
            o, p = frf.outputs[i], frf.inputs[j]
            text = (
                f"at the drive point {o} the force takes power out of the structure: the sensor "
                f"or the force gauge {p} is reversed, or the recording is not {frf.quantity}."
            )
            mend = f"in sensors.csv reverse the direction of output {o} (or of input {p})"
            found.append(Finding("reversed sign", text, "fault", (o,), mend, share))
    lowest = min(shares)
    said = f"{100 * (1 + lowest) / 2:.0f} % of the power goes into the structure"
    return found, Check("drive point", said, not found)


def reciprocity(frf: FRF) -> tuple[list[Finding], Check]:
    """H_ij = H_ji for every two dofs that were both driven and measured."""
    points = drive_points(frf)
    pairs = list(combinations(points, 2))
    if not pairs:
        return [], Check("reciprocity", "needs two dofs that were both driven and measured", None)
    found, largest = [], 0.0
    variance = noise_of(frf)
    for (i, j, s), (k, m, t) in pairs:
        a, b = s * t * frf.values[:, i, m], frf.values[:, k, j]
        noise = float((variance[:, i, m] + variance[:, k, j]).mean())
        power = float((np.abs(a) ** 2 + np.abs(b) ** 2).mean()) / 2
        apart = np.sqrt(max(float((np.abs(a - b) ** 2).mean()) - noise, 0.0) / max(power, 1e-300))
        largest = max(largest, apart)
        if apart > RECIPROCAL:
            names = (frf.outputs[i], frf.outputs[k])
            factor = float(np.real(np.vdot(b, a)) / max(float(np.vdot(b, b).real), 1e-300))
            text = (
                f"{names[0]} and {names[1]} are not reciprocal: H_ij and H_ji differ by "
                f"{100 * apart:.0f} % beyond their noise (best factor {number(factor, 3)})."
            )
            mend = "compare the calibration and the places of both sensors and force gauges"
            found.append(Finding("not reciprocal", text, "warning", names, mend, apart))
    return found, Check("reciprocity", f"differs by {100 * largest:.2g} % at most", not found)


def doubled(frf: FRF, places: dict[str, np.ndarray]) -> tuple[list[Finding], Check]:
    """Two outputs that are one signal: closer to each other than the noise of two sensors.

    The value of a finding is ‖H_a - H_b‖ over that of both together, 1 for two unlike channels.
    """
    noise = noise_of(frf)
    power = (np.abs(frf.values) ** 2).mean(axis=0)
    level = np.sqrt(noise.mean(axis=0).sum() / max(power.sum(), 1e-300))
    found, least = [], np.inf
    for a, b in combinations(range(len(frf.outputs)), 2):
        if abs(np.log(power[a].sum() / power[b].sum())) > 0.5:
            continue
        gap = np.abs(frf.values[:, a] - frf.values[:, b]) ** 2
        own = noise[:, a] + noise[:, b]
        floor = 1e-12 * np.abs(frf.values[:, a]) ** 2 + 1e-300
        ratio = float(np.median(gap / np.maximum(own, floor)) / np.log(2))  # of Exp(1): ln 2
        apart = float(np.sqrt(gap.mean() / max(2 * power[[a, b]].mean(), 1e-300)))
        least = min(least, ratio)
        if ratio < ALIKE:
            names = (frf.outputs[a], frf.outputs[b])
            copied = ratio < COPIED and apart < COPY_APART and level**2 > SILENT_NOISE
            found.append(_doubled(names, places, ratio, apart, copied))
    said = (
        "one channel"
        if not np.isfinite(least)
        else f"nearest pair {number(least, 3)} times its noise"
    )
    return found, Check("doubled channels", said, not found)


def _doubled(
    names: tuple[str, str],
    places: dict[str, np.ndarray],
    ratio: float,
    apart: float,
    copied: bool,
) -> Finding:
    one, other = names
    far = ""
    if one in places and other in places:
        far = f", {np.linalg.norm(places[one] - places[other]):.3g} m apart,"
    if copied:
        text = (
            f"outputs {one} and {other}{far} are one signal under two labels: even their noise is "
            f"the same ({ratio:.2g} of the difference between two sensors)."
        )
        mend = f"{left_out(other)} (or {one}, whichever label is the wrong one)"
        return Finding("duplicated channels", text, "fault", names, mend, apart)
    text = (
        f"outputs {one} and {other}{far} are equal within their noise ({ratio:.2g}): one sensor "
        "under two labels, or symmetric places."
    )
    return Finding("equal channels", text, "warning", names, "compare their cables", apart)
