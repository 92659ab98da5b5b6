"""Curves, matrices and bars with values under the pointer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..dynamics.frf import UNIT
from .drawings import rounded

if TYPE_CHECKING:
    from ..dynamics.frf import FRF
    from ..inference.result import Alternative, FrequencyRow, NamedEffect, Scores
    from .shown import Shown

_VALUES = 1_200_000  # complex numbers on a page: about 5 MB
_LINES = 300  # at least, of every channel
_LOG_STEP, _DEGREE = 1e-3, 1.0  # a thousandth of a decade; a degree


def frf(shown: Shown, share: int = 1) -> dict[str, Any]:
    """Magnitude, phase and coherence of every channel, and the deviation of each curve.

    ``share`` is the number of such drawings on the page.
    """
    curves, held = dict(shown.curves), set(shown.held_out)
    test = curves.get("test", next(iter(curves.values())))
    channels = [(i, j) for j in range(len(test.inputs)) for i in range(len(test.outputs))]
    per_channel = _VALUES // len(curves) // share
    lines = thinned(test, max(_LINES, per_channel // len(channels)))
    off = {name: _off(curve, test) for name, curve in curves.items() if curve is not test}
    last = list(off.values())[-1] if off else np.abs(test.values).max(axis=0)
    room = max(1, per_channel // len(lines))
    if len(channels) > room:  # the worst ones are looked for, of one curve the largest
        order = sorted(channels, key=lambda c: -last[c])
        channels = sorted(order[:room], key=lambda c: c[::-1])
    return {
        "frequency": [float(f"{f:.7g}") for f in test.frequency[lines]],
        "channels": [
            {
                "name": f"{test.outputs[i]} from {test.inputs[j]}",
                "held": test.outputs[i] in held,
                "off": {name: float(f"{q[i, j]:.3g}") for name, q in off.items()},
                "curves": {name: _polar(c.values[lines, i, j]) for name, c in curves.items()},
                "coherence": _coherence(test, lines, i, j),
            }
            for i, j in channels
        ],
        "unit": UNIT.get(test.quantity, ""),
        "quantity": test.quantity,
        "fitted": [list(band) for band in shown.fitted],
        "excluded": [list(band) for band in shown.excluded],
        "lines": [len(lines), len(test.frequency)],
        "of": len(test.outputs) * len(test.inputs),
    }


def thinned(frf: FRF, most: int) -> np.ndarray:
    """Positions of at most ``most`` lines: of every block the highest and the lowest."""
    return extremes(np.log(np.maximum((np.abs(frf.values) ** 2).sum(axis=(1, 2)), 1e-300)), most)


def extremes(values: np.ndarray, most: int) -> np.ndarray:
    """Positions of at most ``most`` values (n,): of every block the highest and the lowest."""
    if len(values) <= most:
        return np.arange(len(values))
    ends = np.linspace(0, len(values), most // 2 + 1).astype(int)
    blocks = list(pairwise(ends))
    picked = [a + int(pick(values[a:b])) for a, b in blocks for pick in (np.argmin, np.argmax)]
    return np.unique(picked)


def _coherence(test: FRF, lines: np.ndarray, i: int, j: int) -> list[Any] | None:
    """Coherence of a channel in thousandths."""
    return None if test.coherence is None else rounded(test.coherence[lines, i, j], 1e-3)


def _off(curve: FRF, test: FRF) -> np.ndarray:
    """Q of every channel (n_out, n_in); 0 where a response is exactly zero, as at a support."""
    from ..ema.correlation import deviation

    out = np.zeros(test.values.shape[1:])
    alive = np.flatnonzero((test.values * curve.values).all(axis=(0, 2)))
    if len(alive):
        names = [test.outputs[k] for k in alive]
        with np.errstate(invalid="ignore"):
            q = np.abs(deviation(curve.sel(names), test.sel(names))) ** 2
            out[alive] = np.nan_to_num(np.nanmean(q, axis=0))
    return out


def _polar(H: np.ndarray) -> list[list[int | None]]:
    """log10 |H| and the phase, None where H is zero."""
    size = np.abs(H)
    with np.errstate(divide="ignore", invalid="ignore"):
        level = np.where(size > 0, np.log10(size), np.nan)
    return [rounded(level, _LOG_STEP), rounded(np.degrees(np.angle(H)), _DEGREE)]


def mac_map(
    test: np.ndarray, found: Mapping[str, tuple[np.ndarray, np.ndarray, Sequence[tuple[int, int]]]]
) -> dict[str, Any]:
    """MAC (test, model) of each deck, with the model's frequencies and the pairs."""
    return {
        "test": [round(float(f), 2) for f in test],
        "maps": {
            name: {
                "model": [round(float(f), 2) for f in model],
                "mac": [rounded(line, 1e-3) for line in mac],
                "pairs": [list(p) for p in pairs],
            }
            for name, (mac, model, pairs) in found.items()
        },
    }


def odds(
    effects: Sequence[NamedEffect], alternatives: Sequence[Alternative]
) -> list[dict[str, Any]]:
    """2 ln Bayes factor of the best explanation against each, most probable first."""
    named = " and ".join(e.name for e in effects)
    rows = [(named, effects[0].log_evidence, "named")] if effects else []
    rows += [(a.name, a.log_evidence, a.why_not) for a in alternatives]
    known = [(name, float(value), why) for name, value, why in rows if value is not None]
    best = max((value for _, value, _ in known), default=0.0)
    bars = [{"name": n, "against": 2 * (best - v), "why": why} for n, v, why in known]
    return sorted(bars, key=lambda bar: bar["against"])


def steps(sides: Mapping[str, Mapping[str, float]], floors: Mapping[str, float]) -> dict[str, Any]:
    """Q of the decks on each side of the data, and the noise alone."""
    return {"sides": {name: dict(q) for name, q in sides.items()}, "floors": dict(floors)}


def ladder(rows: Sequence[FrequencyRow]) -> dict[str, Any]:
    """Deviation of each frequency from the test [%]."""

    def off(f: float | None, test: float) -> float | None:
        return None if not f else round(100 * (f / test - 1), 3)

    return {
        "test": [round(r.test_hz, 2) for r in rows],
        "before": [off(r.before_hz, r.test_hz) for r in rows],
        "after": [off(r.after_hz, r.test_hz) for r in rows],
    }


def floors(fitted: Scores, held: Scores) -> dict[str, float]:
    """Q of the noise of the recording alone, where it is known."""
    both = {"fitted": fitted.floor, "held out": held.floor}
    return {name: value for name, value in both.items() if value is not None}
