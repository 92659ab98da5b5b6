"""Changed joints and masses put into their cards: PBUSH, PFAST, PELAS, CELAS2, CONM2 and others."""

from collections.abc import Iterator

import numpy as np

from ....errors import ModelError
from ....model.assembly import Assembly
from .. import Add, Deck, SetField
from ..text.cards import position
from ..text.format import Value
from ..text.table import Cards
from .changes import Change
from .free_ids import FreeIds
from .split_properties import copied

_SAME = 1e-9
_ALIKE = 1e-6  # factors that are one


def joint_changes(deck: Deck, before: Assembly, after: Assembly, free: FreeIds) -> list[Change]:
    """Edits of the cards of springs, bushes and masses that are in both and differ.

    A bush has a factor for each of its six directions, a spring or a mass has one factor.

    A property is changed where all its elements changed in the same way. Bushes and connectors that
    changed otherwise get one of their own, whose id comes from ``free``.

    Raises
    ------
    ModelError
        If springs of one property changed otherwise, or no card here holds the value.
    """
    return [
        *_springs(deck, _factors(before, after, "springs", "value")),
        *_bushes(deck, _bush_changes(before, after), free),
        *_masses(deck, _factors(before, after, "masses", "matrix")),
    ]


def _factors(before: Assembly, after: Assembly, family: str, column: str) -> dict[int, float]:
    """{element id: new / old} of all members that were there before."""
    old, new = getattr(before, family), getattr(after, family)
    out = {}
    for id, a, b in zip(old.ids.tolist(), getattr(old, column), getattr(new, column), strict=False):
        scale = float(np.abs(a).max())
        factor = 1.0 if scale == 0 else float(np.sum(a * b) / np.sum(a * a))
        if np.abs(b - factor * a).max() > 1e-6 * max(scale, 1e-300):
            raise ModelError(f"element {id}: its values did not change by one factor")
        out[id] = factor
    return out


def _springs(deck: Deck, factor: dict[int, float]) -> Iterator[Change]:
    """K of CELAS2 and CELAS4, and of the PELAS that CELAS1 and CELAS3 share."""
    users: dict[int, list[int]] = {}
    for cards in deck.present("CELAS1", "CELAS2", "CELAS3", "CELAS4"):
        ids, second = cards.integers(1).tolist(), cards.words(2)
        for row, id in enumerate(ids):
            if cards.name in ("CELAS1", "CELAS3"):
                users.setdefault(int(second[row]) if second[row] else id, []).append(id)
            elif abs(factor[id] - 1) > _SAME:
                yield SetField(cards.name, id, "K", cards.reals(2)[row] * factor[id])
    for pid, members in users.items():
        f = _common(f"PELAS {pid}", [factor[id] for id in members])
        if abs(f - 1) > _SAME:
            yield _pelas(deck, pid, f)


def _pelas(deck: Deck, pid: int, factor: float) -> Change:
    """K of a property; a card holds up to two."""
    for cards in deck.present("PELAS"):
        for at in (1, 5):
            ids = cards.words(at)
            for row in np.flatnonzero([w == str(pid).encode() for w in ids]):
                k = cards.take(np.array([row])).reals(at + 1)[0]
                return SetField("PELAS", int(cards.words(1)[row]), at + 1, k * factor)
    raise ModelError(f"{deck.path} has no PELAS {pid}")


Six = tuple[float, ...]
_BushChange = tuple[Six, Six]  # factors on K1 to K6; GE1 to GE6, none where it stays


def _bush_changes(before: Assembly, after: Assembly) -> dict[int, _BushChange]:
    """{element id: what became of a bush that was there before}."""
    out, was, now = {}, before.bushes, after.bushes
    columns = was.stiffness, now.stiffness, was.loss, now.loss
    for id, a, b, old, new in zip(was.ids.tolist(), *columns, strict=False):
        if np.any((a == 0) & (b != 0)):
            raise ModelError(f"element {id} has K{np.flatnonzero((a == 0) & (b != 0))[0] + 1} of 0")
        factors = np.divide(b, a, out=np.ones(6), where=a != 0)
        lost = () if np.allclose(old, new, rtol=_SAME, atol=0) else tuple(new.tolist())
        out[id] = tuple(factors.tolist()), lost
    return out


_BUSHES = ("CBUSH", "CBUSH1D", "CGAP", "CWELD", "CFAST")


def _bushes(deck: Deck, changed: dict[int, _BushChange], free: FreeIds) -> Iterator[Change]:
    """The property that bushes or connectors share; of those that changed otherwise their own.

    The card takes the change that most of them have.
    """
    for cards in deck.present(*_BUSHES):
        users: dict[int, dict[_BushChange, list[int]]] = {}
        for id, p in zip(cards.integers(1).tolist(), cards.properties().tolist(), strict=True):
            if id in changed:  # not one that was taken out
                kinds = users.setdefault(int(p), {})
                same = next((c for c in kinds if _alike(c, changed[id])), changed[id])
                kinds.setdefault(same, []).append(int(id))
        known = deck["P" + cards.name[1:]]
        for property, kinds in users.items():
            common = max(kinds, key=lambda c: (len(kinds[c]), not _changes(c)))
            for change, members in kinds.items():
                if change == common and not _changes(change):
                    continue
                fields, more = _fields(deck, known, property, change, free)
                yield from more
                if change == common:
                    for j, value in fields.items():
                        yield SetField(known.name, property, j, value)
                    continue
                new = next(free.properties)
                yield Add([copied(known, property, {1: new, **fields})], "of joints that changed")
                yield from (SetField(cards.name, id, "PID", new) for id in members)


