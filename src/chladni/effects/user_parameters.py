"""User parameters: a field of parts, joints or masses, one factor e^y for all of them.

Without bounds y = x. A bound b gives y = b tanh(x / b): it is never passed, and the slope at the
deck's value is one. Parts of several kinds share the factor: shells and beams by their fields,
solids, fasteners, springs, bushes and masses by their operators. The operators of two parameters of
one part are added; their second-order product is neglected.

A stiffener at a distance e from the middle of its sheet adds E A e² to the bending stiffness. Some
measure e from the middle of the sheet, others from its face. A tenth of e is a fifth of that
stiffness, and E of the stiffener, which also bends and twists by itself, is no substitute.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..fem.assemble import Structure, over_all_motions
from ..fem.derivative import Slope, by_part, of_lumps, of_part
from ..fem.energy import mass_properties, only
from ..fem.sparse_assembly import congruence
from ..geometry.beam_lines import member_beams
from ..model.assembly import Assembly
from ..model.free_parameter import FreeParameter
from ..model.properties import AnyMaterial, Part, SolidSection
from .calibration_parameters import (
    OF_ALLOYS,
    OF_FIELDS,
    SHEET,
    TUBE,
    LinearScale,
    alloy_of,
    calibration_parameter,
    linear_scale,
    prior_sd,
    value,
    with_scaled,
)
from .effect import Effect, Parameter, Term, Weight, Within
from .element_groups import ElementGroups
from .estimate import Estimate, Location
from .joint_stiffness import within_joints
from .joints import solid_parts

UNITS = {
    **OF_FIELDS,
    **dict.fromkeys(("E1", "E2", "G12"), "Pa"),
    **{"nu": "-", "nu12": "-", "K": "N/m", "M": "kg", "offset": "m"},
}
SD = {"nu": 0.1, "nu12": 0.2}  # prior sd of ln(value / deck's value); others SD_OTHERS
SD_OTHERS = 0.3  # joints and directional moduli are less certain
NEAR_BOUND = 0.9  # of the way to a bound: the value counts as on the bound
SAME = 1e-9
AWAY = 1e-3  # relative step of the finite difference for the second slope
FARTHEST = 20.0  # largest factor on the deck's own value: beyond it the unit is another
SERVES = 0.3  # of the way of nu to 1/2: there two terms of 1/(1 - 2 nu) are accurate to 3 %


@dataclass(frozen=True, eq=False)
class UserParameter(Effect):
    """Members that share their parameters; a single parameter may have bounds of ln factor."""

    name = "part-scale"
    claim = "a calibration parameter of the deck is wrong"
    kind = "calibration"

    members: tuple[Effect, ...] = ()
    low: float = -np.inf
    high: float = np.inf
    called: str = ""  # name given by the user

    def y(self, x: np.ndarray) -> tuple[np.ndarray, float]:
        """The members' parameters and dy/dx; several parameters have no bounds."""
        if len(x) > 1:
            return x, 1.0
        bound = self.high if x[0] > 0 else -self.low
        if not np.isfinite(bound):
            return x, 1.0
        y = bound * np.tanh(x[0] / bound)
        return np.array([y]), float(1 - (y / bound) ** 2)

    def terms(self, x: np.ndarray) -> tuple[Term, ...]:
        """Terms of all members."""
        y, slope = self.y(x)
        every = (t for m in self.members for t in m.terms(y))
        return tuple(replace(t, gradient=slope * t.gradient) for t in every)

    @property
    def axis_1(self) -> np.ndarray | None:
        """Material axis 1 of the first member that has one."""
        return next((m.axis_1 for m in self.members if m.axis_1 is not None), None)

    def weight(self, x: np.ndarray) -> Weight:
        """Mass of all members."""
        y, slope = self.y(x)
        each = [m.weight(y) for m in self.members]
        gradient = slope * np.sum([w.gradient for w in each], axis=0)
        return Weight(sum(w.mass for w in each), gradient, sum(w.removed for w in each))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write all members."""
        y, _ = self.y(x)
        for member in self.members:
            assembly = member.apply(assembly, y)
        return assembly

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Value and interval within the bounds; :meth:`on_bound` detects a value at a bound."""
        if len(x) > 1 or not len(self.parameters):
            return self.members[0].reported(x, sd)
        p, reach = self.parameters[0], 1.96 * self.widened(sd)
        low, here, high = (p.value(float(self.y(x + s * reach)[0][0])) for s in (-1, 0, 1))
        return (Estimate(p.name, here, p.unit, low, high),)

    def on_bound(self, x: np.ndarray) -> bool:
        """True if the value is close to a bound, so that it may compensate for something else."""
        y = float(self.y(x)[0][0])
        return len(x) == 1 and not NEAR_BOUND * self.low < y < NEAR_BOUND * self.high

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The place after a fit."""
        return self.members[0].location(self.y(x)[0], sd) if len(x) > 1 else self.where()


def user_parameter(groups: ElementGroups, free: FreeParameter) -> UserParameter:
    """The effect of one user parameter."""
    built = groups.structure
    parts = built.assembly.parts
    members: list[Effect] = []
    grouped = set(groups.part.tolist())
    plain = [k for k in free.positions if k in grouped and free.field in (*SHEET, *TUBE)]
    if plain:
        members.append(calibration_parameter(groups, free.field, plain))
    members += [_of_part(built, k, free.field) for k in free.positions if k not in plain]
    members += [_of_lumps(built, family, rows) for family, rows in _lumps(free) if rows]
    values = values_of(built.assembly, free)
    alike = len(values) > 0 and np.ptp(values) <= SAME * abs(values[0])
    scale, unit = (values[0], UNITS[free.field]) if alike else (1.0, "of the deck's")
    sd = sd_of(built.assembly, free)
    names = tuple(parts[k].name for k in free.positions)
    text = f"{free.field} of {', '.join(free.parts or names) or 'all'}"
    unknown = (Parameter(free.field, unit, 0.0, sd, float(scale), step=min(0.3, 2 * sd)),)
    low, high = _bounds(parts, free)
    return UserParameter(
        unknown, text, names, members=tuple(members), low=low, high=high, called=free.name,
        replaces=tuple(_whole_families(built.assembly, free)),
    )  # fmt: skip


def sd_of(assembly: Assembly, free: FreeParameter) -> float:
    """Standard deviation of ln(value / deck's value): the user's, or else that of the field."""
    if free.sd is not None:
        return free.sd
    if free.field in OF_FIELDS:
        return prior_sd(assembly.parts, free.field, free.positions)
    if free.field == "offset":
        own = [sd for k in free.positions if (sd := offset_sd(assembly, k)) is not None]
        return max(own, default=SD_OTHERS)
    return SD.get(free.field, SD_OTHERS)


def _whole_families(assembly: Assembly, free: FreeParameter) -> Iterator[str]:
    """Families of joints whose factor is this parameter, so that they need no other."""
    for name, soft in (("adhesive", True), ("welds", False)):
        parts = {int(assembly.solids[g].part[r]) for g, rows in solid_parts(assembly, soft)
                 for r in rows}  # fmt: skip
        if free.field == "E" and parts and parts <= set(free.positions):
            yield name
    own = set(np.flatnonzero(assembly.bushes.ids > 0).tolist())
    if free.field == "K" and own and own <= set(free.bushes):
        yield "bushes"


def _bounds(parts: Sequence[Part], free: FreeParameter) -> tuple[float, float]:
    """Bounds of ln(value / deck's value): the user's, and for nu the range of its expansion."""
    low = -np.inf if free.low is None else float(np.log(free.low))
    high = np.inf if free.high is None else float(np.log(free.high))
    if free.field == "nu":
        nu = max(value(parts[k], "nu") for k in free.positions)
        reach = SERVES * (1 - 2 * nu) / (2 * nu)
        low, high = max(low, -reach), min(high, reach)
    return low, high


def freed_effect(effect: Effect, called: str) -> UserParameter:
    """An effect of known place as a free parameter of every fit."""
    return UserParameter(
        effect.parameters, effect.text, effect.parts, effect.grids, replaces=effect.replaces,
        members=(effect,), called=called,
    )  # fmt: skip


def defaults_of_solids(assembly: Assembly) -> list[FreeParameter]:
    """E and rho of every material of solids; the mesh has all dimensions of these alone."""
    by_material: dict[AnyMaterial, list[int]] = {}
    for k, part in enumerate(assembly.parts):
        if isinstance(part.section, SolidSection):
            by_material.setdefault(part.section.material, []).append(k)
    return [
        FreeParameter(
            name, name, positions=tuple(at), sd=OF_ALLOYS[name] if alloy_of(material) else None
        )
        for material, at in by_material.items()
        for name in ("E", "rho")
    ]


def _lumps(free: FreeParameter) -> tuple[tuple[str, tuple[int, ...]], ...]:
    return ("springs", free.springs), ("bushes", free.bushes), ("masses", free.masses)


def _of_part(built: Structure, k: int, name: str) -> LinearScale:
    """E or rho of solids, wall or offset of beams, nu, or moduli of an orthotropic sheet."""
    if name == "offset":
        return offset_scale(built, k)
    part, write = built.assembly.parts[k], partial(with_scaled, quantity=name, positions=(k,))
    text = f"{name} of {part.name}"
    if name in TUBE:
        whole = mass_properties(built.assembly)[0]
        heavier = mass_properties(write(built.assembly, 2.0))[0] if name != "E" else whole
        slope = of_part(built, k, name)
        return linear_scale(text, name, "-", 1.0, slope, write, weight_slope=heavier - whole)
    v = value(part, name)
    first = _scaled(by_part(built, k, name), v)
    up, down = (
        _three(by_part(replace(built, assembly=write(built.assembly, 1 + h)), k, name))
        for h in (AWAY, -AWAY)
    )
    bent = Slope(*(v * (b - a) / (2 * AWAY) for a, b in zip(down, up, strict=True)))
    return linear_scale(
        text, name, "-", 1.0, first, write, bent=bent, within=_within(built.assembly, k, name)
    )


def offset_of(assembly: Assembly, k: int) -> float:
    """Mean distance of the beams of a part from their grids [m]; 0 without beams."""
    own = assembly.beams.offset[assembly.beams.part == k]
    return float(np.linalg.norm(own, axis=-1).mean()) if len(own) else 0.0


def offset_sd(assembly: Assembly, k: int) -> float | None:
    """Prior standard deviation of ln(distance / deck's): half the thickness of the sheet over it.

    None where the beams of the part have no distance, or some of them no sheet.
    """
    beams, shells = assembly.beams, assembly.shells
    t = np.zeros(len(assembly.points))
    np.maximum.at(t, shells.nodes, shells.thickness[:, : shells.nodes.shape[1]])
    of_sheet, away = t[beams.nodes[beams.part == k]], offset_of(assembly, k)
    if not away or not of_sheet.all():
        return None
    return float(of_sheet.mean() / 2 / away)


def stiffener_offsets(assembly: Assembly) -> list[FreeParameter]:
    """The distance of every part of beams along sheets."""
    own = np.unique(assembly.beams.part[member_beams(assembly)]).tolist()
    return [
        FreeParameter("offset", "offset", positions=(k,), sd=sd)
        for k in own
        if (sd := offset_sd(assembly, k)) is not None
    ]


def offset_scale(built: Structure, k: int) -> LinearScale:
    """One factor on the offsets of the beams of a part, in which K and M are quadratic."""
    made, name = built.assembly, built.assembly.parts[k].name

    def write(assembly: Assembly, factor: float) -> Assembly:
        return with_scaled(assembly, factor, "offset", (k,))

    none, own, twice = (over_all_motions(only(write(made, factor), k)) for factor in (0, 1, 2))
    slope, bent = (
        Slope(*(congruence(built.T, A) for A in change))
        for change in (
            [(c - a) / 2 for a, c in zip(none[:3], twice, strict=False)],
            [a - 2 * b + c for a, b, c in zip(none[:3], own, twice, strict=False)],
        )
    )
    rows = len(made.shells) + np.flatnonzero(made.beams.part[member_beams(made)] == k)
    within = Within(shells=rows) if len(rows) else None
    return linear_scale(
        f"offset of {name}", "offset", "-", 1.0, slope, write, bent=bent, within=within
    )


def _within(assembly: Assembly, k: int, name: str) -> Within:
    """The whole of which the stiffness of a part of shells or solids is a share."""
    shells = np.flatnonzero(assembly.shells.part == k)
    if len(shells):
        return Within(shells=shells)
    ids = (i for group in assembly.solids for i in group.ids[group.part == k])
    return replace(within_joints(ids), complete=name == "E")


def _three(slope: Slope) -> tuple[Any, Any, Any]:
    return slope.M, slope.V, slope.K


def _scaled(slope: Slope, v: float) -> Slope:
    """Slope with respect to the factor: v times the slope with respect to the value."""
    return Slope(*(v * A for A in _three(slope)))


def _of_lumps(built: Structure, family: str, rows: Sequence[int]) -> LinearScale:
    """K of springs or bushes, M of concentrated masses."""
    weight = sum(_mass(built.assembly, row) for row in rows) if family == "masses" else 0.0
    field = "M" if family == "masses" else "K"
    ids = built.assembly.bushes.ids[list(rows)] if family == "bushes" else ()
    return linear_scale(
        f"{field} of {family}", field, "-", 1.0, of_lumps(built, family, rows),
        partial(_with_lumps, family=family, rows=tuple(rows)), weight_slope=weight,
        within=within_joints(ids),
    )  # fmt: skip


def _mass(assembly: Assembly, row: int) -> float:
    return float(np.trace(assembly.masses.matrix[row, :3, :3]) / 3)


def _with_lumps(assembly: Assembly, factor: float, family: str, rows: tuple[int, ...]) -> Assembly:
    """Multiply the values of some springs, bushes or masses by a factor."""
    column = {"springs": "value", "bushes": "stiffness", "masses": "matrix"}[family]
    members = getattr(assembly, family)
    values = getattr(members, column).copy()
    values[list(rows)] *= factor
    return replace(assembly, **{family: replace(members, **{column: values})})


def with_factor(assembly: Assembly, free: FreeParameter, factor: float) -> Assembly:
    """Multiply a user parameter by a factor in all its parts and joints, without linearisation."""
    assembly = with_scaled(assembly, factor, free.field, free.positions)
    for family, rows in _lumps(free):
        if rows:
            assembly = _with_lumps(assembly, factor, family, rows)
    return assembly


def why_implausible(
    field: str, value: float, own: float, farthest: float = FARTHEST, scale: float = 1.0
) -> str:
    """Say why a value cannot replace the deck's own; "" where it can.

    Parameters
    ----------
    own : the deck's value, in the unit of ``value``
    farthest : largest factor between them
    scale : unit in which the sentence names both
    """
    if field == "nu" and value >= 0.5:
        return f"{value:.3g} is too large: materials have less than 0.5"
    if 1 / farthest <= value / own <= farthest:
        return ""
    return f"{value / scale:g} is {value / own:.3g} times the deck's own {own / scale:g}"


def values_of(assembly: Assembly, free: FreeParameter) -> np.ndarray:
    """The deck's values (n,) of all members that share the factor."""
    if free.field == "offset":
        return np.array([offset_of(assembly, k) for k in free.positions])
    out = [value(assembly.parts[k], free.field) for k in free.positions]
    out += [float(assembly.springs.value[r]) for r in free.springs]
    stiff = assembly.bushes.stiffness[list(free.bushes)]
    out += stiff[stiff != 0].tolist()
    return np.array(out + [_mass(assembly, r) for r in free.masses])
