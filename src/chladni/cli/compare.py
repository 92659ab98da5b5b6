"""``chladni compare``: two runs next to each other."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import FileError, did_you_mean
from ..report.run_comparison import compared_runs
from ..report.run_list import FinishedRun, finished_run
from .run import Out, started

Folder = Annotated[Path, typer.Argument(metavar="RUN_FOLDER", help="Folder of a run.")]


def run(first: Folder, second: Folder, out: Out = None) -> None:
    """Put two runs next to each other: results, values, charts of the same quantities."""
    runs = [_opened(folder) for folder in (first, second)]
    name = f"compare-{'-'.join(r.folder.resolve().name for r in runs)}"
    place = out or Path("runs") / name
    with started("compare", first, place) as job:
        job.show(compared_runs(runs[0], runs[1], place))


def _opened(folder: Path) -> FinishedRun:
    found = finished_run(folder)
    if found is None:
        known = [p.name for p in folder.absolute().parent.glob("*") if finished_run(p)]
        near = did_you_mean(folder.name, known)
        raise FileError(f"{folder} is no folder of a run: {near}it has no run.json by chladni")
    return found
