"""Detect a wrong unit system by a deck far from the weighed mass or of no known material."""

import numpy as np

from ..case import Case
from ..errors import FileError
from ..fem.energy import mass_properties
from ..model.assembly import Assembly
from ..units import UNITS, Units
from .unit_guess import guessed_units, material_of, modulus_of

FAR = 5.0  # times the weighed mass: no effect, no forgotten trim explains more
STIFF, HEAVY = (1e6, 2e12), (10.0, 3e4)  # E [Pa] of rubber to diamond, rho [kg/m³] of foam to gold


def refuse_other_units(case: Case) -> None:
    """Refuse a deck that weighs ``FAR`` times more or less than the article on the scales.

    Also refuse a deck whose materials are known only in another unit system.

    Raises
    ------
    FileError
        If either check fails; the sentence names the unit systems that fit mass and materials.
    """
    _refuse_by_mass(case)
    _refuse_by_material(case)


def _refuse_by_material(case: Case) -> None:
    try:
        guess = guessed_units(case.assembly, case.deck.path.name, case.units)
    except FileError:  # nothing to tell by, which is no fault of the user's word
        return
    if guess.sure and guess.units.name != case.units.name:
        raise FileError(
            f'{case.path}: set units = "{guess.units.name}" in [model], not {case.units.name}: '
            f"{guess.why}"
        )


def _refuse_by_mass(case: Case) -> None:
    weighed, mass = case.setup.mass, mass_properties(case.assembly)[0]
    if weighed is None or mass <= 0 or 1 / FAR <= mass / weighed <= FAR:
        return
    fits = [u.name for u in UNITS.values() if _fits(case.assembly, case.units, u, mass, weighed)]
    if fits:
        advice = (
            f'set units = "{fits[0]}" in [model], in which it weighs '
            f"{mass * UNITS[fits[0]].mass / case.units.mass:.4g} kg"
        )
    elif 1 / FAR <= 1e3 * mass / weighed <= FAR:
        advice = f"the mass is in kg: write {weighed / 1e3:.4g} if {weighed:.4g} g were weighed"
    else:
        advice = "its weight is right in no unit system; check its densities and the mass"
    raise FileError(
        f"{case.path}: the deck read in {case.units.name} weighs {mass:.4g} kg, the article "
        f"{weighed:.4g} kg: {advice}"
    )


def _fits(made: Assembly, said: Units, other: Units, mass: float, weighed: float) -> bool:
    """Return True if mass and materials of the deck are plausible in another unit system."""
    if not 1 / FAR <= mass * other.mass / said.mass / weighed <= FAR:
        return False
    materials = [m for part in made.parts if (m := material_of(part.section)) is not None]
    E = np.array([modulus_of(m) for m in materials]) * other.stress / said.stress
    rho = np.array([m.rho for m in materials]) * other.density / said.density
    return _usual(E, STIFF) and _usual(rho, HEAVY)


def _usual(values: np.ndarray, limits: tuple[float, float]) -> bool:
    """Return True if the median of the positive values lies within limits, or there is none."""
    given = values[values > 0]
    return not len(given) or bool(limits[0] <= np.median(given) <= limits[1])
