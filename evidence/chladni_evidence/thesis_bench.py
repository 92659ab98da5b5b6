"""The test of Echaniz Granado (2015) on the virtual bench: three tailgates, two excitations.

Sections 4.2 and 4.3: stepped sine with table 3's schedule and burst random on tailgates A, B and C.
A is also tested at half and at twice the level.  Cords are free, held by hand, or with rubber.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.linalg import eig

from chladni.fem.measured_dofs import MeasuredDofs
from chladni.model.assembly import Assembly
from chladni.parallel import one_blas_thread
from chladni.progress import Progress, silent
from chladni_bench import (
    ABOVE_BAND,
    DAMPING,
    RUBBER,
    TABLE_3,
    THESIS,
    AccelerometerType,
    BenchArticle,
    BenchRecording,
    BenchRig,
    BenchSetup,
    BenchTest,
    Channels,
    Cord,
    PoleModel,
    Stage,
    bench_rig,
    benched,
    channels_of,
    cord,
    drawn_article,
    dwells_of,
    fitted,
    level_for,
    record,
    swept,
    true_places,
)

CORD_SD = 0.01  # of a cord's frequency from article to article: figure 19 shows a few tenths of Hz
HELD = 0.1  # share of a cord's length that stays free when hands hold its lowest part
CORD_BAND = (18.0, 34.0)  # [Hz], about the cords' resonances and the first mode
FACTORS = (0.5, 2.0)  # further levels over the level itself (figure 24)
Held = Literal["free", "held", "rubber"]
WAYS: tuple[Held, ...] = ("free", "held", "rubber")


@dataclass(frozen=True, eq=False)
class Subject:
    """The tested structure, before its three articles differ."""

    article: BenchArticle
    drive: int  # row of the output next to the shaker
    at_cord: int  # row of the output nearest to a cord
    nodes: dict[int, np.ndarray]  # {node: (3,)}: places by the number of a label [m]


@dataclass(frozen=True, eq=False)
class ThesisTest:
    """All recordings of the chapter."""

    subject: Subject
    # stages, articles: the schedule; A, B and C
    stages: tuple[Stage, ...]
    articles: tuple[BenchArticle, ...]
    # stepped, bursts: recordings of A, B and C
    stepped: tuple[BenchRecording, ...]
    bursts: tuple[BenchRecording, ...]
    # recordings of A by stepped sine, one for each of ``FACTORS``
    levels: tuple[BenchRecording, ...]
    # {free, held, rubber: recordings of A, B and C about the cords' resonances}
    cords: dict[Held, tuple[BenchRecording, ...]]
    # tapped, along: (3, k) resonances of each article's cords, across and along them [Hz]
    tapped: np.ndarray
    along: np.ndarray
    poles: np.ndarray  # of A's FRFs, with sensors, gauge and cords (m,) [rad/s]


def thesis_subject(
    assembly: Assembly, outputs: MeasuredDofs, inputs: MeasuredDofs, hangers: Sequence[int],
    rng: np.random.Generator, f_max: float = 400.0,
) -> Subject:  # fmt: skip
    """The article on two cords, its sensors as planned, one of them next to the shaker.

    Its first fourteen modes have the damping of the thesis' table 6 (mean of three articles, by
    rank). The damping of the others is drawn from the scatter of that table.
    """
    places = true_places(assembly, outputs, inputs, AccelerometerType(), rng)
    article = benched(assembly, outputs, inputs, hangers, places, f_max, fitted(), rng)
    hung = assembly.points[assembly.rows(list(hangers))]
    near = np.linalg.norm(outputs.points[:, None] - hung, axis=2).min(axis=1)
    drive = outputs.labels.index(inputs.labels[0])
    return Subject(as_damped(article), drive, int(near.argmin()), outputs.nodes)


def as_damped(article: BenchArticle) -> BenchArticle:
    """The article with the mean damping of table 6 in its first elastic modes, by rank."""
    zeta, mean = article.damping.copy(), np.exp(np.log(DAMPING).mean(axis=0))
    first = np.flatnonzero(article.elastic)[: len(mean)]
    zeta[first] = mean[: len(first)]
    return replace(article, damping=zeta)


def thesis_test(
    subject: Subject, rng: np.random.Generator, stages: Sequence[Stage] = TABLE_3,
    resolution: float = 0.05, progress: Progress = silent,
) -> ThesisTest:  # fmt: skip
    """Run every recording of the chapter.

    Parameters
    ----------
    resolution : of burst random [Hz]
    """
    with one_blas_thread():
        return _tested(subject, rng, tuple(stages), resolution, progress)


def _tested(
    subject: Subject, rng: np.random.Generator, stages: tuple[Stage, ...], resolution: float,
    progress: Progress,
) -> ThesisTest:  # fmt: skip
    band = (stages[0].low, stages[-1].high)
    scatter, differ = fitted(), ABOVE_BAND * band[1]
    articles = tuple(drawn_article(subject.article, scatter, name, differ, rng) for name in "ABC")
    rings = np.array([np.array(THESIS) * np.exp(CORD_SD * rng.normal()) for _ in articles])
    rigs = [rig_on_cords(a, f) for a, f in zip(articles, rings, strict=True)]
    channels = channels_of(rigs[0], rng)
    sine, noise = (level_for(rigs[0], kind, band) for kind in ("stepped-sine", "burst-random"))  # type: ignore[arg-type]

    def sweep(rig: BenchRig, factor: float = 1.0) -> BenchRecording:
        test = BenchTest("stepped-sine", band, factor * sine)
        return swept(rig, test, dwells_of(stages), rng, progress=progress, channels=channels)

    def burst(rig: BenchRig) -> BenchRecording:
        test = BenchTest("burst-random", band, noise, resolution)
        return record(rig, test, rng, progress=progress, channels=channels)

    return ThesisTest(
        subject, stages, articles, tuple(sweep(r) for r in rigs), tuple(burst(r) for r in rigs),
        tuple(sweep(rigs[0], k) for k in FACTORS),
        {way: _about_cords(articles, rings, way, stages, sine, rng, channels) for way in WAYS},
        rings, np.array([_along(a, f) for a, f in zip(articles, rings, strict=True)]),
        frf_poles(rigs[0].measured),
    )  # fmt: skip


def _about_cords(
    articles: Sequence[BenchArticle], rings: np.ndarray, way: Held, stages: Sequence[Stage],
    level: float, rng: np.random.Generator, channels: Channels,
) -> tuple[BenchRecording, ...]:  # fmt: skip
    """Short sweeps of all articles about the cords' resonances."""
    lines = dwells_of(stages, CORD_BAND)
    test = BenchTest("stepped-sine", CORD_BAND, level)
    return tuple(
        swept(rig_on_cords(a, f, way), test, lines, rng, channels=channels)
        for a, f in zip(articles, rings, strict=True)
    )


