"""``chladni report``: the page of a run again, from its JSON and its pictures."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ..output import run_folder
from ..report.blocks import Links, Section
from ..report.diagnosis_json import read_diagnosis
from ..report.drawings import drawings_of
from ..report.page import write_page
from .console import say_results
from .run import folder_named

_OUT = "Folder for the page; default: RUN_FOLDER, in place of the page there."


def run(
    folder: Annotated[
        Path, typer.Argument(metavar="RUN_FOLDER", help="Results of diagnose or calibrate.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", help=_OUT, metavar="DIR", parser=folder_named),
    ] = None,
    title: Annotated[str, typer.Option(help="Title of the page.")] = "",
) -> None:
    """Write report.html of a diagnosis again, for example with a changed note or title."""
    result = read_diagnosis(folder)
    files = [p for p in sorted(folder.iterdir()) if not p.is_symlink()]
    figures = {p.stem: p for p in files if p.suffix in (".png", ".gif", ".svg")}
    tables = [Section("Pictures as files", [Links([(p.name, n) for n, p in figures.items()])])]
    shared, old = drawings_of(folder / "report.html")
    about: dict[str, Any] = {"title": title, "drawn": old, "shared": shared}
    if out is None or out.resolve() == folder.resolve():
        page = write_page(folder, result, figures, result.notes, tables, **about)
    else:
        with run_folder(out, "report", [folder / "diagnosis.json"]) as part:
            write_page(part, result, figures, result.notes, tables, **about)
        page = out / "report.html"
    say_results(page)
