"""Stiffness of one joint, and common factors of joints and of the transverse shear of shells.

Each family is one factor on an existing operator of the structure, so that the stiffness stays
positive. Joints are adhesive, weld solids and bushes. For shells the factor acts on the transverse
shear of a part. Two formulations of one element differ most in it (MacNeal's residual bending
flexibility is a part of it), and so do coarse and fine meshes.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
import scipy.sparse as sp

from ..fem import shell
from ..fem.assemble import Structure
from ..fem.derivative import by_part, of_lumps
from ..fem.sparse_assembly import blocks, congruence
from ..model.assembly import Assembly, Shells, picked
from ..model.properties import Isotropic, ShellSection, SolidSection
from .effect import Effect, MatrixTerm, Parameter, Traits, Within
from .element_groups import shear_matrices
from .joints import Connection, solid_parts, with_factor_on, with_family

ADHESIVE, WELD, FASTENER = 0.5, 0.3, 0.5  # prior sd of ln k
JOINTS = "adhesive", "welds", "bushes"  # names of the families of joints
FAR = 3.0  # limit of scatter in prior standard deviations
SHEAR = 0.5  # prior sd of ln of the transverse shear stiffness of a part
FEWEST = 0.002  # share of the shells' area below which a part has no factor of its own
NONE_ELSE = 1e-9  # of a family's stiffness: with less of it elsewhere, the joint is all of it


@dataclass(frozen=True, eq=False)
class JointFamily:
    """All joints of one kind: their contribution to K, their elements, and the prior sd of ln k."""

    operator: sp.csr_array
    within: Within
    sd: float


JointFamilies = dict[str, JointFamily]


def within_shear(shells: Shells, rows: np.ndarray) -> Within:
    """The share of the transverse shear of sheets that some shells have."""
    return Within(frozenset(("shear", int(i)) for i in shells.ids[rows]), shells=rows)


def within_joints(ids: Iterable[int]) -> Within:
    """The share of joints that consists of these elements."""
    return Within(frozenset(("joint", int(i)) for i in ids))


@dataclass(frozen=True, eq=False)
class ModelFamily(Effect):
    """A factor e^x on the operator of a family in K."""

    name = "family"
    claim = "joints and elements never have exactly the stiffness of the deck"
    kind = "nuisance"
    traits = Traits(writable=False)

    operator: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    within: Within = field(default_factory=Within)

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The operator of the family times the change of the factor."""
        (factor,), (v,) = self.parameters, x
        change, slope = factor.value(v) - 1, np.array([factor.slope(v)])
        return (MatrixTerm("K", self.operator, change, slope, within=self.within),)


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
    return CalibratedFamily(
        family.parameters, family.text, operator=family.operator, within=family.within
    )


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
        ModelFamily(
            (shared_factor("k", text, each.sd),), text, operator=each.operator, within=each.within
        )
        for text, each in found.items()
        if each.operator.nnz
    ]


def joint_families(built: Structure) -> JointFamilies:
    """Every family of joints that the structure has."""
    return dict((*_solids(built), *_bushes(built)))


def _solids(built: Structure) -> Iterator[tuple[str, JointFamily]]:
    """Solids in a model with shells, classified as adhesive or welds by their modulus."""
    assembly = built.assembly
    for name, sd in (("adhesive", ADHESIVE), ("welds", WELD)) if len(assembly.shells) else ():
        found = list(solid_parts(assembly, name == "adhesive"))
        parts = sorted({int(assembly.solids[g].part[rows[0]]) for g, rows in found})
        if parts:
            each = (_modulus(assembly, k) * by_part(built, k, "E").K for k in parts)
            ids = (int(i) for g, rows in found for i in assembly.solids[g].ids[rows])
            yield name, JointFamily(sp.csr_array(sum(each)), within_joints(ids), sd)


def _modulus(assembly: Assembly, part: int) -> float:
    section = assembly.parts[part].section
    assert isinstance(section, SolidSection)
    assert isinstance(section.material, Isotropic)
    return section.material.E


def _bushes(built: Structure) -> Iterator[tuple[str, JointFamily]]:
    """All bushes together."""
    ids = built.assembly.bushes.ids
    own = np.flatnonzero(ids > 0)  # not the firm springs in rigid ties
    if len(own):
        K = of_lumps(built, "bushes", own.tolist()).K
        yield "bushes", JointFamily(K, within_joints(ids[own]), FASTENER)


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
        mine, text = np.flatnonzero(shells.part == k), f"shear of {assembly.parts[k].name}"
        A = shear_matrices(assembly, mine)
        nodes = shell.geometry(assembly.points, picked(shells, mine)).nodes
        K = congruence(built.T, blocks(A.sum(axis=0), nodes, len(assembly.points)))
        if K.nnz:
            yield ModelFamily(
                (shared_factor("k", text, SHEAR),),
                text,
                operator=K,
                within=within_shear(shells, mine),
            )


