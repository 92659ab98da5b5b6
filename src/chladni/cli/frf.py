"""``chladni frf``: frequency response functions of a deck or case."""

from pathlib import Path
from typing import Annotated, cast

import numpy as np
import typer

from ..case import Case, load_case
from ..dynamics.frf import FRF, UNIT, Quantity
from ..errors import FileError, LabelError
from ..fem.measured_dofs import MeasuredDofs
from ..io.tables.write_tables import write_csv, write_npz
from ..io.uff.write_uff import write_uff
from ..progress import within
from ..report.response_page import response_json, response_page
from ..workflows.frf import Side, frf, placed_layout
from ..workflows.loaded_model import (
    DeckModels,
    Model,
    as_model,
    is_case,
    load_deck,
    load_model,
)
from .run import (
    MOST_LINES,
    Allow,
    Answering,
    Damping,
    DeckOrCase,
    Driven,
    Kind,
    Out,
    Pictures,
    Run,
    Units,
    limits,
    started,
)


def run(
    source: DeckOrCase,
    input: Driven = None,
    output: Answering = None,
    band: Annotated[str, typer.Option(help="Band from:to [Hz].")] = "1:200",
    lines: Annotated[int, typer.Option(help="Number of frequencies.", min=2, max=MOST_LINES)] = 800,
    damping: Damping = 0.01,
    quantity: Kind = "accelerance",
    units: Units = None,
    allow: Allow = None,
    sensors: Annotated[
        Path | None,
        typer.Option(help="Outputs and, without --input, inputs: plan.json or a table of sensors."),
    ] = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Compute frequency responses between degrees of freedom.

    Without --input and --sensors: the responses that the deck requests, or those of the first
    recording of a case.
    """
    low, high = limits(band)
    per_force = [name for name in UNIT if name != "transmissibility"]
    if quantity not in per_force:
        raise LabelError(f"no quantity {quantity!r}; there are {', '.join(per_force)}")
    with started("frf", source, out, pictures=pictures) as job:
        job.progress("reading the model", 0.0)
        if sensors is not None and output:
            raise FileError("--sensors defines the outputs; leave out --output")
        driven = bool(input) or sensors is not None
        given = _source(source, driven, units, allow or [])
        f = np.linspace(low, high, lines) if driven else None
        stage = within(job.progress, 0.1, 0.9)
        ends: tuple[Side, Side] = (output or (), input or ())
        if sensors is not None:
            given, *placed = placed_layout(as_model(given, "frf"), sensors, input or ())
            ends = (placed[0], placed[1])
        found = frf(given, *ends, f, damping, progress=stage)
        job.note(found.notes)
        for k, one in enumerate(found.frfs):
            if one.quantity != "transmissibility":
                one = one.to(cast(Quantity, quantity))
            stem = f"frf_{k + 1}" if k else "frf"
            _written(job, stem, one, given, ends)
            job.show(response_page(one))


def _written(
    job: Run, stem: str, one: FRF, given: Case | Model | DeckModels, ends: tuple[Side, Side]
) -> None:
    """The responses in every format that can hold them."""
    write_npz(job.keep(f"{stem}.npz", "the responses as arrays"), one)
    write_csv(job.keep(f"{stem}.csv", "the responses as a table"), one)
    model = as_model(given)
    what = "channels, peaks and levels"
    job.json(f"{stem}.json", response_json(one, bool(model.unit)), what)
    if not model.unit:
        job.notes.append("A universal file of the responses needs the unit system (--units).")
        return
    nodes = dict(zip(model.assembly.ids.tolist(), model.assembly.points, strict=True))
    named = [text.partition(":")[0] for text in (*one.outputs, *one.inputs)]
    places = {int(n): nodes[int(n)] for n in named if n.isdecimal() and int(n) in nodes}
    for side in ends:
        if isinstance(side, MeasuredDofs):
            places |= side.nodes
    path = job.folder / f"{stem}.uff"
    try:
        write_uff(path, one, places, title=job.source.name)
    except FileError as error:
        job.notes.append(f"No universal file was written: {error}.")
        return
    job.files.append((path.name, "the responses as a universal file (dataset 58)"))


def _source(
    source: Path, driven: bool, units: str | None, allow: list[str]
) -> Case | Model | DeckModels:
    """A model where the user says how it is driven, else what says so itself."""
    if driven:
        return load_model(source, units, allow, command="frf")
    return load_case(source) if is_case(source) else load_deck(source, units, allow)
