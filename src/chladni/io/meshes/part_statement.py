"""Properties of a part in words: ``door: t=0.8 mm, steel``, or a row of a table."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ...arrays import real_number
from ...errors import FileError, did_you_mean
from ...model.properties import (
    BeamSection,
    Isotropic,
    Material,
    Section,
    ShellSection,
    SolidSection,
)
from ...units import Units
from ..nastran.read.beam_profiles import SHAPES, Profile
from ..tables.csv_table import read_table

MATERIALS = {  # E [Pa], nu, rho [kg/m³]: handbook values, which a calibration corrects
    "steel": (2.1e11, 0.3, 7850.0),
    "stainless steel": (1.95e11, 0.3, 7950.0),
    "cast iron": (1.1e11, 0.26, 7200.0),
    "aluminium": (7.0e10, 0.33, 2700.0),
    "aluminum": (7.0e10, 0.33, 2700.0),
    "magnesium": (4.5e10, 0.35, 1780.0),
    "titanium": (1.14e11, 0.34, 4430.0),
    "copper": (1.2e11, 0.34, 8930.0),
    "brass": (1.05e11, 0.34, 8500.0),
    "glass": (7.0e10, 0.23, 2500.0),
}
_LENGTH = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
_STRESS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "psi": 6894.757293, "ksi": 6894757.293}
_DENSITY = {
    "kg/m3": 1.0, "kg/m^3": 1.0, "g/cm3": 1e3, "g/cm^3": 1e3, "kg/mm3": 1e9, "t/mm3": 1e12,
    "t/m3": 1e3,
}  # fmt: skip
_UNITS = {  # of each word: name of the factor of a unit system, and units in SI
    "t": ("length", _LENGTH), "d": ("length", _LENGTH), "b": ("length", _LENGTH),
    "h": ("length", _LENGTH), "E": ("stress", _STRESS), "rho": ("density", _DENSITY),
    "nu": ("", {}),
}  # fmt: skip
_MEANT = {"thickness": "t", "diameter": "d", "width": "b", "height": "h", "density": "rho",
          "e": "E", "poisson": "nu"}  # fmt: skip
_VALUE = re.compile(r"(?P<number>[-+.\d][-+.\deE]*)\s*(?P<unit>[A-Za-z][^\s]*)?")
WAY = 'give --part "NAME: t=0.8 mm, steel"'


@dataclass(frozen=True)
class PartStatement:
    """Properties of a part in the numbers of its mesh."""

    name: str  # of the part, or its number; "" for all parts
    values: Mapping[str, float]  # t, d, b, h, E, nu, rho

    def is_of(self, name: str, number: int) -> bool:
        """True if it speaks of the part with this name and number."""
        return self.name.lower() in (name.lower(), str(number), "")

    def lacks(self, dimension: int) -> str:
        """Properties that lines (1), surfaces (2) or volumes (3) need in addition; "" for none."""
        value = self.values
        lacking = [] if {"E", "nu", "rho"} <= set(value) else ["a material"]
        if dimension == 2 and not value.get("t", 0) > 0:
            lacking.append("a thickness t")
        if dimension == 1 and not (value.get("d", 0) > 0 or min(self._bar) > 0):
            lacking.append("a diameter d, or a width b and height h")
        return " and ".join(lacking)

    @property
    def _bar(self) -> tuple[float, float]:
        return self.values.get("b", 0.0), self.values.get("h", 0.0)

    def section(self, dimension: int) -> Section:
        """Section of lines, surfaces or volumes that lack nothing.

        Lines are a bar of width b and height h, else a round bar of diameter d; with t a tube.
        """
        value = self.values
        material = Isotropic(value["E"], value["nu"], value["rho"])
        if dimension == 3:
            return SolidSection(material)
        if dimension == 2:
            return ShellSection(value["t"], material, material)
        if min(self._bar) > 0:
            profile = SHAPES["BAR"][0](*self._bar)
        else:
            wall = value.get("t", value["d"] / 2)
            profile = SHAPES["TUBE2"][0](value["d"] / 2, wall)
        return beam_section(material, profile)


def beam_section(material: Material, p: Profile) -> BeamSection:
    """A beam with this profile, its height along the orientation vector."""
    return BeamSection(material, p.area, p.I1, p.I2, p.I12, p.J, p.shear)


def part_statement(text: str, units: Units | None, said: str = "") -> PartStatement:
    """Read a statement.

    Parameters
    ----------
    units : unit system of the mesh; without one no material and no unit can be named

    Raises
    ------
    FileError
        If a word or unit is unknown.

    Examples
    --------
    >>> from chladni.units import UNITS
    >>> part_statement("door: t=0.8 mm, steel", UNITS["mm-t-s"]).values["t"]
    0.8
    """
    said = said or f"--part {text!r}"
    name, colon, rest = text.rpartition(":")
    values: dict[str, float] = {}
    for word in (w.strip() for w in rest.split(",")):
        key, equals, value = (w.strip() for w in word.partition("="))
        if equals:
            key = _MEANT.get(key.lower(), key)
            values[key] = _number(key, value, units, said)
        elif word:
            values = {**_material(word, units, said), **values}
    if not values:
        raise FileError(f"{said} states no property; {WAY}")
    return PartStatement(name.strip() if colon else "", values)


def statements_of_table(path: Path, units: Units | None) -> list[PartStatement]:
    """Statements of a CSV with the columns part, material, t, d, b, h, E, nu and rho."""
    table = read_table(path, ("part",), ("material", *(k.lower() for k in _UNITS), *_MEANT))
    found = []
    for k, line in enumerate(table.line):
        cells = {name: column[k] for name, column in table.columns.items() if column[k]}
        words = [cells.pop("material", ""), *(f"{n}={v}" for n, v in cells.items() if n != "part")]
        text = f"{cells['part']}: {', '.join(w for w in words if w)}"
        found.append(part_statement(text, units, f"{path.name}, line {line},"))
    return found


def _number(key: str, text: str, units: Units | None, said: str) -> float:
    """A value in the numbers of the mesh."""
    if key not in _UNITS:
        hint = did_you_mean(key, _UNITS)
        raise FileError(f"{said} states {key!r}; {hint}there are {', '.join(_UNITS)}")
    found = _VALUE.fullmatch(text)
    try:
        number = real_number(found["number"] if found else text)
    except ValueError:
        raise FileError(f"{said}: {key} is {text!r}, which is not a number with a unit") from None
    unit = found["unit"] if found else None
    if not unit:
        return number
    factor, known = _UNITS[key]
    if unit not in known:
        there = f"; there are {', '.join(known)}" if known else ""
        raise FileError(f"{said}: {key} has the unit {unit!r}{there}")
    return number * known[unit] / float(getattr(_system(units, said), factor))


def _material(name: str, units: Units | None, said: str) -> dict[str, float]:
    if name.lower() not in MATERIALS:
        hint = did_you_mean(name.lower(), MATERIALS)
        raise FileError(
            f"{said} names the material {name!r}; {hint}there are {', '.join(MATERIALS)}, or state "
            "E, nu and rho"
        )
    E, nu, rho = MATERIALS[name.lower()]
    system = _system(units, said)
    return {"E": E / system.stress, "nu": nu, "rho": rho / system.density}


def _system(units: Units | None, said: str) -> Units:
    if units is None:
        raise FileError(
            f"{said} needs the unit system of the mesh; give it by --units (mm-t-s for millimetres)"
        )
    return units
