"""Effects of the catalogue over a range: a mass or a spring at a grid, sensors, cords."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from chladni.case import Case
from chladni.effects.attachments import MovableAttachment
from chladni.effects.effect import Effect
from chladni.effects.effect_context import EffectContext, Setup, element_grids
from chladni.effects.element_groups import element_groups
from chladni.effects.family import Family
from chladni.effects.registry import family
from chladni.errors import FileError
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.model.assembly import Assembly
from chladni.model.free_parameter import FreeParameter
from chladni.units import Units

from .variation import Variation
from .vary_text import VaryText

MOST = 20  # times the mass of the structure, beyond which a mass has another unit
_TOP = 100.0  # [Hz] highest frequency for priors, which samples do not use


@dataclass(frozen=True, eq=False)
class VariedEffect(Variation):
    """Variation of the single number of an effect; at 0 the deck is unchanged."""

    effect: Effect = field(default_factory=Effect)

    def applied(self, assembly: Assembly, value: float) -> Assembly:
        """The assembly with an effect of this size."""
        if value == 0:
            return assembly
        first, x = self.effect.parameters[0], np.array([p.mean for p in self.effect.parameters])
        x[0] = np.log(value / first.scale) if first.kind == "log" else value / first.scale
        return self.effect.apply(assembly, x)


def of_effect(
    request: VaryText, assembly: Assembly, case: Case | None, units: Units | None
) -> VariedEffect:
    """The variation of an effect over a range, at a grid or at the place in the test of a case.

    Numbers are in the deck's own units, as in its cards.
    """
    kind, grid = family(request.name), request.grid
    if request.parts is not None:
        raise request.refused(f'{kind.name} is an effect; write "{kind.name} at GRID=LOW:HIGH"')
    if grid is not None:
        where = _surroundings(assembly, None)  # one with a direction acts across sheet or beam
        if not issubclass(kind.effect, MovableAttachment) or kind.effect.traits.own_dofs:
            raise _refused(request, kind)
        if grid not in where.grids.grids:
            raise request.refused(f"grid {grid} is on no shell and no beam of the deck")
        effect: Effect = kind.effect.near(where, where.grids.position(grid))
    else:
        effect = _placed(request, kind, assembly, case)
    scale, unit = _scale(effect.parameters[0].unit, units)
    low, high = request.ends(scale, None)
    total = mass_properties(assembly)[0]
    if effect.parameters[0].unit == "kg" and high > MOST * total:
        raise request.refused(
            f"{high:.4g} {unit} are more than {MOST} times the mass of the whole structure, "
            f"{total:.4g} {unit}; numbers are in the deck's units"
        )
    free = FreeParameter(kind.name, kind.name, () if grid is None else (str(grid),))
    name = kind.name if grid is None else f"{kind.name} at {grid}"
    return VariedEffect(name, free, 0.0, low, high, unit, request.log, effect)


def _placed(request: VaryText, kind: Family, assembly: Assembly, case: Case | None) -> Effect:
    """The effect at the place given by the test of a case."""
    if kind.placed is None or kind.on_sheets:
        if issubclass(kind.effect, MovableAttachment) and not kind.effect.traits.own_dofs:
            raise request.refused(
                f"no place; write {kind.name} at GRID=..., with a grid of the deck"
            )
        raise _refused(request, kind)
    every = kind.placed(_surroundings(assembly, case))
    if not every:
        raise request.refused(
            "its place is not known; a case with [test] sensors or hangers defines it"
        )
    if len(every[0].parameters) > 1:
        raise _refused(request, kind)
    return every[0]


def _refused(request: VaryText, kind: Family) -> FileError:
    return request.refused(
        f"{kind.name} takes more than one number or a grid; point-mass and extra-support at a "
        "grid can be varied, and sensor-mass and suspension of a case"
    )


def _surroundings(assembly: Assembly, case: Case | None) -> EffectContext:
    sensors: Any = () if case is None else case.outputs.shares(assembly)
    hangers = () if case is None else tuple(case.setup.hangers)
    groups = element_groups(structure(assembly), 1)
    grids = element_grids(groups)
    setup = Setup(tuple(sensors), hangers, mass_properties(assembly)[0], _TOP)
    return EffectContext(groups, grids, grids, setup)


def _scale(unit: str, units: Units | None) -> tuple[float, str]:
    """Factor on a number in the deck's units, and its unit after that."""
    if units is None:
        return 1.0, "deck units"
    return {"kg": units.inertia, "N/m": units.force / units.length}[unit], unit
