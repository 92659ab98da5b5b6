"""``chladni diagnose``: the name of the physics a deck left out, and the deck with it."""

from pathlib import Path
from typing import Annotated

import typer

from ..workflows.diagnose import diagnose
from .run import Out, diagnosed


def run(
    source: Annotated[Path, typer.Argument(metavar="CASE")],
    out: Out = None,
) -> None:
    """Name the missing physics, write the updated deck, diagnosis.json and a page."""
    diagnosed("diagnose", source, out, diagnose)
