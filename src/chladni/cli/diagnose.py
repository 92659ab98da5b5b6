"""``chladni diagnose``: the name of the physics a deck left out, and the deck with it."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from ..workflows.diagnose import diagnose
from .run import DeckOrCase, Mass, Out, Pictures, Recordings, SensorTable, Units, diagnosed, stated


def run(
    source: DeckOrCase,
    recordings: Recordings = None,
    sensors: SensorTable = None,
    mass: Mass = None,
    units: Units = None,
    earlier: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN",
            help="Folder of an answer about the same object from other data: its odds and "
            "posterior are the prior.",
        ),
    ] = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Name the missing physics, write the updated deck, diagnosis.json and a page."""
    words = stated(sensors=sensors, mass=mass, units=units)
    workflow = diagnose if earlier is None else partial(diagnose, earlier=earlier)
    diagnosed("diagnose", source, out, workflow, pictures, recordings or (), words)
