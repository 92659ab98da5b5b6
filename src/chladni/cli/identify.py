"""``chladni identify``: modes of a recording."""

from pathlib import Path
from typing import Annotated

import typer

from ..case import load_case
from ..results import to_json
from ..workflows.identify import PoleChoice, identify
from ..workflows.loaded_model import is_case
from ..workflows.recordings_of import load_recordings
from .run import Out, Pictures, command_line, limits, started


def run(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="CASE_or_RECORDING", help="A folder with a case.toml, or a recording's file."
        ),
    ],
    band: Annotated[
        str, typer.Option(help="Band from:to [Hz]; default: the whole recording.")
    ] = "",
    quantity: Annotated[
        str,
        typer.Option(help="receptance, mobility or accelerance, if the file does not state it."),
    ] = "",
    averages: Annotated[
        int, typer.Option(help="Number of averages of the FRFs, which defines their noise.", min=1)
    ] = 1,
    drop: Annotated[
        list[float] | None, typer.Option(help="Frequency of a pole to leave out [Hz] (repeatable).")
    ] = None,
    pick: Annotated[
        list[float] | None, typer.Option(help="Frequency of a pole to add [Hz] (repeatable).")
    ] = None,
    states: Annotated[
        int | None,
        typer.Option(help="Use all poles of a state space of this order (subspace method)."),
    ] = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Identify poles, damping and shapes with standard deviations; write a state space."""
    from ..report.identification_page import as_page

    limit = limits(band) if band else None
    choice = PoleChoice(states, tuple(drop or ()), tuple(pick or ()))
    with started("identify", source, out, pictures=pictures) as job:
        is_one = source.exists() and is_case(source)
        read = load_case(source) if is_one else load_recordings(source, quantity or None)
        found = identify(read, limit, averages, choice, progress=job.progress)
        job.json("identified.json", to_json(found))
        job.show(as_page(job.folder, found, command_line()))
    found.trusted()
