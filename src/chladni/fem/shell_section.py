"""Section values of shell elements from parts and materials: Q_m, Q_b, Q_c, S, drilling, density.

Residual bending flexibility is that of Nastran's CQUAD4 (MacNeal, A simple quadrilateral shell
element, Computers and Structures 8, 1978, 175-183). A linear deflection with tied shear misses the
cubic part of bending between corners. Its flexibility L²/12D is put in series with transverse
shear, S⁻¹ = (k_s G t)⁻¹ + diag(L_x²/D_11, L_y²/D_22)/12, of the *mean* of γ over a quadrilateral.
The varying part of γ transfers torsion along free edges and has only ``VARYING`` of it. With all of
it MacNeal-Harder's strip is seven times too soft in torsion. With 0.04 the error of a wing box
against NX Nastran falls from 4.6 to 0.3 %. Frequencies then agree with Nastran's within half a per
cent, but very coarse panels (two elements a side) are too soft.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import ModelError, named
from ..model.assembly import Assembly
from ..model.properties import Isotropic, Material, Orthotropic, ShellSection
from .shell import LEAST, ShellGeometry, geometry, turned

DRILLING = 0.1  # of G t: MacNeal-Harder's twisted beam to 0.1 %; 1e-3 is 30 % too soft
PENALTY = 1e-6  # of G t: a unit of K6ROT at the corners, exact (see .shell_drilling)
VARYING = 0.04  # share of the residual flexibility for the varying part of shear
STIFF = 1e-3  # shear flexibility over 1/(5/6 G_12 t) where the deck has rigid shear


@dataclass(frozen=True, eq=False)
class SectionArrays:
    """Section values of every shell, ready for :func:`chladni.fem.shell.stiffness`."""

    # Qm, Qb, Qc: (m, 3, 3) material frame, Qb times 12 I/t³, Qc in MID4's sign [Pa]
    Qm: np.ndarray
    Qb: np.ndarray
    Qc: np.ndarray
    # (m, 2, 2, 2) transverse shear with residual bending, for the mean of γ and for its variation
    # within the element, element frame [N/m]
    S: np.ndarray
    drill: np.ndarray  # (m, 2) drilling, of the field and of the corners [N/m]
    # rho, nsm: (m,) [kg/m³], [kg/m²]
    rho: np.ndarray
    nsm: np.ndarray
    loss: np.ndarray  # (m,) loss factor of the section [-]
    shear_flexibility: np.ndarray  # (m, 1, 2, 2) (k_s G t)⁻¹ alone, element frame [m/N]
    residual_flexibility: np.ndarray  # (m, 2, 2) L²/12D along x and y, of mean and varying γ [m/N]

    def __len__(self) -> int:
        return len(self.rho)

    def __getitem__(self, which: np.ndarray | slice) -> "SectionArrays":
        return SectionArrays(**{name: value[which] for name, value in vars(self).items()})

    @property
    def stiffness(self) -> dict[str, np.ndarray]:
        """The keywords of :func:`chladni.fem.shell.stiffness`."""
        return {name: getattr(self, name) for name in ("Qm", "Qb", "Qc", "S", "drill")}

    def shear_by_thickness(
        self, geo: ShellGeometry, t: np.ndarray, change: np.ndarray
    ) -> np.ndarray:
        """S (Z_s + 3 Z_r) S δt/t, the change of S for δt (m, 4) at the corners [N/m]."""
        Z = self.shear_flexibility + 3 * _diagonal(self.residual_flexibility)
        ratio = mean_thickness(geo, np.broadcast_to(change, t.shape)) / mean_thickness(geo, t)
        return self.S @ Z @ self.S * ratio[:, None, None, None]

    def shear_by_bending(self, geo: ShellGeometry, dQb: np.ndarray) -> np.ndarray:
        """S diag(Z_r dQ_ii/Q_ii) S, the change of S for dQb of the bending material [N/m]."""
        Q, dQ = (_pair(turned(q, geo.turn)) for q in (self.Qb, np.asarray(dQb)))
        change = np.where(Q > 0, dQ / np.where(Q > 0, Q, 1), 0.0)[:, None]
        return self.S @ _diagonal(self.residual_flexibility * change) @ self.S

    def shear_by_modulus(self, relative: np.ndarray | float) -> np.ndarray:
        """S Z_s S dG/G, the change of S for a relative change of the transverse moduli [N/m]."""
        change = np.broadcast_to(relative, (len(self),))[:, None, None, None]
        return self.S @ self.shear_flexibility @ self.S * change

    def drill_by_thickness(
        self, geo: ShellGeometry, t: np.ndarray, change: np.ndarray
    ) -> np.ndarray:
        """ds = s δt/t (m, 2) [N/m]."""
        ratio = mean_thickness(geo, np.broadcast_to(change, t.shape)) / mean_thickness(geo, t)
        return self.drill * ratio[:, None]

    def drill_by_membrane(self, dQm: np.ndarray) -> np.ndarray:
        """ds = s dQ_66/Q_66 (m, 2) [N/m]."""
        G, dG = self.Qm[:, 2, 2], np.broadcast_to(dQm, (len(self), 3, 3))[:, 2, 2]
        return self.drill * np.divide(dG, G, np.zeros_like(G), where=G > 0)[:, None]


def section_arrays(
    assembly: Assembly,
    geo: ShellGeometry | None = None,
    *,
    residual_bending: bool = True,
) -> SectionArrays:
    """Section values of every shell of the assembly.

    Parameters
    ----------
    geo : ShellGeometry
        Geometry of all shells of the assembly; computed by default.
    residual_bending : bool
        Add MacNeal's residual bending flexibility to transverse shear (agreement with Nastran).

    Raises
    ------
    ModelError
        If a shell refers to a part without a shell section, or its thickness is not positive.
    """
    shells = assembly.shells
    geo = geometry(assembly.points, shells) if geo is None else geo
    _check(assembly)
    table = [_constants(p.section) for p in assembly.parts]
    Qm, Qb, Qc, Z, ratio, rho, nsm, loss = (
        np.array(column)[shells.part] for column in zip(*table, strict=True)
    )
    t = mean_thickness(geo, shells.thickness)
    flexibility = (rotated(Z, geo.turn) / (ratio * t)[:, None, None])[:, None]
    residual = _residual(geo, turned(Qb, geo.turn), t) * residual_bending
    return SectionArrays(
        Qm=Qm,
        Qb=Qb,
        Qc=Qc,
        S=_inverse(flexibility + _diagonal(residual), Qb),
        drill=np.outer(Qm[:, 2, 2] * t, _drilling(assembly.k6rot)),
        rho=rho,
        nsm=nsm + shells.nonstructural,
        loss=loss,
        shear_flexibility=flexibility,
        residual_flexibility=residual,
    )


def _drilling(k6rot: float | None) -> tuple[float, float]:
    """Share of G t in the field's and in the corners' drilling stiffness."""
    return (DRILLING, 0.0) if k6rot is None else (0.0, PENALTY * k6rot)


def modulus_derivative(material: Material, name: str) -> np.ndarray:
    """dQ/dp of the plane stiffness for p = E, nu, E1, E2, nu12 or G12; dQ = -Q dC Q, C = Q⁻¹.

    An isotropic sheet is treated as an equal orthotropic one. E1, E2 and G12 then change
    independently at constant nu12 (nu21 = nu12 E2/E1 follows).
    """
    Q = material.plane_stress()
    if name == "E" and isinstance(material, Isotropic):
        own_G = np.diag([0, 0, material.shear_modulus if material.G is not None else 0.0])
        return (Q - own_G) / material.E
    dC = np.zeros((3, 3))
    if name == "nu" and isinstance(material, Isotropic):
        dC[0, 1] = dC[1, 0] = -1 / material.E
        dC[2, 2] = 2 / material.E if material.G is None else 0.0
        return -Q @ dC @ Q
    E1, E2, nu12, G12 = _engineering(material)
    if name == "E1":
        dC[0, 0], dC[0, 1] = -1 / E1**2, nu12 / E1**2
    elif name == "E2":
        dC[1, 1] = -1 / E2**2
    elif name == "nu12":
        dC[0, 1] = -1 / E1
    elif name == "G12":
        dC[2, 2] = -1 / G12**2
    else:
        raise ModelError(f"no modulus {name!r}; there are E, nu, E1, E2, nu12, G12")
    dC[1, 0] = dC[0, 1]
    return -Q @ dC @ Q


def rotated(Z: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Rᵀ Z R (m, 2, 2): a tensor of the material axes in the element frame."""
    c, s = np.cos(turn), np.sin(turn)
    R = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], -2)
    return R.swapaxes(1, 2) @ Z @ R


