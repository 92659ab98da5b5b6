"""Classical laminate theory: a PCOMP stack smeared to one section (Jones, chapter 4)."""

from dataclasses import dataclass

import numpy as np

from ....model.properties import Anisotropic, Material, ShellSection


@dataclass(frozen=True)
class Ply:
    """One layer: material, thickness [m], angle from material axis 1 [deg]."""

    material: Material
    thickness: float
    angle: float


def laminate_section(plies: list[Ply], id: int = 0, lay: str = "") -> ShellSection:
    """A stack smeared to equivalent membrane, bending, coupling and shear moduli.

    Parameters
    ----------
    lay : LAM of PCOMP, one of "", SYM, MEM, BEND and SMEAR
    """
    t, membrane, bending, coupling, shear, rho = smear(plies)
    bent = membrane if lay == "SMEAR" else bending
    coupled = np.abs(coupling).max() > 1e-9 * np.abs(membrane).max()
    keep = coupled and lay not in ("SMEAR", "MEM", "BEND")
    return ShellSection(
        t,
        None if lay == "BEND" else Anisotropic(membrane, rho=rho, id=id),
        None if lay == "MEM" else Anisotropic(bent, rho=rho, id=id),
        Anisotropic(np.zeros((3, 3)), shear, id=id),
        Anisotropic(coupling, id=id) if keep else None,
        shear_ratio=1.0,
        rigid_shear=not np.any(shear),
    )


def smear(
    plies: list[Ply],
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """A, B, D = ∫ Q̄ (1, z, z²) dz about the middle of the stack, as t, A/t, 12 D/t³, B/t², G, rho.

    G (2, 2) is of transverse shear.
    """
    t = np.array([ply.thickness for ply in plies])
    z = np.concatenate([[0], np.cumsum(t)]) - t.sum() / 2
    Q = np.array([_turned(ply.material.plane_stress(), ply.angle) for ply in plies])
    A, B, D = (np.einsum("k,kij->ij", np.diff(z**power) / power, Q) for power in (1, 2, 3))
    T = float(t.sum())
    rho = float(sum(ply.material.rho * ply.thickness for ply in plies) / T)
    G = np.diag([_shear_modulus(plies, z, Q[:, k, k], k) for k in (0, 1)])
    return T, A / T, 12 * D / T**3, B / T**2, G, rho


def _turned(Q: np.ndarray, angle: float) -> np.ndarray:
    """Q̄ = T⁻¹ Q T⁻ᵀ for a ply turned by an angle in degrees (Jones 2.79)."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    T = np.array(
        [[c * c, s * s, -2 * c * s], [s * s, c * c, 2 * c * s], [c * s, -c * s, c * c - s * s]]
    )
    return T @ Q @ T.T


def _shear_modulus(plies: list[Ply], z: np.ndarray, E: np.ndarray, k: int) -> float:
    """Mean modulus of equal shear energy: 1/(G t) = ∫ g²/G dz / D², g = -∫ E (z - z̄) dz.

    The parabolic shear stress of each ply in cylindrical bending (MSC Nastran Quick Reference,
    PCOMP remarks); a ply without transverse modulus counts as rigid in shear.
    """
    t = np.diff(z)
    neutral = (E * np.diff(z**2) / 2).sum() / (E * t).sum()
    D = (E * np.diff((z - neutral) ** 3) / 3).sum()
    flexibility, g0 = 0.0, 0.0
    points, weights = np.polynomial.legendre.leggauss(3)
    for j, ply in enumerate(plies):
        a, b = z[j] - neutral, z[j + 1] - neutral
        x = (a + b) / 2 + (b - a) / 2 * points
        g = g0 - E[j] * (x**2 - a**2) / 2
        c, s = np.cos(np.radians(ply.angle)), np.sin(np.radians(ply.angle))
        plane = ply.material.transverse()
        G = float(plane[0, 0] * (c, s)[k] ** 2 + plane[1, 1] * (s, c)[k] ** 2)
        if G > 0:
            flexibility += (b - a) / 2 * (weights @ g**2) / G
        g0 -= E[j] * (b**2 - a**2) / 2
    return float(D**2 / flexibility / t.sum()) if flexibility > 0 else 0.0
