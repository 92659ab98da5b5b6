"""``chladni calibrate``: calibration parameters alone, no new physics."""

from functools import partial
from typing import Annotated

import typer

from ..workflows.calibrate import calibrate
from .run import (
    DeckOrCase,
    Mass,
    Out,
    Pictures,
    Recordings,
    SensorTable,
    Units,
    diagnosed,
    opened,
    started,
    stated,
)


def run(
    source: DeckOrCase,
    recordings: Recordings = None,
    variants: Annotated[
        bool,
        typer.Option(
            "--variants",
            help="Fit the deck with other models of its welds, adhesive and screws; compare them.",
        ),
    ] = False,
    sample: Annotated[
        bool,
        typer.Option(
            "--sample",
            help="Draw from the posterior (needs emcee: pip install 'chladni[posterior]').",
        ),
    ] = False,
    sensors: SensorTable = None,
    mass: Mass = None,
    units: Units = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Fit E, rho and t of the parts, or the case's parameters; write the updated deck and a page.

    Choose modes by their frequency: [band] fit and exclude in case.toml.
    """
    if variants and sample:
        raise typer.BadParameter("--sample draws for one model; leave out --variants")
    words = stated(sensors=sensors, mass=mass, units=units)
    if variants:
        from ..report.joint_models_page import as_page
        from ..results import to_json
        from ..workflows.joint_models import joint_models

        with started("calibrate", source, out) as job:
            found = joint_models(opened(source, recordings or (), words), progress=job.progress)
            job.json("variants.json", to_json(found))
            job.show(as_page(job.folder, found))
    else:
        fit = partial(calibrate, sample=sample)
        diagnosed("calibrate", source, out, fit, pictures, recordings or (), words)
