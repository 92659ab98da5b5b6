"""Variation of a number of the deck between two values."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.case.free_parameters import free_parameter
from chladni.case.request import Stated
from chladni.case.schema import FIELDS, PARAMETER, ParameterWords
from chladni.effects.user_parameters import (
    FARTHEST,
    UNITS,
    sd_of,
    values_of,
    why_implausible,
    with_factor,
)
from chladni.errors import FileError
from chladni.io.nastran import Deck
from chladni.model.assembly import Assembly
from chladni.model.free_parameter import FreeParameter
from chladni.units import Units

from .vary_text import VaryText

_SAME = 1e-9
_REACH = {"E": 1e7, "K": 1e9, "M": 1e6}  # in the logarithm: joints are unknown by decades
_SDS = 2.0  # prior standard deviations to either side, where a case gives no bounds


@dataclass(frozen=True)
class Variation:
    """One number of the deck and the range it is sampled over."""

    name: str  # name in tables, "t of inner"
    free: FreeParameter  # the number and its parts
    nominal: float  # the deck's own value; 1 where the members' values differ
    # low, high: in ``unit``, as ``nominal``
    low: float
    high: float
    unit: str  # SI; "deck units" of a bare deck, "of the deck's" where members differ
    log: bool = False  # sampled uniformly in the logarithm

    def value(self, u: np.ndarray) -> np.ndarray:
        """Values at u in [0, 1]."""
        if self.log:
            return self.low * (self.high / self.low) ** u
        return self.low + (self.high - self.low) * u

    def applied(self, assembly: Assembly, value: float) -> Assembly:
        """The assembly with this value in place of the deck's."""
        return with_factor(assembly, self.free, value / self.nominal)


def of_case(
    frees: Sequence[FreeParameter], assembly: Assembly
) -> tuple[list[Variation], list[str]]:
    """The [[parameter]] of a case between their bounds, and notes on those that cannot be varied.

    A missing bound is two standard deviations of the prior from the mean.
    """
    out, notes = [], []
    for free in frees:
        if free.field not in FIELDS:
            notes.append(
                f"{free.name} is an effect, not a number of the deck: it is not varied "
                f'(--vary "{free.field}=LOW:HIGH" varies an effect with one number).'
            )
            continue
        sd = sd_of(assembly, free)
        low = float(np.exp(-_SDS * sd)) if free.low is None else free.low
        high = float(np.exp(_SDS * sd)) if free.high is None else free.high
        nominal, unit = _nominal(assembly, free, True)
        name = free.name if free.name != free.field else _called(free)
        out.append(Variation(name, free, nominal, low * nominal, high * nominal, unit))
    return out, notes


def of_parts(
    request: VaryText, assembly: Assembly, deck: Deck | None, units: Units | None
) -> Variation:
    """The variation of a number of parts over a range.

    Plain numbers are in the deck's own units, as in its cards; per cent are of the deck's own
    value.
    """
    free = free_parameter(_stated(request, assembly), assembly, deck)
    if request.grid is not None or free.field not in FIELDS:
        raise request.refused(
            f'{request.name} is a number of parts; write "{request.name} of PART=LOW:HIGH"'
            if free.field in FIELDS
            else f"{free.field} is an effect, which no part has"
        )
    nominal, unit = _nominal(assembly, free, units is not None)
    low, high = _range(request, nominal, _scale(request, assembly, free, units))
    return Variation(_called(free), free, nominal, low, high, unit, request.log)


def _stated(request: VaryText, assembly: Assembly) -> Stated[ParameterWords]:
    """The option as the words of a [[parameter]]."""
    words: ParameterWords = {"field": request.name}
    if (parts := request.parts) is not None:
        whole = any(parts == p.name for p in assembly.parts)
        words["parts"] = [parts] if whole else [p.strip() for p in parts.split(",")]
    places = {k.argument: f"--vary {request.text!r} ({k.argument})" for k in PARAMETER}
    return Stated(words, places)


def _called(free: FreeParameter) -> str:
    """Name such as 't of inner, outer'; the field alone where it is varied for all parts."""
    return f"{free.field} of {', '.join(free.parts)}" if free.parts else free.field


def _nominal(assembly: Assembly, free: FreeParameter, si: bool) -> tuple[float, str]:
    """The deck's own value and its unit; 1 where the members' values differ."""
    values = values_of(assembly, free)
    if np.ptp(values) > _SAME * abs(values[0]) or values[0] == 0:
        return 1.0, "of the deck's"
    turns = free.field == "K" and _turns(assembly, free)
    return float(values[0]), ("deck units" if not si else "N m/rad" if turns else UNITS[free.field])


def _turns(assembly: Assembly, free: FreeParameter) -> bool:
    """True where the springs or bushes act against rotation."""
    springs = assembly.springs.component[list(free.springs)]
    turned = assembly.bushes.stiffness[list(free.bushes), 3:]
    return bool((springs > 3).any() or turned.any())


def _scale(
    request: VaryText, assembly: Assembly, free: FreeParameter, units: Units | None
) -> float:
    """Factor on a plain number; FileError where the members have no common value."""
    _, unit = _nominal(assembly, free, True)
    if not request.plain or (units is None and unit != "of the deck's"):
        return 1.0
    if free.field == "wall":
        return 1.0
    if unit == "of the deck's":
        values = np.unique(values_of(assembly, free))
        raise request.refused(
            f"{_called(free)} has {len(values)} different values in the deck; give a share of the "
            "deck's value, for example 90%:110%, or vary one part at a time"
        )
    assert units is not None
    moment = units.force * units.length if unit == "N m/rad" else units.force / units.length
    return {
        **dict.fromkeys(("E", "E1", "E2", "G12"), units.stress),
        **{
            "rho": units.density,
            "t": units.length,
            "offset": units.length,
            "K": moment,
            "M": units.inertia,
        },
    }.get(free.field, 1.0)


def _range(request: VaryText, nominal: float, scale: float) -> tuple[float, float]:
    """Ends (low, high) in the unit of the nominal value; FileError where they are far from it."""
    low, high = request.ends(scale, nominal)
    reach = _REACH.get(request.name, FARTHEST) if request.log else FARTHEST
    for value in (low, high):
        if why := why_implausible("", value, nominal, reach, scale):
            raise request.refused(
                f"{why}; plain numbers are in the deck's units, a share of its value is written "
                "90%:110%"
                + ("" if request.log or request.name not in _REACH else ", decades 1e2:1e6:log")
            )
    return low, high


def refuse_impossible(chosen: Sequence[Variation], assembly: Assembly) -> None:
    """Refuse two ranges for one number, and Poisson's ratios of 1/2 or more, by FileError."""
    for k, a in enumerate(chosen):
        if a.free.field == "nu":
            own = float(values_of(assembly, a.free).max())
            if why := why_implausible("nu", own * a.high / a.nominal, own):
                raise FileError(f"{a.name!r}: {why}")
        for b in chosen[:k]:
            shared = any(
                set(getattr(a.free, name)) & set(getattr(b.free, name))
                for name in ("positions", "springs", "bushes", "masses")
            )
            if a.name == b.name or (a.free.field == b.free.field and shared):
                raise FileError(f"{b.name!r} and {a.name!r} vary the same number; leave one out")
