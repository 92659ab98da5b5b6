"""A deck whose mass is far from the weighed one was read in the wrong unit system."""

import numpy as np

from ..case import Case
from ..errors import FileError
from ..fem.energy import mass_properties
from ..model.assembly import Assembly
from ..model.properties import Isotropic, Material, Section, ShellSection
from ..units import UNITS, Units

FAR = 5.0  # times the weighed mass: no effect, no forgotten trim explains more
STIFF, HEAVY = (1e6, 2e12), (10.0, 3e4)  # E [Pa] of rubber to diamond, rho [kg/m³] of foam to gold


def refuse_other_units(case: Case) -> None:
    """Refuse a deck that weighs ``FAR`` times more or less than the article on the scales.

    Raises
    ------
    FileError
        Naming the unit systems in which the deck would weigh right, and be of a usual material.
    """
    weighed, mass = case.setup.mass, mass_properties(case.assembly)[0]
    if weighed is None or mass <= 0 or 1 / FAR <= mass / weighed <= FAR:
        return
    fits = [u.name for u in UNITS.values() if _fits(case.assembly, case.units, u, mass, weighed)]
    advice = (
        f'set units = "{fits[0]}" in [model], in which it weighs '
        f"{mass * UNITS[fits[0]].mass / case.units.mass:.4g} kg"
        if fits
        else "in no unit system it weighs right; look at its densities and at [test] mass"
    )
    raise FileError(
        f"{case.path}: {case.deck.path.name} read in {case.units.name} weighs {mass:.4g} kg, the "
        f"article {weighed:.4g} kg: {advice}"
    )


def _fits(made: Assembly, said: Units, other: Units, mass: float, weighed: float) -> bool:
    """Whether the deck's numbers make sense in another system: its mass, and usual materials."""
    if not 1 / FAR <= mass * other.mass / said.mass / weighed <= FAR:
        return False
    materials = [m for part in made.parts if (m := material_of(part.section)) is not None]
    E = np.array([modulus_of(m) for m in materials]) * other.stress / said.stress
    rho = np.array([m.rho for m in materials]) * other.density / said.density
    return _usual(E, STIFF) and _usual(rho, HEAVY)


def material_of(section: Section) -> Material | None:
    """The material of a section; of a shell that of its membrane."""
    if isinstance(section, ShellSection):
        return section.membrane or section.bending
    return getattr(section, "material", None)


def modulus_of(material: Material) -> float:
    """E, or E1 of the plane stiffness (1 - nu² aside) [Pa]."""
    return material.E if isinstance(material, Isotropic) else float(material.plane_stress()[0, 0])


def _usual(values: np.ndarray, limits: tuple[float, float]) -> bool:
    """Whether the median of those that are given lies within limits."""
    given = values[values > 0]
    return not len(given) or bool(limits[0] <= np.median(given) <= limits[1])
