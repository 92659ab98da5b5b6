"""The virtual test: a case's structure on the bench, its articles, excitations and levels."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Unpack, get_args

import numpy as np

from chladni.arguments import checked, refuse_fields
from chladni.case import Case
from chladni.case.schema import CaseWords
from chladni.dynamics.modes import rigid_modes
from chladni.effects.family import Article
from chladni.effects.registry import family
from chladni.ema.identification import LEAST_LINES
from chladni.errors import FileError, LabelError
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.geometry.refine import refined
from chladni.geometry.sampling import nearest_points
from chladni.io.file_size import OVERRIDE, most_gigabytes
from chladni.parallel import one_blas_thread
from chladni.progress import Progress, silent, within
from chladni.results import Result
from chladni.workflows.given_case import Source, given_case
from chladni.workflows.loaded_model import as_model

from .article_scatter import Scatter, drawn_article, fitted
from .bench_article import BenchArticle
from .bench_recording import (
    BenchRecording,
    BenchTest,
    Channels,
    channels_of,
    level_for,
    record,
)
from .bench_rig import BenchRig, BenchSetup, bench_rig
from .benched_article import benched, true_places
from .cords import cords_for
from .drive_signals import Kind
from .front_end import sampling_rate
from .local_sites import LOCAL, local_site
from .sine_schedule import SineLine, dwells_of, stages_for
from .sine_sweep import swept

NAMES = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
BALANCE = 5e-4  # error of the weighing, relative
MODES = 20  # elastic modes of the band where nobody names one
BELOW, BEYOND = 0.6, 1.05  # of the lowest and of the highest frequency of interest: the test's band
LEAST_FREQUENCY = 5.0  # [Hz]
ABOVE_BAND = 1.5  # articles differ in their modes up to so many times the highest line


@dataclass(frozen=True)
class BenchSettings:
    """Settings of a virtual test.

    Attributes
    ----------
    excitation : burst-random, stepped-sine, multisine or hammer
    band : [Hz]; None: what the case fits and holds out, else the first twenty elastic modes
    level : N, as ``BenchTest`` has it; None: the strongest channel takes a quarter of its range
    levels : factors on it, a recording each
    articles : how many, each drawn
    seed : of all that is drawn
    hide : names of effects to conceal
    local : clearance, cubic-spring, friction: forces that act at concealed places
    exact : the articles are the deck's own, without scatter
    finer : the articles' mesh is the deck's with every shell cut in four
    resolution, averages, sweeps : as ``BenchTest`` has them
    delay : cycles a stepped sine waits at every line, if the thesis' table gives fewer
    room : m/s² rms by which sound and floor move the median accelerometer, in the band
    rubber : whether rubber is taped to the cords' ends, so that they hardly ring
    keep_time : whether time data are kept
    added : number of the last sensors that an earlier test of the same article did not have
    """

    excitation: Kind = "burst-random"
    band: tuple[float, float] | None = None
    level: float | None = None
    levels: tuple[float, ...] = (1.0,)
    articles: int = 1
    seed: int = 0
    hide: tuple[str, ...] = ()
    local: tuple[str, ...] = ()
    exact: bool = False
    finer: bool = False
    resolution: float = 0.05
    averages: int = 20
    sweeps: int = 5
    delay: float = 0.0
    rubber: bool = False
    room: float = 0.0
    keep_time: bool = False
    added: int = 0

    def __post_init__(self) -> None:
        refuse_fields(self)


@dataclass(frozen=True, eq=False, repr=False)
class BenchResult(Result):
    """Recordings, article by article and level by level, and the concealed truth.

    Attributes
    ----------
    settings, setup : as tested
    outputs, inputs : places as the user believes them
    band : of the test [Hz]
    mass : weighed, of the first article [kg]
    recordings : tuple
    truth : concealed effects, true places and scatter
    schedule : lines of the stepped sine, else none
    cords : (k,) as they ring when tapped [Hz]
    """

    settings: BenchSettings
    setup: BenchSetup
    outputs: MeasuredDofs
    inputs: MeasuredDofs
    band: tuple[float, float]
    mass: float
    recordings: tuple[BenchRecording, ...]
    truth: dict[str, Any]
    schedule: tuple[SineLine, ...] = ()
    cords: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()


@checked
def virtual_test(
    source: Source,
    settings: BenchSettings | None = None,
    *,
    progress: Progress = silent,
    **words: Unpack[CaseWords],
) -> BenchResult:
    """Put the case's structure on the bench, conceal the chosen effects in it, and test it.

    Parameters
    ----------
    source, words : as in :func:`chladni.diagnose`; ``sensors`` says where it is driven and measured
    settings : excitation, level, articles, effects to conceal, ...

    Raises
    ------
    FileError
        If the case names no sensors or no place that is driven; if its base moves and a hammer,
        local forces or time data are asked for.
    LabelError
        If an effect, a local force or an excitation has no such name.
    """
    case = given_case(source, (), words)
    settings = settings or BenchSettings()
    _known(settings)
    _places_known(case, settings)
    with one_blas_thread():
        return replace(_tested(case, settings, progress), origin=case)


def _known(settings: BenchSettings) -> None:
    if settings.excitation not in get_args(Kind):
        raise LabelError(
            f"no excitation {settings.excitation!r}; there are {', '.join(get_args(Kind))}"
        )
    for name in settings.hide:
        family(name)
    for name in settings.local:
        if name not in LOCAL:
            raise LabelError(f"no local force {name!r}; there are {', '.join(LOCAL)}")
    if not 1 <= settings.articles <= len(NAMES):
        raise LabelError(f"{settings.articles} articles; there may be 1 to {len(NAMES)}")
    if not settings.levels or min(settings.levels) <= 0:
        given = ", ".join(f"{x:g}" for x in settings.levels)
        raise LabelError(f"levels {given} must be factors above zero")


def _places_known(case: Case, settings: BenchSettings) -> None:
    for what, dofs in (("sensor", case.outputs), ("driven place", case.inputs)):
        if not dofs.labels:
            raise FileError(
                f"{case.path} names no {what}; give them in sensors.csv ([test] sensors), as "
                "chladni plan writes it"
            )
    if case.outputs.base.any():
        raise FileError(f"{case.path}: the base is the input of a shaker table, not a sensor")
    if not case.inputs.base[0]:
        return
    amiss = {
        "--excitation hammer": settings.excitation == "hammer",
        "--local": bool(settings.local), "--time": settings.keep_time,
    }  # fmt: skip
    if words := [word for word, is_set in amiss.items() if is_set]:
        raise FileError(f"{case.path} moves its supports by a shaker table, which has no "
                        f"{', '.join(words)}")  # fmt: skip


def _tested(case: Case, settings: BenchSettings, progress: Progress) -> BenchResult:
    rng = np.random.default_rng([settings.seed, 7])
    progress("modes", 0.0)
    band = settings.band or _band(case)
    _refuse_long(settings, band, 1 + len(case.outputs.labels))
    swept_sine = settings.excitation == "stepped-sine"
    schedule = dwells_of(stages_for(*band, settings.delay)) if swept_sine else ()
    _refuse_few(len(schedule) or int((band[1] - band[0]) / settings.resolution) + 1, band)
    setup = BenchSetup(rubber=settings.rubber, room=settings.room)
    if settings.excitation == "hammer" or case.inputs.base[0]:
        setup = replace(setup, shaker=None)
    scatter = fitted()
    nominal, truth = _article(case, settings, setup, band, scatter, rng)
    plain = bench_rig(nominal, setup)
    level = settings.level or level_for(plain, settings.excitation, band)
    if settings.local:
        sized = BenchTest(settings.excitation, band, level)
        nominal, sites = local_site(plain, settings.local, sized, rng)
        truth["local"] = sites
    differ = ABOVE_BAND * band[1]
    articles = _drawn(nominal, settings, scatter, differ, rng)
    channels = channels_of(plain, rng)
    truth["sensitivity"] = channels.true / channels.stated
    recordings: list[BenchRecording] = []
    jobs = [(a, factor) for a in articles for factor in settings.levels]
    for k, (article, factor) in enumerate(jobs):
        test = BenchTest(
            settings.excitation, band, level * factor, settings.resolution, settings.averages,
            settings.sweeps,
        )  # fmt: skip
        part = within(progress, 0.2 + 0.8 * k / len(jobs), 0.2 + 0.8 * (k + 1) / len(jobs))
        rig, seed = bench_rig(article, setup), np.random.default_rng([settings.seed, 8, k])
        recordings.append(_run(rig, test, schedule, seed, settings.keep_time, part, channels))
    mass = articles[0].weight * (1 + BALANCE * rng.normal())
    truth |= {
        "room_m_s2": settings.room,
        "weight_kg": {a.name: a.weight for a in articles},
        "frequency_hz": {a.name: a.frequency[a.frequency < differ] for a in articles},
        "damping": {a.name: a.damping[a.frequency < differ] for a in articles},
    }
    return BenchResult(
        settings, setup, case.outputs, case.inputs, band, mass, tuple(recordings), truth, schedule,
        _tapped(case, settings, mass), tuple(_notes(case, nominal, settings, recordings)),
    )  # fmt: skip


def _refuse_long(settings: BenchSettings, band: tuple[float, float], channels: int) -> None:
    """Refuse time data too large for the memory; name a resolution that fits."""
    if settings.excitation not in ("burst-random", "multisine"):
        return
    rate, limit = sampling_rate(band[1]), most_gigabytes()
    samples = rate / settings.resolution * settings.averages * channels
    if (gigabytes := 8e-9 * samples) > limit:
        raise FileError(
            f"{settings.averages} blocks of {1 / settings.resolution:g} s at {rate:g} samples a "
            f"second on {channels} channels are {gigabytes:.3g} GB of time data, more than the "
            f"limit of {limit:g} GB: use lines of --resolution "
            f"{settings.resolution * gigabytes / limit:.2g} Hz or a band below {band[1]:g} Hz; "
            f"{OVERRIDE}={int(gigabytes) + 1} in the environment allows it"
        )


def _refuse_few(lines: int, band: tuple[float, float]) -> None:
    """Refuse a recording with too few lines for identification."""
    if lines < LEAST_LINES:
        raise FileError(
            f"{lines} lines between {band[0]:g} and {band[1]:g} Hz are too few for "
            f"identification, which needs {LEAST_LINES}: widen the band, or use closer lines "
            "(--resolution, for bursts, multisines and blows)"
        )


def _tapped(case: Case, settings: BenchSettings, mass: float) -> tuple[float, ...]:
    """Return the frequencies of the cords when tapped [Hz]."""
    cords = cords_for(mass, len(case.setup.hangers))
    return () if settings.rubber or case.inputs.base[0] else tuple(c.frequency for c in cords)


def _run(
    rig: BenchRig, test: BenchTest, schedule: Sequence[SineLine], rng: np.random.Generator,
    keep_time: bool, progress: Progress, channels: Channels,
) -> BenchRecording:  # fmt: skip
    if test.excitation == "stepped-sine":
        return swept(rig, test, schedule, rng, keep_time, progress, channels)
    return record(rig, test, rng, keep_time, progress, channels)


def _band(case: Case) -> tuple[float, float]:
    """Return the band of the case, slightly wider, or that of its first modes [Hz]."""
    named = [b for b in (case.band, case.held_band) if b is not None]
    if named:
        low, high = min(b[0] for b in named), max(b[1] for b in named)
        return max(LEAST_FREQUENCY, BELOW * low), BEYOND * high
    modal = as_model(case).normal_modes(MODES + 6)
    f = modal.frequency[~rigid_modes(modal)]
    return max(LEAST_FREQUENCY, BELOW * float(f[0])), BEYOND * float(f[-1])


def _article(
    case: Case, settings: BenchSettings, setup: BenchSetup, band: tuple[float, float],
    scatter: Scatter, rng: np.random.Generator,
) -> tuple[BenchArticle, dict[str, Any]]:  # fmt: skip
    """Return the nominal article with its concealed effects, and a record of them."""
    made, truth = case.assembly, {"seed": settings.seed, "effects": {}}
    if settings.finer:
        made = refined(made)
    hangers = np.array(case.setup.hangers, dtype=np.int64)
    n = len(case.outputs.labels) - settings.added
    first, drive = case.outputs.first(n), _driven(case)
    held = Article(made, case.assembly, _grids(case, first), hangers, np.ones(n), drive=drive)
    for name in settings.hide:
        if name == "shaker-restraint" and drive is None:
            raise FileError(f"{case.path} moves its supports, so it has no stinger")
        if name == "suspension" and not len(hangers):
            raise FileError(f"{case.path} names no hangers, so it has no cords")
        held = family(name).conceal(held, rng)
        truth["effects"][name] = held.truth  # type: ignore[index]
    kind, later = setup.accelerometer, np.random.default_rng([settings.seed, 9])
    places = true_places(held.assembly, first, case.inputs, kind, rng)
    if settings.added:  # the draws of the article follow those of its first sensors
        whole = true_places(held.assembly, case.outputs, case.inputs, kind, later)
        places = whole.beginning_with(places)
    article = benched(
        held.assembly, case.outputs, case.inputs, case.setup.hangers, places, band[1], scatter, rng
    )
    off, gains = float(held.off_scale), np.append(held.gains, np.ones(settings.added))
    truth["sensors"] = {
        label: {"point_m": x, "direction": d}
        for label, x, d in zip(case.outputs.labels, places.points, places.directions, strict=True)
    }  # type: ignore[assignment]
    return replace(article, weight=article.weight - off, gains=gains), truth


def _grids(case: Case, at: MeasuredDofs) -> np.ndarray:
    """Return the deck's grid nearest to every measured or driven place (n,)."""
    a = case.assembly
    return np.where(at.grids > 0, at.grids, a.ids[nearest_points(a.points, at.points)])


