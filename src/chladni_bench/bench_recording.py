"""A test on the bench: the excitation runs, the front end records, FRFs are estimated."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.ema.frf_estimate import EstimateSettings, estimate
from chladni.ema.time_record import TimeRecord
from chladni.errors import LabelError, ModelError
from chladni.progress import Progress, silent

from .accelerometers import drawn_gains
from .bench_rig import BenchRig
from .drive_signals import BLOW, Kind, blow, burst, multisine, pink_rms
from .first_order_hold import HeldRun
from .front_end import anti_alias, digitised, sampling_rate
from .local_integration import LocalRun
from .pole_model import filtered
from .room import room_samples

FINER, FINER_LOCAL, FINER_BLOW = 2, 8, 8  # steps of a sample: linear, with local forces, of a blow
ROOM = 0.25  # of the range that the largest amplitude of a sine or a blow may take
ROOM_RANDOM = 0.15  # that of a random response its rms: peaks are five times as large
SETTLE = 1  # periods of a multisine before the first that is kept
LEFT = 1e-3  # of a free decay when the next blow may come
LONGEST = 40.0  # a block of a hammer test at most [s]


@dataclass(frozen=True)
class BenchTest:
    """How a test is run.

    Attributes
    ----------
    excitation : burst-random, stepped-sine, multisine or hammer
    band : [Hz]
    level : N; of the coil's force the rms while a burst or multisine lasts, of the measured force
        the amplitude of a sine, of a blow its peak; on a shaker table m/s² of it in place of N
    resolution : distance of lines of burst random and multisine [Hz]
    averages : bursts, periods of a multisine, blows
    sweeps : of a stepped sine
    """

    excitation: Kind
    band: tuple[float, float]
    level: float
    resolution: float = 0.05
    averages: int = 20
    sweeps: int = 5


@dataclass(frozen=True, eq=False)
class BenchRecording:
    """Result of a test.

    Attributes
    ----------
    article : its name
    test : BenchTest
    frf : FRF                  accelerance with coherence (and variance)
    averages : float           what the estimate is worth
    time : TimeRecord or None  where it was kept
    sample : TimeRecord or None  its first block, of tests that are made of blocks
    overloads : {channel in words: blocks, lines or sweeps in which it was beyond its range}
    transient : (n_f,) or None  largest residual transient of a line over its steady part, of all
        channels and sweeps (stepped sine)
    force : (sweeps, n_f) or None  measured amplitude [N] (stepped sine)
    added_damping : that a window added [1/s]
    truth : (n_f, n_out)       the FRF of a front end without noise and errors of sensors
    notes : how the FRFs were estimated
    """

    article: str
    test: BenchTest
    frf: FRF
    averages: float
    time: TimeRecord | None = None
    sample: TimeRecord | None = None
    overloads: dict[str, int] = field(default_factory=dict)
    transient: np.ndarray | None = None
    force: np.ndarray | None = None
    added_damping: float = 0.0
    truth: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Channels:
    """Force first, then every accelerometer: volts per unit, true and stated, and noise.

    Attributes
    ----------
    true, stated : (1 + n_out,) [V/N], [V s²/m]
    noise : (1 + n_out,)        [V/√Hz]
    """

    true: np.ndarray
    stated: np.ndarray
    noise: np.ndarray


def channels_of(rig: BenchRig, rng: np.random.Generator) -> Channels:
    """The sensors of a test with the sensitivities they happen to have."""
    kind, gauge, n = rig.setup.accelerometer, rig.reference, len(rig.article.outputs)
    stated = np.r_[gauge.sensitivity, np.full(n, kind.sensitivity)]
    true = stated * np.r_[1.0, rig.article.gains * drawn_gains(kind, n, rng)]
    return Channels(true, stated, np.abs(true) * np.r_[gauge.noise, np.full(n, kind.noise)])


def level_for(rig: BenchRig, excitation: Kind, band: tuple[float, float]) -> float:
    """The level [N] at which the strongest channel takes about a quarter of its range.

    Pink noise counts by the rms of the response during the burst, a sine by its largest amplitude,
    a blow by the sum of the modal amplitudes.
    """
    kind, front = rig.setup.accelerometer, rig.setup.front_end
    f = np.geomspace(band[0], band[1], 4000)
    H = rig.measured.response(2j * np.pi * f)[:, :, 0]
    if excitation == "stepped-sine":
        volts = np.abs(H[:, 1:] / H[:, :1]).max() * kind.sensitivity
        return float(ROOM * front.volts / volts)
    if excitation == "hammer":
        width = BLOW / band[1] * 2 / np.pi  # area of a half sine of one newton [N s]
        m = rig.measured
        rows = np.abs(m.c[1:] * m.b[:, 0])[:, np.abs(m.poles) < 2 * np.pi * band[1]]
        return float(2 * ROOM * front.volts / (width * rows.sum(axis=1).max() * kind.sensitivity))
    rms = pink_rms(f, H)
    volts = rms * np.r_[rig.reference.sensitivity, np.full(len(rms) - 1, kind.sensitivity)]
    return float(ROOM_RANDOM * front.volts / volts.max())


def record(
    rig: BenchRig,
    test: BenchTest,
    rng: np.random.Generator,
    keep_time: bool = False,
    progress: Progress = silent,
    channels: Channels | None = None,
) -> BenchRecording:
    """Run a test of bursts, a multisine or blows, and estimate its FRFs from the time data.

    A stepped sine is run by ``sine_sweep.swept``. ``channels`` are the sensors of other recordings
    of the same test; else their sensitivities are drawn.

    Raises
    ------
    ModelError
        If a hammer is to hit an article with a shaker, or a shaker is to drive one without.
    """
    driven = rig.article.on_table or rig.setup.shaker is not None
    if (test.excitation == "hammer") == driven:
        raise ModelError("a hammer test has no shaker; all other tests need one")
    rate = sampling_rate(test.band[1])
    channels = channels or channels_of(rig, rng)
    run = PhysicalRun(rig, rate, test)
    blocks, over = [], np.zeros(1 + len(rig.article.outputs), int)
    signals = list(_signals(rig, test, rate, run.finer, rng))
    for k, (u, kept) in enumerate(signals):
        progress(
            f"{rig.article.name}: {test.excitation} {k + 1} of {len(signals)}", k / len(signals)
        )
        volts = channels.true[:, None] * run.on(test.level * u, rng)
        values, high = digitised(volts, channels.noise, rate, rig.setup.front_end, rng)
        if kept:
            blocks.append(values / channels.stated[:, None])
            over += high
    time = time_record_of(rig, blocks, rate)
    kind = {"burst-random": "burst", "multisine": "multisine", "hammer": "hammer"}[test.excitation]
    found = estimate(time, EstimateSettings(excitation=kind, band=test.band))  # type: ignore[arg-type]
    named = {name: int(c) for name, c in zip(time.channels, over, strict=True) if c}
    return BenchRecording(
        rig.article.name, test, rig.called(found.frf), found.averages, time if keep_time else None,
        time_record_of(rig, blocks[:1], rate), named,
        added_damping=found.added_damping, truth=rig.frf(found.frf.frequency), notes=found.notes,
    )  # fmt: skip


def time_record_of(rig: BenchRig, blocks: list[np.ndarray], rate: float) -> TimeRecord:
    """Blocks (channels, n) of force and accelerations as a record of the article's labels."""
    x = np.stack(blocks)
    labels = (rig.article.input_label,), rig.article.output_labels
    return TimeRecord(x[:, :1], x[:, 1:], rate, *labels)


