"""Errors of a whole recording, each tried against the responses of the model.

Both sides are smoothed along frequency (:mod:`.smoothed_responses`). A hypothesis changes how the
numbers are read: another quantity, another unit of frequency, the other sign of time, other labels,
another place of the force. It is scored by

Q = median over channels of mean over lines |log10(H_model / g H_test)|²,

phase wrapped, g the median level, least over a common factor of the model's frequencies. Physics
that the model lacks hardly changes under any of them; the one error that there is takes most of Q.
No hypothesis is proposed that leaves more. Where Q as declared is small, a place or labels chosen
among hundreds are a warning, and a diagnosis compares them with the physics that it finds. Where
none takes it and the responses are unlike the model's, that is said instead.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..dynamics.frf import FRF
from ..ema.chain_checks import LEAST_MODES, QUANTITIES
from ..ema.finding import Check, Finding
from ..ema.frf_maps import Misreading, mapped, misreadings
from ..ema.shape_faults import LEAST_CHANNELS
from ..fem.measured_dofs import MeasuredDofs
from ..units import HERTZ
from .place_hypotheses import driven_elsewhere, mirrored, relabelled, two_forces
from .smoothed_responses import (
    CHANCE,
    EXPLAINED,
    Hypothesis,
    Reading,
    Smoothed,
    against,
    log10_of,
    mean_squares,
)

REACH = 2.0  # times the highest line: modes the model must have
BEYOND_DOUBT = 1 / 2  # of Q of the next best interpretation, at most, before a map is applied
STIFFNESS = tuple(np.arange(-0.5, 0.51, 0.06))  # ln of frequencies: what E and rho may be off by
NOTHING_FITS = "nothing fits"  # no interpretation of the recording does
FLAT = 1e-3  # of Q: responses that vary by 7 % about a power of frequency show no mode


def chain_faults(reading: Reading, before: Sequence[Finding] = ()) -> tuple[list[Finding], Check]:
    """The error of a whole recording that explains most of how far it is from the model.

    Named is the best one, where it :func:`explains` Q as declared.

    Parameters
    ----------
    before : what the recording says of itself. A delay is one more hypothesis, known without the
        model.
    """
    name = "the chain against the model"
    seen = reading.smoothed()
    if seen is None:
        return [], Check(name, "too few lines or modes", None)
    declared, _ = seen.as_declared
    tried = other_readings(seen, before)
    best = min(tried, key=lambda h: h.share)
    late = [h for h in tried if h.finding.kind == "delay" and h.share <= 1]
    said = (
        f"smoothed Q {declared:.2g} as declared, {best.Q:.2g} for the best of {len(tried)} other "
        "interpretations"
    )
    answers = without_modes(reading.frf, reading.lines) > FLAT
    answers &= min(_beyond_power(H, seen.weights @ seen.f) for H in seen.answers()) > FLAT
    named = [best] if explains(best.Q, best.declared) and answers else late
    findings = [_doubted(_applicable(h, tried)) for h in sorted(named, key=lambda h: h.share)[:1]]
    if not findings and answers and declared > EXPLAINED * CHANCE:
        stiffness = min(map(seen.score, seen.answers(shifts=STIFFNESS)))
        findings = [_nothing_fits(declared, best)] if stiffness > EXPLAINED * CHANCE else []
    return findings, Check(name, said, not findings)


def _applicable(best: Hypothesis, tried: Sequence[Hypothesis]) -> Hypothesis:
    """Drop the map of an error from its finding unless all others explain much less."""
    others = [h.Q for h in tried if h is not best and h.finding.mend != best.finding.mend]
    if best.Q < BEYOND_DOUBT * min(others, default=np.inf):
        return best
    return replace(best, finding=replace(best.finding, mend=()))


def _doubted(named: Hypothesis) -> Finding:
    """The finding; a warning where the responses as declared are like those of the model.

    Among so many places and labels one always leaves less of a small Q than those declared. Physics
    that the model lacks may leave less still, and only a diagnosis tries it. An error that a map of
    the numbers undoes was not chosen among many.
    """
    found, unlike = named.finding, named.declared > EXPLAINED * CHANCE
    if unlike or found.mend or found.kind == "delay":
        return found
    return replace(found, severity="warning", left=(named.Q, named.over))


def _nothing_fits(declared: float, best: Hypothesis) -> Finding:
    text = (
        f"recording and model are unlike: smoothed Q is {declared:.2g} where responses with random "
        f"phases have {CHANCE:.2g}, and no other interpretation of the recording fits (the best, "
        f"{best.finding.kind}, {best.Q:.2g})."
    )
    mend = (
        "check in this order: supports of the deck, places and directions of sensors and force, "
        "the force of each output, phases in the file"
    )
    return Finding(NOTHING_FITS, text, "warning", (), mend, declared)


def without_modes(frf: FRF, lines: np.ndarray) -> float:
    """Q of the recording against a power of frequency, another one for each channel.

    Below all modes a structure is rigid, and interpretations cannot be distinguished. This
    holds for the recording as for the model.
    """
    k = lines & (frf.frequency > 0)
    return _beyond_power(frf.values[k], frf.frequency[k])


def _beyond_power(H: np.ndarray, f: np.ndarray) -> float:
    """Q of responses (n_f, ...) against powers of f: the median of the channels."""
    x, level = np.stack([np.ones(len(f)), np.log(f)], axis=1), log10_of(np.abs(H))
    level = level.reshape(len(f), -1)
    return float(np.median(mean_squares(level - x @ np.linalg.lstsq(x, level, rcond=None)[0])))


def explains(Q: float, declared: float) -> bool:
    """True if an error leaves so little of Q as declared that it is named.

    Much is left of responses that are not those of the model, whichever way they are read.
    """
    return Q < EXPLAINED * min(declared, CHANCE)


def other_readings(seen: Smoothed, before: Sequence[Finding] = ()) -> list[Hypothesis]:
    """Every error that is tried."""
    tried = [*_read_otherwise(seen)]
    for late in (f for f in before if f.kind == "delay"):
        Q = min(map(seen.score, seen.answers(delay=late.value)))
        tried.append(Hypothesis(Q, seen.as_declared[0], late))
    inside = (seen.omega > 0) & (seen.omega <= 2 * np.pi * seen.f[-1])
    if len(seen.reading.outputs.labels) >= LEAST_CHANNELS and inside.sum() >= LEAST_MODES:
        swaps = relabelled(seen)
        mixed = two_forces(seen)
        tried += swaps
        tried += driven_elsewhere(seen)
        rivals = [h.Q for h in swaps if h.share < EXPLAINED]  # simpler, where they explain it
        tried += [h for h in mixed if h.Q < BEYOND_DOUBT * min(rivals, default=np.inf)]
        tried += mirrored(seen)
    return tried


def _read_otherwise(seen: Smoothed) -> Iterator[Hypothesis]:
    """Another quantity, sign, direction of time, form of complex numbers or unit of frequency."""
    reading, (declared, _) = seen.reading, seen.as_declared
    frf = reading.frf

    def of(Q: float, error: Misreading) -> Hypothesis:
        said = f"{error.text}: with this interpretation {against(Q, declared)}"
        found = Finding(error.kind, said, "fault", (), error.repair, mend=error.mend)
        return Hypothesis(Q, declared, found)

    for error in (*_of_chain(frf, reading.inputs), *misreadings(frf)):
        read = replace(reading, frf=mapped(frf, error.mend)).smoothed()
        if read is not None:
            yield of(min(map(read.score, read.answers())), error)
    for unit, scale in HERTZ.items():
        reached = (frf.frequency > 0) & (REACH * scale * frf.frequency <= reading.model.band)
        if scale == 1 or (all_lines := replace(reading, lines=reached).smoothed()) is None:
            continue
        Q = min(map(all_lines.score, all_lines.answers(scale=scale)))
        mend = f'in case.toml, [test]: frequency_unit = "{unit}"'
        unit_error = Misreading("wrong unit of frequency", f"the declared Hz are {unit}", mend, ())
        yield of(Q, unit_error)


def _of_chain(frf: FRF, inputs: MeasuredDofs) -> Iterator[Misreading]:
    """Another quantity, sign or direction of time."""
    for other in (q for q in QUANTITIES if frf.quantity in QUANTITIES and q != frf.quantity):
        mend = f'in case.toml, [test]: quantity = "{other}"'
        text = f"the declared {frf.quantity} is {other}"
        yield Misreading("wrong quantity", text, mend, ("quantity", other))
    mend = f"in sensors.csv reverse the direction of input {inputs.labels[0]}"
    text = "the force gauge (or every sensor) is reversed"
    yield Misreading("reversed force", text, mend, ("factor", "-1"))
    text = "the FRFs are conjugated: their phase has the wrong sign (exp(-iωt) for exp(iωt))"
    mend = "in case.toml, [test]: conjugated = true"
    yield Misreading("conjugated FRFs", text, mend, ("conjugated",))
