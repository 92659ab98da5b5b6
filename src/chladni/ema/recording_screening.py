"""Screening of a recording by itself and by the modes identified from it."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..dynamics.frf import FRF
from ..units import number
from .axis_shift import axis_check
from .chain_checks import (
    LOUD,
    QUANTITIES,
    hinted_delay,
    other_reading,
    phase_checks,
)
from .channel_checks import channel_checks, dead
from .channel_delays import channel_delays
from .finding import Check, Finding, Screening
from .frf_maps import Misreading, mapped, misreadings
from .identification import Identified, identify
from .roving_mass import NAME as ROVING
from .roving_mass import roving_mass
from .screening import levels_checked
from .setup import Recording
from .shapes import lines_per_bandwidth
from .signal_faults import signal_checks
from .time_record import overloaded

LINES = 3.0  # in a half-bandwidth: fewer leave the damping uncertain
POOR = 3.0  # times the noise that an identification leaves: its quantity may be wrong
FEW_LINES, FEW_CHANNELS = 300, 6  # on which readings of a recording are compared
STRONG = 3.0  # fall of χ² due to a mode over its required gain


def screened(
    recording: Recording,
    found: Identified | None = None,
    others: Sequence[Recording] = (),
    places: dict[str, np.ndarray] | None = None,
    use: np.ndarray | None = None,
    calmer: Sequence[Recording] = (),
    alone: bool = True,
    spurious: np.ndarray | None = None,
) -> Screening:
    """Screen a recording: channels, overload, levels, and phases of the modes.

    Parameters
    ----------
    found : modes identified from it, if known
    others : recordings of the same test, at the same level or others
    places : {output: (3,)} [m]
    use : (n_f,) bool, lines of that identification, default all; used again for a repetition
    calmer : more recordings of the test: a channel that works at a lower level is not dead
    alone : False where a model follows, which tells how the numbers are to be read
    spurious : (r,) bool, poles of ``found`` that are known to be no modes
    """
    frf = recording.frf
    if frf is None:
        return Screening(recording.name)
    alive = _alive_when_calm(recording, (*others, *calmer))
    findings, checks = channel_checks(frf, places, alive)
    if recording.time is not None:
        clipped = overloaded(recording.time)
        for name, blocks in clipped.items():
            text = f"{name} was overloaded: its signal is cut off in {blocks} blocks."
            mend = "choose a larger range of the front end and measure again"
            findings.append(Finding("overload", text, "fault", (name.split()[-1],), mend, blocks))
        checks.append(Check("overload", f"{len(clipped)} channels are cut off", not clipped))
        more, some = signal_checks(recording.time, frf)
        findings += more
        checks += some
        more, one = channel_delays(frf, found)
        findings += more
        checks.append(one)
    else:
        checks.append(Check("overload", "needs time data", None))
    more, check = levels_checked(recording, others)
    findings += more
    checks += check
    strong = None if found is None else strong_modes(found)
    read = other_readings(frf, strong, use) if strong is not None and alone else []
    if read:  # each output has other poles
        more, one = [], Check(ROVING, "needs the recording in its right reading", None)
    else:
        more, one = roving_mass(frf, found)
    findings += more
    checks.append(one)
    if found is not None and strong is not None:
        said = f"the identified modes leave {number(strong.chi, 3)} times the noise"
        failed = Check("phase of the modes", said, False)
        more, one = (read, failed) if read else _phases(frf, strong, use)
        findings += more
        checks.append(one)
        if not more:
            more, one = axis_check(frf, found, use)
            findings += more
            checks.append(one)
        real = True if spurious is None else ~spurious
        modes = found.sel(found.inside & found.firm & real)
        checks.append(_lines(modes, frf.frequency))
    return Screening(recording.name, tuple(findings), tuple(checks))


def _alive_when_calm(recording: Recording, others: Sequence[Recording]) -> set[str]:
    """Find outputs that work at a lower level and are as strong here: nonlinear, not dead."""
    frf, level, alive = recording.frf, recording.level, set[str]()
    for other in others:
        if frf is None or other.frf is None or level is None or other.level is None:
            continue
        if other.level >= level or other.article != recording.article:
            continue
        both = [o for o in frf.outputs if o in other.frf.outputs]
        if both and frf.inputs == other.frf.inputs and frf.quantity == other.frf.quantity:
            calm = other.frf.sel(outputs=both)
            silent = {c for f in dead(calm)[0] for c in f.channels}
            louder = _rms(frf.sel(outputs=both)) > _rms(calm) / LOUD
            alive |= {o for o, loud in zip(both, louder, strict=True) if loud} - silent
    return alive


def _otherwise(frf: FRF) -> Iterator[Misreading]:
    """Other quantities, the other sign of time, and other forms of complex numbers."""
    for q in QUANTITIES:
        if q != frf.quantity:
            mend = f'in case.toml, [test]: quantity = "{q}"'
            yield Misreading("wrong quantity", f"it were {q}", mend, ("quantity", q))
    mend = "in case.toml, [test]: conjugated = true"
    yield Misreading("conjugated FRFs", "it were conjugated", mend, ("conjugated",))
    yield from misreadings(frf)


def _rms(frf: FRF) -> np.ndarray:
    """Root mean square of each output over lines and inputs (n_out,)."""
    return np.sqrt((np.abs(frf.values) ** 2).mean(axis=(0, 2)))


def other_readings(frf: FRF, strong: Identified, use: np.ndarray | None) -> list[Finding]:
    """Identify a recording again in every other reading where its modes do not explain it.

    A passive structure has stable poles with real modal constants: the right reading leaves the
    noise alone.
    """
    if frf.quantity not in QUANTITIES or strong.chi <= POOR:
        return []
    f, (low, high) = frf.frequency, strong.band
    kept = np.flatnonzero((f >= low) & (f <= high) & (True if use is None else use))
    kept = kept[:: -(-len(kept) // FEW_LINES) or 1]
    loud = np.sort(np.argsort(-_rms(frf))[:FEW_CHANNELS])
    some, lines = frf.sel(outputs=[frf.outputs[k] for k in loud]), np.isin(np.arange(len(f)), kept)

    def modes(of: FRF) -> Identified:
        return strong_modes(identify(of, strong.band, use=lines))

    read = {error: modes(mapped(some, error.mend)) for error in _otherwise(frf)}
    return other_reading(modes(some), read)


def _phases(frf: FRF, strong: Identified, use: np.ndarray | None) -> tuple[list[Finding], Check]:
    """Check delay and quantity; in case of doubt, identify the recording again."""
    delay = hinted_delay(strong)
    if not delay:
        return phase_checks(strong)
    advance = np.exp(2j * np.pi * frf.frequency * delay)[:, None, None]
    again = identify(replace(frf, values=frf.values * advance), strong.band, use=use)
    return phase_checks(strong, strong_modes(again), delay)


def strong_modes(found: Identified) -> Identified:
    """Select the modes within the band that clearly exceed the noise."""
    sure = found.frequency_sd < 0.02 * found.frequency
    return found.sel(found.inside & sure & (found.relative_delta_chi2 > STRONG))


def _lines(found: Identified, frequency: np.ndarray) -> Check:
    """Check the number of lines per half-bandwidth of each mode; it is never a fault."""
    if not found.order:
        return Check("lines per half-bandwidth", "no mode is above the noise", None)
    n = lines_per_bandwidth(found, frequency)
    k = int(n.argmin())
    few = int((n < LINES).sum())
    said = (
        f"{n[k]:.2g} at {found.frequency[k]:.4g} Hz, {few} of {found.order} modes below {LINES:g}"
    )
    return Check("lines per half-bandwidth", said, few == 0)
