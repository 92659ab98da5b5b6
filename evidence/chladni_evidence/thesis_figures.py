"""Figures 19 and 23 to 27 of Echaniz Granado (2015), drawn from our own recordings."""

from pathlib import Path

import numpy as np

from chladni.dynamics.frf import UNIT
from chladni.ema.realisation import realised
from chladni.report.identification_page import circles
from chladni.view import charts
from chladni.view.chart_png import png
from chladni_bench import BenchRecording

from .thesis_bench import FACTORS, ThesisTest
from .thesis_findings import means
from .thesis_modes import BAND, CORDS, ArticleIdentified

ACCELERANCE = f"|H| [{UNIT['accelerance']}]"
_DENSE = 30_000  # lines of a drawn model, so that a circle of 0.4 % damping is round
_LEVELS = {0.5: "half the level", 2.0: "twice the level"}
Curve = tuple[np.ndarray, np.ndarray]


def drawn(
    folder: Path, test: ThesisTest, identified: tuple[ArticleIdentified, ...]
) -> dict[str, Path]:
    """Draw all figures; return their paths by figure number of the thesis."""
    first = identified[0]
    return {
        "19": _cords(folder / "figure_19.png", test),
        "23": _circles(folder / "figure_23.png", test, first),
        "24": _levels(folder / "figure_24.png", test),
        "25": _articles(folder / "figure_25.png", test),
        "26": _excitations(folder / "figure_26.png", test),
        "27": _state_space(folder / "figure_27.png", test.subject.drive, first),
        "27 other": _state_space(folder / "figure_27_other.png", _typical(test), first),
    }


def _typical(test: ThesisTest, share: float = 0.5) -> int:
    """Row of the output at this quantile of strength, without the one at the shaker."""
    size = np.abs(test.stepped[0].frf.values[:, :, 0]).mean(axis=0)
    order = [int(k) for k in np.argsort(size) if k != test.subject.drive]
    return order[int(share * (len(order) - 1))]


def _of(recording: BenchRecording, row: int) -> Curve:
    """Lines and values of a channel."""
    return recording.frf.frequency, recording.frf.values[:, row, 0]


def _named(test: ThesisTest, row: int) -> str:
    """A channel in words."""
    name = test.stepped[0].frf.outputs[row]
    return f"{name}, next to the shaker" if row == test.subject.drive else name


def _cords(path: Path, test: ThesisTest) -> Path:
    """Draw free, held and with rubber at the sensor nearest to a cord, article by article."""
    at = test.subject.at_cord
    channels = {
        f"tailgate {a.name}, {test.stepped[0].frf.outputs[at]}": {
            str(way): _of(recordings[k], at) for way, recordings in test.cords.items()
        }
        for k, a in enumerate(test.articles)
    }
    return png(charts.responses(channels, ACCELERANCE).grid(), path)


def _circles(path: Path, test: ThesisTest, first: ArticleIdentified) -> Path:
    """Draw the mobility of two channels of A, 10 to 195 Hz: lines as dots, the model as a curve."""
    dense = np.geomspace(*BAND, _DENSE)
    dense = dense[(dense < CORDS[0]) | (dense > CORDS[1])]
    model, raw = realised(first.whole, "mobility").frf(dense), first.raw.to("mobility")
    rows = (test.subject.drive, _typical(test))
    curves = {_named(test, k): (raw.values[:, k, 0], model.values[:, k, 0]) for k in rows}
    return png(circles(curves).grid(tile=(4.0, 4.1)), path)


def _levels(path: Path, test: ThesisTest) -> Path:
    """Draw A at the level, at half of it and at twice."""
    recordings = {"the level": test.stepped[0]}
    recordings |= {_LEVELS[k]: r for k, r in zip(FACTORS, test.levels, strict=True)}
    channels = {
        _named(test, row): {name: _of(r, row) for name, r in recordings.items()}
        for row in (test.subject.drive, _typical(test))
    }
    return png(charts.responses(channels, ACCELERANCE).grid(columns=1), path)


def _articles(path: Path, test: ThesisTest) -> Path:
    """Draw A, B and C by stepped sine, four channels."""
    rows = (test.subject.drive, *(_typical(test, share) for share in (0.25, 0.5, 0.75)))
    channels = {_named(test, row): {r.article: _of(r, row) for r in test.stepped} for row in rows}
    return png(charts.responses(channels, ACCELERANCE).grid(), path)


def _excitations(path: Path, test: ThesisTest) -> Path:
    """Draw means of A, B and C by both excitations: shaker, rms of all channels, two others."""
    both = {"burst random": test.bursts, "stepped sine": test.stepped}
    mean = {name: (r[0].frf.frequency, means(r)) for name, r in both.items()}
    channels = {
        _named(test, row): {name: (f, H[:, row]) for name, (f, H) in mean.items()}
        for row in (test.subject.drive, _typical(test), _typical(test, 0.0))
    }
    rms = {
        name: (f, np.sqrt((np.abs(H) ** 2).mean(axis=1)).astype(complex))
        for name, (f, H) in mean.items()
    }
    every = {"rms of all channels": rms, **channels}
    return png(charts.responses(every, ACCELERANCE).grid(), path)


def _state_space(path: Path, row: int, first: ArticleIdentified) -> Path:
    """Draw one channel of A with the identified state space."""
    f = np.geomspace(*BAND, _DENSE)
    model = realised(first.whole, "accelerance").frf(f)
    frf = first.frf.sel(band=BAND)
    curves = {
        "test": (frf.frequency, frf.values[:, row, 0]),
        "identified": (f, model.values[:, row, 0]),
    }
    title = f"Tailgate A, {frf.outputs[row]}: recording and identified state space"
    return png(charts.responses({title: curves}, ACCELERANCE, [CORDS]).at(title), path)
