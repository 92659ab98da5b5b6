"""Exact derivatives of M, V and K with respect to the properties of a part, a joint or a mass.

Every function gives Tᵀ dA T over the free dofs, from the formulas of the elements, never by
differences of matrices. A spring and a mass are linear in their value; a solid is linear in E and
ρ. The thickness of a shell enters as A t + B t³ and, with residual bending, through S.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..model.assembly import (
    Assembly,
    picked,
)
from ..model.properties import BeamSection, Isotropic, Material, ShellSection, SolidSection
from . import shell, solid, spring
from .assemble import Structure, over_all_motions
from .energy import bare, only
from .shell_section import modulus_derivative, section_arrays
from .sparse_assembly import blocks, congruence

SHELL = ("t", "E", "nu", "rho", "E1", "E2", "G12", "nu12")
SOLID = ("E", "nu", "rho")


@dataclass(frozen=True, eq=False)
class Slope:
    """∂M/∂p, ∂V/∂p, ∂K/∂p over the free dofs (n, n); an unchanged matrix is empty."""

    M: sp.csr_array
    V: sp.csr_array
    K: sp.csr_array


def by_part(structure: Structure, part: int, name: str) -> Slope:
    """Slope by t, E, nu, rho (or E1, E2, G12, nu12) of a part of shells or solids, others fixed.

    Raises
    ------
    ModelError
        If the part has no such number.
    """
    section = structure.assembly.parts[part].section
    alone = only(structure.assembly, part)
    if isinstance(section, ShellSection) and name in SHELL:
        return _shell(structure, alone, section, name)
    if isinstance(section, SolidSection) and name in SOLID:
        return _solid(structure, alone, section, name)
    known = {ShellSection: SHELL, SolidSection: SOLID}.get(type(section), ())
    kind = structure.assembly.parts[part].name
    raise ModelError(f"part {kind} has no {name!r}; there are {', '.join(known) or 'none'}")


def _shell(structure: Structure, a: Assembly, section: ShellSection, name: str) -> Slope:
    geo = shell.geometry(a.points, a.shells)
    s, t = section_arrays(a, geo), a.shells.thickness
    if name == "rho":
        one = np.ones(len(geo))
        return _of(structure, M=(shell.mass(geo, t, one, coupled=a.coupled_mass), geo.nodes))
    if name == "t":
        change = np.ones_like(t)
        dK = shell.thickness_derivative(
            geo, t, change, s.Qm, s.Qb, s.Qc, s.shear_by_thickness(geo, t, change),
            s.drill_by_thickness(geo, t, change), reference=s.Qm,
        )  # fmt: skip
        dM = shell.mass_by_thickness(geo, t, change, s.rho, a.coupled_mass)
        return _of(structure, M=(dM, geo.nodes), K=(dK, geo.nodes))
    return _of(structure, K=(_shell_modulus(geo, a, section, name), geo.nodes))


def _shell_modulus(
    geo: shell.ShellGeometry, a: Assembly, section: ShellSection, name: str
) -> np.ndarray:
    """Slope of K through membrane, bending, coupling, transverse shear and drilling stiffness."""
    s, t = section_arrays(a, geo), a.shells.thickness
    slopes = {
        field: modulus_derivative(m, name)
        for field in ("membrane", "bending", "coupling")
        if (m := getattr(section, field)) is not None
    }
    zero = np.zeros((3, 3))
    dQm, dQc = (slopes.get(field, zero) for field in ("membrane", "coupling"))
    dQb = slopes.get("bending", zero) * section.bending_ratio
    shear = section.shear or section.bending
    dS = s.shear_by_bending(geo, np.broadcast_to(dQb, (len(geo), 3, 3)))
    dS = dS + s.shear_by_modulus(0.0 if section.rigid_shear else _shear_slope(shear, name))
    return shell.stiffness(
        geo, t, Qm=dQm, Qb=dQb, Qc=dQc, S=dS, drill=s.drill_by_membrane(dQm),
        reference=s.Qm,
    )  # fmt: skip


def _shear_slope(material: Material | None, name: str) -> float:
    """∂ln G/∂p of the transverse moduli, which are independent in an orthotropic sheet."""
    if not isinstance(material, Isotropic) or material.G is not None:
        return 0.0
    return {"E": 1 / material.E, "nu": -1 / (1 + material.nu)}.get(name, 0.0)


def _solid(structure: Structure, a: Assembly, section: SolidSection, name: str) -> Slope:
    material = section.material
    if not isinstance(material, Isotropic):
        raise ModelError(f"solids need an isotropic material, not {type(material).__name__}")
    out = _of(structure)
    for group in a.solids:
        X = a.points[group.nodes]
        if name == "rho":
            one = np.ones(len(group))
            A = solid.mass(X, one) if a.coupled_mass else solid.lumped_mass(X, one)
            out = replace(out, M=out.M + _assembled(structure, A, group.nodes))
            continue
        C, dC = (
            np.broadcast_to(c, (len(group), 6, 6))
            for c in (solid.elasticity(material), solid.elasticity_derivative(material, name))
        )
        A = solid.stiffness_derivative(X, C, dC, 0 if section.full else section.modes)
        out = replace(out, K=out.K + _assembled(structure, A, group.nodes))
    return out


def of_part(structure: Structure, part: int, name: str) -> Slope:
    """Contribution of a part of solids or beams to K ("E": all moduli), M ("rho"), both ("wall").

    The matrices are linear in the value: K (1 + c) belongs to the part with every modulus times
    1 + c, M likewise. Non-structural mass is excluded. The area and all moments of a tube are
    proportional to its wall.
    """
    a = only(structure.assembly, part)
    section = a.parts[part].section
    if isinstance(section, BeamSection):
        bare_beams = replace(a.beams, nonstructural=np.zeros(len(a.beams)))
        a = replace(a, beams=bare_beams)
        a = replace(a, parts=tuple(replace(p, section=section.structural) if k == part else p
                                   for k, p in enumerate(a.parts)))  # fmt: skip
    M, _, K, _ = over_all_motions(a)
    found = {"E": {"K": K}, "rho": {"M": M}, "wall": {"K": K, "M": M}}[name]
    assembled = {matrix: congruence(structure.T, A) for matrix, A in found.items()}
    return replace(_of(structure), **assembled)


def of_lumps(structure: Structure, family: str, rows: Sequence[int]) -> Slope:
    """Contribution of some "springs" or "bushes" to K, or of some "masses" to M."""
    old = getattr(structure.assembly, family)
    some = picked(old, np.asarray(rows, dtype=int))
    K, _, M, _ = spring.matrices(_bare(structure.assembly, **{family: some}))
    if family == "masses":
        return replace(_of(structure), M=congruence(structure.T, M))
    return replace(_of(structure), K=congruence(structure.T, K))


def _bare(assembly: Assembly, **lumps: object) -> Assembly:
    """The points with these lumped elements only."""
    return replace(bare(assembly), **lumps)  # type: ignore[arg-type]


Matrices = tuple[np.ndarray, np.ndarray]


def _of(structure: Structure, M: Matrices | None = None, K: Matrices | None = None) -> Slope:
    n = structure.T.shape[1]
    found = [sp.csr_array((n, n)) if x is None else _assembled(structure, *x) for x in (M, K)]
    return Slope(found[0], sp.csr_array((n, n)), found[1])


def _assembled(structure: Structure, A: np.ndarray, nodes: np.ndarray) -> sp.csr_array:
    """Tᵀ A T of element matrices."""
    return congruence(structure.T, blocks(A, nodes, len(structure.assembly.points)))
