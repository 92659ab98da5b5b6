"""``chladni modes``: normal modes of a deck or case."""

from typing import Annotated

import typer

from ..progress import within
from ..results import to_json
from ..workflows.loaded_model import load_model
from ..workflows.modes import modes
from .run import Allow, DeckOrCase, Out, Pictures, Units, started


def run(
    source: DeckOrCase,
    count: Annotated[int, typer.Option(help="Number of modes.", min=1)] = 20,
    units: Units = None,
    allow: Allow = None,
    subcase: Annotated[
        int | None,
        typer.Option(help="Subcase whose supports apply; default: the first with modes.", min=0),
    ] = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Compute normal modes: frequencies, shapes, mass, energy of each part, VTU file, pictures."""
    from ..report.modes_page import as_page

    with started("modes", source, out, pictures=pictures) as job:
        job.progress("reading the model", 0.0)
        model = load_model(source, units, allow or (), subcase)
        found = modes(model, count, progress=within(job.progress, 0.0, 0.7))
        job.json("modes.json", to_json(found))
        job.progress("pictures", 0.7)
        job.show(as_page(job.folder, found))
