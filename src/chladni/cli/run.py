"""Parts that all commands share: the folder of a run, its progress bar, its options, its page."""

import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from ..arrays import real_number
from ..errors import FileError
from ..output import name_of, run_folder, write_json
from ..progress import Progress, within
from ..report.blocks import (
    Block,
    Code,
    Items,
    Links,
    PageParts,
    Section,
    Table,
    drawings,
    write_pictures,
)
from ..report.page import write_sections
from ..units import UNITS
from .console import console, say, say_results, say_table, watched

if TYPE_CHECKING:
    from ..case import Case
    from ..case.schema import CaseWords
    from ..workflows.diagnosis_result import DiagnosisResult


def folder_named(text: str) -> Path:
    """A folder by its name; an empty one would be the current folder."""
    if not text.strip():
        raise typer.BadParameter("the name is empty; give a folder")
    return Path(text)


Out = Annotated[
    Path | None,
    typer.Option(
        "--out", help="Folder for the results; default: runs/COMMAND-NAME.",
        metavar="DIR", parser=folder_named,
    ),
]  # fmt: skip
CaseFolder = Annotated[
    Path,
    typer.Argument(
        metavar="CASE", help="Folder with a case.toml, or that file (chladni init drafts one)."
    ),
]
DeckOrCase = Annotated[
    Path,
    typer.Argument(metavar="DECK_or_CASE", help="Nastran deck, or a folder with a case.toml."),
]
Units = Annotated[
    str | None,
    typer.Option(help=f"Unit system of a bare deck: {', '.join(UNITS)}."),
]
Recordings = Annotated[
    list[Path] | None,
    typer.Argument(metavar="RECORDING", help="Files of FRFs or time data, after a bare deck."),
]
SensorTable = Annotated[
    Path | None, typer.Option(help="Table of sensors, in the form of chladni plan.")
]
Mass = Annotated[float | None, typer.Option(help="Weighed mass of the article [kg].")]
Allow = Annotated[
    list[str] | None,
    typer.Option("--allow", help="Nastran card with stiffness that may be left out (repeatable)."),
]
Driven = Annotated[
    list[str] | None,
    typer.Option("--input", help="Drive point: 12:+Z, 12:n, base:+Z (repeatable)."),
]
Answering = Annotated[
    list[str] | None, typer.Option("--output", help="Output: 55:+Z, 55:n (repeatable).")
]
MOST_LINES = 1_000_000  # of responses that are evaluated: beyond, memory and patience end
Damping = Annotated[float, typer.Option(help="Damping ratio of every mode.", min=0)]
Pictures = Annotated[
    bool, typer.Option("--pictures", help="Write every drawing of the page as PNG too.")
]
Kind = Annotated[str, typer.Option(help="receptance, mobility or accelerance.")]


@dataclass
class Run:
    """One run of a command: where it writes, whom it tells, what its page will hold."""

    command: str
    source: Path
    folder: Path  # scratch; moved to its place if all goes well
    place: Path
    progress: Progress
    lead: str = ""
    sections: list[Section] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    files: list[tuple[str, str]] = field(default_factory=list)
    pictures: bool = False  # True: every drawing of the page as PNG too

    def json(self, name: str, data: Any, what: str = "the result for other programs") -> Path:
        """Write ``name`` next to the page and list it there."""
        self.files.append((name, what))
        return write_json(self.folder / name, data)

    def keep(self, name: str, what: str) -> Path:
        """Path of a file that the caller writes and the page lists."""
        self.files.append((name, what))
        return self.folder / name

    def section(self, title: str, blocks: Sequence[Block]) -> None:
        """Add to the page."""
        self.sections.append(Section(title, list(blocks)))

    def note(self, texts: Sequence[str]) -> None:
        """Sentences for the page that are said at once."""
        self.notes += texts
        for text in texts:
            self.say(f"note: {text}")

    def show(self, parts: PageParts) -> None:
        """Add a page's sections, notes and files, and say its lead."""
        self.sections += parts.sections
        self.files += parts.files
        self.files += write_pictures(self.folder, drawings(parts.sections), self.pictures)
        self.lead = parts.lead
        say_sections(parts.lead, parts.sections)
        self.note(parts.notes)

    def say(self, text: str) -> None:
        """One line on standard output."""
        say(text)

    def page(self) -> Path:
        """Write ``report.html`` of what was gathered."""
        from ..view.probe import advice

        notes = [*self.notes, *advice()]
        foot = [
            Section("Steps and reasons", [Items(notes)] if notes else []),
            Section("Files", [Links(self.files)] if self.files else []),
            Section("Run it again", [Code([command_line()])]),
        ]
        title = f"{self.command} – {self.source.name}"
        path = self.folder / "report.html"
        body = [*self.sections, *foot]
        figures = {p.stem: p for p in self.folder.glob("*.png")}
        return write_sections(path, title, body, lead=self.lead, figures=figures)


