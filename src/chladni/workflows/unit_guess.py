"""Which unit system a bare deck is in, by its materials, its size and its mass."""

from dataclasses import dataclass

import numpy as np

from ..errors import FileError
from ..fem.energy import mass_properties
from ..model.assembly import Assembly
from ..model.properties import Isotropic, Material, Section, ShellSection
from ..units import UNITS, Units

MATERIALS = {  # E [Pa], rho [kg/m³]: what decks are made of
    "steel": (2.1e11, 7850.0),
    "aluminium or glass": (7.0e10, 2650.0),
    "magnesium": (4.5e10, 1770.0),
    "titanium": (1.1e11, 4430.0),
    "copper": (1.2e11, 8900.0),
    "a carbon laminate": (7.0e10, 1550.0),
    "wood": (1.1e10, 450.0),
    "a plastic": (2.5e9, 1150.0),
    "an adhesive or rubber": (6.0e6, 1050.0),
}
SIZE, MASS = (0.005, 50.0), (1e-3, 1e5)  # [m], [kg] of what is tested in one piece
NEAR_DECADES = 0.5  # decades: farther from every material a system is not believed
CLEAR = 1.0  # decades the next system must be worse by


@dataclass(frozen=True)
class UnitGuess:
    """A unit system, whether it is the only one that fits, and why in one sentence."""

    units: Units
    sure: bool
    why: str


def guessed_units(made: Assembly, source: str, read_in: Units = UNITS["SI"]) -> UnitGuess:
    """The system in which the deck's numbers are those of known materials.

    Parameters
    ----------
    made : the deck as it was read
    read_in : in which system; a deck read without one counts as SI
    """
    pairs = _materials(made, read_in)
    if not pairs:
        raise FileError(
            f"{source}: no material has a modulus and a density that show the unit system; give "
            f"--units, one of {', '.join(UNITS)}"
        )
    size, mass = _size_and_mass(made, read_in)
    ranked = sorted(
        (_off_materials(pairs, u) + _odd(size, mass, u), k, u) for k, u in enumerate(UNITS.values())
    )
    (best, _, units), (second, *_) = ranked[:2]
    E, rho = pairs[0]
    if best > NEAR_DECADES:
        raise FileError(
            f"{source}: E = {E:g} and rho = {rho:g} are usual in no unit system "
            f"({', '.join(UNITS)}); check the materials, or give --units"
        )
    return UnitGuess(units, second > best + CLEAR, _why(pairs[0], size, mass, units))


def doubt_of_units(made: Assembly, source: str, units: Units) -> str:
    """A sentence against the unit system a bare deck was read in; '' where nothing speaks so."""
    pairs, (size, mass) = _materials(made, units), _size_and_mass(made, units)
    seen = f"in {units.name} {_seen(size, mass, units)}"
    if pairs and _off_materials(pairs, units) > NEAR_DECADES:
        better = min(UNITS.values(), key=lambda u: _off_materials(pairs, u))
        if _off_materials(pairs, better) <= NEAR_DECADES:
            raise FileError(
                f"{source}: give --units {better.name}, not {units.name}: "
                f"{_why(pairs[0], size, mass, better)}; {seen}, and its materials are not known "
                "ones"
            )
        E, rho = pairs[0]
        first = _moduli(E * units.stress, rho * units.density)
        return f"{source}: no unit system makes its materials known ones; {seen}, with {first}"
    if _odd(size, mass, units):
        return f"{source}: {seen}: check --units and the cards"
    return ""


def _size_and_mass(made: Assembly, read_in: Units) -> tuple[float, float]:
    """Diagonal of the box around the deck, and its mass, in the deck's own units."""
    size = float(np.linalg.norm(np.ptp(made.points, axis=0))) / read_in.length
    return size, float(mass_properties(made)[0]) / read_in.mass


def _why(pair: tuple[float, float], size: float, mass: float, u: Units) -> str:
    """The deck as a unit system has it, in which its first material (E, rho) is a known one."""
    E, rho = pair[0] * u.stress, pair[1] * u.density
    named = f"{_named(E, rho)} ({_moduli(E, rho)})"
    return f"in {u.name} {_seen(size, mass, u)} and its first material is {named}"


def _seen(size: float, mass: float, u: Units) -> str:
    return f"the deck is {size * u.length:.3g} m across, weighs {mass * u.mass:.4g} kg"


def _moduli(E: float, rho: float) -> str:
    return f"E = {E / 1e9:.4g} GPa, rho = {rho:.4g} kg/m³"


def material_of(section: Section) -> Material | None:
    """The material of a section; of a shell that of its membrane."""
    if isinstance(section, ShellSection):
        return section.membrane or section.bending
    return getattr(section, "material", None)


def modulus_of(material: Material) -> float:
    """E, or E1 of the plane stiffness (1 - nu² aside) [Pa]."""
    return material.E if isinstance(material, Isotropic) else float(material.plane_stress()[0, 0])


def _materials(made: Assembly, read_in: Units) -> list[tuple[float, float]]:
    """(E, rho) of every part that has both, as they stand in the deck."""
    found = [m for part in made.parts if (m := material_of(part.section)) is not None]
    return [
        (E / read_in.stress, m.rho / read_in.density)
        for m in found
        if (E := modulus_of(m)) > 0 and m.rho > 0
    ]


def _off_materials(pairs: list[tuple[float, float]], u: Units) -> float:
    """Decades from the nearest known material, median of the parts."""
    return float(np.median([_distance(E * u.stress, rho * u.density)[0] for E, rho in pairs]))


def _odd(size: float, mass: float, u: Units) -> int:
    """How many of size and mass are not those of what is tested in one piece."""
    small_or_large = size > 0 and not SIZE[0] <= size * u.length <= SIZE[1]
    light_or_heavy = mass > 0 and not MASS[0] <= mass * u.mass <= MASS[1]
    return small_or_large + light_or_heavy


def _distance(E: float, rho: float) -> tuple[float, str]:
    """(decades, name) of the nearest material."""
    return min(
        (float(np.hypot(np.log10(E / E0), np.log10(rho / rho0))), name)
        for name, (E0, rho0) in MATERIALS.items()
    )


def _named(E: float, rho: float) -> str:
    away, name = _distance(E, rho)
    return name if away < NEAR_DECADES / 2 else f"nearest to {name}"
