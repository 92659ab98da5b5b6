"""Charts of a calibration: profiles, the posterior by pairs, articles, bands."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..inference.calibration_result import CalibrationStudy
from ..view.chart import Chart, ChartAxis, Mark, Panel, Series
from .blocks import Drawing

MOST = 8  # parameters in a picture of pairs
_ANGLE = np.linspace(0, 2 * np.pi, 60)
_CAPTIONS = {
    "profiles": "Profile likelihood of each parameter, and the parabola that its interval assumes; "
    "across: the limit of 95 %.",
    "corner": "Posterior of each pair of parameters, change in %: one and two standard deviations "
    "of the Gaussian; points and steps are draws, if there are any.",
    "articles": "Deviation of each article from the mean of all, with 95 % intervals.",
    "bands": "Responses with the damping of the search: 90 % of the posterior, and the test.",
}
_SIGNIFICANT = 3.84  # χ² of one degree of freedom at 95 %


def study_drawings(study: CalibrationStudy | None) -> Iterator[Drawing]:
    """All that the study allows."""
    if study is None:
        return
    names, C, draws = study.names, np.array(study.covariance), None
    if (sample := study.sample) is not None:
        names = tuple(p.name for p in sample.parameters)
        C = np.array(sample.gaussian_covariance)
        draws = np.array(sample.draws) - np.array(sample.gaussian_mean)
    for name, there, chart in (
        ("profiles", study.profiles, profiles),
        ("corner", len(names) > 1, lambda _: corner(names, C, draws)),
        ("articles", study.articles, articles),
        ("bands", study.bands, bands),
    ):
        if there:
            yield Drawing(name, chart(study), _CAPTIONS[name], place="study")


def profiles(study: CalibrationStudy) -> Chart:
    """-2 ln profile likelihood of each parameter over the parabola of its covariance."""
    at, panels = np.arange(-2.0, 3.0), []
    for p in study.profiles:
        found, parabola = (np.insert(np.array(v, dtype=float), 2, 0.0)
                           for v in (p.neg2_log_likelihood, p.quadratic))  # fmt: skip
        top = max(6.0, 1.1 * float(found[np.isfinite(found)].max()))
        panels.append(Panel(
            [Series("interval", at, parabola, tint="before", dash="dash"),
             Series("profile", at, found, "both", "after")],
            ChartAxis("sd from the best"),
            ChartAxis("-2 ln", limits=(-1.0, top)),
            p.name, [Mark(_SIGNIFICANT, "x")],
        ))  # fmt: skip
    columns = min(4, len(panels))
    rows = -(-len(panels) // columns)
    return Chart.of(*panels, columns=columns, size=(2.5 * columns, 2.4 * rows + 0.4),
                    height=6 + 13 * rows)  # fmt: skip


def corner(names: Sequence[str], covariance: np.ndarray, draws: np.ndarray | None = None) -> Chart:
    """The posterior of every pair of parameters in per cent.

    Ellipses of the Gaussian hold 39 % and 86 %; points and steps are draws, if there are any.

    Parameters
    ----------
    covariance : (p, p)   of ln value
    draws : (n, p)   of ln value from the mean of the Gaussian
    """
    names, C = list(names[:MOST]), 1e4 * np.asarray(covariance)[:MOST, :MOST]
    x = np.zeros((0, len(names))) if draws is None else 100 * np.asarray(draws)[:, :MOST]
    p = len(names)
    panels = [_pair(names, C, x, i, j) if j <= i else None for i in range(p) for j in range(p)]
    side = max(1.25 * p, 2.6)
    return Chart.of(*panels, columns=p, size=(side + 0.8, side), height=8.0 + 7.0 * p)


def _pair(names: Sequence[str], C: np.ndarray, x: np.ndarray, i: int, j: int) -> Panel:
    """One density on the diagonal, else two ellipses; the draws with them."""
    edge = {"x": names[j] if i == len(names) - 1 else "", "y": names[i] if i and not j else ""}
    reach = [3 * np.sqrt(C[n, n]) for n in (j, i)]
    limits = [(min(-r, *x[:, n], 0.0), max(r, *x[:, n], 0.0))
              for r, n in zip(reach, (j, i), strict=True)]  # fmt: skip
    if i == j:
        z, sd = np.linspace(-3, 3, 61), np.sqrt(C[i, i])
        series = [Series("", z * sd, np.exp(-(z**2) / 2), tint="after")]
        if len(x):
            count, edges = np.histogram(x[:, i], 20)
            share = count / len(x) / np.diff(edges) * np.sqrt(2 * np.pi) * sd
            steps = np.repeat(edges, 2)[1:-1], np.repeat(share, 2)
            series.append(Series("", steps[0], steps[1], tint="before", width=1.0))
        return Panel(
            series, ChartAxis(edge["x"], limits=limits[0]), ChartAxis(bare=True, zero=True)
        )
    at = np.ix_((j, i), (j, i))
    root = np.linalg.cholesky(C[at] + 1e-12 * np.trace(C[at]) * np.eye(2))
    series = []
    for k, strength in ((2, 0.2), (1, 0.4)):
        u, v = k * root @ np.stack([np.cos(_ANGLE), np.sin(_ANGLE)])
        series.append(Series("", u, v, "shape", "after", opacity=strength))
    if len(x):
        series.append(Series("", x[:, j], x[:, i], "points", "before", symbol="dot", size=1.5))
    return Panel(
        series, ChartAxis(edge["x"], limits=limits[0]), ChartAxis(edge["y"], limits=limits[1])
    )


def articles(study: CalibrationStudy) -> Chart:
    """Each article's deviation from the mean of all in per cent, over the spread of units."""
    rows = study.articles
    at = np.arange(len(rows), dtype=float)
    tau = 100 * np.array([row.spread for row in rows])
    series = [Series("± spread of units", tau, at, "bars", "after", opacity=0.25, base=-tau,
                     lying=True)]  # fmt: skip
    names = [a.article for a in rows[0].articles]
    for k, name in enumerate(names):
        shift = 0.5 * (k / max(len(names) - 1, 1) - 0.5)
        away, reach = (100 * np.array([getattr(row.articles[k], n) for row in rows])
                       for n in ("away", "reach"))  # fmt: skip
        series.append(Series(name, away, at + shift, "points", ends=(away - reach, away + reach),
                             lying=True))  # fmt: skip
    ticks = {float(k): row.name for k, row in enumerate(rows)}
    y = ChartAxis(ticks=ticks, down=True)
    x = ChartAxis("deviation from the mean of all units [%]")
    panel = Panel(series, x, y, marks=(Mark(0.0),))
    return Chart.of(panel, size=(7.2, 0.5 * len(rows) + 1.6), height=8 + 3.0 * len(rows))


def bands(study: CalibrationStudy) -> Chart:
    """90 % bands of predicted magnitudes and the measured ones, one channel above another."""
    panels = []
    for b in study.bands:
        f, low, high = (np.array(v) for v in (b.frequency, b.low, b.high))
        band = Series("90 % of the posterior", f, high, "area", "after", base=low, opacity=0.35)
        title = f"{b.label}, {'held out' if b.held_out else 'fitted'}"
        test = Series("test", f, np.array(b.measured), tint="ink")
        panels.append(
            Panel([band, test], ChartAxis("frequency [Hz]"), ChartAxis("|H|", log=True), title)
        )
    return Chart.of(*panels, one_x=True, size=(8.2, 1.9 * len(panels) + 0.6),
                    height=8 + 10 * len(panels))  # fmt: skip
