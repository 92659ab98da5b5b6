"""``chladni frf``: frequency response functions of a deck or case."""

from pathlib import Path
from typing import Annotated, cast

import numpy as np
import typer

from ..case import Case, load_case
from ..dynamics.frf import UNIT, Quantity
from ..errors import LabelError
from ..io.tables.write_tables import write_npz
from ..progress import within
from ..workflows.frf import frf
from ..workflows.loaded_model import DeckModels, Model, is_case, load_deck, load_model
from .run import Allow, Out, Units, limits, started


def run(
    source: Annotated[Path, typer.Argument(metavar="DECK_or_CASE")],
    input: Annotated[
        list[str] | None, typer.Option("--input", help="Where it is driven: 12:+Z, 12:n, base:+Z.")
    ] = None,
    output: Annotated[
        list[str] | None, typer.Option("--output", help="Where it answers: 55:+Z, 55:n.")
    ] = None,
    band: Annotated[str, typer.Option(help="From and to, in Hz.")] = "1:200",
    lines: Annotated[int, typer.Option(help="How many frequencies.", min=2)] = 800,
    damping: Annotated[float, typer.Option(help="Damping ratio of every mode.", min=0)] = 0.01,
    quantity: Annotated[
        str, typer.Option(help="receptance, mobility or accelerance.")
    ] = "accelerance",
    units: Units = None,
    allow: Allow = None,
    out: Out = None,
) -> None:
    """Frequency responses between degrees of freedom.

    Without --input those the deck asks for, or of a case those its first recording holds.
    """
    from ..report.response_page import response_page

    low, high = limits(band)
    per_force = [name for name in UNIT if name != "transmissibility"]
    if quantity not in per_force:
        raise LabelError(f"no quantity {quantity!r}; there are {', '.join(per_force)}")
    with started("frf", source, out) as job:
        job.progress("reading the model", 0.0)
        given = _source(source, bool(input), units, allow or [])
        f = np.linspace(low, high, lines) if input else None
        stage = within(job.progress, 0.1, 0.9)
        found = frf(given, output or (), input or (), f, damping, stage)
        job.notes.extend(found.notes)
        for k, one in enumerate(found.frfs):
            if one.quantity != "transmissibility":
                one = one.to(cast(Quantity, quantity))
            name = f"frf_{k + 1}.npz" if k else "frf.npz"
            write_npz(job.keep(name, "the responses as arrays"), one)
            job.show(response_page(job.folder, one))


def _source(
    source: Path, driven: bool, units: str | None, allow: list[str]
) -> Case | Model | DeckModels:
    """A model where the user says how it is driven, else what says so itself."""
    if driven:
        return load_model(source, units, allow)
    return load_case(source) if is_case(source) else load_deck(source, units, allow)
