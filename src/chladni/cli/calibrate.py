"""``chladni calibrate``: ordinary parameters alone, no new physics."""

from pathlib import Path
from typing import Annotated

import typer

from .diagnose import answer, opened
from .run import Out, started


def run(
    source: Annotated[Path, typer.Argument(metavar="CASE")],
    out: Out = None,
) -> None:
    """Fit E, rho and t of the parts (or what the case frees); write the updated deck and a page."""
    with started("calibrate", source, out) as job:
        answer(job, opened(source), search=False)
