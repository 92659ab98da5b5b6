"""``chladni report``: the page of a run again, from its JSON and its pictures."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import FileError
from ..report.blocks import Links, Section
from ..report.page import write_page


def run(
    folder: Annotated[Path, typer.Argument(metavar="RUN_FOLDER")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Where the page goes.", metavar="DIR")
    ] = None,
    title: Annotated[str, typer.Option(help="Title of the page.")] = "",
) -> None:
    """Write report.html of a diagnosis again: after a note was changed, or for another title."""
    diagnosis = read_diagnosis(folder)
    figures = {p.stem: p for p in sorted(folder.iterdir()) if p.suffix in (".png", ".gif", ".svg")}
    notes = [str(note) for note in diagnosis.get("notes") or []]
    tables = [Section("Pictures as files", [Links([(p.name, n) for n, p in figures.items()])])]
    page = write_page(out or folder, diagnosis, figures, notes, tables, title=title)
    typer.echo(f"results in {page}")


def read_diagnosis(folder: Path) -> dict[str, Any]:
    """``diagnosis.json`` of a run.

    Raises
    ------
    FileError
        If it is not there, or is no diagnosis.
    """
    path = folder / "diagnosis.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}; a run of `chladni diagnose` has one") from error
    except ValueError as error:
        raise FileError(f"{path} is no JSON: {error}") from error
    if not isinstance(found, dict) or "verdict" not in found:
        raise FileError(f"{path} holds no verdict, so it is no diagnosis")
    return found
