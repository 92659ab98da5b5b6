"""Common stiffness factors of element families: joints, and the transverse shear of shells.

Each family is one factor on an existing operator of the structure, so that the stiffness stays
positive. Joints are adhesive, weld solids and bushes. For shells the factor acts on the transverse
shear of a part. Two formulations of one element differ most in it (MacNeal's residual bending
flexibility is a part of it), and so do coarse and fine meshes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from ..fem import shell
from ..fem.assemble import Structure
from ..fem.derivative import by_part, of_lumps
from ..fem.energy import only
from ..fem.shell_section import section_arrays
from ..fem.sparse_assembly import blocks, congruence
from ..model.assembly import Assembly
from ..model.properties import Isotropic, ShellSection, SolidSection
from .effect import Effect, MatrixTerm, Parameter, Traits
from .joints import SOFT, with_family

ADHESIVE, WELD, FASTENER = 0.5, 0.3, 0.5  # prior sd of ln k
JOINTS = "adhesive", "welds", "bushes"  # names of the families of joints
FAR = 3.0  # limit of scatter in prior standard deviations
SHEAR = 0.5  # prior sd of ln of the transverse shear stiffness of a part
JointFamilies = dict[str, tuple[sp.csr_array, float]]  # name: operator in K, prior sd of ln k
FEWEST = 0.002  # share of the shells' area below which a part has no factor of its own


@dataclass(frozen=True, eq=False)
class ModelFamily(Effect):
    """A factor e^x on the operator of a family in K."""

    name = "family"
    claim = "joints and elements never have exactly the stiffness of the deck"
    kind = "nuisance"
    traits = Traits(writable=False)

    operator: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    part: int | None = None  # position of the part whose shells the family belongs to

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The operator of the family times the change of the factor."""
        (factor,), (v,) = self.parameters, x
        change, slope = factor.value(v) - 1, np.array([factor.slope(v)])
        return (MatrixTerm("K", self.operator, change, slope, part=self.part),)


@dataclass(frozen=True, eq=False)
class CalibratedFamily(ModelFamily):
    """A family of joints whose factor exceeds the usual scatter: written into the deck."""

    claim = "joints of one kind are far stiffer or softer than in the deck"
    kind = "calibration"
    traits = Traits()
    called = "stiffness, times the deck's"

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the factor on E of solids or on K of bushes."""
        return with_family(assembly, self.text, self.parameters[0].value(x[0]))


def calibrated_family(family: ModelFamily) -> CalibratedFamily:
    """Make a family of joints writable as a number of the deck."""
    return CalibratedFamily(family.parameters, family.text, operator=family.operator)


def shared_factor(name: str, family: str, sd: float) -> Parameter:
    """The unknown factor on a family, or on all of its members but one.

    Coupons of an adhesive scatter, and the section of a bead varies. A stiffness beyond that of any
    coupon is not scatter, but another adhesive or a hem that does not slide.
    """
    reach = FAR * sd if family == "adhesive" else np.inf
    return Parameter(name, "-", 0.0, sd, step=0.5, reach=reach)


def model_families(built: Structure) -> list[ModelFamily]:
    """Every family of joints, and the transverse shear of every part."""
    return [*joint_nuisances(built), *_shear(built)]


def joint_nuisances(built: Structure) -> list[ModelFamily]:
    """Every family of joints; the basis must represent them, because modes alone do not."""
    return _families(joint_families(built))


def _families(found: JointFamilies) -> list[ModelFamily]:
    return [
        ModelFamily((shared_factor("k", text, sd),), text, operator=K)
        for text, (K, sd) in found.items()
        if K.nnz
    ]


def joint_families(built: Structure) -> JointFamilies:
    """Every family of joints that the structure has."""
    return {name: (K, sd) for name, K, sd in (*_solids(built), *_bushes(built))}


def _solids(built: Structure) -> Iterator[tuple[str, sp.csr_array, float]]:
    """Solids in a model with shells, classified as adhesive or welds by their modulus."""
    assembly = built.assembly
    kinds: dict[float, list[sp.csr_array]] = {}
    used = {int(p) for group in assembly.solids for p in np.unique(group.part)}
    for k in sorted(used if len(assembly.shells) else ()):
        section = assembly.parts[k].section
        if isinstance(section, SolidSection) and isinstance(section.material, Isotropic):
            E = section.material.E
            sd = ADHESIVE if E < SOFT else WELD
            kinds.setdefault(sd, []).append(E * by_part(built, k, "E").K)
    for sd, found in kinds.items():
        yield "adhesive" if sd == ADHESIVE else "welds", sp.csr_array(sum(found[1:], found[0])), sd


def _bushes(built: Structure) -> Iterator[tuple[str, sp.csr_array, float]]:
    """All bushes together."""
    own = np.flatnonzero(built.assembly.bushes.ids > 0)  # not the firm springs in rigid ties
    if len(own):
        yield "bushes", of_lumps(built, "bushes", own.tolist()).K, FASTENER


def _shear(built: Structure) -> Iterator[ModelFamily]:
    """γᵀS γ of every part with a share of more than ``FEWEST`` of the shells' area."""
    assembly = built.assembly
    shells = assembly.shells
    if not len(shells):
        return
    area = np.bincount(
        shells.part, shell.geometry(assembly.points, shells).area, len(assembly.parts)
    )
    for k in np.flatnonzero(area > FEWEST * area.sum()):
        if not isinstance(assembly.parts[k].section, ShellSection):
            continue
        alone = only(assembly, int(k))
        geo = shell.geometry(alone.points, alone.shells)
        arrays = section_arrays(alone, geo)
        A = shell.stiffness(geo, alone.shells.thickness, S=arrays.S, reference=arrays.Qm)
        K = congruence(built.T, blocks(A, alone.shells.nodes, len(assembly.points)))
        text = f"shear of {assembly.parts[k].name}"
        if not K.nnz:
            continue
        yield ModelFamily((shared_factor("k", text, SHEAR),), text, operator=K, part=int(k))
