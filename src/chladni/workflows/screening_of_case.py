"""The compared recording of a case, screened alone and against the model, before any fit."""

from dataclasses import replace

import numpy as np

from ..case import Case
from ..effects.channels import GaugeErrors
from ..effects.estimate import Estimate, Location
from ..ema.finding import Check, Finding, Screening, Severity
from ..ema.identification import Identified, identify
from ..ema.recording_screening import screened
from ..errors import ChladniError
from ..fem.energy import mass_properties
from ..fem.modelled import Modelled, modelled
from ..inference.chain_hypotheses import NOTHING_FITS, explains
from ..inference.channel_screening import against_model, shapes_against_model
from ..inference.map_fit import Fit
from ..inference.pole_data import Poles
from ..inference.result import NamedEffect
from ..inference.sensor_errors import gauge_errors
from ..inference.smoothed_responses import Reading
from ..model.point_masses import with_mass_pairs
from ..search.question import Prepared
from .case_model import REACH
from .diagnosis_result import DiagnosisResult
from .sign_of_gain import with_sign_of_gain

HEAVY = 0.1  # of the structure: sensors seldom weigh more
POUND, NEAR_POUND = 0.45359237, 0.1  # [kg], ln: what no scatter of sheets reaches
FITTED = ("reversed sign",)  # of one channel: diagnosis weighs and measures it


class RecordingAtFault(ChladniError):
    """A recording that is to be mended before anything is fitted to it."""

    def __init__(self, screening: Screening) -> None:
        super().__init__(screening.sentence)
        self.screening = screening


def screened_by_model(
    case: Case, found: Identified | None, model: Modelled, use: np.ndarray | None = None,
    above: float = 0.0,
) -> Screening:  # fmt: skip
    """All checks of the first recording, and of the masses that the case gives.

    Parameters
    ----------
    found : identified from its FRFs; None where nothing could be
    model : of the deck as it was tested
    use : (n_f,) bool, lines it was identified from, default all
    above : frequency from which on responses are compared with the model [Hz]
    """
    frf = case.frfs[0]
    lines = (case.lines(frf.frequency) if use is None else use) & (frf.frequency > above)
    places = dict(zip(case.outputs.labels, case.outputs.points, strict=True))
    alone = screened(case.recordings[0], found, case.recordings[1:], places, use, alone=False)
    reading = Reading(frf, lines, model, case.outputs, case.inputs)
    if masses := _masses(case, reading):
        return alone.with_more(masses, [Check("given masses", "check them", False)])
    return against_model(alone, reading, found, case.gain_known)


def _masses(case: Case, reading: Reading) -> list[Finding]:
    """Report sensors in grams and a weighing in pounds, if the responses show it."""
    deck = float(mass_properties(case.assembly)[0])
    sensor_masses = sum(m for _, m in case.sensor_masses)
    found, weighed = [], case.setup.mass
    seen, model = reading.smoothed(), reading.model
    Q, level = (np.nan, np.nan) if seen is None else seen.as_declared
    if sensor_masses > HEAVY * deck:
        light = modelled(with_mass_pairs(case.assembly, case.sensor_masses, 1e-3), model.band)
        other = replace(reading, model=light).smoothed()
        less = np.nan if other is None else other.as_declared[0]
        grams = explains(less, Q)
        said = f"the sensors weigh {sensor_masses:.3g} kg in all, the structure {deck:.3g} kg"
        if grams:
            said += (
                f"; with a thousandth of that, smoothed Q against the model is {less:.2g}, as "
                f"given {Q:.2g}"
            )
        if grams or sensor_masses > deck:
            heaviest = max(m for _, m in case.sensor_masses)
            mend = f"mass in sensors.csv is in kg: write {heaviest / 1e3:.3g} for {heaviest:.3g} g"
            severity: Severity = "fault" if grams else "warning"
            found.append(Finding("sensor mass", f"{said}.", severity, (), mend, sensor_masses))
    if weighed and in_pounds(deck, weighed) and not found:
        said = (
            f"the article weighs {weighed:.4g} kg, the deck {deck:.4g} kg, and the responses are "
            f"{level:.3g} times the model's: {weighed:.4g} lb are {weighed * POUND:.4g} kg"
        )
        mend = f"in case.toml, [test]: mass = {weighed * POUND:.5g}"
        if abs(np.log(level)) < abs(np.log(level / POUND)) and case.gain_known:
            found.append(Finding("weighed mass", f"{said}.", "fault", (), mend, weighed))
    return found


def in_pounds(deck: float, weighed: float) -> bool:
    """Return True if the weighed mass equals the deck's [kg] when read as pounds."""
    return deck > 0 and abs(np.log(deck / (POUND * weighed))) < NEAR_POUND


def screened_prepared(
    case: Case, prepared: Prepared, use: np.ndarray | None = None
) -> Screening | None:
    """Screen with the poles and modes prepared for a diagnosis; None of frequencies alone.

    Parameters
    ----------
    use : (n_f,) bool, lines they were identified from, default all
    """
    if isinstance(prepared.score, Poles) and (shapes := prepared.score.shapes) is not None:
        f, name = prepared.score.frequency, case.recordings[0].name
        return shapes_against_model(name, shapes.values.T, f, prepared.nominal, case.outputs)
    if not case.frfs or prepared.identified is None:
        return None
    return screened_by_model(case, prepared.identified, prepared.nominal, use, prepared.above)


