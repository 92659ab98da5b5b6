"""Maps of FRFs, each of which undoes one way of writing them wrongly, by name.

Right numbers under a wrong description are a family of maps. The quantity, the sign or the
direction of time is another; parts are exchanged; radians stand for degrees, decibels for a ratio.
A map is a word and its arguments, as ``("factor", "-1")``, so that a finding can hold it.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from ..dynamics.frf import FRF, Quantity

LARGEST_DECIBELS = 300.0  # of a magnitude: 10^15
_ROUNDING = 1.001  # of a phase


def _factor(frf: FRF, factor: str) -> FRF:
    """``values`` times a real factor."""
    x = float(factor)
    variance = None if frf.variance is None else x**2 * frf.variance
    return replace(frf, values=x * frf.values, variance=variance)


def _reversed(frf: FRF, label: str) -> FRF:
    """Turn the sign of one output."""
    sign = np.where(np.array(frf.outputs) == label, -1, 1)[:, None]
    return replace(frf, values=sign * frf.values)


def _exchanged(frf: FRF, one: str, other: str) -> FRF:
    """Put two outputs under each other's label."""
    swap = {one: other, other: one}
    order = [swap.get(label, label) for label in frf.outputs]
    return replace(frf.sel(outputs=order), outputs=frf.outputs)


def _polar(frf: FRF, magnitude: np.ndarray, phase: np.ndarray) -> FRF:
    """Form |H| e^(iφ), φ [rad]; the noise that was stated does not hold for it."""
    return replace(frf, values=magnitude * np.exp(1j * phase), variance=None)


def _decibels(frf: FRF) -> FRF:
    """10^(±|v|/20) e^(±iφ) of v = 20 log10|H| e^(iφ), the sign of the decibels by continuity.

    Below 0 dB the phase of v is that of -H. Where v changes sign, its phase jumps by π and that of
    H does not, so the sign with the smaller step of log H is taken. Two courses are left. The phase
    of the right one falls where it is large, as at every stable pole.
    """
    v = frf.values
    plus = np.log(10) / 20 * np.abs(v) + 1j * np.angle(v)
    minus = -np.log(10) / 20 * np.abs(v) + 1j * np.angle(-v)
    out = plus.copy()
    for k in range(1, len(v)):
        steps = [np.abs(_turn(branch[k] - out[k - 1])) for branch in (plus, minus)]
        out[k] = np.where(steps[0] <= steps[1], plus[k], minus[k])
    falls = -_turn(np.diff(out, axis=0)).imag
    large = out.real - np.median(out.real, axis=0)
    wrong = (falls * (large[1:] + large[:-1])).sum(axis=0) < 0
    out = np.where(wrong, -out.conj() + 1j * np.pi, out)
    return replace(frf, values=np.exp(out), variance=None)


def _turn(step: np.ndarray) -> np.ndarray:
    """Step of log H with its phase wrapped to [-π, π)."""
    return np.asarray(step.real + 1j * ((step.imag + np.pi) % (2 * np.pi) - np.pi))


def _two_columns(decibels: bool, unit: float) -> Callable[[FRF], FRF]:
    """Magnitude in the real part, phase times ``unit`` [rad] in the imaginary part."""

    def read(frf: FRF) -> FRF:
        x = frf.values.real
        return _polar(frf, 10 ** (x / 20) if decibels else x, unit * frf.values.imag)

    return read


_DEGREE = float(np.pi / 180)
MAPS: dict[str, Callable[..., FRF]] = {
    "factor": _factor,
    "quantity": lambda frf, quantity: replace(frf, quantity=cast(Quantity, quantity)),
    "conjugated": lambda frf: replace(frf, values=frf.values.conj()),
    "swapped parts": lambda frf: replace(frf, values=1j * frf.values.conj()),  # b + ia of a + ib
    "reversed": _reversed,
    "exchanged": _exchanged,
    "phase in radians": lambda frf: _polar(  # that were read as degrees
        frf, np.abs(frf.values), np.degrees(np.angle(frf.values))
    ),
    "decibels": _decibels,
    "decibels and degrees": _two_columns(True, _DEGREE),
    "decibels and radians": _two_columns(True, 1.0),
    "magnitude and degrees": _two_columns(False, _DEGREE),
    "magnitude and radians": _two_columns(False, 1.0),
}


def mapped(frf: FRF, mend: tuple[str, ...]) -> FRF:
    """Apply a map by its name and arguments.

    >>> frf = FRF(np.full((1, 1, 1), 3 + 4j), np.ones(1), ("1:+Z",), ("1:+Z",))
    >>> complex(mapped(frf, ("swapped parts",)).values[0, 0, 0])
    (4+3j)
    """
    name, *arguments = mend
    return MAPS[name](frf, *arguments)


@dataclass(frozen=True)
class Misreading:
    """One way in which a file may have been written: its kind, in words, the remedy, the map."""

    kind: str
    text: str
    repair: str
    mend: tuple[str, ...]


_AGAIN = "correct the columns, or export complex values again"
_COLUMNS = "the real parts are {} and the imaginary parts {}"
_WRITTEN = {  # what the numbers of a file may be: in words, and what corrects the file
    "swapped parts": (
        "real and imaginary parts are exchanged", "exchange the columns of real and imaginary part",
    ),
    "phase in radians": (
        "the phase is in radians and was read in degrees", "write the phase in degrees",
    ),
    "decibels": ("the magnitudes are decibels", "write 10^(dB / 20)"),
    "decibels and degrees": (_COLUMNS.format("decibels", "degrees"), _AGAIN),
    "decibels and radians": (_COLUMNS.format("decibels", "radians"), _AGAIN),
    "magnitude and degrees": (_COLUMNS.format("magnitudes", "degrees"), _AGAIN),
    "magnitude and radians": (_COLUMNS.format("magnitudes", "radians"), _AGAIN),
}  # fmt: skip


def misreadings(frf: FRF) -> Iterator[Misreading]:
    """Every map of the family under which these numbers would be possible FRFs."""
    v = frf.values
    possible = {
        "phase": bool(np.abs(np.angle(v)).max() <= 2 * np.pi * _DEGREE * _ROUNDING),
        "decibels": bool(np.abs(v).max() <= LARGEST_DECIBELS and v.imag.any()),
        "magnitude": bool((v.real >= 0).all() and v.imag.any()),
    }
    for name, (text, repair) in _WRITTEN.items():
        if possible.get(name.split()[0], True):
            yield Misreading(name, text, repair, (name,))
