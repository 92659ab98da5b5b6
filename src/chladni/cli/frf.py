"""``chladni frf``: frequency response functions of a deck or case."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, cast

import numpy as np
import typer

from ..dynamics.coupled import coupled_receptance
from ..dynamics.frf import FRF, Quantity, residual_flexibility
from ..ema.tables_write import write_npz
from ..errors import FileError, LabelError
from ..report.blocks import Picture, Table
from ..report.words import number
from .model import Model, load_model
from .run import Out, Run, Units, started

UNIT = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s²/N"}


def run(
    source: Annotated[Path, typer.Argument(metavar="DECK_or_CASE")],
    input: Annotated[list[str], typer.Option("--input", help="Where it is driven, as 12:+Z.")],
    output: Annotated[list[str], typer.Option("--output", help="Where it answers, as 55:+Z.")],
    band: Annotated[str, typer.Option(help="From and to, in Hz.")] = "1:200",
    lines: Annotated[int, typer.Option(help="How many frequencies.", min=2)] = 800,
    damping: Annotated[float, typer.Option(help="Damping ratio of every mode.", min=0)] = 0.01,
    quantity: Annotated[
        str, typer.Option(help="receptance, mobility or accelerance.")
    ] = "accelerance",
    units: Units = None,
    out: Out = None,
) -> None:
    """Frequency responses between degrees of freedom, with what higher modes contribute."""
    low, high = limits(band)
    if quantity not in UNIT:
        raise LabelError(f"no quantity {quantity!r}; there are {', '.join(UNIT)}")
    with started("frf", source, out) as job:
        job.progress("reading the model", 0.0)
        model = load_model(source, units)
        frequency = np.linspace(low, high, lines)
        found = response(job, model, output, input, frequency, damping)
        found = found.to(cast(Quantity, quantity))
        write_npz(job.keep("frf.npz", "the responses as arrays"), found)
        _page(job, found)


def limits(text: str) -> tuple[float, float]:
    """A band as two numbers [Hz].

    >>> limits("20:200")
    (20.0, 200.0)
    """
    try:
        low, high = (float(x) for x in text.replace(",", ":").split(":"))
    except ValueError:
        raise FileError(f"--band {text!r} is not of the form 20:200") from None
    if not 0 <= low < high:
        raise FileError(f"--band {text!r} must increase and not be negative")
    return low, high


def response(
    job: Run,
    model: Model,
    outputs: Sequence[str],
    inputs: Sequence[str],
    frequency: np.ndarray,
    damping: float,
) -> FRF:
    """Receptance by modes up to twice the band and the static rest of the others."""
    from ..dynamics.eigen import normal_modes

    s = model.structure
    pick, load = (model.directions(labels).T.toarray() for labels in (outputs, inputs))
    job.progress(f"modes of {len(s.system.dofs)} degrees of freedom", 0.2)
    modal = normal_modes(s.system, band=2 * frequency[-1], points=model.places)
    if not len(modal):
        modal = normal_modes(s.system, 1, points=model.places)
    modal = modal.with_damping(damping)
    job.progress("residual of higher modes", 0.6)
    rest = residual_flexibility(s.system, modal, pick, load, points=model.places)
    phi_o, phi_i = pick.T @ modal.shapes, load.T @ modal.shapes
    loss = s.hysteretic().K.imag
    H = coupled_receptance(modal, phi_o, phi_i, frequency, V=s.system.V, loss=loss, residual=rest)
    job.notes.append(
        f"{len(modal)} modes up to {number(2 * frequency[-1])} Hz were superposed with damping "
        f"ratio {number(damping)}; what higher modes contribute was added as a static residual."
    )
    return FRF(H, frequency, tuple(outputs), tuple(inputs))


def _page(job: Run, found: FRF) -> None:
    from ..view import plots

    pictures = []
    for j, drive in enumerate(found.inputs):
        for i, answer in enumerate(found.outputs[:12]):
            name = f"frf_{answer}_from_{drive}.png".replace(":", "_").replace("+", "p")
            title, curve = f"{answer} from {drive}", (found.frequency, found.values[:, i, j])
            path = job.keep(name, title)
            plots.frf(path, {"model": curve}, title, UNIT[found.quantity])
            pictures.append(Picture(path))
    peak = np.abs(found.values).max(axis=0)
    at = found.frequency[np.abs(found.values).argmax(axis=0)]
    rows = [
        (answer, drive, number(peak[i, j]), number(at[i, j]))
        for i, answer in enumerate(found.outputs)
        for j, drive in enumerate(found.inputs)
    ]
    heads = ("output", "input", f"largest [{UNIT[found.quantity]}]", "at [Hz]")
    f = found.frequency
    job.lead = f"{len(rows)} {found.quantity} functions from {number(f[0])} to {number(f[-1])} Hz."
    job.section("Responses", [*pictures, Table(heads, rows, ("output", "input"))])
    job.say(job.lead)
