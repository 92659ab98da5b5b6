"""``chladni plan``: where to put sensors and shakers, and which lines to measure."""

from dataclasses import replace
from typing import Annotated

import typer

from chladni.cli.run import Allow, DeckOrCase, Out, Pictures, Units, started
from chladni.progress import within
from chladni.results import to_json
from chladni.workflows.loaded_model import model_in_si, opened

from . import PlanSettings
from .plan_summary import durations
from .plan_workflow import plan, with_places_of
from .smallest_findings import smallest_findings


def run(
    source: DeckOrCase,
    sensors: Annotated[int, typer.Option(help="Number of sensors.", min=1)] = 30,
    modes: Annotated[
        int | None,
        typer.Option(help="Number of elastic modes to distinguish; default: by --top.", min=1),
    ] = None,
    top: Annotated[
        float | None, typer.Option(help="Highest frequency of interest [Hz].", min=0.0)
    ] = None,
    shakers: Annotated[int, typer.Option(help="Number of simultaneous shakers.", min=1)] = 1,
    candidates: Annotated[int, typer.Option(help="Number of candidate places.", min=2)] = 300,
    spacing: Annotated[
        float, typer.Option(help="Minimum distance between sensors [m].", min=0.0)
    ] = 0.0,
    damping: Annotated[float, typer.Option(help="Expected damping ratio.", min=1e-6)] = 0.01,
    force: Annotated[
        float, typer.Option(help="Shaker force without rattling [N].", min=1e-9)
    ] = 5.0,
    alike: Annotated[
        float, typer.Option(help="Largest similarity of two modes (AutoMAC).", min=0.0, max=1.0)
    ] = 0.15,
    mass: Annotated[float, typer.Option(help="Mass of one sensor [kg].", min=0.0)] = 0.005,
    drawn: Annotated[
        int,
        typer.Option(
            "--drawn",
            "--ensemble",
            help="Number of models with random thickness that the layout must serve.",
            min=0,
            max=1000,
        ),
    ] = 20,
    detect: Annotated[
        bool,
        typer.Option(
            "--detect",
            help="Predict the smallest mass, softening and thinning that the layout finds.",
        ),
    ] = False,
    separate: Annotated[
        str,
        typer.Option(
            help="Let some of the sensors tell these effects apart, for example "
            "weld-missing,adhesive-stiffness, or the open explanations of a folder of a diagnosis."
        ),
    ] = "",
    region: Annotated[
        list[str] | None,
        typer.Option(
            help="Where sensors and shakers may be: a part, 'box x y z x y z' [m], a label or a "
            "CSV file of labels (repeatable)."
        ),
    ] = None,
    fixed: Annotated[
        list[str] | None,
        typer.Option(help="Sensor of the layout: 412:+Z or a table of sensors (repeatable)."),
    ] = None,
    forbidden: Annotated[
        list[str] | None,
        typer.Option(help="Where none may be, written as a region (repeatable)."),
    ] = None,
    cost: Annotated[
        list[str] | None,
        typer.Option(
            help="Cost of a sensor by place, else 1: inner=3, 412:n=5 or a CSV file with label or "
            "part, and cost (repeatable)."
        ),
    ] = None,
    noise: Annotated[
        float, typer.Option(help="Expected noise relative to |H|, for --detect.", min=1e-5, max=0.5)
    ] = 0.01,
    units: Units = None,
    allow: Allow = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Plan a test: sensors by effective independence and exchange, shaker, cords, duration."""
    settings = PlanSettings(
        sensors=sensors,
        modes=modes,
        f_max=top,
        damping=damping,
        candidates=candidates,
        spacing=spacing,
        actuators=shakers,
        force=force,
        alike=alike,
        mass=mass,
        draws=drawn,
        regions=region or (),
        fixed=fixed or (),
        forbidden=forbidden or (),
        cost=cost or (),
        separate=separate,
    )
    from .detectable_page import detectable_json, detectable_section
    from .plan_page import as_page
    from .separation_page import separation_in_words, separation_json

    with started("plan", source, out, pictures=pictures) as job:
        job.progress("reading the model", 0.0)
        given = opened(source, units, allow or ())
        settings = with_places_of(given, settings)
        model, said = model_in_si(given, "plan")
        job.note(model.notes)
        if said:
            job.say(said)
        found = plan(model, settings, progress=within(job.progress, 0.1, 0.6))
        job.json("plan.json", to_json(found))
        job.progress("pictures", 0.7)
        parts = as_page(job.folder, found)
        if detect:
            band, stage = durations(found).band_hz, within(job.progress, 0.8, 1.0)
            smallest = smallest_findings(model, job.folder / "plan.json", band, noise, stage)
            found_by_it = detectable_json(smallest)
            job.json("smallest.json", found_by_it, "smallest findings, place by place")
            section = detectable_section(model, smallest, noise)
            parts = replace(parts, sections=[*parts.sections, section])
        if found.separation is not None:
            job.say(" ".join(separation_in_words(found.separation)))
            job.json("separate.json", separation_json(found.separation), "what it separates")
        job.show(parts)
