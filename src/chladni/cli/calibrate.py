"""``chladni calibrate``: ordinary parameters alone, no new physics."""

from pathlib import Path
from typing import Annotated

import typer

from ..workflows.calibrate import calibrate
from .run import Out, diagnosed


def run(
    source: Annotated[Path, typer.Argument(metavar="CASE")],
    out: Out = None,
) -> None:
    """Fit E, rho and t of the parts (or what the case frees); write the updated deck and a page."""
    diagnosed("calibrate", source, out, calibrate)
