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
from .measured_frequencies import kept, widened
from .question import OtherTest, Prepared, Question
from .written_scores import gain_offset, seen

ALIKE = ("repeat", "article")  # relations whose differences are the spread of one test
WINDOW = 9  # lines over which a spread is averaged: a few half-bandwidths of the equalised lines


def others_identified(
    question: Question, band: tuple[float, float], progress: Progress = silent
) -> tuple[list[OtherTest], list[str]]:
    """Modes of the recordings that are not fitted, and a sentence on each without modes."""
    found, notes, n = list[OtherTest](), list[str](), len(question.others)
    for k, other in enumerate(question.others):
        frf, use = other.frf, kept(other.frf.frequency, question.exclude)
        part = within(progress, k / n, (k + 1) / n)
        try:
            found.append((other, identify(frf, widened(frf, band), use=use, progress=part)))
        except ChladniError as error:
            notes.append(f"{other.name} ({other.relation}) is not used: {error}")
    return found, notes


def levels(others: Sequence[OtherTest]) -> list[AtLevel]:
    """Recordings at another level of excitation, or repeats at the same level."""
    alike = (other for other in others if other[0].relation in ("level", "repeat"))
    return [AtLevel(r.level, r.frf, modes, r.control) for r, modes in alike]


def measured_spread(
    values: np.ndarray, others: Sequence[OtherTest], s: np.ndarray
) -> np.ndarray | None:
    """Standard deviation of log10 H between repeats and articles (n_s, n_out, n_in).

    The variance is taken about the mean of all K recordings, with K - 1 in the denominator, and
    averaged over neighbouring lines. Recordings are few, so it is half each channel's own and half
    the mean of all channels. None without repeats or articles.
    """
    alike = [equalised(modes, s) for other, modes in others if other.relation in ALIKE]
    if not alike:
        return None
    delta = np.array([np.zeros(values.shape), *(np.log(H / values) / LN10 for H in alike)])
    variance = (np.abs(delta - delta.mean(axis=0)) ** 2).sum(axis=0) / len(alike)
    own = _averaged(variance)
    return np.sqrt((own + own.mean(axis=(1, 2), keepdims=True)) / 2)


def _averaged(x: np.ndarray) -> np.ndarray:
    """Moving mean over the first axis, shorter at its ends."""
    total = np.cumsum(np.concatenate([np.zeros((1, *x.shape[1:])), x]), axis=0)
    k, half = np.arange(len(x)), WINDOW // 2
    low, high = np.maximum(k - half, 0), np.minimum(k + half + 1, len(x))
    return (total[high] - total[low]) / (high - low)[:, None, None]


def spread_note(data: Responses, others: Sequence[OtherTest]) -> list[str]:
    """Sentence on the measured spread over the samples in use; empty without a spread."""
    if data.spread is None:
        return []
    names = [other.name for other, _ in others if other.relation in ALIKE]
    rms = float(np.sqrt((data.spread[data.use] ** 2).mean()))
    return [
        f"{', '.join(names)} and the recording that is fitted differ by {rms:.2g} decades rms "
        "(one standard deviation): the fit need not be closer than that"
    ]


def scored_others(prepared: Prepared, stages: Sequence[Modelled]) -> tuple[RecordingScore, ...]:
    """Q of the nominal, calibrated and updated deck on every recording that was not fitted."""
    score = prepared.score
    if not isinstance(score, Responses) or not prepared.others:
        return ()
    held, f_max = prepared.held, prepared.problem.setup.f_max
    use = score.use | held.choosing | held.reporting
    own = {id(m): seen(prepared.question, score, m, f_max) for m in stages}
    out = []
    for other, modes in prepared.others:
        values = equalised(modes, score.s)
        apart = float((np.abs((np.log(values / score.values) / LN10)[use]) ** 2).mean())
        Q = []
        for model in stages:
            data, state = own[id(model)]
            assert isinstance(data, Responses)
            there = replace(data, values=values)
            offset = gain_offset(prepared, there, state)
            Q.append(there.Q(replace(state, offset=offset), use))
        out.append(RecordingScore(other.name, other.relation, apart, *Q))
    return tuple(out)
