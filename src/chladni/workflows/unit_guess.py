"""Which unit system a bare deck is in, by its materials, its size and its mass."""

from dataclasses import dataclass

import numpy as np

from ..errors import FileError
from ..fem.energy import mass_properties
from ..model.assembly import Assembly
from ..units import UNITS, Units
from .unit_check import material_of, modulus_of

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
NEAR = 0.5  # decades: farther from every material a system is not believed
CLEAR = 1.0  # decades the next system must be worse by


@dataclass(frozen=True)
class UnitGuess:
    """A unit system, whether it is the only one that fits, and why in one sentence."""

    units: Units
    sure: bool
    why: str


def guessed_units(raw: Assembly, source: str) -> UnitGuess:
    """The system in which the deck's numbers are those of known materials.

    Parameters
    ----------
    raw : the deck read without a unit system, in its own numbers

    Raises
    ------
    FileError
        If it has no material with a modulus and a density, or none is usual in any system.
    """
    pairs = _materials(raw)
    if not pairs:
        raise FileError(
            f"{source}: no material has a modulus and a density to tell the unit system by; give "
            f"--units, one of {', '.join(UNITS)}"
        )
    ranked = sorted((_misfit(raw, pairs, u), k, u) for k, u in enumerate(UNITS.values()))
    (best, _, units), (second, *_) = ranked[:2]
    if best > NEAR:
        E, rho = pairs[0]
        raise FileError(
            f"{source}: E = {E:g} and rho = {rho:g} are usual in no unit system "
            f"({', '.join(UNITS)}); look at the materials, or give --units"
        )
    E, rho = pairs[0][0] * units.stress, pairs[0][1] * units.density
    size = float(np.linalg.norm(np.ptp(raw.points, axis=0))) * units.length
    mass = mass_properties(raw)[0] * units.mass
    why = (
        f"in {units.name} the deck is {size:.3g} m across, weighs {mass:.4g} kg and its first "
        f"material is {_named(E, rho)} (E = {E / 1e9:.4g} GPa, rho = {rho:.4g} kg/m³)"
    )
    return UnitGuess(units, second > best + CLEAR, why)


def _materials(raw: Assembly) -> list[tuple[float, float]]:
    """(E, rho) of every part that has both, the heaviest kind not told apart."""
    found = [m for part in raw.parts if (m := material_of(part.section)) is not None]
    return [(E, m.rho) for m in found if (E := modulus_of(m)) > 0 and m.rho > 0]


def _misfit(raw: Assembly, pairs: list[tuple[float, float]], u: Units) -> float:
    """Decades from known materials, median of the parts; one more for an odd size or mass each."""
    each = [_distance(E * u.stress, rho * u.density)[0] for E, rho in pairs]
    size = float(np.linalg.norm(np.ptp(raw.points, axis=0))) * u.length
    mass = mass_properties(raw)[0] * u.mass
    odd = (not SIZE[0] <= size <= SIZE[1]) + (mass > 0 and not MASS[0] <= mass <= MASS[1])
    return float(np.median(each)) + odd


def _distance(E: float, rho: float) -> tuple[float, str]:
    return min(
        (float(np.hypot(np.log10(E / E0), np.log10(rho / rho0))), name)
        for name, (E0, rho0) in MATERIALS.items()
    )


def _named(E: float, rho: float) -> str:
    away, name = _distance(E, rho)
    return name if away < NEAR / 2 else f"nearest to {name}"
