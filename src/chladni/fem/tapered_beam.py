"""Beams with a section that varies along them: natural stiffness and mass (SI).

Area, moments, neutral axis and non-structural mass are linear between stations (MSC Nastran Quick
Reference Guide, PBEAM). The stiffness is the inverse of the flexibility, whose internal forces are
in equilibrium and therefore exact whatever the taper (Przemieniecki, Theory of Matrix Structural
Analysis (1968), ch. 8).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..model.properties import BeamSection, Isotropic

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True, eq=False)
class _Along:
    """The section at points of integration, x from 0 to 1 with weights that add up to 1."""

    x: np.ndarray  # (g,)
    weight: np.ndarray  # (g,)
    # area, I1, I2, I12, J, non-structural mass and inertia, neutral axis, place of the mass
    values: np.ndarray  # (11, g)
    ends: np.ndarray  # (11, 2) the same at ends A and B


def natural_stiffness(section: BeamSection, L: np.ndarray) -> np.ndarray:
    """F⁻¹ (m, 6, 6) of elongation e, twist t, rotations κ and deflections w, as in :mod:`.beam`.

    With P, M̄ and W at the shear centre, EI v'' = M̄ + W L (1/2 - x) + n P, ε = P/EA + n · v'', and
    W acts on the shear area, too: F = L ∫ Bᵀ (EI)⁻¹ B dx + L diag(∫ 1/EA, 0, ∫ 1/kGA).
    """
    assert isinstance(section.material, Isotropic)
    E, G = section.material.E, section.material.shear_modulus
    a = _along(section)
    area, I1, I2, I12, J = a.values[:5]
    bending = E * np.moveaxis(np.array([[I1, I12], [I12, I2]]), 2, 0)
    B = np.zeros((len(L), len(a.x), 2, 5))
    B[..., 0] = a.values[7:9].T
    B[..., 1:3] = np.eye(2)
    B[..., 3:] = (L[:, None] * (0.5 - a.x))[..., None, None] * np.eye(2)
    F = np.einsum("g,mgpi,gpq,mgqj->mij", a.weight, B, np.linalg.inv(bending), B, optimize=True)
    F[:, 0, 0] += a.weight @ (1 / (E * area))
    for plane, factor in enumerate(section.shear):
        if factor * G > 0:
            F[:, 3 + plane, 3 + plane] += a.weight @ (1 / (factor * G * area))
    others = np.array([0, 2, 3, 4, 5])
    K = np.zeros((len(L), 6, 6))
    K[:, others[:, None], others] = np.linalg.inv(L[:, None, None] * F)
    if G > 0 and np.all(J > 0):
        K[:, 1, 1] = 1 / (L * (a.weight @ (1 / (G * J))))
    return K


def masses(
    section: BeamSection, L: np.ndarray, more: np.ndarray, *, coupled: bool
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """(M (m, 12, 12), offsets of its ends (m, 2, 2)) of the beam and of its non-structural mass.

    Axial mass is the mean of lumped and linear, 5/12 and 1/12 of a uniform beam. A lumped mass
    keeps mass and centre of gravity.

    Parameters
    ----------
    more : (m,)   mass of the elements beyond that of the section [kg/m]
    """
    a = _along(section)
    area, I1, I2 = a.values[:3]
    rho, all_alike = section.material.rho, np.ones((len(L), 1))
    for line, polar, at in (
        (rho * area * all_alike, rho * (I1 + I2) * (section.kind == "beam"), slice(7, 9)),
        (a.values[5] + more[:, None], a.values[6], slice(9, 11)),
    ):
        ends = np.tile(a.ends[at].T, (len(L), 1, 1))
        yield (_consistent if coupled else _lumped)(a, line, polar, L), ends


def _consistent(a: _Along, line: np.ndarray, polar: np.ndarray, L: np.ndarray) -> np.ndarray:
    """∫ N Nᵀ over both ends (m, 12, 12): linear axial and torsion, cubic bending."""
    x, one = np.broadcast_arrays(a.x, np.ones((len(L), 1)))
    l = L[:, None]
    N = np.stack([1 - x, x], axis=1)
    cubic = np.stack([1 - 3 * x**2 + 2 * x**3, l * x * (1 - x) ** 2,
                      3 * x**2 - 2 * x**3, l * x**2 * (x - 1)], axis=1)  # fmt: skip
    M = np.zeros((len(L), 12, 12))

    def add(dofs: list[int], shape: np.ndarray, density: np.ndarray, share: float = 1.0) -> None:
        block = np.einsum("mg,mig,mjg->mij", share * a.weight * density, shape, shape)
        M[:, np.array(dofs)[:, None], np.array(dofs)] += L[:, None, None] * block

    for end, dof in enumerate((0, 6)):
        add([dof], np.sqrt(N[:, end : end + 1] * one[:, None]), line, 0.5)
    add([0, 6], N, line, 0.5)
    add([3, 9], N, polar * one)
    add([1, 5, 7, 11], cubic, line)
    add([2, 4, 8, 10], cubic * np.array([1, -1, 1, -1])[:, None], line)
    return M


def _lumped(a: _Along, line: np.ndarray, polar: np.ndarray, L: np.ndarray) -> np.ndarray:
    """Mass and polar inertia at either end (m, 12, 12)."""
    M = np.zeros((len(L), 12, 12))
    for k, N in ((0, 1 - a.x), (6, a.x)):
        for dof in range(3):
            M[:, k + dof, k + dof] = L * (line @ (a.weight * N))
        M[:, k + 3, k + 3] = L * (a.weight * N @ polar)
    return M


def _along(section: BeamSection) -> _Along:
    s = section
    rows = [(0.0, s.area, s.I1, s.I2, s.I12, s.J, s.nonstructural, s.nonstructural_inertia,
             *s.neutral, *s.nonstructural_at)]  # fmt: skip
    for b in s.stations:
        moments = (b.I1 * s.I1, b.I2 * s.I2, b.I12 * s.I1, b.J * s.J)
        other = (b.nonstructural, b.nonstructural_inertia, *b.neutral, *b.nonstructural_at)
        rows.append((b.x, b.area * s.area, *moments, *other))
    at, *columns = np.array(rows).T
    step = np.diff(at)[:, None]
    x = (at[:-1, None] + step * (_GAUSS + 1) / 2).ravel()
    values = np.array([np.interp(x, at, c) for c in columns])
    ends = np.array([c[[0, -1]] for c in columns])
    return _Along(x, (step * _WEIGHTS / 2).ravel(), values, ends)
