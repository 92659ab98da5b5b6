"""``chladni map``: thickness after forming, from a simulation or a scan, onto a deck."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import FileError
from ..io.nastran import write_deck
from ..progress import within
from ..results import to_json
from ..units import units as unit_system
from ..workflows.loaded_model import load_deck
from ..workflows.map import map_formed
from .run import Allow, Out, Pictures, Units, started


def run(
    deck: Annotated[Path, typer.Argument(metavar="DECK", help="A Nastran deck.")],
    formed: Annotated[Path, typer.Argument(metavar="FORMED", help="The sheet after forming.")],
    units: Units = None,
    formed_units: Annotated[
        str | None, typer.Option(help="Unit system of the formed file; default: that of the deck.")
    ] = None,
    align: Annotated[
        bool, typer.Option("--align", help="Move the formed mesh onto the deck first.")
    ] = False,
    mirror: Annotated[
        bool, typer.Option("--mirror", help="Align, with a mirror image if only that fits.")
    ] = False,
    pair: Annotated[
        list[str] | None,
        typer.Option(help="Pair PART=ID of the deck and the formed mesh (repeatable)."),
    ] = None,
    guess: Annotated[
        bool,
        typer.Option(
            "--guess",
            help="Estimate the thinning of parts missing from the file by their curvature.",
        ),
    ] = False,
    allow: Allow = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Map the thickness of a forming simulation or a scan onto the shells of a deck.

    FORMED is an LS-DYNA keyword file, VTU or CSV with thickness, or a scan of both faces (STL, PLY,
    OBJ). Writes the deck with a thickness at every corner, and the error of the mapping.
    """
    from ..report.map_page import as_page

    place = "mirrored" if mirror else "aligned" if align else "as it lies"
    pairs = dict(_pair(text) for text in pair or []) or None
    other = None if formed_units is None else unit_system(formed_units)
    with started("map", deck, out, pictures=pictures) as job:
        job.progress("reading the deck", 0.0)
        model = load_deck(deck, units, allow or ()).model()
        stage = within(job.progress, 0.1, 0.7)
        found = map_formed(model, formed, other, place, pairs, guess, progress=stage)
        job.progress("writing", 0.7)
        assert model.deck is not None
        path = job.keep("mapped.bdf", "the deck with mapped thickness")
        write_deck(model.deck, path, found.changes)
        job.json("mapping.json", to_json(found))
        job.progress("pictures", 0.8)
        job.show(as_page(job.folder, found))


def _pair(text: str) -> tuple[str, int]:
    """PART=ID."""
    name, _, number = text.rpartition("=")
    if not name.strip() or not (number.strip().isdecimal() and number.isascii()):
        raise FileError(f"--pair {text!r} is not of the form PART=ID, for example inner=3")
    return name.strip(), int(number)
