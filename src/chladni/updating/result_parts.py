"""What a diagnosis says, part by part: effects, alternatives, calibrated values, the remainder."""

import numpy as np

from .diagnosis import Diagnosis, threshold
from .hypothesis_fit import Trial
from .likelihood import LN10, Poles
from .outcome import real_poles
from .question import Prepared
from .result import (
    Agreement,
    Alternative,
    CalibratedParameter,
    NamedEffect,
    Remainder,
    Scores,
)

STRUCTURED = 5.0  # times the spread of the recording: more than that is not noise


def named_effect(trial: Trial) -> NamedEffect:
    """The effect of a trial, where it is and how large."""
    effect, x = trial.effect, trial.fit.of(trial.effect)
    return NamedEffect(
        effect.name,
        effect.claim,
        -trial.S / 2,
        effect.location(x),
        effect.reported(x, trial.fit.sd(effect)),
    )


def alternatives(diagnosis: Diagnosis) -> tuple[Alternative, ...]:
    """Everything that was tried and is not the answer, with the reason; most probable first."""
    found = diagnosis.found
    best = found if found is not None else diagnosis.null
    out = [
        Alternative(
            trial.effect.name,
            -trial.S / 2,
            why_not(trial, best, found is not None, diagnosis.gain(trial)),
            trial.effect.location(trial.fit.of(trial.effect)),
        )
        for trial in diagnosis.trials
        if trial is not found
    ]
    if found is not None:
        gap = (diagnosis.null.S - best.S) / 2
        reason = f"E, rho and t alone are e^{gap:.0f} times less probable"
        out.append(Alternative("calibration only", -diagnosis.null.S / 2, reason))
    return tuple(sorted(out, key=lambda a: -(a.log_evidence or 0.0)))


def why_not(trial: Trial, best: Trial, named: bool, gain: float) -> str:
    """Why a hypothesis was not named, with a number."""
    if not named and gain > threshold():
        return f"gains {gain:.1f} in -2 ln evidence, but does not help on the data held out"
    if not named:
        return (
            f"gains {gain:.1f} in -2 ln evidence over plain calibration; "
            f"{threshold():.0f} are needed before anything is named"
        )
    gap = (trial.S - best.S) / 2
    return (
        f"e^{gap:.0f} times less probable than {best.effect.name}; leaves {trial.fit.misfit:.0f} "
        f"of weighted squares, {best.effect.name} {best.fit.misfit:.0f}"
    )


def agreement(
    prepared: Prepared, diagnosis: Diagnosis, fitted: Scores, held_out: Scores
) -> Agreement:
    """The scores, what was held out, and what the leading effect gained."""
    found = diagnosis.found
    last, what = found or diagnosis.null, prepared.what
    if last.effect.channels:
        what = f"channel {', '.join(last.effect.channels)} on the lines held out of {what}"
    gains = [diagnosis.gain(trial) for trial in diagnosis.trials]
    return Agreement(
        fitted,
        held_out,
        what,
        None if found is None else diagnosis.gain(found),
        max(gains, default=None),
        threshold(),
    )


def calibrated(diagnosis: Diagnosis) -> tuple[CalibratedParameter, ...]:
    """Ordinary parameters of the deck that is written, beside the values of the deck given."""
    deck = diagnosis.written or diagnosis.found or diagnosis.plain
    out = []
    for effect in (e for e in deck.fit.effects if e.kind == "ordinary"):
        rows = effect.reported(deck.fit.of(effect), deck.fit.sd(effect))
        for parameter, row in zip(effect.parameters, rows, strict=True):
            given = parameter.value(parameter.mean)
            called = getattr(effect, "called", "")  # by the user
            where = f"{called}: {effect.text}" if called not in ("", row.name) else effect.text
            out.append(CalibratedParameter(where, row, given))
    return tuple(out)


def remainder(prepared: Prepared, diagnosis: Diagnosis) -> Remainder:
    """Is what calibration leaves structure or noise: its rms over the recording's own spread."""
    plain = diagnosis.plain
    if isinstance(prepared.score, Poles):
        real = real_poles(prepared, diagnosis.found or diagnosis.null)
        assert real is not None
        if not real.any():
            return Remainder(False, np.nan, np.nan, "no pole has a partner in the model")
        left = 100 * float(np.sqrt(prepared.score.Q(plain.fit.state, real, real))) * LN10
        known = 100 * float(np.median(prepared.score.sd[real]))
        text = f"{left:.2g} % rms of the frequencies, which are known to {known:.1g} %"
    else:
        data = prepared.score.over(plain.model)
        left = float(np.sqrt(data.Q(plain.fit.state, prepared.score.use)))
        chi = 1.0 if prepared.identified is None else prepared.identified.chi
        known = 0.01 * chi / LN10
        text = f"{left:.2g} decades rms, the recording is known to about {known:.1g}"
    far = left > STRUCTURED * known
    structured = bool(far and diagnosis.found is not None)
    sentence = f"ordinary parameters alone leave {text}: {_meaning(diagnosis, far, structured)}"
    return Remainder(structured, left, known, sentence)


def _meaning(diagnosis: Diagnosis, far: bool, structured: bool) -> str:
    if structured:
        return "that is structured, not noise"
    if not far:
        return "nothing more can be read from that"
    if diagnosis.trials:
        return "mesh error and scatter within the parts account for it as well as any effect tried"
    return "more than noise; a diagnosis says whether physics is missing"
