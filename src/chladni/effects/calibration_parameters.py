"""Calibration parameters, and the scatter that calibration does not remove.

Their optimum is the null hypothesis of every diagnosis, never a finding.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from ..fem.derivative import Slope
from ..model.assembly import Assembly
from ..model.properties import (
    Anisotropic,
    AnisotropicSolid,
    AnyMaterial,
    BeamSection,
    Isotropic,
    Orthotropic,
    Part,
    ShellSection,
    SolidSection,
)
from .effect import Effect, FieldChange, MatrixTerm, Parameter, Traits, Weight, Within
from .element_groups import ElementGroups

SPREAD = {"E": 0.06, "rho": 0.06, "t": 0.05, "wall": 0.05}  # prior sd of ln(value / deck's value)
OF_ALLOYS = {**SPREAD, "E": 0.03, "rho": 0.005, "t": 0.04}  # the same of the classes in ALLOYS
ALLOYS = {  # ranges of E [Pa] and rho [kg/m³]
    "steel": ((185e9, 220e9), (7600.0, 8100.0)),
    "aluminium": ((65e9, 76e9), (2600.0, 2900.0)),
}
REASONS = {  # of the priors, by the field
    "E": "moduli of steel and of aluminium alloys differ by 3 %, those of other materials by more",
    "rho": "steel and aluminium alloys are known to 0.5 %, other materials to 6 %",
    "t": "rolling tolerance is 3 to 5 %; forming thins a sheet and thickens it",
    "wall": "tubes are drawn to 5 to 10 % of their wall",
    "offset": "stiffeners are measured from the middle of their sheet or from its face",
    "nu": "metals lie between 0.27 and 0.34",
    "K": "the stiffness of a joint is seldom known to a third",
    "R": "nugget and heat-affected zone end within some millimetres of a weld",
}
OF_FIELDS = {"E": "Pa", "rho": "kg/m3", "t": "m", "wall": "of the deck's"}
SHEET, TUBE = ("E", "rho", "t"), ("E", "rho", "wall")  # of a part of shells, and of beams
M = TypeVar("M", bound=AnyMaterial)
MODULI = "E", "G", "E1", "E2", "G12", "G1z", "G2z", "Q", "C"  # of all materials
_AREAS = ("area", "I1", "I2", "I12", "J")  # proportional to the wall of a thin tube


@dataclass(frozen=True, eq=False)
class LogField(Effect):
    """ln of the factor on one field of shells and beams: Σ_j x_j φ_j over the groups.

    ``functions`` (n_groups, n_parameters) are φ_j.
    """

    quantity: str = "E"
    functions: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    def terms(self, x: np.ndarray) -> tuple[FieldChange, ...]:
        """The field."""
        return (FieldChange(self.quantity, self.functions @ x, self.functions),)


@dataclass(frozen=True, eq=False)
class PartScale(LogField):
    """E, rho or t (of beams: the wall) of one part, or of several together, times e^x."""

    name = "part-scale"
    claim = "a calibration parameter of the deck is wrong"
    kind = "calibration"

    written: str = "E"  # name of the field in the deck
    positions: tuple[int, ...] = ()

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Change the value in these parts of the deck."""
        return with_scaled(assembly, float(np.exp(x[0])), self.written, self.positions)


def calibration_parameter(
    groups: ElementGroups, quantity: str, positions: Sequence[int], sd: float | None = None
) -> PartScale:
    """One calibration parameter of these parts, with its prior."""
    parts = groups.structure.assembly.parts
    names = tuple(parts[k].name for k in positions)
    nominal = value(parts[positions[0]], quantity)
    sd = prior_sd(parts, quantity, positions) if sd is None else sd
    parameter = Parameter(quantity, OF_FIELDS[quantity], 0.0, sd, nominal, step=0.1)
    inside = np.isin(groups.part, positions).astype(float)
    return PartScale(
        (parameter,), f"{quantity} of {', '.join(names)}", names,
        quantity="t" if quantity == "wall" else quantity, functions=inside[:, None],
        written=quantity, positions=tuple(positions),
    )  # fmt: skip


def alloy_of(material: AnyMaterial | None) -> str:
    """Class of an isotropic material by its E and rho, a key of ``ALLOYS``; "" for any other.

    Ranges and scatter of E and rho: JCSS (2001), Probabilistic Model Code, parts 2.1 and 3.2 (E of
    steel 3 %); ASM (1990), Metals Handbook, vol. 1 and 2 (one alloy keeps its density to 0.5 %).
    Thickness: the limits of EN 10131 (steel) and EN 485-4 (aluminium), 5 to 8 % of thin sheet, are
    two standard deviations.
    """
    if not isinstance(material, Isotropic):
        return ""
    for name, ((soft, stiff), (light, heavy)) in ALLOYS.items():
        if soft <= material.E <= stiff and light <= material.rho <= heavy:
            return name
    return ""


