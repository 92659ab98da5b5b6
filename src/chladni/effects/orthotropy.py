"""A sheet that is stiffer along one axis than across it, and its prior by the class of material.

Wood (clear softwood, 12 % moisture): E_L over density 22 to 33 MPa m³/kg, E_R/E_L 0.06 to 0.16,
E_T/E_L 0.04 to 0.09, G_LR/E_L and G_LT/E_L 0.05 to 0.12. Source: Forest Products Laboratory (2010),
Wood Handbook, FPL-GTR-190, tables 5-1 and 5-3. Rolled metal: directions differ by a few per cent,
in strong textures by up to some fifteen. Source: Hosford (1993), The Mechanics of Crystals and
Textured Polycrystals, ch. 2. Any other material has a wide prior.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from ..model.assembly import Assembly
from ..model.properties import Isotropic, Orthotropic, Part, ShellSection
from .effect import Effect, FieldChange, Parameter, Traits
from .effect_context import EffectContext
from .element_groups import ElementGroups
from .estimate import Estimate
from .family import Article, Family

SQUARE = 1e-3  # relative difference of two extents below which neither is the longest


@dataclass(frozen=True)
class Orthotropy:
    """Medians [Pa] of E1, E2, G12 and the standard deviations of their logarithms.

    ``nu_sd`` is that of the logit of sqrt(nu12 nu21) / 0.6; 0.25 means a deviation of 0.04 at 0.3.
    """

    median: tuple[float, float, float]
    sd: tuple[float, float, float]
    nu_sd: float = 1.0

    @property
    def directed(self) -> bool:
        """True if the prior distinguishes the two directions."""
        return self.median[0] != self.median[1]

    def shift(self, E: float, G: float) -> tuple[float, float, float]:
        """Logarithms of the medians over E, E and G of an isotropic sheet."""
        E1, E2, G12 = self.median
        return float(np.log(E1 / E)), float(np.log(E2 / E)), float(np.log(G12 / G))


def is_wood(material: Isotropic) -> bool:
    """True by density [kg/m³] and a modulus [Pa] between those across and along the grain."""
    return 300 <= material.rho <= 900 and 0.3e9 <= material.E <= 25e9


def is_metal(material: Isotropic) -> bool:
    """True from magnesium to steel, by density [kg/m³] and modulus [Pa]."""
    return material.rho > 1700 and material.E > 35e9


def orthotropy(material: Isotropic) -> Orthotropy:
    """Prior of E1, E2 and G12 of a sheet that is isotropic in the deck."""
    if is_wood(material):
        along = 27e6 * material.rho
        return Orthotropy((along, 0.08 * along, 0.08 * along), (0.25, 0.45, 0.35))
    E, G = material.E, material.shear_modulus
    if is_metal(material):
        return Orthotropy((E, E, G), (0.12, 0.12, 0.12), 0.25)
    return Orthotropy((E, E, G), (1.0, 1.0, 0.7))


@dataclass(frozen=True, eq=False)
class OrthotropicMaterial(Effect):
    """E1, E2, G12 and nu12 in place of one isotropic E and nu.

    x = ln(E1/E), ln(E2/E), ln(G12/G) and the logit of sqrt(nu12 nu21) / 0.6.
    """

    name = "orthotropic-material"
    claim = "the sheet is stiffer along one direction than across it"
    traits = Traits(remakes_structure=True)

    E: float = 0.0
    nu: float = 0.3
    positions: tuple[int, ...] = ()
    inside: np.ndarray = field(default_factory=lambda: np.zeros(0))
    axis: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def moduli(self, x: np.ndarray) -> tuple[float, float, float, float]:
        """(E1, E2, G12 [Pa], nu12), nu12 = nu_m sqrt(E1/E2), nu_m the mean of nu12 and nu21."""
        E1, E2 = self.E * np.exp(x[0]), self.E * np.exp(x[1])
        G12 = self.E / (2 * (1 + self.nu)) * np.exp(x[2])
        return float(E1), float(E2), float(G12), float(_mean_ratio(x[3]) * np.sqrt(E1 / E2))

    @property
    def axis_1(self) -> np.ndarray:
        """Material axis 1, along which the components of the plane stiffness act."""
        return self.axis

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """E1, E2, G12 and nu12."""
        nu12 = self.estimate(x, sd, lambda y: self.moduli(y)[3], "nu12", k=3)
        return *super().reported(x, sd)[:3], nu12

    def _logs(self, x: np.ndarray) -> np.ndarray:
        """ln of Q11, Q22, Q12, Q66 over the isotropic ones (4,)."""
        m = _mean_ratio(x[3])
        base = np.log(1 - self.nu**2) - np.log(1 - m**2)
        return np.array(
            [x[0] + base, x[1] + base, (x[0] + x[1]) / 2 + base + np.log(m / self.nu), x[2]]
        )

    def terms(self, x: np.ndarray) -> tuple[FieldChange, ...]:
        """ln factors of the four components of the plane stiffness."""
        has = 0.0 if self.in_structure is None else self._logs(self.in_structure)
        logs, h = self._logs(x) - has, 1e-6
        slopes = np.stack(
            [(self._logs(x + h * e) - self._logs(x - h * e)) / (2 * h) for e in np.eye(4)], axis=1
        )
        return tuple(
            FieldChange(name, logs[k] * self.inside, np.outer(self.inside, slopes[k]))
            for k, name in enumerate(("Q11", "Q22", "Q12", "Q66"))
        )

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Replace the isotropic sheet of the parts by MAT8 with axis 1 along ``axis``."""
        E1, E2, G12, nu12 = self.moduli(x)
        parts = list(assembly.parts)
        for k in self.positions:
            parts[k] = parts[k].with_section(**_replaced(parts[k].section, E1, E2, G12, nu12))
        shells = assembly.shells
        inside = np.isin(shells.part, self.positions)[:, None]
        shells = replace(shells, axis=np.where(inside, self.axis, shells.axis))
        return replace(assembly.with_parts(tuple(parts)), shells=shells)


