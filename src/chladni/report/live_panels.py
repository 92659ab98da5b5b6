"""Curves one below the other over one axis: frequency, time, amplitude, level of excitation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .live_curves import extremes

if TYPE_CHECKING:
    from ..ema.level_table import LevelTable

_POINTS, _LEAST = 2000, 200  # of a curve; of one among many


def panels(x: str, of: Sequence[Mapping[str, Any]], log: bool = False) -> dict[str, Any]:
    """Join panels above an axis with the title ``x``."""
    return {"x": {"title": x, "log": log}, "panels": list(of)}


def panel(
    title: str,
    curves: Iterable[Mapping[str, Any]],
    log: bool = False,
    limits: tuple[float, float] | None = None,
    zero: bool = False,
) -> dict[str, Any]:
    """Curves on one vertical axis, from ``limits`` or, if ``zero``, from zero."""
    return {"title": title, "curves": list(curves), "log": log, "range": limits, "zero": zero}


def curve(
    name: str,
    x: np.ndarray,
    y: np.ndarray,
    sd: np.ndarray | None = None,
    most: int = _POINTS,
    **look: str,
) -> dict[str, Any]:
    """Values y ± 2 sd (n,) over x (n,), thinned to ``most``; not finite: a gap.

    ``look`` holds tint, dash, symbol, and ``marks`` where points are marked.
    """
    at = extremes(np.nan_to_num(y), most)
    bars = {} if sd is None else {"sd": short(sd[at])}
    return {"name": name, "x": short(x[at]), "y": short(y[at]), **bars, **look}


def short(values: np.ndarray) -> list[float | None]:
    """Five digits of every value (n,), None where it is not finite."""
    return [float(f"{v:.5g}") if np.isfinite(v) else None for v in np.asarray(values, dtype=float)]


def over_frequency(
    frequency: np.ndarray,
    lines: Mapping[str, np.ndarray],
    title: str,
    limits: tuple[float, float] | None = None,
    share: int = 1,
) -> dict[str, Any]:
    """Real functions of frequency (n,) [Hz] by channel; ``share`` such drawings are on the page."""
    most = max(_LEAST, _POINTS // share)
    curves = [curve(name, frequency, y, most=most) for name, y in lines.items()]
    return panels("frequency [Hz]", [panel(title, curves, limits=limits, zero=True)])


def over_time(t: np.ndarray, signals: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Signals (n,) by name and unit, one below the other, over time (n,) [s]."""
    return panels("time [s]", [panel(n, [curve(n, t, x, tint="ink")]) for n, x in signals.items()])


def schedule(
    frequency: np.ndarray,
    delay: np.ndarray,
    measure: np.ndarray,
    drive: np.ndarray,
    transient: np.ndarray,
    unit: str,
) -> dict[str, Any]:
    """Lines of a stepped sine (n,) [Hz]: cycles waited and measured; drive, transient (k, n)."""

    def sweeps(what: str, values: np.ndarray, tint: str) -> list[dict[str, Any]]:
        rows = np.atleast_2d(values)
        return [curve(f"{what}, sweep {k}", frequency, y, tint=tint) for k, y in enumerate(rows, 1)]

    cycles = [curve("waited", frequency, delay), curve("measured", frequency, measure)]
    left = 100 * np.maximum(transient, 1e-12)
    return panels(
        "frequency [Hz]",
        [
            panel("cycles", cycles, log=True),
            panel(unit, sweeps("drive", drive, "after"), log=True),
            panel("transient left [%]", sweeps("transient", left, "before"), log=True),
        ],
        log=True,
    )


def decays(modes: Mapping[str, tuple[np.ndarray, np.ndarray, np.ndarray]]) -> dict[str, Any]:
    """Amplitude, frequency [Hz] and damping of critical, each (k,), of modes by name."""
    marks = "lines+markers"
    f = [curve(n, a, 100 * (f / f[-1] - 1), marks=marks) for n, (a, f, _) in modes.items()]
    z = [curve(n, a, 100 * z, marks=marks) for n, (a, _, z) in modes.items()]
    both = [panel("frequency, relative [%]", f), panel("damping [%]", z, zero=True)]
    return panels("amplitude of the response [SI]", both, log=True)


def over_levels(t: LevelTable) -> dict[str, Any]:
    """Frequency and damping of one mode over its amplitude: measured, fitted, predicted, linear."""
    rows = [(r.amplitude_m, r.frequency_hz, r.frequency_sd_hz, r.foretold_hz,
             r.damping, r.damping_sd, r.foretold_damping) for r in t.rows]  # fmt: skip
    a, f, f_sd, f_foretold, z, z_sd, z_foretold = np.array(rows, dtype=float).T
    fitted = np.array(t.curve, dtype=float).reshape(-1, 3).T
    element = t.elements[0].name if t.elements else "the element"

    def side(
        measured: np.ndarray, sd: np.ndarray, foretold: np.ndarray, line: np.ndarray,
        mean: float | None,
    ) -> list[dict[str, Any]]:  # fmt: skip
        curves = [curve("measured", 1e3 * a, measured, sd, marks="markers", tint="ink")]
        if len(line):
            curves.append(curve(f"{element}, fitted to all", 1e3 * fitted[0], line, tint="after"))
        if np.isfinite(foretold).any():
            curves.append(
                curve("predicted from the others", 1e3 * a, foretold, marks="markers",
                      symbol="diamond-open", tint="after")
            )  # fmt: skip
        if mean:
            ends, level = 1e3 * a[[0, -1]], np.full(2, mean)
            curves.append(curve("one linear model", ends, level, tint="before", dash="dash"))
        return curves

    mean = None if t.mean_damping is None else 100 * t.mean_damping
    frequency = side(f, f_sd, f_foretold, fitted[1], t.mean_hz)
    damping = side(100 * z, 100 * z_sd, 100 * z_foretold, 100 * fitted[2], mean)
    both = [panel("frequency [Hz]", frequency), panel("damping [%]", damping, zero=True)]
    return panels("amplitude [mm]", both, log=True)
