"""Changed joints and masses put into their cards: PBUSH, K of PELAS and CELAS2, M of CONM2."""

from collections.abc import Iterator

import numpy as np

from ....errors import ModelError
from ....model.assembly import Assembly
from .. import Add, Deck, SetField
from ..text.table import Cards
from .changes import Change
from .split_properties import copied

_SAME = 1e-9
_ALIKE = 1e-6  # factors that are one


def joint_changes(
    deck: Deck, before: Assembly, after: Assembly, free: Iterator[int]
) -> list[Change]:
    """Edits of the cards of springs, bushes and masses that are in both and differ.

    A bush has a factor for each of its six directions, a spring or a mass has one factor.

    A property is changed where all its elements changed alike; bushes that changed otherwise get
    one of their own, whose id comes from ``free``.

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


def _bushes(deck: Deck, changed: dict[int, _BushChange], free: Iterator[int]) -> Iterator[Change]:
    """K and GE of the PBUSH that its CBUSH share; of those that changed otherwise one of their own.

    What became of most stays with the card.
    """
    users: dict[int, dict[_BushChange, list[int]]] = {}
    for cards in deck.present("CBUSH"):
        for id, p in zip(cards.integers(1).tolist(), cards.properties().tolist(), strict=True):
            if id in changed:  # not one that was taken out
                kinds = users.setdefault(int(p), {})
                same = next((c for c in kinds if _alike(c, changed[id])), changed[id])
                kinds.setdefault(same, []).append(int(id))
    for property, kinds in users.items():
        common = max(kinds, key=lambda c: len(kinds[c]))
        if np.abs(np.subtract(common[0], 1)).max() > _SAME or common[1]:
            for j, k in _fields(deck["PBUSH"], property, common).items():
                yield SetField("PBUSH", property, j, k)
        for change, members in kinds.items():
            if change != common:
                new = next(free)
                fields = {1: new, **_fields(deck["PBUSH"], property, change)}
                yield Add([copied(deck["PBUSH"], property, fields)], "of bushes that changed")
                yield from (SetField("CBUSH", id, "PID", new) for id in members)


def _alike(one: _BushChange, other: _BushChange) -> bool:
    return np.allclose(one[0], other[0], rtol=_ALIKE, atol=0) and one[1] == other[1]


def _fields(cards: Cards, pid: int, change: _BushChange) -> dict[int, float | str]:
    """{position: K times its factor} of a PBUSH, and GE: where it stands, or behind all else."""
    one = cards.single(int(np.flatnonzero(cards.integers(1) == pid)[0]))
    words, (factors, loss) = one.fields(0), change
    keys = {words[k - 1]: k for k in range(2, len(words) + 1, 8)}
    at = range(keys["K"] + 1, min(keys["K"] + 6, len(words)) + 1) if "K" in keys else ()
    of_k = zip(at, factors, strict=False)
    out: dict[int, float | str] = {j: float(one.reals(j)[0]) * f for j, f in of_k if words[j - 1]}
    if loss:
        key = keys.get("GE", 2 + 8 * -(-(len(words) - 1) // 8))
        out |= {key: "GE", **{key + 1 + k: v for k, v in enumerate(loss)}}
    return out


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
