"""A stepped sine on the bench: state carried from line to line, the force controlled.

The response of a linear article to a line has a closed form: q = γ e^{pt} + α e^{iωt} + β e^{-iωt},
γ from the line before. The transient's share of a measured value is an integral of exponentials.
A sweep of an hour is therefore exact without steps in time. With local forces it runs in time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from time import monotonic

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.ema.signals import Spectra, estimated
from chladni.ema.time_record import TimeRecord
from chladni.progress import Progress, silent, time_left

from .bench_recording import (
    BenchRecording,
    BenchTest,
    Channels,
    PhysicalRun,
    channels_of,
    time_record_of,
)
from .bench_rig import BenchRig
from .front_end import digitised, sampling_rate
from .pole_model import PoleModel
from .sine_schedule import SineLine


@dataclass
class _Force:
    """Closed loop of the force: the drive of a line is that which the line before needed.

    From the second sweep on it is what the line itself needed in the sweep before.
    """

    per_drive: float  # force over drive at the first line, as the operator finds it
    known: list[float] = field(default_factory=list)

    def drive(self, k: int, force: float) -> float:
        """Amplitude of the drive for a force [N]."""
        per_drive = self.known[k] if k < len(self.known) else self.per_drive
        return force / max(per_drive, 1e-30)

    def seen(self, k: int, per_drive: float) -> None:
        """What line k had."""
        self.per_drive = per_drive
        if k < len(self.known):
            self.known[k] = per_drive
        else:
            self.known.append(per_drive)


def swept(
    rig: BenchRig,
    test: BenchTest,
    lines: Sequence[SineLine],
    rng: np.random.Generator,
    keep_time: bool = False,
    progress: Progress = silent,
    channels: Channels | None = None,
) -> BenchRecording:
    """All sweeps of a stepped sine, demodulated line by line.

    With local forces, or where time data are wanted, it runs in time; else in closed form.
    """
    channels = channels or channels_of(rig, rng)
    in_time = keep_time or bool(rig.article.laws)
    sweep = (
        _TimeSweep(rig, test, channels, keep_time) if in_time else _ExactSweep(rig, test, channels)
    )
    f = np.array([line.frequency for line in lines])
    control = _Force(float(np.abs(rig.measured.response(2j * np.pi * f[:1])[0, 0, 0])))
    found = np.empty((test.sweeps, len(lines), len(channels.true)), complex)
    over = np.zeros(len(channels.true), int)
    begun = monotonic()
    for k in range(test.sweeps):
        for n, line in enumerate(lines):
            if n % 50 == 0:
                done = (k + n / len(lines)) / test.sweeps
                at = f"{rig.article.name}: sweep {k + 1} of {test.sweeps}, {line.frequency:.1f} Hz"
                progress(f"{at}{time_left(begun, done)}", done)
            drive = control.drive(n, test.level * line.share)
            found[k, n], high = sweep.line(line, drive, rng)
            control.seen(n, float(np.abs(found[k, n, 0])) / drive)
            over += high
    frf = _averaged(rig, f, found)
    names = (
        f"input {rig.article.input_label}",
        *(f"output {o}" for o in rig.article.output_labels),
    )
    seconds = test.sweeps * sum(line.seconds for line in lines)
    said = (
        f"stepped sine: {len(lines)} lines, {test.sweeps} sweeps, {seconds / 60:.3g} minutes on "
        f"the bench; the remaining transient of a line is at most {100 * max(sweep.left):.2g} % "
        "of it"
    )
    return BenchRecording(
        rig.article.name, test, frf, float(test.sweeps), sweep.time(), None,
        {name: int(c) for name, c in zip(names, over, strict=True) if c},
        np.reshape(sweep.left, (test.sweeps, -1)).max(axis=0), np.abs(found[:, :, 0]),
        truth=rig.frf(f), notes=(said,),
    )  # fmt: skip


def _averaged(rig: BenchRig, f: np.ndarray, found: np.ndarray) -> FRF:
    """H1 over the sweeps, with their coherence."""
    F, Y = found[:, :, 0], found[:, :, 1:]
    n = len(found)
    s = Spectra(
        f, (np.abs(F) ** 2).mean(axis=0)[:, None, None],
        (np.einsum("sfo,sf->fo", Y, F.conj()) / n)[:, :, None],
        (np.abs(Y) ** 2).mean(axis=0), float(n),
    )  # fmt: skip
    return rig.called(estimated(s, rig.article.output_labels, (rig.article.input_label,)))


def _clipping(amplitude: np.ndarray, limit: float) -> np.ndarray:
    """Fundamental of a clipped sine over the sine (describing function of saturation).

    (2/π)(asin δ + δ √(1 - δ²)), δ = limit / amplitude (Gelb and Vander Velde 1968, section 2.3).
    """
    d = np.minimum(limit / np.maximum(amplitude, 1e-300), 1.0)
    return 2 / np.pi * (np.arcsin(d) + d * np.sqrt(1 - d**2))


class _ExactSweep:
    """Line after line in closed form."""

    def __init__(self, rig: BenchRig, test: BenchTest, channels: Channels) -> None:
        self.model: PoleModel = rig.measured.inputs(slice(0, 1))
        self.q = np.zeros(len(self.model.poles), complex)
        self.channels, self.front = channels, rig.setup.front_end
        self.room, self.density = rig.of_room, rig.room_density(test.band)
        self.left: list[float] = []

    def line(
        self, line: SineLine, drive: float, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Complex amplitude of every channel [N, m/s²], and which were overloaded.

        The front end correlates over T seconds: white noise of density S leaves E|e|² = 2 S / T.
        """
        steady, moving = self.response(line, drive)
        self.left.append(float((np.abs(moving) / np.maximum(np.abs(steady), 1e-300)).max()))
        y = steady + moving + self.loud(line, rng)
        volts = self.channels.true * y
        over = np.abs(volts) > self.front.volts
        volts = volts * _clipping(np.abs(volts), self.front.volts)
        density = self.channels.noise**2 + self.front.noise**2
        sd = np.sqrt(density * line.frequency / line.measure)  # of real and imaginary part
        e = rng.normal(size=(2, len(volts)))
        return (volts + sd * (e[0] + 1j * e[1])) / self.channels.stated, over

    def loud(self, line: SineLine, rng: np.random.Generator) -> np.ndarray | float:
        """Contribution of the room to every channel (channels,), correlated over T like noise."""
        if not self.density:
            return 0.0
        H = self.room.response(np.array([2j * np.pi * line.frequency]))[0]
        e = rng.normal(size=(2, H.shape[1])) * self.density * np.sqrt(line.frequency / line.measure)
        return H @ (e[0] + 1j * e[1])

    def response(self, line: SineLine, drive: float) -> tuple[np.ndarray, np.ndarray]:
        """Measured parts of steady response and transient (channels,), in the phase of sin."""
        m, w = self.model, 2 * np.pi * line.frequency
        U, b = -1j * drive, self.model.b[:, 0]  # a sine: it begins at zero
        p, c = m.poles, m.c
        alpha, beta = 0.5 * b * U / (1j * w - p), 0.5 * b * np.conj(U) / (-1j * w - p)
        gamma = self.q - alpha - beta
        begin, end = line.delay / line.frequency, line.seconds
        steady = c @ alpha + (c @ beta).conj() + m.d[:, 0] * U
        one = gamma * (np.exp(p * end) - np.exp(p * begin)) / (p - 1j * w)
        other = gamma.conj() * (np.exp(p.conj() * end) - np.exp(p.conj() * begin))
        other = other / (p.conj() - 1j * w)
        self.q = gamma * np.exp(p * end) + alpha + beta
        return steady, (c @ one + c.conj() @ other) / (end - begin)

    def time(self) -> None:
        """None is kept."""


