"""What every command shares: the folder of a run, its progress bar, its options, its page."""

import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from ..output import run_folder, write_json
from ..progress import Progress, terminal
from ..report.blocks import Block, Code, Items, Links, Section
from ..report.page import write_sections

Out = Annotated[
    Path | None,
    typer.Option("--out", help="Folder for the results (made if needed).", metavar="DIR"),
]
Units = Annotated[
    str | None,
    typer.Option(help="Unit system of a bare deck: SI, mm-t-s, mm-kg-ms, mm-kg-s, in-lb-s."),
]
Allow = Annotated[
    list[str] | None,
    typer.Option("--allow", help="Card of a deck to leave out although it carries stiffness."),
]


@dataclass
class Run:
    """One run of a command: where it writes, whom it tells, what its page will hold."""

    command: str
    source: Path
    folder: Path  # scratch; moved to its place if all goes well
    progress: Progress
    lead: str = ""
    sections: list[Section] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    files: list[tuple[str, str]] = field(default_factory=list)

    def json(self, name: str, data: Any, what: str = "the result for other programs") -> Path:
        """Write ``name`` beside the page and list it there."""
        self.files.append((name, what))
        return write_json(self.folder / name, data)

    def keep(self, name: str, what: str) -> Path:
        """Path of a file that the caller writes and the page lists."""
        self.files.append((name, what))
        return self.folder / name

    def section(self, title: str, blocks: Sequence[Block]) -> None:
        """Add to the page."""
        self.sections.append(Section(title, list(blocks)))

    def say(self, text: str) -> None:
        """One line on standard output."""
        typer.echo(text)

    def page(self) -> Path:
        """Write ``report.html`` of what was gathered."""
        from ..view.probe import advice

        notes = [*self.notes, *advice()]
        foot = [
            Section("What was done, and why", [Items(notes)] if notes else []),
            Section("Files", [Links(self.files)] if self.files else []),
            Section("Run it again", [Code([command_line()])]),
        ]
        title = f"{self.command} – {self.source.name}"
        path = self.folder / "report.html"
        return write_sections(path, title, [*self.sections, *foot], lead=self.lead)


@contextmanager
def started(command: str, source: Path | str, out: Path | None) -> Iterator[Run]:
    """A run whose files appear in ``out`` only if nothing failed; by default in ./runs."""
    place = out or Path("runs") / f"{command}-{_name(Path(source))}"
    with run_folder(place) as folder:
        with terminal() as progress:
            run = Run(command, Path(source), folder, progress)
            yield run
        if run.sections:
            run.page()
    page = place / "report.html"
    typer.echo(f"results in {page if page.exists() else place}")


def command_line() -> str:
    """The command as it was typed, for the page."""
    return shlex.join(["chladni", *sys.argv[1:]])


def _name(source: Path) -> str:
    """Name of a case or deck, for the folder of its run."""
    whole = source.resolve()
    if whole.is_dir() or whole.name == "case.toml":
        return (whole if whole.is_dir() else whole.parent).name
    return whole.stem
