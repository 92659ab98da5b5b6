"""``chladni check``: what of a case or deck will be used, what not, what cannot be right."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from ..errors import AccuracyError, FileError
from ..progress import within
from ..report.blocks import Items, Table
from ..report.words import counted
from ..results import to_json
from ..workflows.case_check import check
from ..workflows.deck_check import check_deck
from ..workflows.loaded_model import is_case
from .run import (
    Allow,
    DeckOrCase,
    Mass,
    Out,
    Pictures,
    Recordings,
    SensorTable,
    Units,
    opened,
    say_sections,
    started,
    stated,
)


def run(
    source: DeckOrCase,
    recordings: Recordings = None,
    mesh: Annotated[
        bool,
        typer.Option(
            "--mesh", help="Compare the modes of a case with those of a mesh twice as fine."
        ),
    ] = False,
    sensors: SensorTable = None,
    mass: Mass = None,
    units: Units = None,
    allow: Allow = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Check a case before a long run: units, mass, size, places, band, words; or a deck's cards."""
    from ..report.check_page import as_page

    given = stated(sensors=sensors, mass=mass)
    if source.is_file() and not is_case(source) and not (recordings or given):
        if mesh:
            raise FileError("--mesh is of a case; chladni init drafts one of a deck")
        _deck(source, tuple(allow or ()), units, out)
        return
    words = given | stated(units=units, allow=allow)
    with started("check", source, out, pictures=pictures, reads=recordings or ()) as job:
        case = opened(source, recordings or (), words)
        found = check(case, mesh=mesh, progress=within(job.progress, 0.0, 0.7))
        job.json("check.json", to_json(found))
        job.progress("the picture", 0.7)
        job.show(as_page(job.folder, found))
        for what, text in found.facts:
            job.say(f"{what}: {text}")
        for f, limit in zip(found.frequency, found.converged, strict=False):
            job.say(f"mode at {f:.4g} Hz: {limit:.4g} Hz on an infinitely fine mesh")
        for finding in found.findings:
            job.say(f"{'FAULT' if finding.fault else 'check'}: {finding.text}; {finding.remedy}")
        for note in dict.fromkeys(n for said in found.unused.values() for n in said):
            job.say(f"note: {note}")
    if found.faults:
        first = found.faults[0]
        raise AccuracyError(f"{source}: {first.text}; {first.remedy}")


def _deck(source: Path, allow: tuple[str, ...], units: str | None, out: Path | None) -> None:
    """The table of a deck's cards, with ``units`` its content, size and mass too."""
    with started("check", source, out) as job:
        found = check_deck(source, allow, units)
        job.json("check.json", asdict(found))
        rows = [(c.name, str(c.count), c.use, c.meaning) for c in found.cards]
        job.lead = f"{counted(len(rows), 'kind', 'kinds')} of cards and commands; " + (
            "the deck is refused." if found.refused else "the deck is read."
        )
        table = Table(("card", "count", "use", "meaning"), rows, words=_WORDS)
        job.section("Cards", [*([Items([found.refused])] if found.refused else []), table])
        if found.facts:
            job.section("The structure", [Table(("what", "value"), found.facts, ("what", "value"))])
        say_sections(job.lead, job.sections)
        job.note([found.doubt] if found.doubt else [])
    if found.refused:
        raise AccuracyError(found.refused)


_WORDS = ("card", "use", "meaning")
