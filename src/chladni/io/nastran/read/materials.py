"""Materials: MAT1, MAT2, MAT8, MAT9 to the model's types, in SI."""

from collections.abc import Callable, Iterator

import numpy as np

from ....model.properties import Anisotropic, AnisotropicSolid, Isotropic, Material, Orthotropic
from ....units import Units
from ..text.deck import Deck
from ..text.table import Cards
from .context import Context

_OTHER = ("MAT3", "MAT10", "MAT11", "MATHE", "MATHP", "MATORT", "MAT4", "MAT5")


class Materials:
    """Materials by id, made when first asked for."""

    def __init__(self, ctx: Context) -> None:
        self._scale = ctx.scale
        self._cards: dict[int, tuple[Cards, int]] = {}
        self._made: dict[int, Material | AnisotropicSolid] = {}
        for name in _MAKERS:
            for cards in ctx.deck.present(name):
                for i, id in enumerate(cards.unique()):
                    self._claim(int(id), cards, i)
        self._foreign = {
            int(id): name
            for name in _OTHER
            for cards in ctx.deck.present(name)
            for id in cards.integers(1, 0)
        }

    def _claim(self, id: int, cards: Cards, i: int) -> None:
        if id in self._cards:
            other, j = self._cards[id]
            raise cards.refuse(i, f"the id is already taken by {other.name} at {other.where(j)}")
        self._cards[id] = (cards, i)

    def get(self, asker: Cards, i: int, id: int) -> Material | AnisotropicSolid:
        """The material that card i of ``asker`` names."""
        if id not in self._cards:
            if id in self._foreign:
                raise asker.refuse(
                    i, f"material {id} is a {self._foreign[id]}, not understood here"
                )
            there = ", ".join(map(str, sorted(self._cards)[:10])) or "none"
            raise asker.refuse(i, f"material {id} does not exist; there are {there}")
        if id not in self._made:
            cards, k = self._cards[id]
            self._made[id] = _MAKERS[cards.name](cards.single(k), self._scale)
        return self._made[id]

    def sheet(self, asker: Cards, i: int, id: int) -> Material:
        """A material for shells, whose plane stiffness needs |ν| < 1."""
        found = self.get(asker, i, id)
        if isinstance(found, AnisotropicSolid):
            raise asker.refuse(i, f"material {id} is a MAT9, which only solids have")
        if isinstance(found, Isotropic):
            self._refuse_ratio(asker, i, found, 1.0, "shells")
        return found

    def solid(self, asker: Cards, i: int, id: int) -> Isotropic | AnisotropicSolid:
        """A material for solids, which take MAT9, and MAT1 with -1 < ν < 0.5."""
        found = self.get(asker, i, id)
        if isinstance(found, AnisotropicSolid):
            return found
        if not isinstance(found, Isotropic):
            raise asker.refuse(i, f"material {id} is neither a MAT1 nor a MAT9")
        self._refuse_ratio(asker, i, found, 0.5, "solids")
        return found

    def _refuse_ratio(
        self, asker: Cards, i: int, found: Isotropic, most: float, users: str
    ) -> None:
        """Refuse a Poisson's ratio at which the stiffness is infinite or negative."""
        if not -1 < found.nu < most:
            cards, k = self._cards[found.id]
            where = f"NU {found.nu:g} of material {found.id} ({cards.where(k)})"
            raise asker.refuse(i, f"{where} is not between -1 and {most:g}, as {users} need")

    def isotropic(self, asker: Cards, i: int, id: int) -> Isotropic:
        """The same, for beams and rods, which take MAT1 only."""
        found = self.get(asker, i, id)
        if not isinstance(found, Isotropic):
            raise asker.refuse(i, f"material {id} is not a MAT1")
        return found


def _density(card: Cards, k: int, scale: Units) -> float:
    rho = float(card.reals(k, 0.0)[0])
    if rho < 0:
        raise card.refuse(0, f"the density {rho:g} is negative")
    return rho * scale.density


def _isotropic(card: Cards, scale: Units) -> Isotropic:
    """MAT1: whichever of E, G, ν is blank follows from E = 2 (1 + ν) G.

    E or G alone leaves the other and ν at zero (MSC Nastran Quick Reference, MAT1).
    """
    E, G, nu = (float(card.reals(k, np.nan)[0]) for k in (2, 3, 4))
    if np.isnan(E) and np.isnan(G):
        raise card.refuse(0, "neither E nor G is given")
    given = not np.isnan(G)
    if np.isnan(E):
        E, nu = (0.0, 0.0) if np.isnan(nu) else (2 * (1 + nu) * G, nu)
    elif np.isnan(nu):
        nu, G, given = (
            (E / (2 * G) - 1, G, True) if given and E and G else (0.0, G if given else 0.0, True)
        )
    if E < 0 or (given and G < 0):
        raise card.refuse(0, f"E {E:g} and G {G:g} cannot be negative")
    if not -1 < nu <= 0.5 and not given:
        raise card.refuse(0, f"Poisson's ratio {nu:g} is not between -1 and 0.5")
    return Isotropic(
        E * scale.stress,
        nu,
        _density(card, 5, scale),
        float(card.reals(8, 0.0)[0]),
        G * scale.stress if given else None,
        int(card.integers(1)[0]),
    )


