"""Which numbers a case frees: a field of parts, of joints by their cards, or an effect by name."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..effects.registry import families
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
from .schema import ALIASES, FIELDS, PLANNED
from .toml_sections import TomlSection

_CARD = re.compile(r"^\s*([A-Z]+[0-9]?)\s+(\d{1,8})\s*$")
_LUMPS = {"PBUSH": "bushes", "PELAS": "springs", "CELAS2": "springs", "CONM2": "masses"}
_OF_LUMPS = {"springs": "K", "bushes": "K", "masses": "M"}
_WORDS = {"springs": "a spring", "bushes": "a bush", "masses": "a mass"}


def free_parameters(
    sections: Sequence[TomlSection], made: Assembly, deck: Deck | None
) -> tuple[FreeParameter, ...]:
    """Every [[parameter]], resolved.

    Raises
    ------
    FileError, LabelError
        As :func:`free_parameter`, and where two free the same numbers: a fit could not tell them
        apart.
    """
    found = tuple(free_parameter(s, made, deck) for s in sections)
    lines: dict[FreeParameter, int] = {}
    for section, one in zip(sections, found, strict=True):
        same = replace(one, name="", parts=(), sd=None, low=None, high=None)
        if same in lines:
            raise FileError(
                f"{section.at('field')} = {section.values['field']!r} frees the same numbers as "
                f"the [[parameter]] of line {lines[same]}; leave one of them out"
            )
        lines[same] = section.line
    return found


def free_parameter(section: TomlSection, made: Assembly, deck: Deck | None) -> FreeParameter:
    """One [[parameter]], resolved.

    Raises
    ------
    FileError, LabelError
        One sentence that names the line, the field, what the parts are and what they have.
    """
    what = _field(section)
    sd = section.number("sd", low=1e-3, high=2.0)
    low = section.number("low", low=1e-6, high=0.999)
    high = section.number("high", low=1.001, high=1e6)
    name = section.text("name") or what
    if what in _placed_names():
        return _placed(section, made, what, name)
    field = ALIASES.get(what, what)
    given, positions, lumps = _members(section, made, deck)
    if not given:
        positions, lumps = _all_that_have(section, made, field, what)
    for k in positions:
        _serves(section, made.parts[k], field)
    for family in lumps:
        if _OF_LUMPS[family] != field:
            raise FileError(
                f"{section.at('field')} = {what!r} cannot be freed of {_WORDS[family]}, which has "
                f"{_OF_LUMPS[family]}"
            )
    return FreeParameter(
        name, field, tuple(given), sd, low, high, tuple(positions),
        **{family: tuple(rows) for family, rows in lumps.items()},
    )  # fmt: skip


def _field(section: TomlSection) -> str:
    """The field, or why it cannot be freed."""
    what = section.text("field", due=True) or ""
    freeable = (*FIELDS, *ALIASES, *_placed_names())
    if what not in freeable and what in {f.name for f in families() if f.placed is None}:
        raise FileError(
            f"{section.at('field')} = {what!r} has an unknown place, so calibration cannot free "
            f"it; diagnose searches for it; fields that can be freed: {', '.join(freeable)}"
        )
    if what in PLANNED:
        raise FileError(
            f"{section.at('field')} = {what!r} is an effect without a model; fields that can be "
            f"freed: {', '.join(freeable)}"
        )
    return section.text("field", among=freeable) or ""


def _placed_names() -> tuple[str, ...]:
    """Effects of which deck and test tell where they act, those of installed packages too."""
    return (*(f.name for f in families() if f.placed is not None), *PATCHES)


def _placed(section: TomlSection, made: Assembly, what: str, name: str) -> FreeParameter:
    """An effect freed as it is, of the parts named."""
    for key in ("sd", "low", "high"):
        if key in section:
            raise FileError(
                f"{section.at(key)} is for numbers ({', '.join(FIELDS)}); {what} has its own prior"
            )
    given, positions, _ = _members(section, made, None)
    if what in PATCHES:
        return FreeParameter(name, what, tuple(given), positions=tuple(positions))
    if given and what != "orthotropic-material":
        raise FileError(f"{section.at('parts')}: {what} belongs to the test, not to parts")
    usable = [k for k, p in enumerate(made.parts) if _isotropic_shell(p)]
    for k in positions:
        if k not in usable:
            raise FileError(
                f"{section.at('parts')}: {made.parts[k].name} is not an isotropic sheet "
                f"({_kind(made.parts[k])}), so it cannot be made orthotropic"
            )
    chosen = (positions or usable) if what == "orthotropic-material" else []
    if what == "orthotropic-material" and not chosen:
        raise FileError(f"{section.at('field')} = {what!r}: the deck has no isotropic sheet")
    return FreeParameter(name, what, tuple(given), positions=tuple(chosen))


def _members(
    section: TomlSection, made: Assembly, deck: Deck | None
) -> tuple[list[str], list[int], dict[str, list[int]]]:
    """(names as given, positions of parts, rows of lumps by family)."""
    given: list[str] = []
    positions: list[int] = []
    lumps: dict[str, list[int]] = {}
    value = section.values.get("parts", [])
    for name in value if isinstance(value, list) else [value]:
        card = _CARD.match(str(name))
        if deck is not None and card and not _names_a_part(made, str(name)):
            family, rows = _lumps(section, made, deck, card[1], int(card[2]))
            lumps.setdefault(family, []).extend(rows)
            given.append(f"{card[1]} {card[2]}")
            continue
        k = _position(section, made, name)
        positions.append(k)
        given.append(made.parts[k].name)
    if "parts" in section and not given:
        raise FileError(f"{section.at('parts')} is empty; leave it out to free all parts")
    return given, list(dict.fromkeys(positions)), lumps


def _names_a_part(made: Assembly, name: str) -> bool:
    return any(name == p.name for p in made.parts)


def _position(section: TomlSection, made: Assembly, name: object) -> int:
    if isinstance(name, bool) or not isinstance(name, str | int):
        raise FileError(f"{section.at('parts')} holds {name!r}; write names of parts in quotes")
    try:
        return made.part(name)
    except LabelError as error:
        hint = did_you_mean(str(name), [p.name for p in made.parts])
        cards = ", ".join(f"{kind} ID" for kind in _LUMPS)
        raise LabelError(
            f"{section.at('parts')}: {hint}{error}; joints and masses are {cards}"
        ) from error


def _lumps(
    section: TomlSection, made: Assembly, deck: Deck, kind: str, id: int
) -> tuple[str, list[int]]:
    """(family, rows) of the springs, bushes or masses a card stands for."""
    where = section.at("parts")
    if kind not in _LUMPS:
        raise LabelError(f"{where}: {kind} {id} has no free number; there are {', '.join(_LUMPS)}")
    ids = _elements(deck, kind, id)
    family = _LUMPS[kind]
    rows = np.flatnonzero(np.isin(getattr(made, family).ids, ids)).tolist()
    if not rows:
        raise LabelError(f"{where}: the deck has no element of {kind} {id}")
    return family, rows


def _elements(deck: Deck, kind: str, id: int) -> list[int]:
    """Ids of the elements that take their value from a card."""
    users = {"PBUSH": ("CBUSH",), "PELAS": ("CELAS1", "CELAS3")}.get(kind)
    if users is None:
        return [id]
    out: list[int] = []
    for cards in deck.present(*users):
        own, pid = cards.integers(1), cards.integers(2, 0)
        out += own[np.where(pid == 0, own, pid) == id].tolist()
    return out


def _all_that_have(
    section: TomlSection, made: Assembly, field: str, what: str
) -> tuple[list[int], dict[str, list[int]]]:
    """Every part, spring, bush or mass that has the field, and not as zero."""
    if what == "adhesive-stiffness":
        solids = [p.name for p in made.parts if isinstance(p.section, SolidSection)]
        raise FileError(
            f"{section.at('field')} = {what!r} needs the parts that are adhesive; "
            f"solids here are {', '.join(solids) or 'none'}"
        )
    with_field = [k for k, p in enumerate(made.parts) if field in fields_of(p)]
    positions = [k for k in with_field if _value(made.parts[k], field) != 0]
    lumps = {
        family: list(range(len(getattr(made, family))))
        for family, name in _OF_LUMPS.items()
        if name == field and len(getattr(made, family))
    }
    if "bushes" in lumps:
        lumps["bushes"] = np.flatnonzero(made.bushes.stiffness.any(axis=1)).tolist()
    if not positions and not any(lumps.values()):
        there = ", ".join(dict.fromkeys(_kind(p) for p in made.parts)) or "no parts"
        raise FileError(f"{section.at('field')} = {field!r}: no part of the deck has it ({there})")
    return positions, lumps


def _serves(section: TomlSection, part: Part, field: str) -> None:
    """Refuse a field the part has not."""
    if field not in fields_of(part):
        have = ", ".join(fields_of(part)) or "no field that can be freed"
        raise FileError(
            f"{section.at('field')} = {field!r} cannot be freed of {part.name}, {_kind(part)}, "
            f"which has {have}"
        )
    if _value(part, field) == 0:
        raise FileError(
            f"{section.at('field')} = {field!r}: {part.name} has {field} = 0, and no factor "
            "changes that"
        )


def _value(part: Part, field: str) -> float:
    """Nominal value; 1 for a pure factor (E of a laminate)."""
    section = part.section
    if field == "t" and isinstance(section, ShellSection):
        return section.thickness
    shell = isinstance(section, ShellSection)
    material = (section.membrane or section.bending) if shell else section.material  # type: ignore[union-attr]
    return float(getattr(material, field, 1.0))


def fields_of(part: Part) -> tuple[str, ...]:
    """Fields of a part that can be freed."""
    section = part.section
    if isinstance(section, BeamSection):
        return ("E", "rho", "wall") if section.tube else ("E", "rho")
    if isinstance(section, SolidSection):
        return ("E", "rho", "nu") if isinstance(section.material, Isotropic) else ()
    material = section.membrane or section.bending
    if isinstance(material, Isotropic):
        return ("E", "rho", "nu", "t")
    if isinstance(material, Orthotropic):
        return ("E", "rho", "t", "E1", "E2", "G12", "nu12")
    return ("E", "rho", "t")


def _isotropic_shell(part: Part) -> bool:
    return isinstance(part.section, ShellSection) and "nu" in fields_of(part)


def _kind(part: Part) -> str:
    """The part in words."""
    if isinstance(part.section, BeamSection):
        return f"a part of {part.section.kind}s"
    if isinstance(part.section, SolidSection):
        return "a part of solids"
    material = part.section.membrane or part.section.bending
    return f"a part of {type(material).__name__.lower()} shells"