def _changes(change: _BushChange) -> bool:
    return bool(np.abs(np.subtract(change[0], 1)).max() > _SAME or change[1])


def _alike(one: _BushChange, other: _BushChange) -> bool:
    return np.allclose(one[0], other[0], rtol=_ALIKE, atol=0) and one[1] == other[1]


Fields = dict[int, Value]
_STIFF = {  # fields of a property that are proportional to K1 to K6, or to all of them together
    "PFAST": ("KT1", "KT2", "KT3", "KR1", "KR2", "KR3"),
    "PBUSH1D": ("K",),
    "PGAP": ("KA", "KB", "KT"),
}


def _fields(
    deck: Deck, cards: Cards, pid: int, change: _BushChange, free: FreeIds
) -> tuple[Fields, list[Change]]:
    """{position: value} of a property with what became of its joints, and the cards it needs.

    A field that is blank follows from the others or stays zero.
    """
    one = cards.single(int(np.flatnonzero(cards.integers(1) == pid)[0]))
    factors, loss = change
    if cards.name == "PBUSH":
        return _of_bush(one, change), []
    if cards.name == "PWELD":
        return _of_weld(deck, one, change, free)
    if cards.name == "PGAP":
        factors = (_common(f"PGAP {pid}", [f for f in factors if f != 1] or [1.0]),) * 6
    at = [position(cards.name, name) for name in _STIFF[cards.name]]
    each = zip(at, factors, strict=False)
    fields: Fields = {j: one.real(0, j) * f for j, f in each if one.word(0, j)}
    if loss and cards.name == "PFAST":
        fields[position("PFAST", "GE")] = _common(f"PFAST {pid}", list(loss))
    return fields, []


def _of_bush(one: Cards, change: _BushChange) -> Fields:
    """K of a PBUSH times its factor, and GE: where it stands, or behind all else."""
    words, (factors, loss) = one.fields(0), change
    keys = {words[k - 1]: k for k in range(2, len(words) + 1, 8)}
    at = range(keys["K"] + 1, min(keys["K"] + 6, len(words)) + 1) if "K" in keys else ()
    of_k = zip(at, factors, strict=False)
    out: Fields = {j: one.real(0, j) * f for j, f in of_k if words[j - 1]}
    if loss:
        key = keys.get("GE", 2 + 8 * -(-(len(words) - 1) // 8))
        out |= {key: "GE", **{key + 1 + k: v for k, v in enumerate(loss)}}
    return out


def _of_weld(
    deck: Deck, one: Cards, change: _BushChange, free: FreeIds
) -> tuple[Fields, list[Change]]:
    """MID of a PWELD and a material of its own, with E and G times the factor of the weld."""
    if not _changes(change):
        return {}, []
    pid, mid = one.integer(0, 1), one.integer(0, position("PWELD", "MID"))
    factor = _common(f"PWELD {pid}", list(change[0]))
    table = deck["MAT1"]
    card = table.single(int(np.flatnonzero(table.integers(1) == mid)[0]))
    moduli = {position("MAT1", name): card.word(0, position("MAT1", name)) for name in "EG"}
    new = next(free.materials)
    fields: Fields = {1: new, **{j: card.real(0, j) * factor for j, w in moduli.items() if w}}
    if change[1]:
        fields[position("MAT1", "GE")] = _common(f"PWELD {pid}", list(change[1]))
    added = Add([copied(table, mid, fields)], "of welds that changed")
    return {position("PWELD", "MID"): new}, [added]


def _masses(deck: Deck, factor: dict[int, float]) -> Iterator[Change]:
    """M and the inertia of CONM2, its offset kept."""
    known = {}
    for cards in deck.present("CONM2"):
        known.update({int(id): cards.single(row) for row, id in enumerate(cards.integers(1))})
    for id, f in factor.items():
        if abs(f - 1) <= _SAME:
            continue
        if id not in known:
            raise ModelError(f"{deck.path}: mass {id} is not a CONM2 and cannot be changed")
        for field in (4, *range(9, 15)):
            value = float(known[id].reals(field, 0.0)[0])
            if value:
                yield SetField("CONM2", id, field, value * f)


def _common(name: str, factors: list[float]) -> float:
    """The one factor of all elements of a property."""
    if np.ptp(factors) > 1e-6:
        raise ModelError(f"elements of {name} changed differently; give them separate properties")
    return factors[0]
