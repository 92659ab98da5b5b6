"""Unit systems of decks: everything is converted to SI once, where the deck is read."""

import math
from dataclasses import dataclass

from .errors import FileError


@dataclass(frozen=True)
class Units:
    """A consistent system: one unit of length, mass and time, in SI.

    >>> UNITS["mm-t-s"].stress
    1000000.0
    """

    name: str
    length: float  # [m]
    mass: float  # [kg]
    time: float = 1.0  # [s]
    weight: float = 1.0  # what a deck multiplies its masses by: PARAM,WTMASS

    @property
    def force(self) -> float:
        """[N]."""
        return self.mass * self.length / self.time**2

    @property
    def stress(self) -> float:
        """[Pa]."""
        return self.mass / (self.length * self.time**2)

    @property
    def inertia(self) -> float:
        """Mass as a deck counts it, its weight included [kg]."""
        return self.mass * self.weight

    @property
    def density(self) -> float:
        """[kg/m³]."""
        return self.inertia / self.length**3


UNITS = {
    unit.name: unit
    for unit in (
        Units("SI", 1.0, 1.0),
        Units("mm-t-s", 1e-3, 1e3),
        Units("mm-kg-ms", 1e-3, 1.0, 1e-3),
        Units("mm-kg-s", 1e-3, 1.0),
        Units("in-lb-s", 0.0254, 4.4482216152605 / 0.0254),  # pound-force; mass in lbf s²/in
    )
}
HERTZ = {"Hz": 1.0, "kHz": 1e3, "rad/s": 1 / (2 * math.pi), "rpm": 1 / 60}  # of a recording


def units(name: str | Units) -> Units:
    """The unit system of this name; a system as it is.

    Raises
    ------
    FileError
        If there is none of this name; the sentence lists those there are.
    """
    if isinstance(name, Units):
        return name
    if name not in UNITS:
        raise FileError(f"no unit system {name!r}; there are {', '.join(UNITS)}")
    return UNITS[name]


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float | None, digits: int = 4) -> str:
    """A number with so many significant digits, whole up to a million.

    >>> number(0.0123456), number(31794.2), number(1940.0, 2), number(None)
    ('0.01235', '31794', '1940', '–')
    >>> number(2.755e7), number(-1e-9)
    ('2.755×10⁷', '-1×10⁻⁹')
    """
    if value is None or not math.isfinite(value):
        return "–"
    if value and digits - 1 < math.log10(abs(value)) < 6:
        return f"{value:.0f}"
    mantissa, _, power = f"{value:.{digits}g}".partition("e")
    return f"{mantissa}×10{str(int(power)).translate(_RAISED)}" if power else mantissa
