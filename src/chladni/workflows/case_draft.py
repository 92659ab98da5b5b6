"""Draft a case from a deck and a recording, with what was guessed and what is missing."""

import json
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..case.files_of_source import files_of
from ..case.free_parameters import fields_of
from ..case.mended_recordings import with_frf
from ..case.schema import KEYS
from ..ema.response_correlations import responses
from ..ema.setup import Recording
from ..errors import FileError
from ..fem.energy import mass_properties
from ..io.nastran import assembly
from ..io.tables.csv_table import csv_text
from ..io.tables.read_tables import read_recordings
from ..io.tables.sensor_table import read_sensors
from ..model.assembly import Assembly
from ..units import Units
from ..units import units as unit_system
from .loaded_model import load_deck, refuse_exchanged, similar_names
from .matched_dofs import MatchedDof, matched
from .unit_guess import guessed_units

COLUMNS = (
    *("label", "grid", "x", "y", "z", "direction", "nx", "ny", "nz"),
    *("role", "mass", "position_sd"),
)
WAYS = {
    "grid": "by grid number",
    "place": "by the grid at their place",
    "nearest": "on the nearest point of the mesh",
    "table": "from the given table",
    "base": "as the motion of the supports",
    "missing": "nowhere: their places are missing",
}
_NAMED = 8  # labels a sentence names
_FAR = 0.01  # [m] from the mesh: worth saying


@dataclass(frozen=True, eq=False)
class CaseDraft:
    """Content of the case that `chladni init` writes."""

    # deck, recordings: files
    deck: Path
    recordings: tuple[Path, ...]
    units: Units  # and ``units_why`` how they are known
    units_why: str
    assembly: Assembly
    mass: float  # of the deck [kg]
    quantity: str  # the user's word, "" where the files say it
    weighed: float | None
    allow: tuple[str, ...]  # cards of the deck that are passed over
    read: tuple[Recording, ...]  # recordings as read, the compared one first
    dofs: tuple[MatchedDof, ...]  # where its outputs and inputs are
    notes: tuple[str, ...]  # what was assumed
    missing: tuple[str, ...]  # what is still missing, and how to supply it

    @property
    def found(self) -> str:
        """How many dofs were found in which way."""
        count: Counter[str] = Counter(d.matched_by for d in self.dofs)
        return ", ".join(f"{count[kind]} {text}" for kind, text in WAYS.items() if count[kind])

    @property
    def nowhere(self) -> bool:
        """True if there are dofs and no place of any is known."""
        return bool(self.dofs) and all(d.matched_by == "missing" for d in self.dofs)


def draft(
    deck: Path,
    recordings: Sequence[Path] = (),
    units: str | None = None,
    quantity: str | None = None,
    table: Path | None = None,
    weighed: float | None = None,
    allow: Sequence[str] = (),
) -> CaseDraft:
    """Read the files, guess what they do not state, and list what is missing."""
    for path in (deck, *recordings):
        if not str(path).isprintable():
            raise FileError(
                f"{path}: a case.toml holds only printable UTF-8; rename this file or its folder"
            )
    refuse_exchanged(deck, recordings)
    bare = load_deck(deck, None, allow)
    if units is None:
        guess = guessed_units(assembly(bare.deck), deck.name)
        system, why = guess.units, guess.why
        sure = "no other system fits" if guess.sure else "another system fits too: check this"
        why = f"{why}; {sure}"
    else:
        system = unit_system(units)
        why = _as_given(assembly(bare.deck), deck.name, system)
    made = assembly(bare.deck, system)
    read = [r for path in recordings for r in _recordings(path, quantity)]
    read.sort(key=lambda r: (r.frf is None, r.poles is None))
    dofs, notes = matched(made, read[0] if read else None, read_sensors(table) if table else ())
    mass = float(mass_properties(made)[0])
    notes += [note for r in read for note in r.notes]
    notes += _far(dofs)
    return CaseDraft(
        deck, tuple(recordings), system, why, made, mass, quantity or "", weighed, tuple(allow),
        tuple(read), tuple(dofs), tuple(notes), tuple(_missing(read, dofs, mass, weighed)),
    )  # fmt: skip


def _as_given(made: Assembly, name: str, system: Units) -> str:
    """State why these units hold, or that only another system fits the materials."""
    try:
        guess = guessed_units(made, name)
    except FileError:  # no known material in any system
        return "as given"
    if guess.sure and guess.units.name != system.name:
        return f"as given, but check: {guess.why}; no other system fits"
    return "as given"


