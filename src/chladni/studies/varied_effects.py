"""Effects of the catalogue over a range: a mass or a spring at a grid, sensors, cords."""

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..case import Case
from ..effects.effect import Effect
from ..effects.element_groups import element_groups
from ..effects.family import Family
from ..effects.movable_attachment import MovableAttachment
from ..effects.registry import family, names
from ..effects.surroundings import Setup, Surroundings, element_grids
from ..errors import FileError
from ..fem.assemble import structure
from ..fem.energy import mass_properties
from ..model.assembly import Assembly
from ..model.free_parameter import FreeParameter
from ..units import Units
from .variation import Variation

_FORM = re.compile(r"\s*([a-z][a-z-]*)(?:\s+at\s+(\d+))?\s*")
_TOP = 100.0  # [Hz] of priors, which no sample asks for


@dataclass(frozen=True, eq=False)
class VariedEffect(Variation):
    """The one number of an effect; without it, at 0, is the deck as it is."""

    effect: Effect = field(default_factory=Effect)

    def applied(self, assembly: Assembly, value: float) -> Assembly:
        """The assembly with an effect of this size."""
        if value == 0:
            return assembly
        first, x = self.effect.parameters[0], np.array([p.mean for p in self.effect.parameters])
        x[0] = np.log(value / first.scale) if first.kind == "log" else value / first.scale
        return self.effect.apply(assembly, x)


def effect_of(text: str) -> str:
    """The name of the effect with which a range begins, "" where it is none's."""
    first = re.split(r"[\s=]", text.strip(), maxsplit=1)[0]
    return first if first in names() else ""


def of_effect(
    text: str, assembly: Assembly, case: Case | None, units: Units | None
) -> VariedEffect:
    """A range as `point-mass at 412=0.01:0.2` or, of a case, `suspension=1e2:1e4:log`.

    Numbers are in the deck's own units, as they would stand in its cards.

    Raises
    ------
    FileError
        One sentence that names the text, what is wrong with it, and what there is.
    """
    wanted, _, span = text.rpartition("=")
    found = _FORM.fullmatch(wanted)
    if not found:
        raise FileError(
            f'--vary {text!r} is not of the form "point-mass at 412=0.01:0.2", with a grid'
        )
    kind, grid = family(found[1]), found[2]
    effect = _at(text, kind, int(grid), assembly) if grid else _placed(text, kind, assembly, case)
    first = effect.parameters[0]
    scale, unit = _scale(first.unit, units)
    low, high, log = _range(text, span, scale)
    free = FreeParameter(kind.name, kind.name, (grid,) if grid else ())
    name = f"{kind.name} at {grid}" if grid else kind.name
    return VariedEffect(name, free, 0.0, low, high, unit, log, effect)


def _at(text: str, kind: Family, grid: int, assembly: Assembly) -> Effect:
    """The effect at a grid, across the sheet or beam where it pushes."""
    where = _surroundings(assembly, None)
    if not issubclass(kind.effect, MovableAttachment) or kind.effect.own_dofs:
        raise _refused(text, kind)
    if grid not in where.grids.grids:
        raise FileError(f"--vary {text!r}: grid {grid} is on no shell and no beam of the deck")
    return kind.effect.near(where, where.grids.position(grid))


def _placed(text: str, kind: Family, assembly: Assembly, case: Case | None) -> Effect:
    """The effect where the test of a case says that it acts."""
    if kind.placed is None or kind.on_sheets:
        if issubclass(kind.effect, MovableAttachment) and not kind.effect.own_dofs:
            raise FileError(
                f"--vary {text!r}: where? write {kind.name} at GRID=..., with a grid of the deck"
            )
        raise _refused(text, kind)
    every = kind.placed(_surroundings(assembly, case))
    if not every:
        raise FileError(
            f"--vary {text!r}: where it acts is not known; a case with [test] sensors or hangers "
            "says it"
        )
    if len(every[0].parameters) > 1:
        raise _refused(text, kind)
    return every[0]


def _refused(text: str, kind: Family) -> FileError:
    return FileError(
        f"--vary {text!r}: {kind.name} takes more than one number or a grid; what can be varied "
        "are point-mass and extra-support at a grid, and sensor-mass and suspension of a case"
    )


def _surroundings(assembly: Assembly, case: Case | None) -> Surroundings:
    sensors: Any = () if case is None else case.outputs.shares(assembly)
    hangers = () if case is None else tuple(case.setup.hangers)
    groups = element_groups(structure(assembly), 1)
    grids = element_grids(groups)
    setup = Setup(tuple(sensors), hangers, mass_properties(assembly)[0], _TOP)
    return Surroundings(groups, grids, grids, setup)


def _scale(unit: str, units: Units | None) -> tuple[float, str]:
    """What a number of the deck's units is multiplied by, and its unit then."""
    if units is None:
        return 1.0, "deck units"
    return {"kg": units.mass, "N/m": units.force / units.length}[unit], unit


def _range(text: str, span: str, scale: float) -> tuple[float, float, bool]:
    """(low, high, sampled in the logarithm)."""
    pieces = span.split(":")
    log = len(pieces) == 3 and pieces[2].strip() == "log"
    if "%" in span:
        raise FileError(f"--vary {text!r}: the deck has nothing there of which to take a share")
    try:
        low, high = (float(p) * scale for p in pieces[: 2 if log else None])
    except ValueError:
        raise FileError(
            f"--vary {text!r}: {span.strip()!r} is no range; write 0.01:0.2 or 1e2:1e6:log"
        ) from None
    if not 0 <= low < high < np.inf or (log and low == 0):
        raise FileError(f"--vary {text!r}: the range must increase and not begin below zero")
    return low, high, log
