"""``chladni identify``: modes of a recording."""

from pathlib import Path
from typing import Annotated

import typer

from ..case import load_case
from ..report.result_json import to_json
from ..workflows.identify import PoleChoice, identify
from ..workflows.loaded_model import is_case
from ..workflows.recordings_of import load_recordings
from .run import Out, limits, started


def run(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="CASE_or_RECORDING", help="A folder with a case.toml, or a recording's file."
        ),
    ],
    band: Annotated[str, typer.Option(help="From and to, in Hz; default the whole.")] = "",
    quantity: Annotated[
        str, typer.Option(help="receptance, mobility, ... where the file does not say.")
    ] = "",
    averages: Annotated[
        int, typer.Option(help="Averages of the estimate, for the noise.", min=1)
    ] = 1,
    drop: Annotated[
        list[float] | None, typer.Option(help="A pole to leave out, by its frequency in Hz.")
    ] = None,
    pick: Annotated[
        list[float] | None, typer.Option(help="A pole to put in, by its frequency in Hz.")
    ] = None,
    states: Annotated[
        int | None,
        typer.Option(help="All poles of a state space of that order, by the subspace road."),
    ] = None,
    out: Out = None,
) -> None:
    """Poles with their spread, damping, shapes; a stabilisation diagram, the fit, a state space."""
    from ..report.identification_page import identification_page

    limit = limits(band) if band else None
    choice = PoleChoice(states, tuple(drop or ()), tuple(pick or ()))
    with started("identify", source, out) as job:
        is_one = source.exists() and is_case(source)
        read = load_case(source) if is_one else load_recordings(source, quantity or None)
        found = identify(read, limit, averages, job.progress, choice)
        job.json("identified.json", to_json(found))
        job.show(identification_page(job.folder, found))
    found.trusted()