def mean_thickness(geo: ShellGeometry, t: np.ndarray) -> np.ndarray:
    """Mean over the corners, three of a triangle (m,) [m]."""
    return np.where(geo.triangle, t[:, :3].mean(axis=1), t.mean(axis=1))


def _engineering(material: Material) -> tuple[float, float, float, float]:
    """E1, E2, nu12, G12 of a sheet whose Q has no shear coupling."""
    if isinstance(material, Orthotropic):
        return material.E1, material.E2, material.nu12, material.G12
    C = np.linalg.inv(material.plane_stress())
    return 1 / C[0, 0], 1 / C[1, 1], -C[0, 1] / C[0, 0], 1 / C[2, 2]


def _check(assembly: Assembly) -> None:
    shells = assembly.shells
    for k in np.unique(shells.part):
        if not isinstance(assembly.parts[k].section, ShellSection):
            raise ModelError(f"part {assembly.parts[k].name!r} has shells but no shell section")
        if _couples_too_much(assembly.parts[k].section):
            raise ModelError(
                f"part {assembly.parts[k].name!r} has a coupling (MID4) that its membrane and "
                "bending cannot hold: the stiffness of the sheet has a negative eigenvalue"
            )
    t = shells.thickness  # a wedge may have none at some of its corners
    if (thin := (t < 0).any(axis=1) | ~(t.mean(axis=1) > 0)).any():
        raise ModelError(f"shells {named(shells.ids[thin])} have no thickness")


