"""Shear panels (CSHEAR): one shear flow round the edges, and rods along them (PSHEAR, F1 and F2).

A panel resists one deformation. Shear flows of its edges that are in equilibrium add up to forces
along its diagonals. Opposite sides meet in two points, and p is the distance from the line through
both. With the flow q of side 1-2 the shear stress is τ t = q p_1 p_2 / p². Its energy, with the
normal stress that equilibrium asks for, is

    U = q²/2 ∫ (p_1 p_2 / p²)² (1 + 2 cot²α / (1+ν)) dA / G t

where α is the angle between the directions to both points. On a parallelogram p and α are constant
and the stress is exact.

Sources: Garvey, The quadrilateral shear panel, Aircraft Engineering 23 (1951) 134-144; NASTRAN
Theoretical Manual, 5.3; MSC Nastran Quick Reference Guide, PSHEAR (rods).
"""

from collections.abc import Iterator

import numpy as np

from ....model.assembly import Masses, concatenated
from ....model.properties import Isotropic
from .context import Context, with_property
from .materials import Materials
from .shell_elements import face_normals
from .strain_springs import StrainSpring

_WIDTH = 1.01  # F1 and F2 up to it are shares of the panel, above it widths over the thickness
_SIDES = ((0, 1), (1, 2), (2, 3), (3, 0))


def shear_panels(ctx: Context) -> tuple[list[StrainSpring], Masses]:
    """The springs and the masses of all CSHEAR."""
    springs: list[StrainSpring] = []
    masses = [Masses()]
    materials = Materials(ctx)
    for cards in ctx.deck.present("CSHEAR"):
        nodes = ctx.rows(cards, cards.ids(3, 4))
        normal = face_normals(ctx, cards, nodes)
        X, L = ctx.places[nodes] * ctx.scale.length, ctx.scale.length
        for i, card in with_property(ctx.deck, cards):
            material = materials.isotropic(card, 0, card.integer(0, 2))
            t = card.real(0, 3) * L
            if not t > 0:
                raise card.refuse(0, f"T is {card.word(0, 3)}; it is to be positive")
            rods = [card.real(0, k, 0.0) for k in (5, 6)]
            if min(rods) < 0:
                raise card.refuse(0, "F1 or F2 is negative; they widen the rods along the edges")
            nsm = card.real(0, 4, 0.0) * ctx.scale.inertia / L**2
            eid, rows = cards.integer(i, 1), nodes[i].tolist()
            springs += _panel(eid, rows, X[i], normal[i], material, t)
            springs += _rods(eid, rows, X[i], material, t, rods)
            each = (material.rho * t + nsm) * _shares(X[i])
            lumps = each[:, None, None] * np.diag([1.0] * 3 + [0.0] * 3)
            masses.append(Masses(np.full(4, eid), nodes[i], lumps))
    return springs, concatenated(*masses)


def _panel(
    eid: int, rows: list[int], X: np.ndarray, normal: np.ndarray, material: Isotropic, t: float
) -> Iterator[StrainSpring]:
    """The forces along the diagonals that the unit flow of side 1-2 asks for, and its energy."""
    G = material.shear_modulus
    if not G > 0:
        return
    x = X[1] - X[0]
    x = x - normal * (normal @ x)
    x = x / np.linalg.norm(x)
    P = (X - X[0]) @ np.column_stack([x, np.cross(normal, x)])
    A123, A124, A134, A234 = (_area(np.delete(P, k, axis=0)) for k in (3, 2, 1, 0))
    first, second = X[2] - X[0], X[3] - X[1]
    a, b = A124 / (2 * A134) * first, -A123 / (2 * A234) * second
    factors = np.zeros((4, 6))
    factors[:, :3] = a, b, -a, -b
    yield StrainSpring(eid, rows, factors, G * t / _energy(P, material.nu), material.damping)


def _area(P: np.ndarray) -> float:
    """Area of a triangle (3, 2)."""
    u, v = P[1:] - P[0]
    return float(u[0] * v[1] - u[1] * v[0]) / 2


def _energy(P: np.ndarray, nu: float) -> float:
    """∫ (p_1 p_2 / p²)² (1 + 2 cot²α / (1+ν)) dA of corners (4, 2), by 8 x 8 Gauss points [m²]."""
    size = np.sqrt(_area(P[[0, 1, 2]]) + _area(P[[0, 2, 3]]))
    corners = np.column_stack([P / size, np.ones(4)])  # homogeneous: parallels meet far away
    sides = [np.cross(corners[i], corners[j]) for i, j in _SIDES]
    one, other = np.cross(sides[0], sides[2]), np.cross(sides[1], sides[3])
    line = np.cross(one, other)
    p_1, p_2 = corners[:2] @ line
    at, weight = np.polynomial.legendre.leggauss(8)
    r, s = (c.ravel() for c in np.meshgrid(at, at))
    N = np.stack([(1 - r) * (1 - s), (1 + r) * (1 - s), (1 + r) * (1 + s), (1 - r) * (1 + s)]) / 4
    place = N.T @ corners
    dr = np.stack([s - 1, 1 - s, 1 + s, -1 - s]).T @ corners[:, :2] / 4
    ds = np.stack([r - 1, -1 - r, 1 + r, 1 - r]).T @ corners[:, :2] / 4
    dA = np.outer(weight, weight).ravel() * _cross(dr, ds)
    to_one, to_other = (p[:2] - place[:, :2] * p[2] for p in (one, other))
    cot = (to_one * to_other).sum(axis=1) / _cross(to_one, to_other)
    flow = p_1 * p_2 / (place @ line) ** 2
    return float(size**2 * (dA * flow**2 * (1 + 2 * cot**2 / (1 + nu))).sum())


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _rods(
    eid: int, rows: list[int], X: np.ndarray, material: Isotropic, t: float, rods: list[float]
) -> Iterator[StrainSpring]:
    """Rods along the edges: F t A / (sum of both lengths) in area, F t² / 2 where F is a width."""
    area = np.linalg.norm(np.cross(X[2] - X[0], X[3] - X[1])) / 2
    along = [X[j] - X[i] for i, j in _SIDES]
    length = np.linalg.norm(along, axis=1)
    for k, (i, j) in enumerate(_SIDES):
        F = rods[k % 2]
        both = length[k] + length[(k + 2) % 4]
        section = F * t**2 / 2 if F > _WIDTH else F * t * area / both
        if section > 0:
            e = np.zeros((2, 6))
            e[:, :3] = np.array([[-1.0], [1.0]]) * along[k] / length[k]
            stiffness = float(material.E * section / length[k])
            yield StrainSpring(eid, (rows[i], rows[j]), e, stiffness, material.damping)


def _shares(X: np.ndarray) -> np.ndarray:
    """Area (4,) of each corner: a third of the triangles it belongs to, of both ways to cut."""
    out = np.zeros(4)
    for k in ([0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]):
        out[k] += np.linalg.norm(np.cross(X[k[1]] - X[k[0]], X[k[2]] - X[k[0]])) / 12
    return out