def screened_unprepared(case: Case) -> Screening | None:
    """Screen the first recording when its preparation failed; None without an FRF."""
    if not case.frfs:
        return None
    case = with_sign_of_gain(case)
    frf = case.frfs[0]
    try:
        found = identify(frf, case.band, use=case.lines(frf.frequency))
    except ChladniError:
        found = None
    high = case.band[1] if case.band else float(frf.frequency[-1])
    return screened_by_model(case, found, modelled(case.tested(case.assembly), REACH * high))


def settled(case: Case, screening: Screening, above: float, after: Modelled, fit: Fit) -> Screening:
    """The screening without interpretations that leave more of Q than a diagnosis does.

    Parameters
    ----------
    above : frequency from which on responses are compared with the model [Hz]
    after : the deck with all that was found
    fit : of it, with the usual errors of the place and direction of each force

    Raises
    ------
    RecordingAtFault
        If an interpretation of the recording leaves less.
    """
    doubted = [f for f in screening.findings if f.left is not None]
    if not doubted:
        return screening
    frf = case.frfs[0]
    lines = case.lines(frf.frequency) & (frf.frequency > above)
    seen = Reading(frf, lines, after, case.outputs, case.inputs).smoothed()
    if seen is None:
        return screening
    seen = replace(seen, drive=seen.drive + _gauges(case, after, fit))
    kept = []
    for f in screening.findings:
        if f.left is None:
            kept.append(f)
            continue
        left, over = f.left
        Q = min(seen.score(H, over=over) for H in seen.answers())
        if left < Q:
            text = f"{f.text.rstrip('.')}; the best deck without this error leaves {Q:.2g}."
            kept.append(replace(f, severity="fault", text=text))
    checked = replace(screening, findings=tuple(kept))
    if checked.faults and unmendable(checked):
        raise RecordingAtFault(checked)
    return checked


def _gauges(case: Case, after: Modelled, fit: Fit) -> np.ndarray:
    """Change of the loads of the inputs (n_in, r) by the fitted errors of their gauges."""
    change = np.zeros((len(case.inputs.labels), len(after.modes)))
    fitted = [fit.of(e) for e in fit.effects if isinstance(e, GaugeErrors)]
    made = gauge_errors(case.outputs, case.inputs, after.structure, case.setup.accuracy)
    for j, e, x in zip(np.flatnonzero(~case.inputs.base), made, fitted, strict=False):
        change[j] = sum(v * (row @ after.modes.shapes)[0] for v, row in zip(x, e.rows, strict=True))
    return change


def unmendable(screening: Screening) -> bool:
    """Return True if a fault was found that a fit alone cannot compensate."""
    faults = screening.faults
    return len(faults) > 1 or any(f.kind not in FITTED for f in faults)


def unlike(result: DiagnosisResult, screening: Screening | None) -> tuple[str, ...]:
    """Return a doubt where the recording fits nothing, and the result explains less than half."""
    fits_nothing = screening is not None and any(f.kind == NOTHING_FITS for f in screening.findings)
    fit = None if result.agreement is None else result.agreement.fitted
    if not fits_nothing or fit is None or fit.nominal is None or fit.after is None:
        return ()
    if explains(fit.after, fit.nominal):
        return ()
    return (
        f"recording and model are unlike and stay so (Q {fit.nominal:.2g} before, {fit.after:.2g} "
        "after): places, supports or the recording may be wrong",
    )


def instead_of_effects(verdict: str, screening: Screening | None) -> tuple[str, ...]:
    """Return doubts about a verdict without a cause, if the recording itself looks wrong."""
    if verdict != "not in catalogue" or screening is None or not screening.findings:
        return ()
    return (f"{screening.sentence}: this may be the unexplained part",)


def at_fault(case: Case, screening: Screening, diagnosing: bool) -> DiagnosisResult:
    """Return the result for a recording that must be corrected first; no effect is named."""
    tried = any(f.left is not None for f in screening.faults)
    begin = "Effects were tried, but none is named" if tried else "Nothing was fitted"
    note = (
        f"{begin}: an effect found in a faulty recording may be the fault itself. "
        "Correct the recording or measure again, and repeat the diagnosis."
    )
    command = "diagnose" if diagnosing else "calibrate"
    return DiagnosisResult(
        verdict="measurement fault",
        effects=tuple(_named(f) for f in screening.faults),
        notes=(*screening.notes, note, *case.said(command)),
        distrust=() if diagnosing else (f"{screening.sentence}; nothing was calibrated",),
        searched=diagnosing,
        screening=screening,
    )


def _named(fault: Finding) -> NamedEffect:
    size = () if np.isnan(fault.value) else (Estimate(fault.kind, float(fault.value)),)
    where = Location(fault.text.rstrip("."), channels=fault.channels)
    return NamedEffect("sensor-fault", fault.kind, None, where, size)
