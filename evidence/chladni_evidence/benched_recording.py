"""A recording of an article on the virtual bench: cords, shaker, sensors, front end.

Instead of independent noise on every line the recording has the errors of a laboratory. Sensors are
tilted and a little off their places, and sensitivities are a little wrong. Cords have rubber at
their ends, as a laboratory adds it against their resonances. A stinger, transients or leakage, and
noise of sensors and converter act as well.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.fem.energy import mass_properties
from chladni.geometry.facets import tangents, unit
from chladni.geometry.sampling import nearest_points
from chladni.model.assembly import Assembly
from chladni_bench import (
    AccelerometerType,
    BenchArticle,
    BenchSetup,
    BenchTest,
    bench_rig,
    dwells_of,
    level_for,
    record,
    stages_for,
    swept,
)

from .article_modes import ArticleModes, Solver, article_modes
from .bench_of_structure import Bench
from .hidden import Hidden
from .mesh_transfer import MeshTransfer, Spots, still_there
from .response_of_article import seen

Recorder = Literal["independent noise", "stepped-sine", "burst-random"]
RECORDERS: tuple[Recorder, ...] = get_args(Recorder)
PLAIN: Recorder = "independent noise"
LINES = 1500  # of burst random over the band, at most: more take minutes to identify
DELAY = 200.0  # cycles: 0.7 % of the transient remains for a mode of 0.4 % damping


@dataclass(frozen=True, eq=False)
class Benched:
    """A recording of the bench, with the laboratory's knowledge of it."""

    frf: FRF  # at the places as the user states them
    averages: float
    # sensor_mass, gauge_mass: mass that each device adds to the article [kg]
    sensor_mass: float
    gauge_mass: float


def can_be_benched(hidden: Hidden, modes: ArticleModes) -> bool:
    """True where modes describe the article: no part of it has a law of frequency of its own."""
    return not hidden.couplings and not modes.loss.any()


def benched_recording(
    bench: Bench, whole: Assembly, hidden: Hidden, zeta: np.ndarray, by: Recorder, solver: Solver,
    residual_bending: bool, cache: Path | None, rng: np.random.Generator,
) -> Benched:  # fmt: skip
    """Test the article with its hidden effect over the lines; ``whole`` is it before hiding."""
    setup = BenchSetup(rubber=True)
    article = _article(
        bench, whole, hidden, zeta, setup.accelerometer, solver, residual_bending, cache, rng
    )
    rig = bench_rig(article, setup)
    band = (float(bench.lines[0]), float(bench.lines[-1]))
    if by == "stepped-sine":
        test = BenchTest("stepped-sine", band, level_for(rig, "stepped-sine", band))
        found = swept(rig, test, dwells_of(stages_for(*band, DELAY)), rng)
    else:
        resolution = max(0.05, (band[1] - band[0]) / LINES)
        level = level_for(rig, "burst-random", band)
        found = record(rig, BenchTest("burst-random", band, level, resolution), rng)
    assert setup.shaker is not None
    gauge = setup.shaker.gauge
    return Benched(
        replace(found.frf, values=hidden.spoil(found.frf.values)), found.averages,
        setup.accelerometer.mass, gauge.mass * gauge.beyond,
    )  # fmt: skip


def _article(
    bench: Bench, whole: Assembly, hidden: Hidden, zeta: np.ndarray, kind: AccelerometerType,
    solver: Solver, residual_bending: bool, cache: Path | None, rng: np.random.Generator,
) -> BenchArticle:  # fmt: skip
    """The article's modes at true places; rotations at the shaker are unknown, so none is held."""
    a = hidden.article
    true = true_places(bench.outputs, kind, rng)
    out, drive = still_there(a, whole, true), still_there(a, whole, bench.drive)
    hung = nearest_points(a.points, bench.deck.points[bench.deck.rows(list(bench.hangers))])
    rows = np.concatenate([out.rows.ravel(), hung])
    modes = article_modes(
        a, rows, drive.rows.ravel(), float(bench.lines[-1]), solver, cache, residual_bending
    )
    r, n = len(modes.frequency), len(bench.outputs)
    d = bench.drive.directions[0]
    u, _ = tangents(d)
    axes = np.stack([d, u, np.cross(d, u)])
    moved = np.stack([_along(modes, out, e) for e in np.eye(3)], axis=1)
    pushed = np.concatenate([_along(modes, drive, e) for e in axes])
    return BenchArticle(
        name="A", weight=mass_properties(a)[0] - hidden.unweighed, frequency=modes.frequency,
        damping=zeta[np.minimum(np.arange(r), len(zeta) - 1)],
        outputs=seen(modes, out, true.directions), mounts=moved.reshape(n, 3, r),
        drive=np.vstack([pushed, np.zeros((3, r))]), hangers=modes.at(hung),
        output_labels=bench.outputs.labels, input_label=bench.drive.labels[0],
    )  # fmt: skip


def _along(modes: ArticleModes, foot: MeshTransfer, axes: np.ndarray) -> np.ndarray:
    """Shapes (k, r) of places along one direction."""
    return seen(modes, foot, np.tile(axes, (len(foot.rows), 1)))


def true_places(spots: Spots, kind: AccelerometerType, rng: np.random.Generator) -> Spots:
    """True places and directions of the sensors."""
    u, v = tangents(spots.directions)
    off, tilt = kind.place_sd * rng.normal(size=(2, len(spots))), rng.normal(size=(2, len(spots)))
    turned = spots.directions + kind.tilt_sd * (tilt[0][:, None] * u + tilt[1][:, None] * v)
    points = spots.points + off[0][:, None] * u + off[1][:, None] * v
    return replace(spots, points=points, directions=unit(turned))
