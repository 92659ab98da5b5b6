"""``chladni convert``: a deck of a model or mesh of another program."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ..errors import FileError
from ..fem.energy import mass_properties
from ..model.assembly import Assembly
from ..report.blocks import Table
from ..report.words import number
from ..units import UNITS
from ..workflows.convert import ConvertedModel, converted, with_guessed_units
from ..workflows.loaded_model import similar_names
from .console import say, say_table, watched


def run(
    source: Annotated[
        Path, typer.Argument(metavar="MODEL", help="A model or mesh of another program.")
    ],
    part: Annotated[
        list[str] | None,
        typer.Option(
            help="Properties of a part that has none: 'NAME: t=0.8 mm, steel', without a name for "
            "all parts, or a CSV with the columns part, t, material (repeatable)."
        ),
    ] = None,
    units: Annotated[
        str | None,
        typer.Option(
            help=f"Unit system of the model: {', '.join(UNITS)}; default: that of its materials."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="The deck; default: MODEL.bdf here.", metavar="FILE"),
    ] = None,
) -> None:
    """Make a Nastran deck of a model of another program.

    MODEL is an input file of Abaqus or CalculiX, an Ansys archive (.cdb), an LS-DYNA keyword file
    or a universal file. It may be a mesh that meshio reads: Gmsh, VTK, VTU, STL, MED and others.
    The deck has the numbers of the file. Whatever the deck does not have is listed.
    """
    if not source.is_file():
        raise FileError(f"no file {source}{similar_names(source)}")
    place = Path(f"{source.stem}.bdf") if out is None else out
    if place.exists():
        raise FileError(f"{place} exists and is not replaced; give another --out")
    with watched() as progress:
        progress("reading the model", 0.0)
        found = converted(source, units, part or ())
        if found is None:
            raise FileError(
                f"{source} is no model of another program that is known; a Nastran deck needs no "
                "conversion"
            )
        found, why = with_guessed_units(found)
        progress("checking the deck", 0.5)
        made = found.models.model().assembly
        found.write(place)
    _say(found, made, why, place)


def _say(found: ConvertedModel, made: Assembly, why: str, place: Path) -> None:
    """Counts, mass, parts, and all that was left out."""
    assert found.units is not None
    mass, _ = mass_properties(made)
    counts = (
        (len(made.shells), "shell", "s"),
        (sum(map(len, made.solids)), "solid", "s"),
        (len(made.beams), "beam", "s"),
        (len(made.springs) + len(made.bushes), "spring", "s"),
        (len(made.masses), "mass", "es"),
        (len(made.rigid), "constraint", "s"),
    )
    there = ", ".join(f"{n} {what}{s * (n > 1)}" for n, what, s in counts if n)
    say(f"{place}: {len(made.points)} grids, {there}; its mass is {number(mass, 6)} kg.")
    if why:
        say(why)
    of = [made.shells.part, made.beams.part, *(s.part for s in made.solids)]
    count = np.bincount(np.concatenate(of), minlength=len(made.parts))
    rows = [
        (str(p.id), p.name, type(p.section).__name__.removesuffix("Section").lower(), str(n))
        for p, n in zip(made.parts, count.tolist(), strict=True)
    ]
    say_table(Table(("id", "part", "section", "elements"), rows))
    if found.model.left_out:
        say("\nLeft out of the deck")
        lost = [(x.name, str(x.count), x.why) for x in found.model.left_out]
        say_table(Table(("in the file", "count", "why"), lost))
    say(f"next: chladni modes {place} --units {found.units.name}")
