"""What a whole family of elements may have more or less of: joints, and shells' own formulation.

Each family is one factor on an operator the structure has already, so that the stiffness stays
positive. Joints: adhesive, weld solids, bushes, springs between parts. Shells: the transverse shear
of a part, in which two formulations of one element differ most (MacNeal's residual bending
flexibility is part of it), and the same for coarse and fine meshes.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..fem import shell
from ..fem.assemble import Structure
from ..fem.derivative import Slope, by_part, of_lumps
from ..fem.energy import only
from ..fem.shell_section import section_arrays
from ..fem.sparse_assembly import blocks, congruence
from ..model.properties import Isotropic, ShellSection, SolidSection
from .effect import MatrixTerm, Parameter
from .linear_parameter import LinearScale

SOFT = 20e9  # [Pa] below it a solid between sheets is adhesive, above it a weld
ADHESIVE, WELD, FASTENER = 0.5, 0.3, 0.5  # prior sd of ln k
JOINTS = "adhesive", "welds", "bushes"  # names of the families of joints
FAR = 3.0  # prior sd of scatter: what is farther off than that is no scatter
SHEAR = 0.5  # prior sd of ln of the transverse shear stiffness of a part
FEWEST = 0.002  # share of the shells' area below which a part has no factor of its own


@dataclass(frozen=True, eq=False)
class ModelFamily(LinearScale):
    """A factor e^x on all that a family has in K."""

    name = "family"
    claim = "joints and elements are never quite as stiff as a deck says"
    kind = "nuisance"
    writable = False

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """What the family has, times the change of the factor."""
        assert self.slope is not None
        (factor,), (v,) = self.parameters, x
        return (MatrixTerm("K", self.slope.K, factor.value(v) - 1, np.array([factor.slope(v)])),)


def shared_factor(name: str, family: str, sd: float) -> Parameter:
    """The unknown factor on all that a family has, or on all of it but one.

    Coupons of an adhesive scatter, and a bead is higher here and wider there. What is stiffer than
    any coupon is no scatter: another adhesive, or a hem that does not slide.
    """
    reach = FAR * sd if family == "adhesive" else np.inf
    return Parameter(name, "-", 0.0, sd, step=0.5, reach=reach)


def model_families(built: Structure) -> list[ModelFamily]:
    """Every family of joints, and the transverse shear of every part."""
    return [*joint_nuisances(built), *_families(_shear(built))]


def joint_nuisances(built: Structure) -> list[ModelFamily]:
    """Every family of joints: it moves what modes alone do not, and a basis has to carry it."""
    return _families(joint_families(built))


def _families(found: Iterable[tuple[str, sp.csr_array, float]]) -> list[ModelFamily]:
    return [
        ModelFamily((shared_factor("k", text, sd),), text, slope=_slope(K))
        for text, K, sd in found
        if K.nnz
    ]


def joint_families(built: Structure) -> Iterator[tuple[str, sp.csr_array, float]]:
    """(name, what it has in K, prior sd of ln k) of every family of joints."""
    yield from _solids(built)
    yield from _bushes(built)


def _slope(K: sp.csr_array) -> Slope:
    empty = sp.csr_array(K.shape)
    return Slope(empty, empty, K)


def _solids(built: Structure) -> Iterator[tuple[str, sp.csr_array, float]]:
    """Parts of solids beside shells, adhesive and welds gathered by their modulus."""
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
    own = np.flatnonzero(built.assembly.bushes.ids > 0)  # none of the firm ones in rigid ties
    if len(own):
        yield "bushes", of_lumps(built, "bushes", own.tolist()).K, FASTENER


def _shear(built: Structure) -> Iterator[tuple[str, sp.csr_array, float]]:
    """γᵀS γ of every part of shells that is more than a scrap."""
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
        yield f"shear of {assembly.parts[k].name}", K, SHEAR