def prior_sd(parts: Sequence[Part], quantity: str, positions: Sequence[int]) -> float:
    """Prior standard deviation of ln(value / deck's value) of a field that these parts share.

    The class of the material counts where one of them has a thickness of its own. E and rho of
    solid bars alone also stand for their section.
    """
    chosen = [parts[k] for k in positions]
    known = any(map(thickness_of, chosen)) and all(alloy_of(material_of(p)) for p in chosen)
    return (OF_ALLOYS if known else SPREAD)[quantity]


def defaults(groups: ElementGroups) -> list[PartScale]:
    """Default calibration parameters: E and t (wall of tubes) of every part, rho of every material.

    A part may have the wrong sheet, so that every part has its own E. Weighing determines one
    density at most. For a solid bar E and rho cover all that modes reveal of its section.
    """
    parts = groups.structure.assembly.parts
    used = sorted(set(groups.part.tolist()))
    by_material: dict[int, list[int]] = {}
    for k in used:
        material = material_of(parts[k])
        by_material.setdefault(id(material) if material is None else material.id, []).append(k)
    out = [calibration_parameter(groups, "E", [k]) for k in used]
    out += [calibration_parameter(groups, "rho", ks) for ks in by_material.values()]
    return out + [
        calibration_parameter(groups, t, [k]) for k in used if (t := thickness_of(parts[k]))
    ]


def thickness_of(part: Part) -> str:
    """Name of the thickness of a part: t of a sheet, wall of a tube, "" for other parts."""
    section = part.section
    if isinstance(section, BeamSection):
        return "wall" if section.tube else ""
    return "t" if isinstance(section, ShellSection) else ""


def material_of(part: Part) -> AnyMaterial | None:
    """Material of a part; of a sheet that of its membrane, or of its bending."""
    section = part.section
    if isinstance(section, ShellSection):
        return section.membrane or section.bending
    return section.material


def value(part: Part, quantity: str) -> float:
    """The deck's value of a field of a part [SI]; the wall of a part of beams is 1.

    E of an orthotropic sheet is sqrt(E1 E2), that of an anisotropic solid the geometric mean along
    its axes.
    """
    section, material = part.section, material_of(part)
    if isinstance(material, AnisotropicSolid) and quantity == "E":
        compliance = np.linalg.pinv(material.C)
        return float(np.prod(1 / np.diag(compliance)[:3]) ** (1 / 3))
    if isinstance(section, SolidSection) or quantity not in (*SHEET, *TUBE):
        return float(getattr(material, quantity))
    if quantity not in (TUBE if isinstance(section, BeamSection) else SHEET):
        raise TypeError(f"part {part.name} has no {quantity}")
    if quantity == "wall":
        return 1.0
    if quantity == "t":
        assert isinstance(section, ShellSection)
        return section.thickness
    if quantity == "rho" and material is not None:
        return material.rho
    if isinstance(material, Isotropic):
        return material.E
    if isinstance(material, Orthotropic):
        return float(np.sqrt(material.E1 * material.E2))
    if isinstance(material, Anisotropic):
        return float(np.sqrt(material.Q[0, 0] * material.Q[1, 1]))
    return 0.0


def with_scaled(
    assembly: Assembly, factor: float, quantity: str, positions: Sequence[int]
) -> Assembly:
    """Multiply a field of these parts by a factor."""
    if quantity == "offset":
        chosen = np.isin(assembly.beams.part, positions)[:, None, None]
        offset = assembly.beams.offset * np.where(chosen, factor, 1.0)
        return replace(assembly, beams=replace(assembly.beams, offset=offset))
    parts = list(assembly.parts)
    for k in positions:
        parts[k] = scaled(parts[k], quantity, factor)
    assembly = assembly.with_parts(tuple(parts))
    if quantity != "t":
        return assembly
    chosen = np.isin(assembly.shells.part, positions)[:, None]
    t = assembly.shells.thickness * np.where(chosen, factor, 1.0)
    return replace(assembly, shells=replace(assembly.shells, thickness=t))


def scaled(part: Part, quantity: str, factor: float) -> Part:
    """Multiply a field of a part by a factor; E scales all moduli."""
    section = part.section
    if quantity == "wall":
        return part.with_section(**{n: getattr(section, n) * factor for n in _AREAS})
    if quantity == "t":
        assert isinstance(section, ShellSection)
        return part.with_section(thickness=section.thickness * factor)
    materials = {n: m for n, m in vars(section).items() if isinstance(m, AnyMaterial)}
    return part.with_section(
        **{n: scaled_material(m, quantity, factor) for n, m in materials.items()}
    )


def scaled_material(material: M, quantity: str, factor: float) -> M:
    """Multiply the numbers that a material has of a field."""
    names = MODULI if quantity == "E" else (quantity,)
    known = {n: v for n in names if (v := getattr(material, n, None)) is not None}
    return replace(material, **{n: v * factor for n, v in known.items()})


