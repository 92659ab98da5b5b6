"""Circular beams (CBEND): exact stiffness by the flexibility of the arc, mass lumped at the ends.

With A clamped, forces and moments at B cause N, V_1, V_2, T, M_1 and M_2 at the angle φ. The
flexibility of B is F = ∫ bᵀ c b R dφ with the compliances

    c = diag(1/EA, 1/K_1 GA, 1/K_2 GA, 1/GJ, 1/EI_1, 1/EI_2)

M_1 is about the neutral axis. It lies DELTAN from the centroid towards the centre of curvature,
I_1 / A R unless given. The stiffness is Eᵀ F⁻¹ E, E of ``relative``.

Sources: MSC Nastran Quick Reference Guide, CBEND and PBEND; Timoshenko, Strength of Materials II
(1956), ch. 12 (curved bars).
"""

from dataclasses import dataclass

import numpy as np

from ....model.assembly import Masses, concatenated
from ..text.table import Cards
from .context import Context, with_property
from .materials import Materials
from .strain_springs import StrainSpring, relative, squares

_POINTS = 16  # of Gauss along an arc of less than 180 degrees: exact to rounding


@dataclass(frozen=True, eq=False)
class _Arc:
    """An arc from A to B in the basic frame [m]."""

    A: np.ndarray
    B: np.ndarray
    out: np.ndarray  # (3,) unit vector from the centre to the middle of the arc
    radius: float

    @property
    def half(self) -> float:
        """Half the angle [rad]."""
        return float(np.arcsin(np.linalg.norm(self.B - self.A) / 2 / self.radius))

    def flexibility(self, compliance: np.ndarray, neutral: float) -> np.ndarray:
        """F (6, 6) of end B in the basic frame.

        Parameters
        ----------
        compliance : (6,)   1/EA, in-plane and other shear, 1/GJ, 1/EI_1, 1/EI_2
        neutral : offset of the neutral axis towards the centre [m]
        """
        along = (self.B - self.A) / np.linalg.norm(self.B - self.A)
        side = np.cross(self.out, along)
        centre = (self.A + self.B) / 2 - self.radius * np.cos(self.half) * self.out
        F = np.zeros((6, 6))
        for xi, w in zip(*np.polynomial.legendre.leggauss(_POINTS), strict=True):
            c, s = np.cos(xi * self.half), np.sin(xi * self.half)
            radial, tangent = c * self.out + s * along, c * along - s * self.out
            place = centre + self.radius * radial
            axes = np.array([tangent, radial, side])
            moment = relative(self.B - place)[:3, 3:6]  # M = M_B + (B - place) x F
            b = np.zeros((6, 6))
            b[:3, :3] = axes
            b[3:] = axes[[0, 2, 1]] @ np.hstack([moment, np.eye(3)])
            b[4] += neutral * b[0]
            F += w * self.half * self.radius * (b.T * compliance) @ b
        return F


def curved_beams(ctx: Context) -> tuple[list[StrainSpring], Masses]:
    """The springs and the masses of all CBEND."""
    springs: list[StrainSpring] = []
    masses, materials, L = [Masses()], Materials(ctx), ctx.scale.length
    for cards in ctx.deck.present("CBEND"):
        nodes = ctx.rows(cards, cards.ids(3, 2))
        for i, card in with_property(ctx.deck, cards):
            arc = _arc(ctx, cards, i, nodes[i], card)
            material = materials.isotropic(card, 0, card.integer(0, 2))
            A, I1, I2, J = (_positive(card, k) for k in (3, 4, 5, 6))
            A, I1, I2, J = A * L**2, I1 * L**4, I2 * L**4, J * L**4
            E, G = material.E, material.shear_modulus
            neutral = card.real(0, 22) * L if card.word(0, 22) else I1 / A / arc.radius
            if not min(E, G) > 0:
                raise card.refuse(0, f"material {material.id} has no E or no G")
            factors = (card.real(0, k, 0.0) for k in (17, 18))
            shear = [1 / (k * G * A) if k else 0.0 for k in factors]
            compliance = np.array([1 / (E * A), *shear, 1 / (G * J), 1 / (E * I1), 1 / (E * I2)])
            K = np.linalg.inv(arc.flexibility(compliance, neutral))
            E_ab, eid = relative(arc.B - arc.A), cards.integer(i, 1)
            unit = np.array([1.0] * 3 + [float(np.linalg.norm(arc.B - arc.A))] * 3)
            springs += squares(eid, nodes[i].tolist(), E_ab, K, unit, material.damping)
            each = material.rho * A + card.real(0, 19, 0.0) * ctx.scale.inertia / L
            lump = each * arc.half * arc.radius * np.diag([1.0] * 3 + [0.0] * 3)
            masses.append(Masses(np.full(2, eid), nodes[i], np.stack([lump, lump])))
    return springs, concatenated(*masses)