def rig_on_cords(article: BenchArticle, rings: np.ndarray, way: Held = "free") -> BenchRig:
    """The article on its cords, which have the resonances ``rings`` [Hz]."""
    cords = tuple(_touched(c, way) for c in _cords(article, rings))
    return bench_rig(article, BenchSetup(cords=cords))


def _cords(article: BenchArticle, rings: np.ndarray) -> list[Cord]:
    n = len(article.hangers)
    return [cord(article.weight, n, float(rings[k % len(rings)])) for k in range(n)]


def _along(article: BenchArticle, rings: np.ndarray) -> list[float]:
    """First longitudinal resonance √(k/m) / 2 of each cord, a bar held at both ends [Hz]."""
    return [float(np.sqrt(c.stiffness / c.mass) / 2) for c in _cords(article, rings)]


def frf_poles(measured: PoleModel) -> np.ndarray:
    """Poles of accelerations over the force, the first output: zeros of that force (m,) [rad/s].

    They exclude the shaker and include everything attached to the article.
    """
    p = np.r_[measured.poles, measured.poles.conj()]
    n = len(p)
    A, E = np.zeros((n + 1, n + 1), complex), np.diag(np.r_[np.ones(n), 0.0])
    A[range(n), range(n)] = p
    A[:n, n] = np.r_[measured.b[:, 0], measured.b[:, 0].conj()]
    A[n, :n] = np.r_[measured.c[0], measured.c[0].conj()] / 2
    A[n, n] = measured.d[0, 0]
    z = eig(A, E, right=False)
    z = z[np.isfinite(z)]
    z = z[z.imag > 1e-6 * np.abs(z)]
    return np.asarray(z[np.argsort(np.abs(z))])


def _touched(one: Cord, way: Held) -> Cord:
    """A cord that hangs free, has rubber taped to its end, or is held by hand near the article."""
    if way == "rubber":
        return replace(one, damping=RUBBER)
    if way == "held":
        return replace(one, length=HELD * one.length, mass=HELD * one.mass, damping=RUBBER)
    return one