def _couples_too_much(section: ShellSection) -> bool:
    """True if [A B; B D] has a negative eigenvalue, whatever the thickness."""
    if section.coupling is None:
        return False
    A, D, B = _constants(section)[:3]
    value = np.linalg.eigvalsh(np.block([[A, B], [B, D / 12]]))
    return bool(value[0] < -LEAST * np.abs(value).max())


def _constants(section: object) -> tuple:
    """(Qm, Qb, Qc, shear flexibility times k_s t, k_s, rho, nsm, loss) of one section."""
    if not isinstance(section, ShellSection):
        return (*np.zeros((3, 3, 3)), np.zeros((2, 2)), 1.0, 0.0, 0.0, 0.0)
    Qm, Qb, Qc = (
        np.zeros((3, 3)) if m is None else m.plane_stress()
        for m in (section.membrane, section.bending, section.coupling)
    )
    sheet = section.membrane or section.bending
    return (
        Qm,
        Qb * section.bending_ratio,
        Qc,
        _flexibility(section),
        section.shear_ratio,
        sheet.rho if sheet else 0.0,
        section.nonstructural,
        section.damping or (sheet.damping if sheet else 0.0),
    )


def _flexibility(section: ShellSection) -> np.ndarray:
    """Inverse of the transverse moduli (2, 2) [1/Pa]; a small value for rigid shear."""
    if section.bending is None:
        return np.zeros((2, 2))
    Q = section.bending.plane_stress()
    mean = (Q[0, 0] + Q[1, 1]) / 4  # E/2(1+nu) of an isotropic sheet with nu = 0
    modulus = Q[2, 2] if Q[2, 2] > LEAST * mean else mean
    if not modulus > 0:
        return np.zeros((2, 2))
    least = STIFF / modulus * np.eye(2)
    shear = section.shear or section.bending
    G = shear.transverse() if not section.rigid_shear else np.zeros((2, 2))
    given = np.diag(G) > 0
    if not given.all():
        return np.where(given, 1 / np.where(given, np.diag(G), 1), np.diag(least)) * np.eye(2)
    return np.asarray(np.linalg.inv(G))


def _residual(geo: ShellGeometry, Qb: np.ndarray, t: np.ndarray) -> np.ndarray:
    """L²/12D along x and y, D = Q_b t³/12, of the mean and of the varying shear (m, 2, 2)."""
    D = _pair(Qb) * t[:, None] ** 3 / 12
    mean = np.where(D > 0, geo.sides**2 / 12 / np.where(D > 0, D, 1), 0.0)
    mean[geo.curved] = 0.0  # their shear is not that of a linear deflection
    varying = np.where(geo.triangle, 1.0, VARYING)
    return np.stack([mean, mean * varying[:, None]], axis=1)


def _pair(Q: np.ndarray) -> np.ndarray:
    return np.stack([Q[:, 0, 0], Q[:, 1, 1]], axis=1)


def _diagonal(d: np.ndarray) -> np.ndarray:
    return d[..., None] * np.eye(2)


def _inverse(Z: np.ndarray, Qb: np.ndarray) -> np.ndarray:
    """Z⁻¹ for shells with bending stiffness, zero for pure membranes."""
    bends = (_pair(Qb).max(axis=1) > 0)[:, None, None, None]
    return np.where(bends, np.linalg.inv(np.where(bends, Z, np.eye(2))), 0.0)
