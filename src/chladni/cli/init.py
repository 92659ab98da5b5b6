"""``chladni init``: a commented case.toml and sensors.csv from a deck and a recording."""

from pathlib import Path
from typing import Annotated

import typer

from ..case import Case, load_case
from ..errors import ChladniError, FileError
from ..output import write_text
from ..workflows.case_check import NO_RECORDING, check
from ..workflows.case_draft import CaseDraft, case_text, draft, said_of, sensors_text
from ..workflows.ready_case import refuse_without_effects
from .console import say, watched
from .run import Allow, Mass, Out, Recordings, SensorTable, Units, place_of, started


def run(
    source: Annotated[Path, typer.Argument(metavar="DECK", help="A Nastran deck.")],
    recordings: Recordings = None,
    sensors: SensorTable = None,
    quantity: Annotated[
        str | None,
        typer.Option(help="receptance, mobility or accelerance, if the file does not state it."),
    ] = None,
    mass: Mass = None,
    units: Units = None,
    allow: Allow = None,
    out: Out = None,
) -> None:
    """Draft a case: guess units, match labels to the deck, list missing words."""
    if mass is not None and not 0 < mass < 1e9:
        raise FileError(f"--mass {mass:g}: a weighed mass must be above zero, in kg")
    place = place_of("init", source, out)
    taken = [n for n in ("case.toml", "sensors.csv") if (place / n).exists()]
    if taken:
        raise FileError(f"{place / taken[0]} exists and is not replaced; give another --out")
    made = draft(source, recordings or (), units, quantity, sensors, mass, allow or ())
    with started("init", source, place, listed=False) as job:
        write_text(job.folder / "case.toml", case_text(made, place))
        if made.dofs:
            write_text(job.folder / "sensors.csv", sensors_text(made))
        for sentence in _sentences(made):
            job.say(sentence)
    say(_next(place, made))


def _sentences(made: CaseDraft) -> list[str]:
    out = [f"units = {made.units.name}: {made.units_why}", *(said_of(r) for r in made.read)]
    if made.dofs:
        out.append(f"outputs and inputs: {made.found}")
    return [*out, *made.notes, *(f"missing: {text}" for text in made.missing)]


def _next(place: Path, made: CaseDraft) -> str:
    """State if the case can be used, else the first reason why a comparison would refuse it."""
    if made.nowhere:
        return "not complete yet: no output or input has a place; add rows to sensors.csv"
    try:
        case = load_case(place)
    except ChladniError as error:
        return f"not complete yet: {error}"
    if not made.read:
        return f"not complete yet: there is no recording; {NO_RECORDING}"
    if why := _refusal(case):
        return f"not ready yet: {why}; next: chladni check {place}"
    said = "can be used; what is missing would improve it" if made.missing else "is complete"
    return f"the case {said}; next: chladni check {place}"


def _refusal(case: Case) -> str:
    """The first reason why diagnose would refuse the case before its fit; "" for none."""
    try:
        refuse_without_effects(case)
        with watched() as progress:
            faults = check(case, progress=progress).faults
    except ChladniError as error:
        return str(error).removeprefix(f"{case.path}: ")
    return f"{faults[0].text}; {faults[0].remedy}" if faults else ""