def _mean_ratio(x: float) -> float:
    """sqrt(nu12 nu21) in (0, 0.6), 0.6 / (1 + e^-x)."""
    return float(0.6 / (1 + np.exp(-x)))


def _replaced(
    section: object, E1: float, E2: float, G12: float, nu12: float
) -> dict[str, Orthotropic]:
    """Orthotropic membrane, bending and shear materials of a section, where it has them."""
    if not isinstance(section, ShellSection):
        return {}
    out = {}
    for name in ("membrane", "bending", "shear"):
        old = getattr(section, name)
        if old is not None:
            G = old.transverse()[0, 0]
            out[name] = Orthotropic(E1, E2, nu12, G12, G, G, old.rho, old.damping, old.id)
    return out


def orthotropic(
    groups: ElementGroups, positions: tuple[int, ...], axis: np.ndarray
) -> OrthotropicMaterial:
    """Orthotropy of these isotropic parts with axis 1 along a direction of the basic frame.

    It replaces the parameter E. It also replaces t where the moduli are so uncertain that t adds
    nothing.
    """
    parts = groups.structure.assembly.parts
    section = parts[positions[0]].section
    material = section.membrane or section.bending if isinstance(section, ShellSection) else None
    if not isinstance(material, Isotropic):
        raise TypeError(f"part {parts[positions[0]].name} is not isotropic")
    nu = min(max(material.nu, 0.02), 0.55)
    nu_mean = float(np.log(nu / (0.6 - nu)))
    E, G, prior = material.E, material.shear_modulus, orthotropy(material)
    unknown = (
        *(
            Parameter(name, "Pa", mean, sd, scale, step=0.3, starts=(mean - sd, mean, mean + sd))
            for name, mean, sd, scale in zip(
                ("E1", "E2", "G12"), prior.shift(E, G), prior.sd, (E, E, G), strict=True
            )
        ),
        Parameter("nu mean", "-", nu_mean, prior.nu_sd, kind="linear", step=0.5, nominal=nu_mean),
    )
    names = tuple(parts[k].name for k in positions)
    direction = "xyz"[int(np.argmax(np.abs(axis)))]
    return OrthotropicMaterial(
        unknown,
        f"all of {', '.join(names)}, axis 1 along {direction}",
        names,
        replaces=tuple(f"{q} of {n}" for q in ("E" if is_metal(material) else "Et") for n in names),
        expected=prior.directed,
        E=material.E,
        nu=material.nu,
        positions=positions,
        inside=np.isin(groups.part, positions).astype(float),
        axis=np.asarray(axis, float),
    )


