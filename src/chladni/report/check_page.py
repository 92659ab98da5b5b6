"""A checked case as a page: its content, suspected errors, places of the sensors."""

from pathlib import Path
from typing import Any

from ..output import plain
from ..workflows.case_check import CaseCheck, CheckedDof
from .blocks import Facts, Items, PageParts, Section, Table
from .mesh_drawings import case_shown, layout
from .words import counted, direction, fixed, hertz, number, percent


def as_json(found: CaseCheck) -> dict[str, Any]:
    """``check.json``."""
    return {
        "facts": [{"what": what, "text": text} for what, text in found.facts],
        "findings": [vars(f) for f in found.findings],
        "model_hz": found.frequency,
        "converged_hz": found.converged,
        "sensors": [plain(vars(d)) for d in found.dofs],
        "notes": found.unused,
    }


def as_page(folder: Path, found: CaseCheck) -> PageParts:
    """Sections of the page."""
    caption = "Sensors, shakers and cords; arrows: their directions."
    drawn = layout("where", case_shown(found.origin), "sensors", caption, "sensors on the mesh")
    looks, facts, *told = in_words(found).sections
    sections = [looks, facts, Section("Sensors", [drawn, _table(found.dofs)]), *told]
    return PageParts(_lead(found), sections)


def in_words(found: CaseCheck) -> PageParts:
    """The page without its picture."""
    looks = [f"{'Fault: ' if f.fault else ''}{f.text}. Remedy: {f.remedy}" for f in found.findings]
    modes = ", ".join(number(f) for f in found.frequency)
    facts = [*found.facts, ("model's lowest elastic modes", f"{modes} Hz")]
    sections = [
        Section("Possible errors", [Items(looks)]),
        Section("Data and settings in use", [Facts(facts), _mesh(found)]),
        *(Section(f"For {who}", [Items(said)]) for who, said in _unused_words(found.unused)),
    ]
    return PageParts(_lead(found), sections)


def _mesh(found: CaseCheck) -> Table:
    """Elastic modes with the error that their mesh makes."""
    both = zip(found.frequency.tolist(), found.converged.tolist(), strict=False)
    rows = [(hertz(f), hertz(limit), percent(f, limit)) for f, limit in both]
    return Table(("model [Hz]", "on a fine mesh [Hz]", "off"), rows, caption=_MESH)


_MESH = (
    "Elastic modes, and their limit for an infinitely fine mesh. It follows from a mesh twice as "
    "fine. Errors fall with the square of the element size. They fall with its fourth power where "
    "all shells have nodes on their edges."
)


def _unused_words(unused: dict[str, tuple[str, ...]]) -> list[tuple[str, list[str]]]:
    """(commands, sentences): what is said to the same commands together, and once.

    >>> _unused_words({"calibrate": ("a", "b"), "diagnose": ("a",), "study": ("b",)})
    [('calibrate, diagnose', ['a']), ('calibrate, study', ['b'])]
    """
    out: dict[str, list[str]] = {}
    for text in dict.fromkeys(text for said in unused.values() for text in said):
        who = ", ".join(command for command, said in unused.items() if text in said)
        out.setdefault(who, []).append(text)
    return list(out.items())


def _lead(found: CaseCheck) -> str:
    faults, rest = len(found.faults), len(found.findings) - len(found.faults)
    said = [
        *([counted(faults, "thing is", "things are") + " to be corrected first"] if faults else []),
        *([counted(rest, "thing is", "things are") + " to be checked"] if rest else []),
    ]
    return f"{', '.join(said) or 'Nothing looks wrong with the case'}."


def _table(dofs: tuple[CheckedDof, ...]) -> Table:
    rows = [
        (d.label, d.role, d.place, *(fixed(x, 4) for x in d.point_m),
         direction(d.direction), fixed(1e3 * d.off_mesh_m, 1),
         number(1e3 * d.mass_kg, 3))
        for d in dofs
    ]  # fmt: skip
    heads = ("label", "role", "where", "x [m]", "y [m]", "z [m]", "direction", "off the mesh [mm]",
             "mass [g]")  # fmt: skip
    return Table(heads, rows, words=("label", "role", "where", "direction"))