def _driven(case: Case) -> tuple[int, tuple[float, float, float]] | None:
    """Return grid and direction of the force; None if the supports move."""
    if case.inputs.base[0]:
        return None
    x, y, z = case.inputs.directions[0].tolist()
    return int(_grids(case, case.inputs)[0]), (x, y, z)


def _drawn(
    nominal: BenchArticle, settings: BenchSettings, scatter: Scatter, within_hz: float,
    rng: np.random.Generator,
) -> list[BenchArticle]:  # fmt: skip
    if settings.exact:
        return [replace(nominal, name=NAMES[k]) for k in range(settings.articles)]
    return [
        drawn_article(nominal, scatter, NAMES[k], within_hz, rng) for k in range(settings.articles)
    ]


def level_unit(inputs: MeasuredDofs) -> str:
    """Return the unit of a test's level: of force, or of a shaker table's acceleration."""
    return "m/s²" if inputs.base[0] else "N"


def _notes(
    case: Case,
    article: BenchArticle,
    settings: BenchSettings,
    recordings: Sequence[BenchRecording],
) -> list[str]:
    out = [*case.said("bench")]
    table, unit = bool(case.inputs.base[0]), level_unit(case.inputs)
    if table and case.setup.hangers:
        out.append("A shaker table moves the supports; cords are not used.")
    if not table and not case.setup.hangers and not article.elastic.all():
        out.append(
            "The case names no hangers: the articles have no cords but rigid motions at 0.7 Hz."
        )
    if not settings.finer and len(case.assembly.shells):
        out.append(
            "The articles have the mesh of the deck and so its mesh error. A real article has no "
            "mesh error, and a diagnosis allows for one: use --finer for a more realistic test."
        )
    for r in recordings:
        out += [f"{r.article}, level {r.test.level:.3g} {unit}: {said}" for said in r.notes]
        if r.overloads:
            worst = ", ".join(f"{name} ({n})" for name, n in sorted(r.overloads.items()))
            out.append(f"Overload in article {r.article} at {r.test.level:.3g} {unit}: {worst}; "
                       "lower the level (--level)")  # fmt: skip
    if len(case.inputs.labels) > 1:
        out.append(f"One shaker at a time: {case.inputs.labels[0]} was driven, "
                   f"{', '.join(case.inputs.labels[1:])} not.")  # fmt: skip
    return out
