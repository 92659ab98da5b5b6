"""What the numbers of a universal file mean: unit systems (dataset 164), labels, quantities."""

import re
from dataclasses import dataclass

import numpy as np

from ...dynamics.frf import MOTION_OVER_FORCE
from ...errors import FileError
from .uff_function import FunctionSet
from .unit_labels import is_force, plain, unit

# code of dataset 164: (metre per file length, newton per file force)
_POUND, _KILOGRAM_FORCE = 4.4482216152605, 9.80665
_SYSTEMS = {
    1: (1.0, 1.0),
    2: (0.3048, _POUND),
    3: (1.0, _KILOGRAM_FORCE),
    4: (0.3048, 0.138254954376),  # poundal
    5: (1e-3, 1e-3),
    6: (1e-2, 1e-2),
    7: (0.0254, _POUND),
    8: (1e-3, _KILOGRAM_FORCE),
}
_RESPONSE = {8: "receptance", 11: "mobility", 12: "accelerance"}
_HERTZ = {
    **dict.fromkeys(("", "hz", "hertz", "1/s", "s-1", "cps", "c/s", "cycle/s", "cycles/s"), 1.0),
    "khz": 1e3,
    **dict.fromkeys(("rad/s", "radian/s", "radians/s"), 1 / (2 * np.pi)),
    **dict.fromkeys(("1/min", "cpm", "rpm", "r/min", "rev/min", "u/min"), 1 / 60),
}
_SPEED = ("rpm", "r/min", "rev/min", "u/min")  # a frequency only where the data type says so
_FREQUENCY = 18  # specific data type; 0 and 1 leave it open
_ABSCISSA = {17: "time", 19: "rpm", 20: "order"}
_ELECTRICAL = re.compile(r"[kmunμ]?v|k?volts?|millivolts?|counts?|lsb|p?coulomb|pc")


@dataclass(frozen=True)
class FileUnits:
    """Metre and newton per unit of the file."""

    length: float = 1.0
    force: float = 1.0


@dataclass(frozen=True)
class Meaning:
    """The quantity of a record (None: not said) and the factor that turns it into SI."""

    quantity: str | None
    factor: float


def file_units(system: int, length: float, force: float) -> FileUnits:
    """Dataset 164: the named system, or for a user's own (code 9) the factors written there."""
    known = _SYSTEMS.get(system)
    if known:
        return FileUnits(*known)
    return FileUnits(1 / (length or 1.0), 1 / (force or 1.0))


def numerator(label: str) -> tuple[str | None, float]:
    """(quantity, factor to SI) of 'mm/s^2', 'g', 'in'; (None, 1) where it is no motion.

    >>> numerator("g")
    ('accelerance', 9.80665)
    """
    found = unit(label)
    if found is None or found.force or found.motion is None:
        return None, 1.0
    return found.motion, found.factor


def force_factor(label: str) -> float | None:
    """Newton per unit of a label; None where it is no force.

    >>> force_factor("lbf"), force_factor("Newton"), force_factor("mm")
    (4.4482216152605, 1.0, None)
    """
    found = unit(label)
    return found.factor if found is not None and is_force(found) else None


def ratio(label: str) -> tuple[str | None, float | None, float | None]:
    """(quantity, factor above, factor below) of a unit label such as '(m/s^2)/N'; None: not said.

    >>> ratio("mm/s/N"), ratio("mm/s")
    (('mobility', 0.001, 1.0), ('mobility', 0.001, None))
    >>> ratio("g/g")
    ('transmissibility', 9.80665, 9.80665)
    """
    found, text = unit(label), plain(label)
    if found is not None and found.motion is not None:
        return found.motion, found.factor, 1.0 if found.force else None
    for cut in range(len(text)):  # motion over motion: every slash may be the bar
        if text[cut] == "/":
            above, below = numerator(text[:cut]), numerator(text[cut + 1 :])
            if above[0] and above[0] == below[0]:
                return "transmissibility", above[1], below[1]
    return None, None, None


def meaning(record: FunctionSet, units: FileUnits, where: str) -> Meaning:
    """Quantity and SI factor of an FRF: unit labels first, then data types and dataset 164."""
    typed = _RESPONSE.get(record.ordinate.kind)
    motion_below = record.denominator.kind in _RESPONSE
    if over := _force_over_motion(record, units):
        return over
    if record.function == 5 or (typed and motion_below):
        return Meaning("transmissibility", 1.0)
    said, length, force = ratio(record.ordinate.unit)
    below = record.denominator.unit
    for text, motion in ((record.ordinate.unit, said), (below, numerator(below)[0])):
        if plain(text) and not motion and force_factor(text) is None:
            raise FileError(
                f"{where}: the unit {text!r} is not known; known are m, mm, in, g, N, lbf and "
                "similar units; state the quantity in the case if the numbers have the units of "
                "the file's head (dataset 164, else SI)"
            )
    if said and typed and said not in (typed, "transmissibility"):
        raise FileError(
            f"{where}: the data type says {typed}, the unit label "
            f"{record.ordinate.unit!r} says {said}; state the quantity in the case"
        )
    if said == "transmissibility":
        return Meaning(said, length / force if length and force else 1.0)
    force = force or force_factor(below) or units.force
    return Meaning(said or typed, (length or units.length) / force)


_FORCE = 13  # data type of a force
_RECIPROCAL: dict[str, str] = {name: dual for dual, name in MOTION_OVER_FORCE.items()}


def _force_over_motion(record: FunctionSet, units: FileUnits) -> Meaning | None:
    """Apparent mass, impedance or dynamic stiffness; None for any other record."""
    force = force_factor(record.ordinate.unit)
    said, length = numerator(record.denominator.unit)
    motion = said or _RESPONSE.get(record.denominator.kind)
    if motion is None or not (record.ordinate.kind == _FORCE or force):
        return None
    length = length if said else units.length
    return Meaning(_RECIPROCAL[motion], (force or units.force) / length)


def hertz(record: FunctionSet, where: str) -> np.ndarray:
    """The abscissa as frequencies [Hz]; revolutions only where they are said to be a frequency."""
    kind, text = record.abscissa.kind, plain(record.abscissa.unit).strip("()")
    needed = f"a function of frequency has data type {_FREQUENCY} and is in Hz, kHz, rad/s or rpm"
    is_frequency = kind == _FREQUENCY or (kind in (0, 1) and text not in _SPEED)
    if text not in _HERTZ or not is_frequency:
        named = _ABSCISSA.get(kind)
        typed = f"data type {kind}" + (f" ({named})" if named else "")
        raise FileError(f"{where}: its abscissa, {typed}, is in {record.abscissa.unit!r}; {needed}")
    f = np.asarray(record.x, float) * _HERTZ[text]
    if np.any(f < 0):
        raise FileError(f"{where}: a frequency of {f.min():g} Hz is negative")
    return f


def check_calibrated(record: FunctionSet, where: str) -> None:
    """Refuse what a front end measured but nobody calibrated."""
    for axis in (record.ordinate, record.denominator):
        if any(_ELECTRICAL.fullmatch(part) for part in re.split(r"[^a-zμ]", plain(axis.unit))):
            raise FileError(
                f"{where}: its values are in {axis.unit!r} and the file has no calibration; "
                "export units of motion and force (m, mm/s, m/s^2 or g over N or lbf); "
                'or use .npz with the quantity, and gain = "unknown" in the case'
            )
