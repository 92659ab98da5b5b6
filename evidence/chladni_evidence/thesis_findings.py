"""Numbers of the thesis' tables and figures from our own recordings."""

from dataclasses import dataclass

import numpy as np

from chladni.ema.correlation import Quality, deviation, quality
from chladni.ema.mode_pairing import pair
from chladni.ema.realisation import realised
from chladni.ema.screening import Homogeneity, homogeneity
from chladni.ema.shapes import lines_per_bandwidth
from chladni_bench import BenchRecording, Stage

from .thesis_bench import ThesisTest
from .thesis_modes import ArticleIdentified, ModesOfArticles, errors, paired, spread

BANDS = ((10.0, 100.0), (100.0, 200.0), (220.0, 280.0), (280.0, 320.0), (340.0, 400.0))  # fig. 25
FIRST = (26.0, 34.0)  # [Hz] the first elastic mode, above the cords
OUTER = 0.25  # share of the weakest or the strongest lines of a channel


@dataclass(frozen=True, eq=False)
class StageRun:
    """A row of table 3 as it was run."""

    stage: Stage
    lines: int  # number of lines
    per_octave: float  # actual lines per octave
    transient: float  # median over lines of the largest remaining transient, over all channels of A


@dataclass(frozen=True, eq=False)
class CordReading:
    """Figure 19 of one article."""

    tapped: np.ndarray  # (k,) [Hz]
    height: np.ndarray  # (k,) |H| at them over that with the cords held
    rubber: np.ndarray  # (k,) |H| at them with rubber, over that with the cords held
    first: np.ndarray  # (3,) peak of the first mode, free, held, with rubber [Hz]


@dataclass(frozen=True, eq=False)
class ThesisFindings:
    """Numbers of every table and figure."""

    schedule: tuple[StageRun, ...]  # rows of table 3
    minutes: float  # duration of all its sweeps
    weights: np.ndarray  # (3,) [kg]
    identified: tuple[ArticleIdentified, ...]  # of A, B and C
    modes: ModesOfArticles  # their modes, paired
    partner: np.ndarray  # (r,) row of the thesis' table 5 nearest to each mode, -1: none
    # largest error of frequency and damping of A against the bench's own poles
    worst: tuple[float, float]
    cords: tuple[CordReading, ...]  # figure 19, by article
    lines: np.ndarray  # (r,) of A's modes, lines between their half-power points
    # homogeneity of A at half the level and at twice, each against the level itself
    levels: tuple[Homogeneity, ...]
    # between_articles, between_excitations: (bands,) rms of 20 log|H| about the mean [dB]
    between_articles: np.ndarray
    between_excitations: np.ndarray
    # faint, strong: rms between excitations at the weakest and strongest quarter of the lines [dB]
    faint: float
    strong: float
    state_space: Quality  # deviation of the state space from A's recording
    states: int  # order of the state space


def findings(
    test: ThesisTest, identified: tuple[ArticleIdentified, ...], thesis: np.ndarray
) -> ThesisFindings:
    """All findings of a test.

    Parameters
    ----------
    thesis : (articles, modes)   frequencies of the thesis' table 5 [Hz]
    """
    first = identified[0]
    modes = paired(identified)
    p = pair(modes.frequency[:, 0], thesis[0])
    partner = np.full(len(modes.frequency), -1)
    partner[p.model] = p.test
    mine = first.modes.sel(modes.rows)
    off = errors(mine, test.poles)
    articles, excitations = _between(test)
    faint, strong = _by_strength(test)
    near, raw = test.stepped[0], first.raw
    system = realised(first.whole, "accelerance")
    return ThesisFindings(
        tuple(_stage_run(test, s) for s in test.stages),
        test.stepped[0].averages * sum(_seconds(test, s) for s in test.stages) / 60,
        np.array([a.weight for a in test.articles]),
        identified, modes, partner, (float(np.abs(off[0]).max()), float(np.abs(off[1]).max())),
        tuple(_cord_reading(test, k) for k in range(len(test.articles))),
        2 * lines_per_bandwidth(mine, first.frf.frequency),
        tuple(homogeneity(near.frf, other.frf) for other in test.levels),
        articles, excitations, faint, strong,
        quality(deviation(system.frf(raw.frequency), raw), raw.frequency), len(system.A),
    )  # fmt: skip


