"""``chladni plan``: where to put sensors, shaker and cords, which lines to measure."""

from pathlib import Path
from typing import Annotated

import typer

from ..output import write_text
from .model import load_model
from .run import Out, Units, started


def run(
    source: Annotated[Path, typer.Argument(metavar="DECK_or_CASE")],
    sensors: Annotated[int, typer.Option(help="Uniaxial sensors at hand.", min=1)] = 30,
    modes: Annotated[
        int | None, typer.Option(help="Target modes (default: 24, or 4/5 of the sensors).", min=1)
    ] = None,
    top: Annotated[float | None, typer.Option(help="Highest frequency of interest [Hz].")] = None,
    shakers: Annotated[int, typer.Option(help="Shakers that work together.", min=1)] = 1,
    damping: Annotated[float, typer.Option(help="Expected damping ratio.", min=1e-6)] = 0.01,
    candidates: Annotated[int, typer.Option(help="Places looked at.", min=2)] = 300,
    spacing: Annotated[float, typer.Option(help="Least distance of sensors [m].", min=0)] = 0.0,
    mass: Annotated[float, typer.Option(help="Mass of a sensor [kg].", min=0)] = 0.005,
    draws: Annotated[
        int, typer.Option(help="Models drawn with uncertain thickness; 0: the deck alone.", min=0)
    ] = 0,
    units: Units = None,
    out: Out = None,
) -> None:
    """Test plan: sensors by effective independence and exchange, shaker, cords, lines, duration."""
    from ..planning import Wishes, page, plan, sensors_csv, summary

    with started("plan", source, out) as job:
        job.progress("reading the model", 0.0)
        model = load_model(source, units)
        wishes = Wishes(
            sensors, modes, top, damping, candidates, spacing, shakers, mass=mass, draws=draws
        )
        built = model.structure
        found = plan(model.assembly, wishes, built=built, unit=model.unit, progress=job.progress)
        result = summary(found)
        job.json("plan.json", result)
        write_text(job.keep("sensors.csv", "sensors and shaker for a case"), sensors_csv(found))
        job.progress("pictures", 0.9)
        job.sections += page.sections(found, result, model.seen, built, job.folder)
        job.files += page.PICTURES.items()
        job.notes += page.notes(found)
        job.lead = page.lead(result)
        job.say(job.lead)
