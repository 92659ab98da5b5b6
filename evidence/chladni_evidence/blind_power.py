"""Power of a diagnosis: how often effects of each size are named, and how often none is made up."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chladni.output import write_json, write_text
from chladni.view.chart import Chart, ChartAxis, Panel, Series
from chladni.view.chart_png import png

from .blind_score import score
from .outcome_row import NULLS, Row

NAMED = ("right", "among")


@dataclass(frozen=True)
class Share:
    """Share of some cases, with its interval of 90 % (Jeffreys)."""

    # size of the effects over scatter and mesh together; 0 for cases without an effect
    times: float
    named: int  # named right, or among several names; without an effect, named at all
    cases: int  # all of this size
    listed: int  # these, and those that "calibration alone, or one of" lists

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the interval of the share named."""
        return self.ends(self.named)

    def ends(self, k: int) -> tuple[float, float]:
        """Ends of the interval where k cases count; 0 or 1 where none or every case does."""
        from scipy.stats import beta

        n = self.cases
        low = 0.0 if k == 0 else float(beta.ppf(0.05, k + 0.5, n - k + 0.5))
        return low, 1.0 if k == n else float(beta.ppf(0.95, k + 0.5, n - k + 0.5))


def shares(rows: Sequence[Row]) -> list[Share]:
    """Share named, and share named or listed, by size; first those of false alarms.

    Cases whose size was not set belong to no share.
    """
    nulls = [r for r in rows if r["effect"] in NULLS]
    out = [_share(0.0, nulls, ("wrong", "among"))] if nulls else []
    for times in sorted({r["times"] for r in rows if r["times"] is not None}):
        out.append(_share(times, [r for r in rows if r["times"] == times], NAMED))
    return out


def _share(times: float, rows: Sequence[Row], counted: tuple[str, ...]) -> Share:
    named = [r["outcome"] in counted for r in rows]
    listed = [n or r["listed"] for n, r in zip(named, rows, strict=True)]
    return Share(times, sum(named), len(rows), sum(listed))


def power(outs: Sequence[Path], say: Callable[[str], object]) -> dict[str, list[Share]]:
    """Score folders one by one; write power.json, power.txt and power.png into the first.

    Each folder has two curves, named and listed; two versions of a diagnosis stand side by side.
    """
    found = {str(out): shares(score([out], lambda text: None)) for out in outs}
    lines = [f"{'':24}{'size':>6}{'named':>7}{'listed':>8}{'of':>5}   90 % interval of named"]
    for name, every in found.items():
        for s in every:
            size = f"{s.times:g}" if s.times else "none"
            low, high = s.interval
            lines.append(
                f"{name[-22:]:24}{size:>6}{s.named:>7}{s.listed:>8}{s.cases:>5}   "
                f"{low:.0%} to {high:.0%}"
            )
    lines += [
        "size: change of the responses over that by scatter and mesh; none: false alarms",
        "listed: named, or one of several with calibration alone",
    ]
    write_json(outs[0] / "power.json", {n: [vars(s) for s in every] for n, every in found.items()})
    write_text(outs[0] / "power.txt", "\n".join(lines) + "\n")
    curves = {
        f"{name}: {what}": (
            [s.times for s in every],
            [getattr(s, kind) / s.cases for s in every],
            [s.ends(getattr(s, kind)) for s in every],
        )
        for name, every in found.items()
        for kind, what in (("named", "named"), ("listed", "named or listed"))
    }
    png(shares_over_size(curves), outs[0] / "power.png")
    for line in lines:
        say(line)
    return found


def shares_over_size(
    curves: Mapping[str, tuple[Sequence[float], Sequence[float], Sequence[tuple[float, float]]]],
) -> Chart:
    """Shares of named effects over their size: {label: (size, share, interval)}."""
    series = []
    for name, (size, share, ends) in curves.items():
        low, high = np.array(ends, dtype=float).T
        place = np.array(size, dtype=float), np.array(share, dtype=float)
        series.append(Series(name, *place, "both", dash="dot", ends=(low, high)))
    x = ChartAxis("size of the effect, times scatter and mesh (0: no effect, false alarms)")
    y = ChartAxis("share named", limits=(-0.03, 1.03))
    return Chart.of(Panel(series, x, y, "Power of the diagnosis"), size=(6.4, 4.4))
