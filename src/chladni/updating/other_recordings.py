"""Recordings of the same test that no fit is made to: what they say of the one that is fitted.

Repeats and articles give the spread below which no fit is asked to go; levels tell whether natural
frequencies move with the excitation; all of them score the decks.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ema.identification import Identified, equalised, identify
from ..errors import ChladniError
from ..fem.modelled import Modelled
from .likelihood import LN10, Responses
from .measured_frequencies import LEAST_DELTA_CHI2, counted, widened
from .question import OtherRecording, Prepared, Question
from .result import RecordingScore
from .written_scores import gain_offset, seen

ALIKE = ("repeat", "article")  # whose differences are the spread of one test
WINDOW = 9  # lines over which a spread is averaged: a few half-bandwidths of the equalised lines
PARTNER = 0.05  # of a frequency: farther away is another mode
MOVED = 1e-3, 4.0  # a frequency has moved: by this share of it and this many standard deviations


@dataclass(frozen=True, eq=False)
class OtherTest:
    """Another recording with its modes."""

    recording: OtherRecording
    identified: Identified


def others_identified(
    question: Question, band: tuple[float, float]
) -> tuple[list[OtherTest], list[str]]:
    """Modes of the recordings that are not fitted, and a sentence on each that has none."""
    found, notes = [], []
    for other in question.others:
        frf = other.frf
        try:
            modes = identify(frf, widened(frf, band), use=counted(frf, question.exclude))
        except ChladniError as error:
            notes.append(f"{other.name} ({other.relation}) is not used: {error}")
            continue
        found.append(OtherTest(other, modes))
    return found, notes


def measured_spread(
    values: np.ndarray, others: Sequence[OtherTest], s: np.ndarray
) -> np.ndarray | None:
    """Standard deviation of log10 H between repeats and articles (n_s, n_out, n_in).

    Around the mean of all, K - 1 in the denominator, averaged over neighbouring lines; of so few
    recordings half of each channel's own and half of what all channels have. None without any.
    """
    alike = [equalised(o.identified, s) for o in others if o.recording.relation in ALIKE]
    if not alike:
        return None
    delta = np.array([np.zeros(values.shape), *(_apart(values, H) for H in alike)])
    variance = (np.abs(delta - delta.mean(axis=0)) ** 2).sum(axis=0) / len(alike)
    own = _averaged(variance)
    return np.asarray(np.sqrt((own + own.mean(axis=(1, 2), keepdims=True)) / 2))


def _apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """log10(b / a), phase wrapped."""
    return np.asarray(np.log(b / a) / LN10)


def _averaged(x: np.ndarray) -> np.ndarray:
    """Moving mean over the first axis, shorter at its ends."""
    total = np.cumsum(np.concatenate([np.zeros((1, *x.shape[1:])), x]), axis=0)
    k, half = np.arange(len(x)), WINDOW // 2
    low, high = np.maximum(k - half, 0), np.minimum(k + half + 1, len(x))
    return np.asarray((total[high] - total[low]) / (high - low)[:, None, None])


def spread_note(
    spread: np.ndarray | None, use: np.ndarray, others: Sequence[OtherTest]
) -> list[str]:
    """A sentence on the spread that was measured, on the samples in use."""
    names = [o.recording.name for o in others if o.recording.relation in ALIKE]
    if spread is None:
        return []
    rms = float(np.sqrt((spread[use] ** 2).mean()))
    return [
        f"{', '.join(names)} and the recording that is fitted differ by {rms:.2g} decades rms (one "
        "standard deviation): no fit is asked to go below that"
    ]


def level_notes(question: Question, fitted: Identified, others: Sequence[OtherTest]) -> list[str]:
    """Whether natural frequencies move with the level of excitation."""
    levels = [(question.level, fitted)]
    levels += [(o.recording.level, o.identified) for o in others if o.recording.relation == "level"]
    known = [(level, found) for level, found in levels if level is not None]
    if len(known) < 2:
        return []
    known = sorted(known, key=lambda pair: pair[0])
    unit = "m/s²" if question.base is not None else "N"
    tracks = [_track(fitted, int(k), known) for k in np.flatnonzero(_clear(fitted))]
    moved = [t for t in tracks if _moves(t)]
    said = ", ".join(f"{level:g}" for level, _ in known)
    if not moved:
        return [f"no natural frequency moves with level ({said} {unit})"]
    rows = [
        ", ".join(f"{f:.5g} Hz at {level:g} {unit}" for level, f, _ in track) for track in moved
    ]
    return [f"nonlinear: natural frequencies move with level: {'; '.join(rows)}"]


Track = list[tuple[float, float, float]]  # (level, frequency, its standard deviation)


def _clear(found: Identified) -> np.ndarray:
    """Modes that stand out (r,)."""
    return np.asarray(found.inside & (found.relative_delta_chi2 > LEAST_DELTA_CHI2))


def _track(fitted: Identified, mode: int, known: Sequence[tuple[float, Identified]]) -> Track:
    """A mode of the fitted recording at every level where it has a partner."""
    f, out = fitted.frequency[mode], []
    for level, found in known:
        near = np.flatnonzero(_clear(found))
        if not len(near):
            continue
        k = near[np.abs(np.log(found.frequency[near] / f)).argmin()]
        if abs(np.log(found.frequency[k] / f)) < PARTNER:
            out.append((level, float(found.frequency[k]), float(found.frequency_sd[k])))
    return out


def _moves(track: Track) -> bool:
    """Whether the frequencies of a mode differ by more than they are known."""
    (_, f, sd), away = track[0], np.array(track)
    change = np.abs(away[:, 1] - f)
    return bool(np.any(change > np.maximum(MOVED[0] * f, MOVED[1] * np.hypot(away[:, 2], sd))))


def scored_others(
    question: Question, prepared: Prepared, stages: Sequence[Modelled]
) -> tuple[RecordingScore, ...]:
    """Q of the nominal, calibrated and updated deck on every recording that was not fitted."""
    score = prepared.score
    if not isinstance(score, Responses) or not prepared.others:
        return ()
    use = score.use | prepared.held
    f_max = prepared.problem.setup.f_max
    own = {id(m): seen(question, score, m, f_max) for m in stages}
    out = []
    for other in prepared.others:
        values = equalised(other.identified, score.s)
        apart = float((np.abs(_apart(score.values, values)[use]) ** 2).mean())
        Q = []
        for model in stages:
            data, state = own[id(model)]
            assert isinstance(data, Responses)
            there = replace(data, values=values)
            offset = gain_offset(question, prepared, there, state)
            Q.append(there.Q(replace(state, offset=offset), use))
        name, relation = other.recording.name, other.recording.relation
        out.append(RecordingScore(name, relation, apart, *Q))
    return tuple(out)