def material_axes(where: EffectContext) -> list[OrthotropicMaterial]:
    """Orthotropy of every isotropic material, axis 1 along the longest extent of its parts."""
    groups = where.groups
    parts = groups.structure.assembly.parts
    by_material: dict[Isotropic, list[int]] = {}
    for k in sorted(set(groups.part.tolist())):
        if (material := isotropic(parts[k])) is not None:
            by_material.setdefault(material, []).append(k)
    return [
        orthotropic(groups, tuple(positions), axis)
        for material, positions in by_material.items()
        for axis in _extents(groups, np.isin(groups.part, positions))[
            : 1
            + orthotropy(
                material
            ).directed  # both if the prior distinguishes them
        ]
    ]


def isotropic(part: Part) -> Isotropic | None:
    """The isotropic sheet material of a part, or None."""
    if not isinstance(part.section, ShellSection):
        return None
    material = part.section.bending or part.section.membrane
    return material if isinstance(material, Isotropic) else None


def _extents(groups: ElementGroups, inside: np.ndarray) -> list[np.ndarray]:
    """Principal directions of some groups, longest first, snapped to nearby coordinate axes.

    The third, if any, is across the sheet.  A square has none: it gets coordinate axes.
    """
    made = groups.structure.assembly
    chosen = inside[groups.group[: len(made.shells)]]
    centre = made.points[made.shells.nodes[chosen]].mean(axis=1)
    if len(centre) < 3:
        return list(np.eye(3))
    X = centre - centre.mean(axis=0)
    _, size, directions = np.linalg.svd(X, full_matrices=False)
    if size[1] > (1 - SQUARE) * size[0]:
        return [np.eye(3)[k] for k in np.argsort(-np.ptp(X, axis=0).round(9), kind="stable")]
    at = [(d, int(np.argmax(np.abs(d)))) for d in directions]
    return [np.eye(3)[k] if abs(d[k]) > 0.98 else d for d, k in at]


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Change E1/E2 by 6 to 35 % and G12 by up to 16 %, axis 1 along x, in all parts."""
    old = isotropic(article.assembly.parts[0])
    assert old is not None
    ratio = float(rng.choice([-1, 1]) * rng.uniform(0.06, 0.3))
    E1, E2 = old.E * np.exp(ratio / 2), old.E * np.exp(-ratio / 2)
    G = old.shear_modulus
    G12 = G * float(np.exp(rng.uniform(-0.15, 0.15)))
    new = Orthotropic(E1, E2, old.nu * np.sqrt(E1 / E2), G12, G, G, old.rho)
    made = article.assembly
    made = made.with_parts(tuple(p.with_section(membrane=new, bending=new) for p in made.parts))
    axis = np.broadcast_to([1.0, 0, 0], made.shells.axis.shape)
    moduli = {"E1": E1, "E2": E2, "G12": G12}
    return replace(
        article, assembly=replace(made, shells=replace(made.shells, axis=axis)),
        truth={**moduli, "parameters": moduli},
    )  # fmt: skip


FAMILY = Family(
    OrthotropicMaterial,
    conceal,
    placed=material_axes,
    cards=("MAT8", "CORD2R", "CQUAD4", "CTRIA3"),
    settled_by="test strips in bending, cut along the sheet and across it",
    on_sheets=True,
)