def _signals(
    rig: BenchRig, test: BenchTest, rate: float, finer: int, rng: np.random.Generator
) -> Iterator[tuple[np.ndarray, bool]]:
    """Blocks of the drive of level one, and whether each is kept."""
    n = round(rate / test.resolution)
    if test.excitation == "hammer":
        n = 2 ** int(np.ceil(np.log2(rate * _decay(rig))))
        for _ in range(test.averages):
            yield blow(n, rate, test.band[1], rng, finer), True
    elif test.excitation == "burst-random":
        for _ in range(test.averages):
            yield burst(n, rate, test.band, rng, finer), True
    elif test.excitation == "multisine":
        period = multisine(n, rate, test.band, rng, finer)
        for k in range(SETTLE + test.averages):
            yield period, k >= SETTLE
    else:
        raise LabelError(f"{test.excitation} is not made of blocks")


def _decay(rig: BenchRig) -> float:
    """Until elastic motion has died away [s]."""
    a = rig.article
    slowest = (a.damping * 2 * np.pi * a.frequency)[a.elastic].min()
    return float(np.clip(-np.log(LEFT) / slowest, 1.0, LONGEST))


class PhysicalRun:
    """Forces and accelerations behind the anti-alias filter, sampled, block after block."""

    def __init__(self, rig: BenchRig, rate: float, test: BenchTest) -> None:
        rest = FINER_LOCAL if rig.article.laws else FINER
        self.finer = FINER_BLOW if test.excitation == "hammer" else rest
        self.rate, self.density = rate * self.finer, rig.room_density(test.band)
        h = 1 / (rate * self.finer)
        self.outputs = HeldRun(filtered(rig.measured, anti_alias(rate)), h)
        self.local = LocalRun(rig.openings, rig.article.laws, h) if rig.article.laws else None

    def on(self, u: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(channels, n) [N, m/s²] of a block of the drive (n · finer,) [N]; rng: of the room."""
        x = u[None]
        if self.density:
            x = np.vstack([x, room_samples(self.density, self.rate, len(u), rng)])
        if self.local is not None:
            x = np.vstack([x, self.local.on(x)])
        return self.outputs.on(x, self.finer)