def _positive(card: Cards, k: int) -> float:
    value = card.real(0, k)
    if not value > 0:
        raise card.refuse(0, f"{card.field_name(k)} is {value:g}; it is to be positive")
    return value


def _arc(ctx: Context, cards: Cards, i: int, nodes: np.ndarray, card: Cards) -> _Arc:
    """The arc that GEOM describes: 1 centre, 2 tangent at A, 3 radius RB, 4 angle THETAB."""
    _refuse_other_forms(card)
    A, B = ctx.places[nodes] * ctx.scale.length
    v, along = _towards(ctx, cards, i, int(nodes[0])), B - A
    chord = float(np.linalg.norm(along))
    if not chord > 0:
        raise cards.refuse(i, "its ends lie at one place")
    e = along / chord
    across = v - e * (v @ e)
    if not np.linalg.norm(across) > 1e-9 * np.linalg.norm(v):
        raise cards.refuse(i, "its vector v (or GO) lies along its chord, so it has no plane")
    out = across / np.linalg.norm(across)
    geom = cards.integer(i, 8)
    if geom == 1:  # |A + s v - B| = |s v|
        towards = float(v @ along)
        if not abs(towards) > 0:
            raise cards.refuse(i, "no centre of curvature on its line A to O is as far from B")
        s = chord**2 / (2 * towards)
        return _Arc(A, B, -np.sign(s) * out, float(np.linalg.norm(s * v)))
    if geom == 2:
        sine, cosine = np.linalg.norm(across) / np.linalg.norm(v), v @ e
        if not cosine > 0:
            raise cards.refuse(i, "its arc is 180 degrees or more")
        return _Arc(A, B, out, chord / 2 / float(sine))
    if geom == 3:
        radius = _positive(card, 7) * ctx.scale.length
        if not radius > chord / 2:
            raise cards.refuse(i, f"RB of PBEND {card.integer(0, 1)} is too small for its chord")
        return _Arc(A, B, out, radius)
    if geom == 4:
        angle = np.radians(_positive(card, 8))
        if not angle < np.pi:
            raise cards.refuse(i, "its arc is 180 degrees or more")
        return _Arc(A, B, out, float(chord / 2 / np.sin(angle / 2)))
    raise cards.refuse(i, f"GEOM is {geom}; there are 1, 2, 3, 4")


def _refuse_other_forms(card: Cards) -> None:
    """Refuse pipes by FSI, and a centroid off the grids."""
    if card.word(0, 3).lstrip("+-").isdecimal():
        raise card.refuse(0, "FSI, a curved pipe, is not supported; give A, I1, I2 and J")
    if any(card.real(0, k, 0.0) for k in (20, 21)):
        raise card.refuse(0, "RC and ZC, a centroid off the grids, are not supported")


def _towards(ctx: Context, cards: Cards, i: int, node: int) -> np.ndarray:
    """The vector v in the basic frame, or that from A to GO."""
    words = [cards.word(i, k) for k in (5, 6, 7)]
    if words[0].isdecimal() and not words[1] and not words[2]:
        v = ctx.places[ctx.row(cards, i, int(words[0]))] - ctx.places[node]
    else:
        v = cards.single(i).block(5, 3, 0.0)[0] @ ctx.frame_at(node)
    if not np.any(v):
        raise cards.refuse(i, "its vector v (or GO) is missing or zero")
    return np.asarray(v)
