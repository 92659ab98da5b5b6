"""Exact derivatives of M, V and K with respect to the properties of a part, a joint or a mass.

Every function gives Tᵀ dA T over the free dofs, from the formulas of the elements, never by
differences of matrices. A spring, a damper and a mass are linear in their value; a solid is linear
in E and ρ. The thickness of a shell enters as A t + B t³ and, with residual bending, through S. The
weights of an RBE3 may be smooth functions of a radius R. They change the transformation,
dA = dTᵀ A T + Tᵀ A dT.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..model.assembly import (
    Assembly,
    Average,
    Bushes,
    Equation,
    Masses,
    RigidBody,
    Scalars,
    picked,
)
from ..model.properties import BeamSection, Isotropic, Material, ShellSection, SolidSection
from . import shell, solid, spring
from .assemble import Structure, over_all_motions
from .average import average_derivative, average_weights, lever
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
        own = replace(section, nonstructural=0.0, nonstructural_inertia=0.0)
        a = replace(a, parts=tuple(replace(p, section=own) if k == part else p
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


def by_spring(structure: Structure, row: int) -> Slope:
    """∂K/∂k = bᵀ b of one scalar spring."""
    K, *_ = spring.matrices(_bare(structure.assembly, springs=_unit(structure, "springs", row)))
    return replace(_of(structure), K=congruence(structure.T, K))


def by_damper(structure: Structure, row: int) -> Slope:
    """∂V/∂c = bᵀ b of one scalar damper."""
    _, V, *_ = spring.matrices(_bare(structure.assembly, dampers=_unit(structure, "dampers", row)))
    return replace(_of(structure), V=congruence(structure.T, V))


def by_bush(structure: Structure, row: int, direction: int, name: str = "K") -> Slope:
    """Slope by stiffness K or damping B of one bush in one of its directions 1 to 6."""
    old = structure.assembly.bushes
    if name not in ("K", "B") or not 1 <= direction <= 6:
        raise ModelError(f"a bush has K and B along 1 to 6, no {name!r} along {direction}")
    unit, zero = np.eye(6)[direction - 1 : direction], np.zeros((1, 6))
    one = Bushes(
        old.ids[[row]], old.nodes[[row]], old.frame[[row]], old.place[[row]],
        unit if name == "K" else zero, unit if name == "B" else zero, zero,
    )  # fmt: skip
    K, V, *_ = spring.matrices(_bare(structure.assembly, bushes=one))
    assembled = congruence(structure.T, K if name == "K" else V)
    return replace(_of(structure), **{"K" if name == "K" else "V": assembled})


def by_mass(structure: Structure, row: int) -> Slope:
    """∂M/∂m of one concentrated mass, its inertia and offset kept in proportion."""
    old = structure.assembly.masses
    m = np.trace(old.matrix[row, :3, :3]) / 3
    if not m > 0:
        raise ModelError(f"CONM2 {old.ids[row]} has no mass to increase")
    one = Masses(old.ids[[row]], old.node[[row]], old.matrix[[row]] / m)
    M = spring.matrices(_bare(structure.assembly, masses=one))[2]
    return replace(_of(structure), M=congruence(structure.T, M))


def _unit(structure: Structure, family: str, row: int) -> Scalars:
    old: Scalars = getattr(structure.assembly, family)
    return Scalars(old.ids[[row]], old.nodes[[row]], old.component[[row]], np.ones(1), np.zeros(1))


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


def with_radius(assembly: Assembly, position: int, R: float) -> Assembly:
    """Set the weights w(r/R) = (1 - r²/R²)² in one RBE3, r from its reference."""
    mean = _mean(assembly, position)
    w, _ = average_weights(_distance(assembly, mean), R)
    if np.count_nonzero(w) < 3:
        raise ModelError(f"RBE3 {mean.id}: fewer than three of its points lie within {R:g} m")
    terms = tuple((n, c, float(k)) for (n, c, _), k in zip(mean.terms, w, strict=True) if k > 0)
    rigid = list(assembly.rigid)
    rigid[position] = replace(mean, terms=terms)
    return replace(assembly, rigid=tuple(rigid))


def by_radius(structure: Structure, mean: Average, R: float) -> Slope:
    """Slope by the radius of one RBE3 with smooth weights; ``mean`` lists all its points.

    No other rigid element may share its points, and the points must be free with basic displacement
    frames. Its terms must be translations 123 and its components all six.

    Raises
    ------
    ModelError
        If the element is not of this plain kind.
    """
    a, T = structure.assembly, structure.T
    _plain(a, mean)
    w, dw = (np.repeat(x, 3) for x in average_weights(_distance(a, mean), R))
    nodes = np.array([n for n, _, _ in mean.terms])
    along = np.tile(np.hstack([np.eye(3), np.zeros((3, 3))]), (len(nodes), 1))
    arm = np.repeat(a.points[nodes] - a.points[mean.reference], 3, axis=0)
    _, dG = average_derivative(lever(along, arm), w, dw)
    at = 6 * mean.reference + np.arange(6)
    on = (6 * nodes[:, None] + np.arange(3)).ravel()
    where = (np.repeat(at, len(on)), np.tile(on, 6))
    dT = sp.csr_array(sp.csr_array((dG.ravel(), where), shape=(T.shape[0],) * 2) @ T)
    M, V, K, _ = over_all_motions(a)
    return Slope(*(_both(dT.T @ (A @ T)) for A in (M, V, K)))


def _both(half: sp.csr_array) -> sp.csr_array:
    return sp.csr_array(half + half.T)


def _mean(assembly: Assembly, position: int) -> Average:
    mean = assembly.rigid[position]
    if not isinstance(mean, Average):
        raise ModelError(f"rigid element {mean.id} is not an RBE3 and has no radius")
    return mean


def _distance(assembly: Assembly, mean: Average) -> np.ndarray:
    nodes = [n for n, _, _ in mean.terms]
    arm = assembly.points[nodes] - assembly.points[mean.reference]
    return np.linalg.norm(arm, axis=1)


def _plain(assembly: Assembly, mean: Average) -> None:
    """Raise if the formula of :func:`by_radius` does not hold."""
    translations = all(tuple(sorted(c)) == (1, 2, 3) for _, c, _ in mean.terms)
    others = [e for e in assembly.rigid if e.id != mean.id]
    mine = {mean.reference, *(n for n, _, _ in mean.terms)}
    led = any(mine & _touched(e) for e in others)
    if not translations or len(mean.components) != 6 or mean.moved or led:
        raise ModelError(
            f"RBE3 {mean.id} has no radius here: its terms must be 123, its components 123456, "
            "without UM, and no other rigid element may share its grids"
        )
    if assembly.axes is not None and np.any(assembly.axes[list(mine)] != np.eye(3)):
        raise ModelError(f"RBE3 {mean.id} has no radius here: its grids' frames are not basic")


def _touched(element: RigidBody | Average | Equation) -> set[int]:
    if isinstance(element, Average):
        return {element.reference, *(n for n, _, _ in element.terms)}
    if isinstance(element, RigidBody):
        return {element.independent, *element.dependent}
    return set(element.nodes)
