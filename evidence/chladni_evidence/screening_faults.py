"""Faults put into sound recordings, and the rates at which the screening names them."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.ema.chain_checks import FACTORS
from chladni.ema.finding import Screening
from chladni.errors import ModelError

from .response_of_article import seen
from .screening_evidence import STRUCTURES, Sound, screening_of, sound

Spoilt = tuple[FRF, tuple[str, ...]]  # the recording, and the channels at fault
AWAY = 0.15  # least displacement of a misplaced sensor, over the length of the structure
SEEN = 0.15  # least motion at a turned sensor, over a typical motion across the sheet


def _channel(made: Sound, rng: np.random.Generator) -> int:
    return int(rng.integers(len(made.frf.outputs)))


def _times(made: Sound, i: int, factor: float) -> Spoilt:
    values = made.frf.values.copy()
    values[:, i] *= factor
    variance = made.frf.variance
    if variance is not None:
        variance = variance.copy()
        variance[:, i] *= factor**2
    return replace(made.frf, values=values, variance=variance), (made.frf.outputs[i],)


def gain(made: Sound, rng: np.random.Generator) -> Spoilt:
    """One channel times 0.5, 0.7, 1.4 or 2."""
    return _times(made, _channel(made, rng), float(rng.choice([0.5, 0.7, 1.4, 2.0])))


def sign(made: Sound, rng: np.random.Generator) -> Spoilt:
    """One sensor upside down."""
    return _times(made, _channel(made, rng), -1.0)


def swapped(made: Sound, rng: np.random.Generator) -> Spoilt:
    """Two cables exchanged."""
    i, j = rng.choice(len(made.frf.outputs), 2, replace=False)
    order = np.arange(len(made.frf.outputs))
    order[[i, j]] = j, i
    labels = made.frf.outputs
    return replace(made.frf.sel([labels[k] for k in order]), outputs=labels), (labels[i], labels[j])


def dead(made: Sound, rng: np.random.Generator) -> Spoilt:
    """A disconnected cable: the noise of the front end alone."""
    i = _channel(made, rng)
    values = made.frf.values.copy()
    size = 10 ** rng.uniform(-4, -1) * np.sqrt((np.abs(values) ** 2).mean())
    noise = rng.normal(size=(2, len(values), 1)) * size / np.sqrt(2)
    values[:, i] = noise[0] + 1j * noise[1]
    variance = made.frf.variance
    if variance is not None:
        variance = variance.copy()
        variance[:, i] = size**2
    return replace(made.frf, values=values, variance=variance), (made.frf.outputs[i],)


def copied(made: Sound, rng: np.random.Generator) -> Spoilt:
    """One signal recorded twice, with the same noise."""
    i, j = rng.choice(len(made.frf.outputs), 2, replace=False)
    values = made.frf.values.copy()
    values[:, j] = values[:, i]
    variance = made.frf.variance
    if variance is not None:
        variance = variance.copy()
        variance[:, j] = variance[:, i]
    labels = made.frf.outputs
    return replace(made.frf, values=values, variance=variance), (labels[i], labels[j])


def doubled(made: Sound, rng: np.random.Generator) -> Spoilt:
    """One sensor under two labels in two runs: the signal is the same, the noise is not."""
    i, j = rng.choice(len(made.frf.outputs), 2, replace=False)
    clean = made.clean.copy()
    clean[:, j] = clean[:, i]
    frf = made.measured(clean, rng)
    return _like(made, frf), (frf.outputs[i], frf.outputs[j])


def _like(made: Sound, frf: FRF) -> FRF:
    return frf if made.frf.variance is not None else replace(frf, variance=None)


def _with_row(made: Sound, i: int, phi: np.ndarray, rng: np.random.Generator) -> Spoilt:
    """Channel i measured with other shapes (r,)."""
    clean = made.clean.copy()
    clean[:, i] = made.accelerance(phi[None])[:, 0]
    return _like(made, made.measured(clean, rng)), (made.frf.outputs[i],)


def turned(made: Sound, rng: np.random.Generator) -> Spoilt:
    """A sensor along another axis, in which its place also moves."""
    typical = np.sqrt((np.abs(made.clean) ** 2).mean())
    for i in rng.permutation(len(made.frf.outputs)):
        for axis in rng.permutation(3):
            n = made.outputs.directions[i]
            if abs(n[axis]) > 0.7:
                continue
            foot = made.foot_of(int(i))
            phi = seen(made.modes, foot, np.eye(3)[[axis]] * rng.choice([-1.0, 1.0]))[0]
            if np.sqrt((np.abs(made.accelerance(phi[None])) ** 2).mean()) > SEEN * typical:
                return _with_row(made, int(i), phi, rng)
    raise ModelError(f"no sensor of {made.bench.name} has motion along another axis")


def misplaced(made: Sound, rng: np.random.Generator) -> Spoilt:
    """A sensor at an unlisted place, a seventh of the structure away or more."""
    i = _channel(made, rng)
    apart = np.linalg.norm(made.places - made.outputs.points[i], axis=1)
    far = np.flatnonzero(apart > AWAY * np.ptp(made.places, axis=0).max())
    return _with_row(made, i, made.elsewhere[int(rng.choice(far))], rng)


def delay(made: Sound, rng: np.random.Generator) -> Spoilt:
    """All responses late, by 20 to 120 degrees at the highest line."""
    f = made.frf.frequency
    tau = rng.uniform(0.35, 2.1) / (2 * np.pi * f[-1])
    late = np.exp(-2j * np.pi * f * tau)[:, None, None]
    return replace(made.frf, values=made.frf.values * late), ()


def quantity(made: Sound, rng: np.random.Generator) -> Spoilt:
    """Receptance or mobility that is labelled accelerance."""
    other = made.frf.to(str(rng.choice(["receptance", "mobility"])))  # type: ignore[arg-type]
    return replace(other, quantity="accelerance"), ()


def units(made: Sound, rng: np.random.Generator) -> Spoilt:
    """A factor of 9.81 or 4.448, or its inverse."""
    factor = 1 / float(rng.choice(list(FACTORS)[:4]))
    variance = made.frf.variance
    variance = None if variance is None else variance * factor**2
    return replace(made.frf, values=made.frf.values * factor, variance=variance), ()


def polarity(made: Sound, rng: np.random.Generator) -> Spoilt:
    """The force gauge upside down."""
    return replace(made.frf, values=-made.frf.values), ()


@dataclass(frozen=True)
class FaultKind:
    """Maker of a fault, and the kinds of finding that name it."""

    make: Callable[[Sound, np.random.Generator], Spoilt]
    kinds: tuple[str, ...]


FAULTS = {
    "gain": FaultKind(gain, ("wrong gain",)),
    "sign": FaultKind(sign, ("reversed sign",)),
    "swapped pair": FaultKind(swapped, ("swapped channels",)),
    "dead": FaultKind(dead, ("dead channel",)),
    "duplicated pair": FaultKind(copied, ("duplicated channels",)),
    "one sensor, two labels": FaultKind(doubled, ("duplicated channels",)),
    "turned": FaultKind(turned, ("turned sensor",)),
    "misplaced": FaultKind(misplaced, ("misplaced sensor",)),
    "delay": FaultKind(delay, ("delay",)),
    "wrong quantity": FaultKind(quantity, ("wrong quantity",)),
    "wrong units": FaultKind(units, ("wrong units",)),
    "force reversed": FaultKind(polarity, ("reversed force", "reversed sign")),
}


def outcome(screening: Screening, kind: FaultKind, channels: Sequence[str]) -> str:
    """Outcome: named (the fault and its channels), seen (another name, or further ones), missed."""
    named = [f for f in screening.findings if f.kind in kind.kinds]
    if any(not channels or set(f.channels) & set(channels) for f in named):
        exact = any(not channels or set(f.channels) == set(channels) for f in named)
        return "named" if exact else "seen"
    return "seen" if screening.findings else "missed"


def tally(
    seeds: Sequence[int], kinds: Sequence[str], say: Callable[[str], None], long: bool = False
) -> dict[str, Counter[str]]:
    """Outcomes of every fault over seeds, the structures in turn; findings on sound recordings.

    Parameters
    ----------
    long : use recordings of so many lines that screening leaves out most of them
    """
    counts: dict[str, Counter[str]] = {k: Counter() for k in ("sound", *kinds)}
    for seed in seeds:
        for name in (STRUCTURES[seed % 6], STRUCTURES[(seed + 3) % 6]):  # two recordings a seed
            made = sound(name, seed, long)
            found = screening_of(made, made.frf)
            counts["sound"]["clean" if not found.findings else "alarm"] += 1
            if found.findings:
                say(f"{name} {seed}: {found.sentence}")
        for kind in kinds:
            rng = np.random.default_rng([seed, 13, *kind.encode()])
            try:
                frf, channels = FAULTS[kind].make(made, rng)
            except ModelError:
                counts[kind]["none possible"] += 1
                continue
            found = screening_of(made, frf)
            said = outcome(found, FAULTS[kind], channels)
            counts[kind][said] += 1
            if said != "named":
                say(f"{kind}, {name} {seed} {channels}: {said}; {found.sentence}")
    return counts
