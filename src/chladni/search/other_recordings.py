"""Further recordings of the same test, which are not fitted.

Repeats and articles give the measured spread, below which a fit need not go. Levels show whether
natural frequencies move with the excitation. All of them score the decks.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..ema.identification import equalised, identify
from ..ema.level_modes import AtLevel
from ..errors import ChladniError
from ..fem.modelled import Modelled
from ..inference.likelihood import LN10, Responses
from ..inference.result import RecordingScore
from ..progress import Progress, silent, within
from .measured_frequencies import counted, widened
from .question import OtherTest, Prepared, Question
from .written_scores import gain_offset, seen

ALIKE = ("repeat", "article")  # relations whose differences are the spread of one test
WINDOW = 9  # lines over which a spread is averaged: a few half-bandwidths of the equalised lines


def others_identified(
    question: Question, band: tuple[float, float], progress: Progress = silent
) -> tuple[list[OtherTest], list[str]]:
    """Modes of the recordings that are not fitted, and a sentence on each without modes."""
    found, notes = [], []
    n = len(question.others)
    for k, other in enumerate(question.others):
        frf, use = other.frf, counted(other.frf, question.exclude)
        part = within(progress, k / n, (k + 1) / n)
        try:
            modes = identify(frf, widened(frf, band), use=use, progress=part)
        except ChladniError as error:
            notes.append(f"{other.name} ({other.relation}) is not used: {error}")
            continue
        found.append(OtherTest(other, modes))
    return found, notes


def levels(others: Sequence[OtherTest]) -> list[AtLevel]:
    """Recordings at another level of excitation, or repeats at the same level."""
    alike = [o for o in others if o.recording.relation in ("level", "repeat")]
    return [
        AtLevel(o.recording.level, o.recording.frf, o.identified, o.recording.control)
        for o in alike
    ]


def measured_spread(
    values: np.ndarray, others: Sequence[OtherTest], s: np.ndarray
) -> np.ndarray | None:
    """Standard deviation of log10 H between repeats and articles (n_s, n_out, n_in).

    The variance is taken about the mean of all K recordings, with K - 1 in the denominator, and
    averaged over neighbouring lines. Recordings are few, so it is half each channel's own and half
    the mean of all channels. None without repeats or articles.
    """
    alike = [equalised(o.identified, s) for o in others if o.recording.relation in ALIKE]
    if not alike:
        return None
    delta = np.array([np.zeros(values.shape), *(_apart(values, H) for H in alike)])
    variance = (np.abs(delta - delta.mean(axis=0)) ** 2).sum(axis=0) / len(alike)
    own = _averaged(variance)
    return np.sqrt((own + own.mean(axis=(1, 2), keepdims=True)) / 2)


def _apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """log10(b / a), phase wrapped."""
    return np.log(b / a) / LN10


def _averaged(x: np.ndarray) -> np.ndarray:
    """Moving mean over the first axis, shorter at its ends."""
    total = np.cumsum(np.concatenate([np.zeros((1, *x.shape[1:])), x]), axis=0)
    k, half = np.arange(len(x)), WINDOW // 2
    low, high = np.maximum(k - half, 0), np.minimum(k + half + 1, len(x))
    return (total[high] - total[low]) / (high - low)[:, None, None]


def spread_note(
    spread: np.ndarray | None, use: np.ndarray, others: Sequence[OtherTest]
) -> list[str]:
    """Sentence on the measured spread over the samples in use; empty without a spread."""
    names = [o.recording.name for o in others if o.recording.relation in ALIKE]
    if spread is None:
        return []
    rms = float(np.sqrt((spread[use] ** 2).mean()))
    return [
        f"{', '.join(names)} and the recording that is fitted differ by {rms:.2g} decades rms "
        "(one standard deviation): the fit need not be closer than that"
    ]


def scored_others(prepared: Prepared, stages: Sequence[Modelled]) -> tuple[RecordingScore, ...]:
    """Q of the nominal, calibrated and updated deck on every recording that was not fitted."""
    score = prepared.score
    if not isinstance(score, Responses) or not prepared.others:
        return ()
    use = score.use | prepared.held.whole
    f_max = prepared.problem.setup.f_max
    own = {id(m): seen(prepared.question, score, m, f_max) for m in stages}
    out = []
    for other in prepared.others:
        values = equalised(other.identified, score.s)
        apart = float((np.abs(_apart(score.values, values)[use]) ** 2).mean())
        Q = []
        for model in stages:
            data, state = own[id(model)]
            assert isinstance(data, Responses)
            there = replace(data, values=values)
            offset = gain_offset(prepared, there, state)
            Q.append(there.Q(replace(state, offset=offset), use))
        name, relation = other.recording.name, other.recording.relation
        out.append(RecordingScore(name, relation, apart, *Q))
    return tuple(out)
