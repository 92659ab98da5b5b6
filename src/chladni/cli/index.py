"""``chladni index``: a page that lists the runs below a folder."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import FileError
from ..output import run_folder, write_text
from ..report.page import page_text
from ..report.run_list import index_page
from .console import say, say_results
from .run import folder_named


def run(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the runs.")] = Path(
        "runs"
    ),
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", help="Folder for index.html; default: DIR.", metavar="DIR", parser=folder_named
        ),
    ] = None,
) -> None:
    """List every run below a folder: command, case, date, verdict, Q before and after."""
    if not folder.is_dir():
        raise FileError(f"{folder} is no folder; give the one that holds the results")
    place = out or folder
    parts = index_page(folder, place)
    say(parts.lead)
    with run_folder(place, "index") as part:
        write_text(part / "index.html", page_text("Runs", parts.sections, lead=parts.lead))
    say_results(place / "index.html")
