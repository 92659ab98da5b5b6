"""``chladni check``: what of a case or deck will be used, what not, what cannot be right."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from ..errors import AccuracyError, FileError
from ..progress import within
from ..report.blocks import Items, Table
from ..report.result_json import to_json
from ..report.words import counted
from ..workflows.case_check import check
from ..workflows.deck_check import check_deck
from ..workflows.loaded_model import is_case
from .run import Allow, DeckOrCase, Out, Pictures, opened, say_sections, started


def run(
    source: DeckOrCase,
    mesh: Annotated[
        bool,
        typer.Option(
            "--mesh", help="Compare the modes of a case with those of a mesh twice as fine."
        ),
    ] = False,
    allow: Allow = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Check a case before a long run: units, mass, size, places, band, words; or a deck's cards."""
    from ..report.check_page import check_page

    if mesh and source.is_file() and not is_case(source):
        raise FileError("--mesh is of a case; chladni init drafts one of a deck")
    if source.is_file() and not is_case(source):
        _deck(source, tuple(allow or ()), out)
        return
    if allow:
        raise FileError("--allow is of a bare deck; a case says [model] allow")

    with started("check", source, out, pictures=pictures) as job:
        case = opened(source)
        found = check(case, mesh=mesh, progress=within(job.progress, 0.0, 0.7))
        job.json("check.json", to_json(found))
        job.progress("the picture", 0.7)
        job.show(check_page(case, found))
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


def _deck(source: Path, allow: tuple[str, ...], out: Path | None) -> None:
    """The table of a deck's cards: which are read, passed over, not understood."""
    with started("check", source, out) as job:
        found = check_deck(source, allow)
        job.json("check.json", asdict(found))
        rows = [(c.name, str(c.count), c.use, c.meaning) for c in found.cards]
        job.lead = f"{counted(len(rows), 'kind', 'kinds')} of cards and commands; " + (
            "the deck is refused." if found.refused else "the deck is read."
        )
        table = Table(("card", "count", "use", "meaning"), rows, words=_WORDS)
        job.section("Cards", [*([Items([found.refused])] if found.refused else []), table])
        say_sections(job.lead, job.sections)
    if found.refused:
        raise AccuracyError(found.refused)


_WORDS = ("card", "use", "meaning")
