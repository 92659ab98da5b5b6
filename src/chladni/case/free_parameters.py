"""Which numbers a case frees: a field of parts, of joints by their cards, or an effect by name."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..effects.registry import families
from ..effects.user_parameters import offset_of
from ..effects.weld_patch import PATCHES
from ..errors import FileError, LabelError, did_you_mean
from ..io.nastran import Deck
from ..model.assembly import Assembly
from ..model.free_parameter import FreeParameter
from ..model.properties import (
    BeamSection,
    Isotropic,
    Orthotropic,
    Part,
    ShellSection,
    SolidSection,
)
from .key import refuse_other
from .request import Stated
from .schema import ALIASES, FIELDS, PLANNED, ParameterWords

_CARD = re.compile(r"^\s*([A-Z]+[0-9]?D?)\s+(\d{1,8})\s*$")
_LUMPS = {
    "PBUSH": "bushes", "PFAST": "bushes", "PWELD": "bushes", "PBUSH1D": "bushes",
    "PELAS": "springs", "CELAS2": "springs", "CONM2": "masses",
}  # fmt: skip
_HELD_BY = {  # the first members of a family, one a card; others belong to elements of more numbers
    "springs": ("CELAS1", "CELAS2", "CELAS3", "CELAS4"), "masses": ("CONM2",),
}  # fmt: skip
_OF_LUMPS = {"springs": "K", "bushes": "K", "masses": "M"}
_WORDS = {"springs": "a spring", "bushes": "a bush", "masses": "a mass"}


def free_parameters(
    asked: Sequence[Stated[ParameterWords]], made: Assembly, deck: Deck | None
) -> tuple[FreeParameter, ...]:
    """Every [[parameter]], resolved.

    Raises
    ------
    FileError, LabelError
        As :func:`free_parameter`, and where two free the same numbers: a fit could not tell them
        apart.
    """
    found = tuple(free_parameter(stated, made, deck) for stated in asked)
    earlier: dict[FreeParameter, str] = {}
    for stated, one in zip(asked, found, strict=True):
        same = replace(one, name="", parts=(), sd=None, low=None, high=None)
        if same in earlier:
            raise FileError(
                f"{stated.places['field']} = {stated.words['field']!r} frees the same numbers as "
                f"{earlier[same]}; leave one of them out"
            )
        earlier[same] = stated.whole
    return found


def free_parameter(
    stated: Stated[ParameterWords], made: Assembly, deck: Deck | None
) -> FreeParameter:
    """One [[parameter]], resolved.

    Raises
    ------
    FileError, LabelError
        One sentence that names the line, the field, what the parts are and what they have.
    """
    words, at = stated.words, stated.places
    what = _field(stated)
    name = words.get("name") or what
    if what in _placed_names():
        return _placed(stated, made, what, name)
    field = ALIASES.get(what, what)
    given, positions, lumps = _members(stated, made, deck)
    if not given:
        positions, lumps = _all_that_have(at["field"], made, deck, field, what)
    for k in positions:
        _serves(at["field"], made, k, field)
    for family in lumps:
        if _OF_LUMPS[family] != field:
            raise FileError(
                f"{at['field']} = {what!r} cannot be freed of {_WORDS[family]}, which has "
                f"{_OF_LUMPS[family]}"
            )
    return FreeParameter(
        name, field, tuple(given), words.get("sd"), words.get("low"), words.get("high"),
        tuple(positions), **{family: tuple(rows) for family, rows in lumps.items()},
    )  # fmt: skip


def _field(stated: Stated[ParameterWords]) -> str:
    """The field, or why it cannot be freed."""
    what, at = stated.words["field"], stated.places["field"]
    freeable = (*FIELDS, *ALIASES, *_placed_names())
    if what not in freeable and what in {f.name for f in families() if f.placed is None}:
        raise FileError(
            f"{at} = {what!r} has an unknown place, so calibration cannot free it; diagnose "
            f"searches for it; fields that can be freed: {', '.join(freeable)}"
        )
    if what in PLANNED:
        raise FileError(
            f"{at} = {what!r} is an effect without a model; fields that can be freed: "
            f"{', '.join(freeable)}"
        )
    refuse_other(at, what, freeable)
    return what


def _placed_names() -> tuple[str, ...]:
    """Effects of which deck and test tell where they act, those of installed packages too."""
    return (*(f.name for f in families() if f.placed is not None), *PATCHES)


def _placed(stated: Stated[ParameterWords], made: Assembly, what: str, name: str) -> FreeParameter:
    """An effect freed as it is, of the parts named."""
    at = stated.places
    for key in ("sd", "low", "high"):
        if key in stated.words:
            raise FileError(
                f"{at[key]} is for numbers ({', '.join(FIELDS)}); {what} has its own prior"
            )
    given, positions, _ = _members(stated, made, None)
    if what in PATCHES:
        return FreeParameter(name, what, tuple(given), positions=tuple(positions))
    if given and what != "orthotropic-material":
        raise FileError(f"{at['parts']}: {what} belongs to the test, not to parts")
    usable = [k for k, p in enumerate(made.parts) if _isotropic_shell(p)]
    for k in positions:
        if k not in usable:
            raise FileError(
                f"{at['parts']}: {made.parts[k].name} is not an isotropic sheet "
                f"({_kind(made.parts[k])}), so it cannot be made orthotropic"
            )
    chosen = (positions or usable) if what == "orthotropic-material" else []
    if what == "orthotropic-material" and not chosen:
        raise FileError(f"{at['field']} = {what!r}: the deck has no isotropic sheet")
    return FreeParameter(name, what, tuple(given), positions=tuple(chosen))


def _members(
    stated: Stated[ParameterWords], made: Assembly, deck: Deck | None
) -> tuple[list[str], list[int], dict[str, list[int]]]:
    """(names as given, positions of parts, rows of lumps by family)."""
    given: list[str] = []
    positions: list[int] = []
    lumps: dict[str, list[int]] = {}
    at = stated.places["parts"]
    for name in stated.words.get("parts", ()):
        card = _CARD.match(str(name))
        if deck is not None and card and not _names_a_part(made, str(name)):
            family, rows = _lumps(at, made, deck, card[1], int(card[2]))
            lumps.setdefault(family, []).extend(rows)
            given.append(f"{card[1]} {card[2]}")
            continue
        k = _position(at, made, name)
        positions.append(k)
        given.append(made.parts[k].name)
    if "parts" in stated.words and not given:
        raise FileError(f"{at} is empty; leave it out to free all parts")
    return given, list(dict.fromkeys(positions)), lumps


def _names_a_part(made: Assembly, name: str) -> bool:
    return any(name == p.name for p in made.parts)


def _position(at: str, made: Assembly, name: str | int) -> int:
    try:
        return made.part(name)
    except LabelError as error:
        hint = did_you_mean(str(name), [p.name for p in made.parts])
        cards = ", ".join(f"{kind} ID" for kind in _LUMPS)
        raise LabelError(f"{at}: {hint}{error}; joints and masses are {cards}") from error


def _lumps(at: str, made: Assembly, deck: Deck, kind: str, id: int) -> tuple[str, list[int]]:
    """(family, rows) of the springs, bushes or masses a card stands for."""
    if kind not in _LUMPS:
        raise LabelError(f"{at}: {kind} {id} has no free number; there are {', '.join(_LUMPS)}")
    ids = _elements(deck, kind, id)
    family = _LUMPS[kind]
    rows = np.flatnonzero(np.isin(getattr(made, family).ids, ids)).tolist()
    if not rows:
        raise LabelError(f"{at}: the deck has no element of {kind} {id}")
    return family, rows


def _elements(deck: Deck, kind: str, id: int) -> list[int]:
    """Ids of the elements that take their value from a card."""
    users = ("CELAS1", "CELAS3") if kind == "PELAS" else ("C" + kind[1:],)
    if kind[0] == "C":
        return [id]
    out: list[int] = []
    for cards in deck.present(*users):
        own, pid = cards.integers(1), cards.integers(2, 0)
        out += own[np.where(pid == 0, own, pid) == id].tolist()
    return out


def _all_that_have(
    at: str, made: Assembly, deck: Deck | None, field: str, what: str
) -> tuple[list[int], dict[str, list[int]]]:
    """Every part, spring, bush or mass that has the field, and not as zero."""
    if what == "adhesive-stiffness":
        solids = [p.name for p in made.parts if isinstance(p.section, SolidSection)]
        raise FileError(
            f"{at} = {what!r} needs the parts that are adhesive; "
            f"solids here are {', '.join(solids) or 'none'}"
        )
    with_field = [k for k in range(len(made.parts)) if field in fields_of(made, k)]
    positions = [k for k in with_field if _value(made.parts[k], field) != 0]
    lumps = {
        family: list(range(len(getattr(made, family))))
        for family, name in _OF_LUMPS.items()
        if name == field and len(getattr(made, family))
    }
    if deck is not None:
        for family in lumps.keys() & _HELD_BY.keys():
            own = sum(len(cards) for cards in deck.present(*_HELD_BY[family]))
            lumps[family] = [row for row in lumps[family] if row < own]
    if "bushes" in lumps:
        lumps["bushes"] = np.flatnonzero(made.bushes.stiffness.any(axis=1)).tolist()
    if not positions and not any(lumps.values()):
        there = ", ".join(dict.fromkeys(_kind(p) for p in made.parts)) or "no parts"
        raise FileError(f"{at} = {field!r}: no part of the deck has it ({there})")
    return positions, lumps


def _serves(at: str, made: Assembly, k: int, field: str) -> None:
    """Refuse a field the part has not."""
    part, has = made.parts[k], fields_of(made, k)
    if field not in has:
        have = ", ".join(has) or "no field that can be freed"
        raise FileError(
            f"{at} = {field!r} cannot be freed of {part.name}, {_kind(part)}, which has {have}"
        )
    if _value(part, field) == 0:
        raise FileError(
            f"{at} = {field!r}: {part.name} has {field} = 0, and no factor changes that"
        )


def _value(part: Part, field: str) -> float:
    """Nominal value; 1 for a pure factor (E of a laminate)."""
    section = part.section
    if field == "t" and isinstance(section, ShellSection):
        return section.thickness
    shell = isinstance(section, ShellSection)
    material = (section.membrane or section.bending) if shell else section.material  # type: ignore[union-attr]
    return float(getattr(material, field, 1.0))


def fields_of(made: Assembly, k: int) -> tuple[str, ...]:
    """Fields of the k-th part that can be freed."""
    section = made.parts[k].section
    if isinstance(section, BeamSection):
        wall, offset = ("wall",) * section.tube, ("offset",) * (offset_of(made, k) > 0)
        return ("E", "rho", *wall, *offset)
    if isinstance(section, SolidSection):
        return ("E", "rho", "nu") if isinstance(section.material, Isotropic) else ()
    material = section.membrane or section.bending
    if isinstance(material, Isotropic):
        return ("E", "rho", "nu", "t")
    if isinstance(material, Orthotropic):
        return ("E", "rho", "t", "E1", "E2", "G12", "nu12")
    return ("E", "rho", "t")


def _isotropic_shell(part: Part) -> bool:
    section = part.section
    material = isinstance(section, ShellSection) and (section.membrane or section.bending)
    return isinstance(material, Isotropic)


def _kind(part: Part) -> str:
    """The part in words."""
    if isinstance(part.section, BeamSection):
        return f"a part of {part.section.kind}s"
    if isinstance(part.section, SolidSection):
        return "a part of solids"
    material = part.section.membrane or part.section.bending
    return f"a part of {type(material).__name__.lower()} shells"