def _nothing() -> sp.csr_array:
    return sp.csr_array((0, 0))


@dataclass(frozen=True, eq=False)
class JointStiffness(Effect):
    """K + (g - 1) Σ_i K_i + (f/g - 1) g K_j: the joint times f(x_0), others of its family times g.

    The last parameter is ln g, where there are others. It takes the place of the factor that a
    family shares. The joint is within its family, so each factor multiplies what the other left
    (:class:`.effect.Within`), also where two effects act on one family. With ``own_loads``
    the basis contains (P⁻¹ A)ᵏ φ, which spans the mode change for any stiffness of the joint.
    """

    joint: Connection | None = None  # what it is in the deck
    family: str = ""  # name of its family, "" for a joint of none
    operator: sp.csr_array = field(default_factory=_nothing)  # contribution to K of the joint
    whole: JointFamily | None = None  # its family with other members, or None

    @classmethod
    def of(
        cls, joint: Connection, unknown: tuple[Parameter, ...], text: str, tried: int, family: str,
        families: JointFamilies, shared: str, own: sp.csr_array | None = None, **more: Any,
    ) -> Self:  # fmt: skip
        """The effect on one joint, or one run of joints, of as many as were tried.

        Parameters
        ----------
        families : of :func:`.joint_stiffness.joint_families`
        shared : name of the parameter of the others
        own : contribution of the joint to K; bᵀ b of its rows by default
        """
        own = sp.csr_array(joint.rows.T @ joint.rows) if own is None else own
        whole = None
        if known := families.get(family):
            if abs(known.operator - own).max() > NONE_ELSE * abs(known.operator).max():
                whole, unknown = known, (*unknown, shared_factor(shared, family, known.sd))
        x, y, z = joint.point.tolist()
        return cls(
            unknown, text, joint.parts, joint.grids, point=(x, y, z), trials_factor=tried,
            replaces=(family,) if family in families else (), joint=joint, family=family,
            operator=own, whole=whole, **more,
        )  # fmt: skip

    def factor(self, x: np.ndarray) -> tuple[float, float]:
        """Factor f on the joint, and its slope by the first parameter."""
        p = self.parameters[0]
        return p.value(x[0]) / p.scale, p.slope(x[0]) / p.scale

    def loss(self, x: np.ndarray) -> float | None:
        """Loss factor of the joint, or None if it is that of the deck."""
        return None

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The terms of the family and of the joint."""
        (f, slope), (g, dg) = self.factor(x), self.shared(x)
        gradient = slope / g * np.eye(len(x))[0] - f / g**2 * dg
        own = MatrixTerm("K", self.operator, f / g - 1, gradient, within=self.within)
        return (own, *self.of_family(x))

    @property
    def within(self) -> Within:
        """The elements of the joint."""
        return within_joints(() if self.joint is None else self.joint.ids)

    def shared(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Factor g on the family and its gradient (n_p,); 1 where the joint is all of it."""
        if self.whole is None:
            return 1.0, np.zeros(len(x))
        p = self.parameters[-1]
        return p.value(x[-1]), p.slope(x[-1]) * np.eye(len(x))[-1]

    def of_family(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The term of the family, if it has other members."""
        if self.whole is None:
            return ()
        g, dg = self.shared(x)
        return (MatrixTerm("K", self.whole.operator, g - 1, dg, within=self.whole.within),)

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """A φ of the joint; the basis already represents all of its family together."""
        return sp.csr_array((self.operator @ shapes).T)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the joint as fitted, and the others as fitted with it."""
        assert self.joint is not None
        g, _ = self.shared(x)
        made = with_family(assembly, self.family, g)
        return with_factor_on(made, self.joint, self.factor(x)[0] / g, self.loss(x))


@dataclass(frozen=True, eq=False)
class Fastener(JointStiffness):
    """A joint of few elements: the basis contains all relative motions that load it.

    The basis is loaded again by inertia, because a joint that is gone may free a mode of its own.
    """

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """Rows b with K_j = bᵀ b."""
        assert self.joint is not None
        return self.joint.rows
