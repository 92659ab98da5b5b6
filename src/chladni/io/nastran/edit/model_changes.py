"""The changes that turn one assembly's deck into another's: what was repaired, and only that."""

from collections.abc import Iterator

import numpy as np

from ....errors import ModelError
from ....model.assembly import Assembly, Shells
from ....model.properties import (
    Anisotropic,
    AnisotropicSolid,
    AnyMaterial,
    Isotropic,
    Orthotropic,
    Part,
    ShellSection,
)
from ....units import Units
from .. import Add, Deck, Replace, SetColumns, SetField, units_of
from ..export.numbering import Systems
from ..export.part_cards import material_card
from ..text.cards import SHELL_CARDS
from .added_elements import added_elements
from .beam_changes import offset_changes, with_sections
from .changes import Change
from .free_ids import FreeIds, free_ids, ids_of
from .joint_changes import joint_changes
from .laminate_changes import laminate_changes, laminated
from .split_properties import (
    PROPERTIES,
    Split,
    property_kind,
    section_changes,
    split_changes,
    taken_out,
    with_new_properties,
)
from .support_changes import support_changes
from .tie_changes import tie_changes

_MID = {"membrane": "MID1", "bending": "MID2", "shear": "MID3", "coupling": "MID4"}


def changes(
    deck: Deck, before: Assembly, after: Assembly, units: Units | str | None
) -> list[Change]:
    """Edits of the deck: materials, properties, thickness, joints and masses that differ.

    Raises
    ------
    ModelError
        If the two differ in something no card here can say.
    """
    units = units_of(deck, units)
    added = added_elements(before, after)
    free, after = free_ids(deck, after), added.rest
    before, out = taken_out(deck, before, after)
    before, after, split = with_new_properties(before, after, free.properties)
    out += _materials(deck, before, after, units, free, split)
    out += laminate_changes(deck, before, after, units, free.materials)
    out += _thickness(deck, before, after, units)
    out += joint_changes(deck, before, after, free)
    out += tie_changes(deck, before, after, units)
    out += offset_changes(deck, before, after)
    out = with_sections(deck, before, after, units, split, out)
    out = split_changes(deck, after, split, [*out, *section_changes(before, after, units)])
    if cards := list(added.cards(before, units, free)):
        out.append(Add(cards, "added by the diagnosis"))
    return [*out, *support_changes(deck, before, after)]


def _uses(deck: Deck, assembly: Assembly) -> Iterator[tuple[int, str, AnyMaterial]]:
    """(position of the part, field of the section, material) of all that name a material."""
    stacked = laminated(deck, assembly)
    for k, part in enumerate(assembly.parts):
        if k in stacked:
            continue
        for name in _MID if isinstance(part.section, ShellSection) else ("material",):
            if (material := getattr(part.section, name)) is not None:
                yield k, name, material


def _materials(
    deck: Deck, before: Assembly, after: Assembly, units: Units, free: FreeIds, split: Split
) -> list[Change]:
    """Cards of materials changed; where only some users of one changed, a card of their own."""
    known = {(k, name): m for k, name, m in _uses(deck, before)}
    users: dict[int, dict[AnyMaterial, list[tuple[int, str]]]] = {}
    for k, name, material in _uses(deck, after):
        if (old := known.get((k, name))) is None:
            raise ModelError(
                f"part {after.parts[k].name} has a {name} material that the deck lacks"
            )
        kinds = users.setdefault(old.id, {})
        now = next((m for m in (old, *kinds) if _equal(m, material)), material)
        kinds.setdefault(now, []).append((k, name))
    out: list[Change] = []
    for id, kinds in users.items():
        for now, at in kinds.items():
            old = known[at[0]]
            if now is old:
                continue
            if len(kinds) == 1:
                out += _edited(deck, id, old, now, units)
                continue
            new = next(free.materials)
            out.append(Add([material_card(now, new, units)], "of the parts that changed"))
            out += [_of_material(deck, after.parts[k], name, new, split) for k, name in at]
    oriented = any(isinstance(m, Orthotropic) for _, _, m in _uses(deck, after))
    return out + (_axes(before, after, free) if oriented else [])


def _of_material(deck: Deck, part: Part, name: str, material: int, split: Split) -> Change:
    """The property card of a part names another material."""
    if name in _MID:
        return SetField("PSHELL", part.id, _MID[name], material)
    if kind := property_kind(deck, split.get(part.id, part.id)):
        return SetField(kind, part.id, "MID", material)
    raise ModelError(
        f"part {part.name} shares a material with others and none of {', '.join(PROPERTIES[1:])} "
        "names it, so it cannot have its own"
    )


def _equal(a: AnyMaterial, b: AnyMaterial) -> bool:
    """The same numbers."""
    if isinstance(a, Anisotropic) and isinstance(b, Anisotropic):
        same = np.array_equal(a.Q, b.Q) and np.array_equal(a.G, b.G)
        return same and (a.rho, a.damping, a.id) == (b.rho, b.damping, b.id)
    if isinstance(a, AnisotropicSolid) and isinstance(b, AnisotropicSolid):
        same = np.array_equal(a.C, b.C)
        return same and (a.rho, a.damping, a.id) == (b.rho, b.damping, b.id)
    return a == b