def _recordings(path: Path, quantity: str | None) -> tuple[Recording, ...]:
    if not path.is_file():
        raise FileError(f"no file {path}{similar_names(path)}")
    try:
        return tuple(with_frf(r)[0] for r in read_recordings(path, quantity))
    except FileError as error:
        if quantity is None and "quantity" in str(error):
            raise FileError(f"{error} (--quantity)") from error
        raise


def _far(dofs: Sequence[MatchedDof]) -> list[str]:
    far = [d for d in dofs if d.matched_by == "nearest" and d.distance > _FAR]
    if not far:
        return []
    worst = max(far, key=lambda d: d.distance)
    return [
        f"{len(far)} {'place is' if len(far) == 1 else 'places are'} more than "
        f"{1e3 * _FAR:g} mm from the mesh, {worst.label} "
        f"{1e3 * worst.distance:.3g} mm: check that the recording is in the deck's frame"
    ]


def _missing(
    read: Sequence[Recording], dofs: Sequence[MatchedDof], mass: float, weighed: float | None
) -> list[str]:
    """List what is still missing, and how to supply it."""
    out = []
    lost = [f"{d.label} ({d.role})" for d in dofs if d.matched_by == "missing"]
    if lost:
        more = f" and {len(lost) - _NAMED} more" if len(lost) > _NAMED else ""
        out.append(
            f"places of {', '.join(lost[:_NAMED])}{more}: neither deck nor recording defines "
            "them; add a row for each to sensors.csv, with a grid or x, y, z in metres"
        )
    if not read:
        out.append("a recording: [test] recordings, a universal file, .npz or .csv")
    elif all(r.frf is None and r.poles is None and not responses(r.functions) for r in read):
        out.append("FRFs or a table of poles: the recordings have neither")
    if weighed is None:
        out.append(
            f"the weighed mass: [test] mass in kg, without sensors; the deck weighs {mass:.4g} "
            "kg, and a comparison would show a wrong unit system"
        )
    return out


def sensors_text(made: CaseDraft) -> str:
    """Return the text of ``sensors.csv``; a missing sensor has no row."""
    return csv_text([COLUMNS, *(_row(d) for d in made.dofs if d.matched_by != "missing")])


def _row(d: MatchedDof) -> list[str]:
    place = [""] * 3 if d.place is None else [f"{x:.7g}" for x in d.place]
    axis_text, axis = "n", [""] * 3
    if d.axis is not None:
        k = int(np.abs(d.axis).argmax())
        plain = np.isclose(abs(d.axis[k]), 1.0, atol=1e-9)
        axis_text = f"{'+' if d.axis[k] > 0 else '-'}{'XYZ'[k]}" if plain else ""
        axis = [""] * 3 if plain else [f"{x:.9g}" for x in d.axis]
    grid = "" if d.grid is None or d.matched_by == "base" else str(d.grid)
    mass = f"{d.mass:g}" if d.mass else ""
    return [d.label, grid, *place, axis_text, *axis, d.role, mass, ""]


def case_text(made: CaseDraft, folder: Path) -> str:
    """Return the text of ``case.toml``, paths relative to ``folder``, a comment on every word."""
    name = lambda path: json.dumps(_seen_from(path, folder), ensure_ascii=False)  # noqa: E731
    lines = [
        "# A chladni case, drafted by chladni init. Lines that begin with # are off: remove the",
        "# mark to use them. chladni check shows what is used.",
        "",
        "[model]",
        f"deck = {name(made.deck)}",
        *_of_outside(made, folder),
        *([f"allow = {json.dumps(list(made.allow))}"] if made.allow else []),
        *_comment(made.units_why),
        f'units = "{made.units.name}"',
        _off("model", "damping"),
        "",
        "[test]",
        *_of_recordings(made, name),
        _of_mass(made),
        *(_off("test", name) for name in ("mass_sd", "hangers", "gain")),
        "",
        *_of_band(made),
        "",
        "[held_out]",
        _off("held_out", "sensors"),
        "",
        *_of_parts(made),
    ]  # fmt: skip
    missing = [line for text in made.missing for line in _comment(f"MISSING {text}")]
    notes = [line for text in made.notes for line in _comment(f"NOTE {text}")]
    return "\n".join([*lines, *([""] if missing or notes else []), *missing, *notes, ""])


