"""Changes of an assembly that a deck does not hold; the written deck is read and compared."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from ....errors import ModelError
from ....model.assembly import Assembly, Average, Equation, RigidBody, picked

_ROUNDED = 1e-5  # of an entry: what a card of eight columns keeps of a number
_NOTHING = 1e-9  # of the largest entry of a column
_JOINTS = ("springs", "dampers", "scalar_masses", "masses")  # which can be added, not taken out
_FAMILIES = ("shells", "beams", "bushes", "rotors", *_JOINTS)
_SWITCHES = ("coupled_mass", "structural_damping", "auto_spc", "k6rot")
_NEW = "chladni.io.nastran.write_assembly writes it as a new deck"


def refuse_regrouped(before: Assembly, after: Assembly) -> None:
    """Raise if points, beams, joints, shells or solids of ``before`` are missing in ``after``.

    Edits are found by comparing the two in order.
    """
    pairs = [("points", before.ids, after.ids), ("shells", before.shells.ids, after.shells.ids)]
    pairs += [(n, getattr(before, n).ids, getattr(after, n).ids) for n in ("beams", *_JOINTS)]
    pairs += [
        ("solids", np.append(s.ids, s.nodes.shape[1]), np.append(t.ids, t.nodes.shape[1]))
        for s, t in zip(before.solids, after.solids, strict=False)
    ]
    pairs.append(("solids", np.zeros(len(before.solids)), np.zeros(len(after.solids))))
    for name, old, new in pairs:
        added = name not in ("shells", "solids")
        if not np.array_equal(old, new[: len(old)] if added else new):
            raise ModelError(f"{name} were taken out, put in or renumbered, not changed; {_NEW}")


def refuse_unwritten(before: Assembly, after: Assembly, found: Assembly) -> None:
    """Raise if the deck as it is read again, ``found``, is not ``after``; name what is missing.

    Numbers may be rounded as cards hold them. Elements that were added have other numbers.
    """
    for name in _missing(before, after, found):
        raise ModelError(f"the deck cannot hold the change of its {name}; {_NEW}")


def _missing(before: Assembly, after: Assembly, found: Assembly) -> Iterator[str]:
    if not np.array_equal(after.ids, found.ids) or not _equal(after.points, found.points):
        yield "points"
    if not _equal(_axes(after), _axes(found)):
        yield "displacement frames"
    if not _equal(_scalars(after), _scalars(found)):
        yield "scalar points"
    if {*map(tuple, after.supports.tolist())} != {*map(tuple, found.supports.tolist())}:
        yield "supports"
    for name in _SWITCHES:
        if not _equal(getattr(after, name), getattr(found, name)):
            yield name
    for name, was, wanted, got in _families(before, after, found):
        yield from _unlike(name, was, wanted, got, after, found)
    if not _equal(_ties(after), _ties(found)):
        yield "rigid elements"
    names = {p.id: p.name for p in found.parts}
    if any(
        names.get(p.id, q.name) != q.name for p, q in zip(before.parts, after.parts, strict=False)
    ):
        yield "names of parts"


def _families(
    before: Assembly, after: Assembly, found: Assembly
) -> Iterator[tuple[str, Any, Any, Any]]:
    """(name, family before, wanted, found) of all elements."""
    for name in _FAMILIES:
        yield name, getattr(before, name), getattr(after, name), getattr(found, name)
    for kinds in zip(before.solids, after.solids, found.solids, strict=False):
        yield "solids", *kinds


def _unlike(
    name: str, was: Any, wanted: Any, got: Any, after: Assembly, found: Assembly
) -> Iterator[str]:
    """Columns of a family whose members that were there before are unlike, and its number."""
    if len(wanted) != len(got):
        yield f"number of {name}"
        return
    a, b = (_old(family, was.ids) for family in (wanted, got))
    if not np.array_equal(a.ids, b.ids):
        yield f"number of {name}"
        return
    for column in vars(a):
        if column != "part" and not _equal(getattr(a, column), getattr(b, column)):
            yield f"{column} of {name}"
    if hasattr(a, "part"):
        pairs = {*zip(a.part.tolist(), b.part.tolist(), strict=True)}
        sections = ((after.parts[i].section, found.parts[k].section) for i, k in pairs)
        if not all(_alike_section(x, y) for x, y in sections):
            yield f"properties or materials of {name}"


def _old(family: Any, ids: np.ndarray) -> Any:
    """The members that have these ids, in the order of their ids."""
    rows = np.flatnonzero(np.isin(family.ids, ids))
    return picked(family, rows[np.argsort(family.ids[rows], kind="stable")])


def _alike_section(a: Any, b: Any) -> bool:
    """Compare numbers without ids of materials and without T; elements have their own thickness."""
    if not is_dataclass(a) or type(a) is not type(b):
        return _equal(a, b)
    names = [f.name for f in fields(a) if f.name not in ("id", "thickness")]
    return all(_alike_section(getattr(a, n), getattr(b, n)) for n in names)


def _equal(a: Any, b: Any) -> bool:
    """Equal but for the rounding of cards, through arrays, tuples and numbers."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(_equal(x, y) for x, y in zip(a, b, strict=True))
    if a is None or b is None or isinstance(a, str) or isinstance(b, str):
        return bool(a is b or a == b)
    x, y = np.asarray(a, float), np.asarray(b, float)
    if x.shape != y.shape:
        return False
    least = _NOTHING * np.abs(x).max(initial=0)
    return bool(np.all(np.abs(x - y) <= _ROUNDED * np.abs(x) + least))


def _axes(made: Assembly) -> np.ndarray:
    return np.broadcast_to(np.eye(3), (len(made.ids), 3, 3)) if made.axes is None else made.axes


def _scalars(made: Assembly) -> np.ndarray:
    none = np.zeros(len(made.ids), bool)
    return none if made.scalar_points is None else made.scalar_points


def _ties(made: Assembly) -> tuple[Any, ...]:
    """All ties without their ids, one for each follower of a rigid body, sorted."""
    every = [part for tie in made.rigid for part in _tie(tie)]
    return tuple(sorted(every, key=lambda t: repr(t[:2])))


def _tie(tie: RigidBody | Average | Equation) -> Iterator[tuple[Any, ...]]:
    """(kind, points and components, numbers)."""
    if isinstance(tie, RigidBody):
        for row, components in zip(tie.dependent, tie.components, strict=True):
            yield "rigid", (tie.independent, row, components), ()
    elif isinstance(tie, Average):
        terms = sorted(tie.terms)
        places = (tie.reference, tie.components, *((r, c) for r, c, _ in terms), *tie.moved)
        yield "average", places, tuple(w for _, _, w in terms)
    else:
        yield "equation", (tie.nodes, tie.components), tie.factors