def _edited(deck: Deck, id: int, was: AnyMaterial, now: AnyMaterial, units: Units) -> list[Change]:
    """One card's values, or another card in its place."""
    if isinstance(now, Orthotropic) and isinstance(was, Isotropic):
        return [Replace("MAT1", id, material_card(now, id, units))]
    if isinstance(was, AnisotropicSolid) and isinstance(now, AnisotropicSolid):
        return list(_solid_stiffness(deck, was, now, units))
    if isinstance(now, Anisotropic) and id in ids_of(deck, "MAT2"):
        return list(_stiffness(id, was, now, units))
    if type(was) is not type(now) or isinstance(now, Anisotropic):
        kinds = f"{type(was).__name__} to {type(now).__name__}"
        raise ModelError(f"{deck.path}: material {id} cannot be changed from {kinds}")
    return list(_numbers(id, was, now, units))


def _numbers(id: int, was: AnyMaterial, now: AnyMaterial, units: Units) -> Iterator[Change]:
    """Fields of MAT1 or MAT8 whose values differ."""
    names = {"rho": ("RHO", units.density), "damping": ("GE", 1.0)}
    if isinstance(now, Isotropic):
        kind = "MAT1"
        names |= {"E": ("E", units.stress), "G": ("G", units.stress), "nu": ("NU", 1.0)}
    else:
        kind = "MAT8"
        names |= {k: (k.upper(), units.stress) for k in ("E1", "E2", "G12", "G1z", "G2z")}
        names["nu12"] = ("NU12", 1.0)
    for name, (field, unit) in names.items():
        a, b = getattr(was, name), getattr(now, name)
        if a is not None and b is not None and not np.isclose(a, b, rtol=1e-9, atol=0):
            yield SetField(kind, id, field, b / unit)


def _stiffness(id: int, was: AnyMaterial, now: Anisotropic, units: Units) -> Iterator[Change]:
    """G11 to G33 and RHO of a MAT2."""
    assert not isinstance(was, AnisotropicSolid)
    Q = was.plane_stress()
    for i, j in zip(*np.triu_indices(3), strict=True):
        if not np.isclose(Q[i, j], now.Q[i, j], rtol=1e-9, atol=0):
            yield SetField("MAT2", id, f"G{i + 1}{j + 1}", float(now.Q[i, j] / units.stress))
    if not np.isclose(was.rho, now.rho, rtol=1e-9, atol=0):
        yield SetField("MAT2", id, "RHO", now.rho / units.density)


def _solid_stiffness(
    deck: Deck, was: AnisotropicSolid, now: AnisotropicSolid, units: Units
) -> Iterator[Change]:
    """G11 to G66 of a MAT9 times one factor, whatever its axes, and RHO."""
    factor = float(now.C.trace() / was.C.trace())
    if not np.allclose(now.C, factor * was.C, rtol=1e-9, atol=1e-9 * np.abs(now.C).max()):
        raise ModelError(f"{deck.path}: material {now.id} changed by more than one factor")
    table = deck["MAT9"]
    card = table.single(int(np.flatnonzero(table.integers(1) == was.id)[0]))
    for k in range(2, 23):
        if factor != 1 and card.word(0, k):
            yield SetField("MAT9", was.id, k, card.real(0, k) * factor)
    if not np.isclose(was.rho, now.rho, rtol=1e-9, atol=0):
        yield SetField("MAT9", was.id, "RHO", now.rho / units.density)


def _axes(before: Assembly, after: Assembly, free: FreeIds) -> list[Change]:
    """A coordinate system whose x is the material axis, named by the shells it turned."""
    moved = np.flatnonzero(np.any(before.shells.axis != after.shells.axis, axis=1))
    if not len(moved):
        return []
    x = after.shells.axis[moved[0]]
    x = x / np.linalg.norm(x)
    z = np.eye(3)[int(np.argmin(np.abs(x)))]
    z = z - x * (x @ z)
    z = z / np.linalg.norm(z)
    systems = Systems(after, free.systems)
    cid = systems.of_frame(np.array([x, np.cross(z, x), z]))
    out: list[Change] = [Add(list(systems.cards()), "material axis 1 of the sheet")]
    for kind, chosen in _by_kind(after.shells, moved):
        if len(chosen):
            out += [SetField(kind, int(i), "THETA", cid) for i in after.shells.ids[chosen]]
    return out


def _by_kind(shells: Shells, rows: np.ndarray) -> list[tuple[str, np.ndarray]]:
    kind = (shells.triangle + 2 * shells.curved)[rows]
    return [(name, rows[kind == k]) for k, name in enumerate(SHELL_CARDS)]


def _thickness(deck: Deck, before: Assembly, after: Assembly, units: Units) -> list[Change]:
    """PSHELL T where a whole part scales, T1 to T4 where it does not."""
    out: list[Change] = []
    ratio = after.shells.thickness / before.shells.thickness
    stacked = laminated(deck, before)
    for k, part in enumerate(after.parts):
        if k in stacked:
            continue
        mine = np.flatnonzero(after.shells.part == k)
        if not len(mine) or not isinstance(part.section, ShellSection):
            continue
        was = before.parts[k].section
        assert isinstance(was, ShellSection)
        if np.allclose(ratio[mine], 1, rtol=0, atol=1e-9):
            continue
        plain = np.allclose(before.shells.thickness[mine], was.thickness, rtol=1e-9)
        if plain and np.ptp(ratio[mine]) < 1e-9:
            t = was.thickness * ratio[mine[0], 0] / units.length
            out.append(SetField("PSHELL", part.id, "T", float(t)))
            continue
        touched = mine[np.abs(ratio[mine] - 1).max(axis=1) > 1e-9]
        for kind, rows in _by_kind(after.shells, touched):
            n = 3 if kind.startswith("CTRIA") else 4
            if len(rows):
                fields = tuple(f"T{c + 1}" for c in range(n))
                t = after.shells.thickness[rows, :n] / units.length
                out.append(SetColumns(kind, after.shells.ids[rows], fields, t))
    return out
