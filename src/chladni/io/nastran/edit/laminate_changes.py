"""A laminate's change put into its layers: moduli and densities of the plies, their thickness.

A smeared section is homogeneous in what its layers are made of: with every modulus times e, every
density times d and every thickness times h, membrane, bending, coupling and shear moduli are times
e, the density times d and the thickness times h.  So such a change is written exactly.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ....errors import ModelError
from ....model.assembly import Assembly
from ....model.properties import Material, Part, ShellSection
from ....units import Units
from .. import Add, Deck, SetField
from ..text.cards import position
from ..text.table import Cards
from .changes import Change
from .split_properties import copied

KINDS = ("PCOMP", "PCOMPG")
MODULI = {
    "MAT1": ("E", "G"),
    "MAT2": ("G11", "G12", "G13", "G22", "G23", "G33"),
    "MAT8": ("E1", "E2", "G12", "G1Z", "G2Z"),
}
_SAME = 1e-9


@dataclass(frozen=True)
class Factors:
    """What moduli, densities and thicknesses are to be multiplied with."""

    moduli: float
    density: float
    thickness: float

    @property
    def material(self) -> tuple[float, float]:
        """The two that concern materials, alike where they differ by rounding."""
        return round(self.moduli, 9), round(self.density, 9)


def laminated(deck: Deck, assembly: Assembly) -> dict[int, tuple[Cards, int]]:
    """Parts whose property is a laminate: {position: (cards, row)}."""
    known = {
        int(id): (cards, row)
        for cards in deck.present(*KINDS)
        for row, id in enumerate(cards.integers(1))
    }
    return {
        k: known[part.id]
        for k, part in enumerate(assembly.parts)
        if isinstance(part.section, ShellSection) and part.id in known
    }


def laminate_changes(
    deck: Deck, before: Assembly, after: Assembly, units: Units, free: Iterator[int]
) -> list[Change]:
    """Edits of the laminates' cards and of their plies' materials; new ids come from ``free``.

    A material that others use as it is gets a copy.

    Raises
    ------
    ModelError
        If a laminate changed in a way its layers cannot take on together.
    """
    cards = laminated(deck, before)
    factors = {k: _factors(deck, before, after, k) for k in cards}
    out: list[Change] = []
    for k, (table, row) in cards.items():
        if abs(factors[k].thickness - 1) > _SAME:
            out += _thicker(table, row, before.parts[k], factors[k].thickness, units)
    users: dict[int, set[int]] = {}
    for k, (table, row) in cards.items():
        for mid in {int(m) for _, m, _ in layers(table, row) if m}:
            users.setdefault(mid, set()).add(k)
    for mid, parts in users.items():
        out += _material(deck, before, mid, sorted(parts), factors, free)
    return out


def layers(cards: Cards, row: int) -> list[tuple[int, str, str]]:
    """(position of MID, MID, T) of every layer as the card has them, blanks as blanks."""
    fields, ahead = cards.fields(row), int(cards.name == "PCOMPG")
    padded = [*fields, "", "", ""]
    return [
        (k, padded[k - 1].strip(), padded[k].strip())
        for k in range(9 + ahead, len(fields) + 1, 8 if ahead else 4)
        if any(padded[k - 1 : k + 3])
    ]


def _factors(deck: Deck, before: Assembly, after: Assembly, k: int) -> Factors:
    """The factors of one part; refused where the change is no common factor."""
    was, now = before.parts[k].section, after.parts[k].section
    assert isinstance(was, ShellSection)
    mine = before.shells.part == k
    ratio = (after.shells.thickness / before.shells.thickness)[mine]
    names = [n for n in ("membrane", "bending", "coupling", "shear") if getattr(was, n) is not None]
    pairs = [(getattr(was, n), getattr(now, n, None)) for n in names]
    kept = [(a, b) for a, b in pairs if b is not None]
    if len(kept) < len(pairs) or (len(ratio) and np.ptp(ratio) > _SAME):
        raise _refusal(deck, before.parts[k])
    moduli = _ratio([(x, y) for a, b in kept for x, y in _stiffness(a, b)])
    density = _ratio([(np.array([a.rho]), np.array([b.rho])) for a, b in kept])
    if moduli is None or density is None:
        raise _refusal(deck, before.parts[k])
    return Factors(moduli, density, float(ratio[0, 0]) if len(ratio) else 1.0)


def _refusal(deck: Deck, part: Part) -> ModelError:
    return ModelError(
        f"{deck.path}: laminate {part.name} ({part.id}) changed in a way that its layers cannot "
        "represent; they accept one factor each on all moduli, all densities and all thicknesses"
    )


def _stiffness(a: Material, b: Material) -> list[tuple[np.ndarray, np.ndarray]]:
    return [(a.plane_stress(), b.plane_stress()), (a.transverse(), b.transverse())]


def _ratio(pairs: list[tuple[np.ndarray, np.ndarray]]) -> float | None:
    """The f with b = f a in every pair; None where there is none."""
    a, b = (np.concatenate([np.ravel(pair[k]) for pair in pairs]) for k in (0, 1))
    if not a.any():
        return None if b.any() else 1.0
    top = int(np.argmax(np.abs(a)))
    f = float(b[top] / a[top])
    ends = np.cumsum([pair[0].size for pair in pairs])[:-1]
    alike = all(
        np.allclose(y, f * x, rtol=_SAME, atol=_SAME * np.abs(x).max(initial=0))
        for x, y in zip(np.split(a, ends), np.split(b, ends), strict=True)
    )
    return f if alike else None


def _thicker(table: Cards, row: int, part: Part, factor: float, units: Units) -> Iterator[SetField]:
    """Thickness of every layer, and the bottom so that the middle stays where it is."""
    for k, _, t in layers(table, row):
        if t:
            old = float(table.single(row).reals(k + 1)[0])
            yield SetField(table.name, part.id, k + 1, old * factor)
    card = table.single(row)
    if card.words(2)[0] != b"":
        assert isinstance(part.section, ShellSection)
        total = part.section.thickness / units.length
        z0 = float(card.reals(2)[0]) + (1 - factor) * total / 2
        yield SetField(table.name, part.id, "Z0", z0)


def _material(
    deck: Deck, before: Assembly, mid: int, parts: list[int], factors: dict[int, Factors],
    free: Iterator[int],
) -> Iterator[Change]:  # fmt: skip
    """One material of plies: changed where it stands, or copied for those that changed."""
    wanted = {factors[k].material for k in parts}
    if wanted == {(1.0, 1.0)}:
        return
    kind, table, row = _found(deck, mid)
    if len(wanted) == 1 and mid not in _plain_users(deck, before):
        yield from (SetField(kind, mid, n, v) for n, v in _times(table, row, wanted.pop()).items())
        return
    cards = laminated(deck, before)
    for pair in sorted(wanted - {(1.0, 1.0)}):
        id = next(free)
        changed = {position(kind, n): v for n, v in _times(table, row, pair).items()}
        card = copied(table, mid, {1: id, **changed})
        yield Add([card], "of the laminates that changed")
        for k in (k for k in parts if factors[k].material == pair):
            name = cards[k][0].name
            for at, m, _ in layers(*cards[k]):
                if m and int(m) == mid:
                    yield SetField(name, before.parts[k].id, at, id)


def _found(deck: Deck, mid: int) -> tuple[str, Cards, int]:
    for table in deck.present(*MODULI):
        at = np.flatnonzero(table.integers(1) == mid)
        if len(at):
            return table.name, table, int(at[0])
    raise ModelError(f"{deck.path} has no material {mid}")


def _plain_users(deck: Deck, assembly: Assembly) -> set[int]:
    """Materials that sections other than laminates name."""
    stacked = laminated(deck, assembly)
    names = ("membrane", "bending", "shear", "coupling", "material")
    sections = [p.section for k, p in enumerate(assembly.parts) if k not in stacked]
    found = [getattr(s, name, None) for s in sections for name in names]
    return {m.id for m in found if m is not None}


def _times(table: Cards, row: int, pair: tuple[float, float]) -> dict[str, float]:
    """Fields that are given, times their factors."""
    card, factor = table.single(row), dict.fromkeys(MODULI[table.name], pair[0]) | {"RHO": pair[1]}
    at = {name: position(table.name, name) for name in factor}
    return {
        name: card.real(0, at[name]) * f
        for name, f in factor.items()
        if f != 1.0 and card.words(at[name])[0] != b""
    }