@contextmanager
def started(
    command: str, source: Path | str, out: Path | None, *, listed: bool = True, adds: bool = False,
    pictures: bool = False, reads: Sequence[Path] = (),
) -> Iterator[Run]:  # fmt: skip
    """A run whose files appear in ``out`` only if nothing failed; by default in ./runs."""
    from ..case.files_of_source import files_of

    place = place_of(command, Path(source), out)
    inputs = (*files_of(Path(source)), *reads)
    with run_folder(place, command, inputs, listed=listed, adds=adds) as folder:
        with watched() as progress:
            run = Run(command, Path(source), folder, place, progress, pictures=pictures)
            yield run
        if run.sections:
            run.page()
    page = place / "report.html"
    say_results(page if page.exists() else place)


def say_sections(lead: str, sections: Sequence[Section]) -> None:
    """A result in one sentence, and its tables under their titles."""
    say(lead)
    for section in sections:
        for block in section.blocks:
            if isinstance(block, Table) and block.rows:
                say(f"\n{section.title}" + (f": {block.caption}" if block.caption else ""))
                say_table(block)


def place_of(command: str, source: Path, out: Path | None) -> Path:
    """Where a run writes: --out, else a folder of its own in ./runs."""
    return out or Path("runs") / f"{command}-{_name(source)}"


def stated(**words: Any) -> "CaseWords":
    """The words of a case that were given as options."""
    return cast("CaseWords", {name: word for name, word in words.items() if word is not None})


def opened(
    source: Path, recordings: Sequence[Path] = (), words: "CaseWords | None" = None
) -> "Case":
    """The case of a folder or a case.toml, or of a deck with its recordings."""
    from ..case import load_case
    from ..io.mesh_format import refuse_foreign
    from ..workflows.given_case import given_case
    from ..workflows.loaded_model import is_case, refuse_exchanged, similar_names

    refuse_exchanged(source, recordings)
    if recordings or words:
        return given_case(source, list(recordings), words)
    if not source.exists():
        raise FileError(f"no file or folder {source}{similar_names(source)}")
    if source.exists() and not is_case(source):
        refuse_foreign(source)
        raise FileError(
            f"{source} is not a case; give a folder with a case.toml (chladni init drafts one), "
            "or a deck with its recording"
        )
    return load_case(source)


def diagnosed(
    command: str,
    source: Path,
    out: Path | None,
    workflow: Callable[..., "DiagnosisResult"],
    pictures: bool = False,
    recordings: Sequence[Path] = (),
    words: "CaseWords | None" = None,
) -> "DiagnosisResult":
    """Diagnose or calibrate a case, or a deck with recordings, and say the verdict.

    Raises
    ------
    AccuracyError
        After all is written, if the result is not to be trusted.
    """
    from ..report.diagnosis_folder import write_diagnosis
    from ..report.sentence import sentence
    from ..report.verdict import sections

    with started(command, source, out, reads=recordings) as job:
        case = opened(source, recordings, words)
        found = workflow(case, progress=within(job.progress, 0.0, 0.85))
        stage = within(job.progress, 0.85, 1.0)
        case = found.origin  # without channels that say nothing of the model
        found = write_diagnosis(job.folder, case, found, command_line(), stage, job.place, pictures)
        say_sections(sentence(found), sections(found, {}, (), (), ""))
        for note in found.notes:
            console().aside(f"note: {note}")
    return found.trusted()


def limits(text: str) -> tuple[float, float]:
    """A band as two numbers [Hz].

    >>> limits("20:200")
    (20.0, 200.0)
    """
    try:
        low, high = (real_number(x) for x in text.replace(",", ":").split(":"))
    except ValueError:
        raise FileError(f"--band {text!r} is not of the form 20:200") from None
    if not 0 <= low < high < float("inf"):
        raise FileError(f"--band {text!r} must increase, be finite and not be negative")
    return low, high


def command_line() -> str:
    """The command as it was typed, for the page."""
    return shlex.join(["chladni", *sys.argv[1:]])


def _name(source: Path) -> str:
    """Name of a case or deck, for the folder of its run."""
    whole = source.resolve()
    if whole.is_dir() or whole.name == "case.toml":
        return name_of(whole if whole.is_dir() else whole.parent).replace("/", "-")
    return whole.stem