def unlike_moduli(deck: Deck) -> Iterator[str]:
    """MAT1 of which E, G and NU contradict one another by more than 1 %, in one sentence.

    Nastran warns of them, too, and takes all three (Quick Reference, MAT1).
    """
    for cards in deck.present("MAT1"):
        E, G, nu = (cards.reals(k, np.nan) for k in (2, 3, 4))
        due = E / (2 * (1 + np.where(nu == -1, np.nan, nu)))
        unlike = np.flatnonzero(np.abs(G - due) > 0.01 * np.abs(G))
        if len(unlike):
            i, more = int(unlike[0]), len(unlike) - 1
            others = f" (and {more} others)" if more else ""
            yield (
                f"{cards.where(i)}: MAT1 {cards.integers(1)[i]}: G {G[i]:g} is "
                f"{G[i] / due[i]:.3g} times E/2(1+NU) = {due[i]:g}; E, G and NU are used "
                f"unchanged{others}"
            )


def lone_moduli(deck: Deck) -> Iterator[str]:
    """MAT1 with E alone or G alone: the other two are zero (Quick Reference, MAT1)."""
    for cards in deck.present("MAT1"):
        E, G, nu = (cards.words(k) != b"" for k in (2, 3, 4))
        for i in np.flatnonzero(~nu & (E != G)):
            alone, other = "EG" if E[i] else "GE"
            yield (
                f"{cards.where(int(i))}: MAT1 {cards.integers(1)[i]} has {alone} alone, so "
                f"{other} and NU are 0, as in Nastran"
            )


def _orthotropic(card: Cards, scale: Units) -> Orthotropic:
    """MAT8."""
    E1, E2 = card.block(2, 2)[0]
    nu12, G12, G1z, G2z = card.block(4, 4, 0.0)[0]
    none = G12 == 0 and card.words(5)[0] != b""  # written as such; a blank is an omission
    if not (E1 > 0 and E2 > 0 and (G12 > 0 or none)):
        raise card.refuse(0, f"E1 {E1:g}, E2 {E2:g} and G12 {G12:g} are to be positive")
    if nu12**2 * E2 >= E1:
        raise card.refuse(0, f"NU12 {nu12:g} is too large for E1/E2 {E1 / E2:g}")
    s = scale.stress
    return Orthotropic(
        float(E1 * s),
        float(E2 * s),
        float(nu12),
        float(G12 * s),
        float(G1z * s),
        float(G2z * s),
        _density(card, 8, scale),
        float(card.reals(17, 0.0)[0]),
        int(card.integers(1)[0]),
    )


def _anisotropic(card: Cards, scale: Units) -> Anisotropic:
    """MAT2: plane stiffness; as MID3 its G11, G12, G22 are the transverse shear moduli."""
    a, b, c, d, e, f = card.block(2, 6, 0.0)[0] * scale.stress
    Q = np.array([[a, b, c], [b, d, e], [c, e, f]])
    if np.linalg.eigvalsh(Q)[0] < -1e-9 * np.abs(Q).max():
        raise card.refuse(0, "its stiffness matrix is not positive")
    return Anisotropic(
        Q,
        np.array([[a, b], [b, d]]),
        _density(card, 8, scale),
        float(card.reals(13, 0.0)[0]),
        int(card.integers(1)[0]),
    )


def _solid(card: Cards, scale: Units) -> AnisotropicSolid:
    """MAT9: MID G11 G12... G16 G22... G66 RHO A1... A6 TREF GE."""
    C, upper = np.zeros((6, 6)), np.triu_indices(6)
    C[upper] = C.T[upper] = card.block(2, 21, 0.0)[0] * scale.stress
    if np.linalg.eigvalsh(C)[0] < -1e-9 * np.abs(C).max():
        raise card.refuse(0, "its stiffness matrix is not positive")
    return AnisotropicSolid(C, _density(card, 23, scale), card.real(0, 31, 0.0), card.integer(0, 1))


_MAKERS: dict[str, Callable[[Cards, Units], Material | AnisotropicSolid]] = {
    "MAT1": _isotropic,
    "MAT2": _anisotropic,
    "MAT8": _orthotropic,
    "MAT9": _solid,
}
