"""``chladni next``: measurements that would separate what a diagnosis left open."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import FileError
from ..output import run_folder, write_json, write_text
from ..report.typed_fields import as_data
from ..report.verdict import next_measurements
from ..search.next_measurement import ADVISED, ODDS, advised, read_outlook
from .console import say, say_results, say_table
from .run import folder_named


def run(
    folder: Annotated[Path, typer.Argument(metavar="RUN_FOLDER", help="Folder of a diagnosis.")],
    count: Annotated[int, typer.Option(help="Number of measurements.", min=1)] = ADVISED,
    odds: Annotated[float, typer.Option(help="Odds that settle an explanation.", min=1.0)] = ODDS,
    without: Annotated[
        str, typer.Option(help="Kinds or dofs that cannot be measured, for example drive,614:n.")
    ] = "",
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="Folder for next.json and sensors.csv.",
            metavar="DIR",
            parser=folder_named,
        ),
    ] = None,
) -> None:
    """Say which further measurements would probably tell the open explanations apart.

    The forecasts come from the diagnosis: each explanation predicts the data of every candidate,
    with all that is not known under it.
    """
    known = read_outlook(folder)
    barred = [word.strip() for word in without.split(",") if word.strip()]
    names = {c.kind for c in known.candidates} | {c.label for c in known.candidates}
    if unknown := [word for word in barred if word not in names]:
        kinds = ", ".join(sorted({c.kind for c in known.candidates}))
        raise FileError(f"--without {unknown[0]}: this is no candidate; kinds are {kinds}")
    say(f"open: {', '.join(known.names)}")
    every = advised(known, count, odds, barred)
    if not every:
        say("none of the candidates tells these explanations apart")
        return
    say_table(next_measurements(every, odds))
    if out is not None:
        with run_folder(out, "next", [folder / "outlook.npz"]) as part:
            write_json(part / "next.json", {"open": known.names, "measurements": as_data(every)})
            labels = [m.label for m in every if m.kind == "sensor"]
            write_text(part / "sensors.csv", "label\n" + "".join(f"{n}\n" for n in labels))
        say_results(out)
