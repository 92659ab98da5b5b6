"""``chladni calibrate``: free the ordinary parameters of the deck, nothing added."""

from pathlib import Path
from typing import Annotated

import typer

from .correlate import opened
from .diagnose import finished
from .run import Out, started


def run(source: Annotated[Path, typer.Argument(metavar="CASE")], out: Out = None) -> int:
    """Fit the deck's own parameters, with intervals and a score on data the fit never saw."""
    from ..updating.run import calibrate_case

    with started("calibrate", source, out) as job:
        case, model = opened(source)
        return finished(job, case, model, calibrate_case, "Calibration")