class _TimeSweep:
    """Line after line in time, as the front end samples it."""

    def __init__(self, rig: BenchRig, test: BenchTest, channels: Channels, keep: bool) -> None:
        self.rate = sampling_rate(test.band[1])
        self.run = PhysicalRun(rig, self.rate, test)
        self.rig, self.channels, self.keep = rig, channels, keep
        self.blocks: list[np.ndarray] = []
        self.phase = 0.0
        self.left: list[float] = []

    def line(
        self, line: SineLine, drive: float, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes by least squares over the measured samples."""
        n = int(np.ceil(line.seconds * self.rate))
        t = np.arange(1, n * self.run.finer + 1) / (self.rate * self.run.finer)
        angle = 2 * np.pi * line.frequency * t + self.phase
        volts = self.channels.true[:, None] * self.run.on(drive * np.sin(angle), rng)
        self.phase = float(angle[-1] % (2 * np.pi))
        x, over = digitised(volts, self.channels.noise, self.rate, self.rig.setup.front_end, rng)
        x = x / self.channels.stated[:, None]
        if self.keep:
            self.blocks.append(x.astype(np.float32))
        m = int(line.measure / line.frequency * self.rate)
        sampled, half = angle[self.run.finer - 1 :: self.run.finer], n - m // 2
        y, first, second = (
            _fitted(x[:, k], sampled[k])
            for k in (slice(n - m, n), slice(n - m, half), slice(half, n))
        )
        change = np.abs(second / second[0] - first / first[0])[1:]
        self.left.append(float((change / np.maximum(np.abs(y[1:] / y[0]), 1e-300)).max()))
        return y, over

    def time(self) -> TimeRecord | None:
        """One stretch, where it is kept."""
        if not self.keep:
            return None
        return time_record_of(
            self.rig, [np.concatenate(self.blocks, axis=1).astype(float)], self.rate
        )


def _fitted(x: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Complex amplitude (channels,) of x = Re Y e^{i angle} + constant, by least squares."""
    A = np.column_stack([np.cos(angle), -np.sin(angle), np.ones_like(angle)])
    a = np.linalg.lstsq(A, x.T, rcond=None)[0]
    return a[0] + 1j * a[1]
