"""``chladni test``: FRFs from time data, and what is wrong with a recording."""

from pathlib import Path
from typing import Annotated, cast

import typer

from ..case import load_case
from ..ema.frf_estimate import EstimateSettings, Excitation, Method
from ..results import to_json
from ..workflows.evaluation import evaluate_recordings
from ..workflows.loaded_model import is_case
from ..workflows.recordings_of import load_recordings
from .run import Out, Pictures, limits, started


def run(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="CASE_or_RECORDING", help="A folder with a case.toml, or a recording's file."
        ),
    ],
    excitation: Annotated[
        str,
        typer.Option(
            help="Excitation: hammer, burst, random, sine or multisine; default: detected."
        ),
    ] = "",
    method: Annotated[str, typer.Option(help="Estimator: H1, H2, Hv or LPM.")] = "H1",
    resolution: Annotated[
        float | None, typer.Option(help="Line spacing of continuous random [Hz].", min=1e-9)
    ] = None,
    exponential: Annotated[
        float | None, typer.Option(help="End value of the exponential window of a hammer test.")
    ] = None,
    band: Annotated[
        str, typer.Option(help="Band from:to [Hz]; default: the whole recording.")
    ] = "",
    quantity: Annotated[
        str,
        typer.Option(help="receptance, mobility or accelerance, if the file does not state it."),
    ] = "",
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Estimate FRFs with coherence and variance from time data; screen recordings for faults.

    The universal file it writes goes straight into a case.
    """
    from ..report.evaluation_page import as_page

    settings = EstimateSettings(
        cast(Excitation, excitation) if excitation else None,
        cast(Method, method),
        resolution,
        exponential,
        limits(band) if band else None,
    )
    with started("test", source, out, pictures=pictures) as job:
        job.progress("reading", 0.0)
        is_one = source.exists() and is_case(source)
        read = load_case(source) if is_one else load_recordings(source, quantity or None)
        found = evaluate_recordings(read, settings, progress=job.progress)
        job.json("test.json", to_json(found))
        job.show(as_page(job.folder, found))
