"""Recordings of a sound plate written wrongly: the answer is a refusal, or it names the cause.

Each is one map of the FRFs of the plate or of their axis. The deck is right, so that every name but
that of the map is wrong.
"""

import io
import random
from collections.abc import Callable

import numpy as np

from .fuzz_input import FuzzInput
from .sound_files import Files

Stored = Callable[[np.ndarray, np.ndarray, random.Random], tuple[np.ndarray, np.ndarray]]
_CASE = """\
[model]
deck = "plate.bdf"
units = "mm-t-s"
damping = 0.01

[test]
recordings = ["frf.npz"]
quantity = "accelerance"

[band]
fit = [25.0, 170.0]
"""
_NOISE = 0.002  # of every sample


def _values(change: Callable[[np.ndarray], np.ndarray]) -> Stored:
    return lambda f, H, rng: (f, change(H))


def _decibels(H: np.ndarray) -> np.ndarray:
    return np.asarray(20 * np.log10(np.abs(H)))


def _polar(size: np.ndarray, phase: np.ndarray) -> np.ndarray:
    return np.asarray(size * np.exp(1j * phase))


def _cut(f: np.ndarray, H: np.ndarray, rng: random.Random) -> tuple[np.ndarray, np.ndarray]:
    """Every magnitude at most a part of the largest."""
    size = np.abs(H)
    return f, H * np.minimum(1, rng.uniform(0.05, 0.3) * size.max(axis=0) / size)


def _shifted(f: np.ndarray, H: np.ndarray, rng: random.Random) -> tuple[np.ndarray, np.ndarray]:
    return f + rng.uniform(5.0, 9.0), H


def _exchanged(f: np.ndarray, H: np.ndarray, rng: random.Random) -> tuple[np.ndarray, np.ndarray]:
    i, j = rng.sample(range(H.shape[1]), 2)
    order = np.arange(H.shape[1])
    order[[i, j]] = j, i
    return f, H[:, order]


STORED: dict[str, tuple[str, Stored]] = {  # what was done: what the answer has to say, how
    "reversed": ("reversed", _values(lambda H: -H)),
    "conjugated": ("conjugated", _values(np.conj)),
    "swapped parts": ("exchanged", _values(lambda H: H.imag + 1j * H.real)),
    "radians": ("radians", _values(lambda H: _polar(np.abs(H), np.radians(np.angle(H))))),
    "degrees": ("phase", _values(lambda H: _polar(np.abs(H), np.degrees(np.angle(H))))),
    "decibels": ("decibels", _values(lambda H: _polar(_decibels(H), np.angle(H)))),
    "decibels, degrees": (
        "decibels",
        _values(lambda H: _decibels(H) + 1j * np.degrees(np.angle(H))),
    ),
    "real decibels": ("decibels", _values(lambda H: _decibels(H) + 0j)),
    "imaginary part": ("imaginary", _values(lambda H: H.imag + 0j)),
    "real part": ("real parts", _values(lambda H: H.real + 0j)),
    "magnitude": ("magnitudes", _values(lambda H: np.abs(H) + 0j)),
    "g": ("in g", _values(lambda H: H / 9.80665)),
    "rad/s": ("rad/s", lambda f, H, rng: (2 * np.pi * f, H)),
    "cut off": ("cut off", _cut),
    "axis": ("frequency axis|nothing fits|unlike", _shifted),
    "two channels": ("exchanged|place|wrong|unlike", _exchanged),
}


def contradictory(rng: random.Random, sound: Files) -> FuzzInput:
    """The plate's own responses with a little noise, under one of ``STORED``."""
    held = dict(np.load(io.BytesIO(sound["frf.npz"]), allow_pickle=False))
    noise = np.random.default_rng(rng.randrange(2**32)).normal(size=(2, *held["values"].shape))
    H = held["values"] * (1 + _NOISE * (noise[0] + 1j * noise[1]))
    name = rng.choice(list(STORED))
    cause, change = STORED[name]
    held["frequency_hz"], held["values"] = change(held["frequency_hz"], H, rng)
    with io.BytesIO() as out:
        np.savez(out, **held)
        files = {"frf.npz": out.getvalue()}
    files |= {"plate.bdf": sound["plate.bdf"], "case.toml": _CASE.encode()}
    return FuzzInput("contradictory", files, ("check", "."), cause=cause)