def _stage_run(test: ThesisTest, stage: Stage) -> StageRun:
    r = test.stepped[0]
    f = r.frf.frequency
    mine = (stage.low <= f) & (f < stage.high)
    assert r.transient is not None
    per_octave = float(1 / np.diff(np.log2(f[mine])).mean())
    return StageRun(stage, int(mine.sum()), per_octave, float(np.median(r.transient[mine])))


def _seconds(test: ThesisTest, stage: Stage) -> float:
    """Duration of one sweep over the stage [s]."""
    f = test.stepped[0].frf.frequency
    last = stage is test.stages[-1]
    mine = f[(stage.low <= f) & ((f < stage.high) | last)]
    return float(((stage.delay + stage.measure) / mine).sum())


def _cord_reading(test: ThesisTest, k: int) -> CordReading:
    """Reading of article k at the sensor nearest to a cord."""
    at = test.subject.at_cord
    curves = {way: np.abs(r[k].frf.values[:, at, 0]) for way, r in test.cords.items()}
    f = test.cords["free"][k].frf.frequency
    near = np.abs(f[:, None] - test.tapped[k]).argmin(axis=0)
    mode = (FIRST[0] <= f) & (f <= FIRST[1])
    peaks = np.array([_peak(f[mode], curve[mode]) for curve in curves.values()])
    height = {way: np.array([_about(curves[way] / curves["held"], n) for n in near])
              for way in ("free", "rubber")}  # fmt: skip
    return CordReading(test.tapped[k], height["free"], height["rubber"], peaks)


def _about(ratio: np.ndarray, n: int) -> float:
    """Largest value of a ratio over the lines around one line."""
    return float(ratio[max(n - 4, 0) : n + 5].max())


def _peak(f: np.ndarray, H: np.ndarray) -> float:
    """Vertex of the parabola through the three highest lines of ln H over ln f [Hz]."""
    n = int(np.clip(H.argmax(), 1, len(H) - 2))
    x, y = np.log(f[n - 1 : n + 2] / f[n]), np.log(H[n - 1 : n + 2])
    a, b, _ = np.polyfit(x, y, 2)
    return float(f[n] * np.exp(-b / (2 * a)))


def means(recordings: tuple[BenchRecording, ...]) -> np.ndarray:
    """Mean FRF of the articles (n_f, n_out)."""
    return np.mean([r.frf.values[:, :, 0] for r in recordings], axis=0)


def on_lines(f: np.ndarray, grid: np.ndarray, H: np.ndarray) -> np.ndarray:
    """Complex H (n_grid, n_out) at lines f, linear between those of the grid."""
    k = np.clip(np.searchsorted(grid, f) - 1, 0, len(grid) - 2)
    t = ((f - grid[k]) / (grid[k + 1] - grid[k]))[:, None]
    return (1 - t) * H[k] + t * H[k + 1]


def decibels(test: ThesisTest) -> np.ndarray:
    """20 log of the mean FRF by bursts over that by stepped sine (n_f, n_out)."""
    f = test.stepped[0].frf.frequency
    random = on_lines(f, test.bursts[0].frf.frequency, means(test.bursts))
    return 20 * np.log10(np.abs(random / means(test.stepped)))


def _between(test: ThesisTest) -> tuple[np.ndarray, np.ndarray]:
    """Rms about the mean by band, of articles and of excitations [dB]."""
    f = test.stepped[0].frf.frequency
    level = 20 * np.log10([np.abs(r.frf.values[:, :, 0]) for r in test.stepped])
    articles, half = level - level.mean(axis=0), decibels(test) / 2
    inside = [(low <= f) & (f <= high) for low, high in BANDS]
    return (
        np.array([_rms(articles[:, at]) for at in inside]),
        np.array([_rms(half[at]) for at in inside]),
    )


def _by_strength(test: ThesisTest) -> tuple[float, float]:
    """Rms between excitations at the weakest and at the strongest lines of every channel [dB]."""
    half, size = decibels(test) / 2, np.abs(means(test.stepped))
    order = np.argsort(size, axis=0)
    n = max(1, int(OUTER * len(size)))
    faint, strong = (np.take_along_axis(half, at, axis=0) for at in (order[:n], order[-n:]))
    return _rms(faint), _rms(strong)


def _rms(x: np.ndarray) -> float:
    """Root mean square √ mean x²; 0 for no values."""
    return float(np.sqrt((x**2).mean())) if x.size else 0.0


def dispersion(x: np.ndarray) -> float:
    """Largest relative difference of the rows that all articles have; nan without such rows."""
    whole = x[np.isfinite(x).all(axis=1)]
    return float(spread(whole).max()) if len(whole) else float("nan")