def _off(section: str, name: str, example: str = "") -> str:
    """Return a word that is off: an example, its meaning and what holds without it."""
    key = KEYS[section, name]
    unit = f" [{key.unit}]" if key.unit else ""
    meaning = key.meaning.partition(". ")[0].rstrip(".")
    return f"# {name} = {example or key.example}  # {meaning}{unit}; default: {key.default}"


def _of_outside(made: CaseDraft, folder: Path) -> list[str]:
    """Return the line that permits files outside the folder, if there are any."""
    files = (*files_of(made.deck), *made.recordings)
    ways = (Path(_seen_from(path, folder)) for path in files)
    if not any(axis_text.is_absolute() or ".." in axis_text.parts for axis_text in ways):
        return []
    return ["outside = true  # files outside this folder: not part of the case"]


def _of_mass(made: CaseDraft) -> str:
    """Return the line of the weighed mass; without a weighing it is a comment."""
    if made.weighed is not None:
        return f"mass = {made.weighed:g}  # weighed [kg]"
    return (
        f"# mass = 0.0  # weigh the article [kg] without sensors; the deck weighs {made.mass:.4g} "
        "kg"
    )


def _seen_from(path: Path, folder: Path) -> str:
    """Return a path relative to the case, or the absolute path if it is on another drive."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return path.resolve().as_posix()


def _comment(text: str) -> list[str]:
    """Wrap a sentence into lines that begin with #, without unprintable characters."""
    words, lines = "".join(c if c.isprintable() else " " for c in text).split(), ["#"]
    for word in words:
        if len(lines[-1]) + len(word) > 98 and lines[-1] != "#":
            lines.append("#  ")
        lines[-1] += f" {word}"
    return lines


def _of_recordings(made: CaseDraft, name: object) -> list[str]:
    assert callable(name)
    where = []
    if made.dofs:
        where = [*_comment(f"Found on the deck: {made.found}."), 'sensors = "sensors.csv"']
    if not made.read:
        return ['# recordings = ["recording.uff"]  # universal file, .npz or .csv', *where]
    out = [f"recordings = [{', '.join(name(p) for p in made.recordings)}]"]
    for r in made.read:
        out += _comment(said_of(r))
    frf = made.read[0].frf
    if made.quantity:
        out.append(f'quantity = "{made.quantity}"')
    elif frf is not None:
        out.append(f'# quantity = "{frf.quantity}"  # from the file; only to overrule it')
    return [*out, *where]


def said_of(r: Recording) -> str:
    """A recording in one sentence."""
    if (modal := r.modal) is not None:
        return f"{r.name}: {len(modal.frequency)} modes with shapes at {len(modal.dofs)} dofs"
    if r.poles is not None and r.frf is None:
        return f"{r.name}: {len(r.poles.frequency)} poles"
    if r.frf is None and (used := responses(r.functions)):
        return (
            f"{r.name}: {len(used)} records of responses ({used[0].kind}) and no force: their "
            "natural frequencies are compared"
        )
    if r.frf is None:
        return f"{r.name}: neither FRFs nor poles"
    f = r.frf
    shown = ", ".join(f.inputs[:4]) + (" ..." if len(f.inputs) > 4 else "")
    return (
        f"{r.name}: {f.quantity} of {len(f.outputs)} outputs from {shown}, {len(f.frequency)} "
        f"lines from {f.frequency[0]:g} to {f.frequency[-1]:g} Hz, "
        f"{'with' if f.coherence is not None else 'without'} coherence"
    )


def _of_band(made: CaseDraft) -> list[str]:
    frf = next((r.frf for r in made.read if r.frf is not None), None)
    ends = (frf.frequency[frf.frequency > 0][[0, -1]]) if frf is not None else (20.0, 200.0)
    return [
        "[band]",
        _off("band", "fit", f"[{ends[0]:g}, {ends[1]:g}]"),
        _off("band", "exclude"),
    ]


def _of_parts(made: CaseDraft) -> list[str]:
    out = ["# Calibration parameters; default: E and t of every sheet, rho of every material."]
    a = made.assembly
    having = [(p, fields) for k, p in enumerate(a.parts) if (fields := fields_of(a, k))]
    for part, fields in having[:20]:
        out += _comment(f"{part.name} ({part.id}) has {', '.join(fields)}")
    for part, fields in having[:1]:
        quoted = json.dumps(part.name, ensure_ascii=False)
        out += ["# [[parameter]]", f"# parts = [{quoted}]", f'# field = "{fields[0]}"']
    return out