@dataclass(frozen=True, eq=False)
class RandomField(LogField):
    """Smooth scatter of a field within the parts, by Karhunen-Loève functions with unit prior."""

    name = "scatter"
    claim = "thickness and modulus vary smoothly within a part"
    kind = "nuisance"
    traits = Traits(writable=False)


def random_field(
    groups: ElementGroups, quantity: str, sd: float, length: float = 0.3, most: int = 12
) -> RandomField:
    """Gaussian scatter of standard deviation sd within each part, mean removed.

    The correlation is exp(-d²/2ℓ²), with ℓ a share ``length`` of the part's longest side. Each part
    keeps its strongest functions: ``most`` over the square root of the number of parts, 3 or more.
    Ghanem and Spanos (1991), Stochastic Finite Elements, ch. 2.
    """
    columns = []
    parts = np.unique(groups.part)
    each = max(3, round(most / np.sqrt(max(1, len(parts)))))
    for p in parts:
        inside = np.flatnonzero(groups.part == p)
        if len(inside) > 2:
            columns += _functions(groups, inside, sd, length, each)
    functions = np.array(columns).T if columns else np.zeros((len(groups), 0))
    unknown = tuple(
        Parameter(f"{quantity} scatter {j + 1}", "-", 0.0, 1.0, kind="linear", step=1.5)
        for j in range(functions.shape[1])
    )
    return RandomField(unknown, f"scatter of {quantity}", quantity=quantity, functions=functions)


def _functions(
    groups: ElementGroups, inside: np.ndarray, sd: float, length: float, most: int
) -> list[np.ndarray]:
    """Eigenfunctions of the area-weighted covariance of one part, scaled to sd."""
    X, area = groups.centre[inside], groups.area[inside]
    ell = length * np.ptp(X, axis=0).max()
    d2 = ((X[:, None] - X[None]) ** 2).sum(axis=-1)
    mean = np.eye(len(area)) - np.outer(np.ones(len(area)), area / area.sum())
    root = np.sqrt(area / area.sum())
    C = mean @ np.exp(-d2 / (2 * ell**2)) @ mean.T
    w, V = np.linalg.eigh(root[:, None] * C * root)
    out = []
    for k in np.argsort(-w)[:most]:
        if w[k] > 1e-3:
            column = np.zeros(len(groups))
            column[inside] = sd * np.sqrt(w[k]) * V[:, k] / root
            out.append(column)
    return out


@dataclass(frozen=True, eq=False)
class LinearScale(Effect):
    """K + d ∂K/∂v + d²/2 ∂²K/∂v², d = v (e^x - 1), and M likewise; v is the structure's value.

    ``write`` puts a value into an assembly.
    """

    kind = "calibration"
    claim = "a calibration parameter of the deck is wrong"

    slope: Slope | None = None
    write: Callable[[Assembly, float], Assembly] | None = None
    bent: Slope | None = None  # second slope: Poisson's ratio is not linear in v
    weight_slope: float = 0.0  # ∂m/∂v [kg]
    within: Within = field(default_factory=Within)  # the operator in K is a share of this whole

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The slopes of the operators times the change of the value."""
        assert self.slope is not None
        v = self.parameters[0].scale
        d, slope = v * np.expm1(x[0]), v * np.exp(x[0])
        out = _terms(self.slope, d, slope, self.within)
        if self.bent is None:
            return out
        return out + _terms(self.bent, d**2 / 2, d * slope, replace(self.within, complete=False))

    def weight(self, x: np.ndarray) -> Weight:
        """The change of the value times its mass per unit."""
        v = self.parameters[0].scale * self.weight_slope
        return Weight(float(v * np.expm1(x[0])), np.array([v * np.exp(x[0])]))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the value into the structure."""
        return (
            assembly if self.write is None else self.write(assembly, self.parameters[0].value(x[0]))
        )


def _terms(slope: Slope, change: float, gradient: float, within: Within) -> tuple[MatrixTerm, ...]:
    """The operators of a slope, times a change."""
    g = np.array([gradient])
    out = [MatrixTerm("K", slope.K, change, g, within=within)] if slope.K.nnz else []
    return (*out, *([MatrixTerm("M", slope.M, change, g)] if slope.M.nnz else []))


def linear_scale(
    text: str, name: str, unit: str, value: float, slope: Slope,
    write: Callable[[Assembly, float], Assembly] | None = None, sd: float = 0.3,
    bent: Slope | None = None, weight_slope: float = 0.0, within: Within | None = None,
) -> LinearScale:  # fmt: skip
    """The parameter v e^x of a linear operator, with prior standard deviation ``sd`` of x."""
    return LinearScale(
        (Parameter(name, unit, 0.0, sd, value, step=0.3),), text, slope=slope, write=write,
        bent=bent, weight_slope=weight_slope, within=within or Within(),
    )  # fmt: skip
