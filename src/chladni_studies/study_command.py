"""``chladni study``: parameters of a model sampled, on this machine or on a cluster."""

import sys
from typing import Annotated, cast

import typer

from chladni.cli.console import say, watched
from chladni.cli.run import (
    MOST_LINES,
    Allow,
    Answering,
    Damping,
    DeckOrCase,
    Driven,
    Kind,
    Out,
    Pictures,
    Units,
    limits,
    place_of,
    started,
)
from chladni.dynamics.frf import Quantity
from chladni.errors import AccuracyError, FileError
from chladni.progress import Progress
from chladni.results import to_json
from chladni.workflows.loaded_model import is_case

from .parameter_study import study
from .study_settings import StudySettings
from .study_store import write_samples
from .workers import NO_WORKER


def run(
    source: DeckOrCase,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help='Parameter and range (repeatable), in the deck\'s units: "t of inner=0.6:0.8", '
            '"K of PBUSH 7=10:1e4:log". In per cent of the deck\'s value: "E=90%:110%". An effect: '
            '"point-mass at 412=1e-5:2e-4" (10 to 200 g in mm-t-s). Default: the [[parameter]] of '
            "the case."
        ),
    ] = None,
    samples: Annotated[int, typer.Option(help="Maximum number of samples.")] = 100,
    sampler: Annotated[
        str,
        typer.Option(
            help="Sampler: sobol, lhs, grid, oat (one at a time), saltelli (Sobol' indices), "
            "morris."
        ),
    ] = "sobol",
    seed: Annotated[int, typer.Option(help="Random seed of the samplers.")] = 0,
    modes: Annotated[int, typer.Option(help="Number of elastic modes in the results.")] = 10,
    input: Driven = None,
    output: Answering = None,
    band: Annotated[str, typer.Option(help="Band of the responses [Hz].")] = "1:200",
    lines: Annotated[int, typer.Option(help="Number of frequencies.", min=2, max=MOST_LINES)] = 400,
    damping: Damping = 0.01,
    quantity: Kind = "accelerance",
    frf: Annotated[bool, typer.Option("--frf", help="Keep every sample's responses.")] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            help="Number of local processes; default: one per core, or the current process for a "
            "short study."
        ),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, for example tcp://host:8786.")
    ] = None,
    units: Units = None,
    allow: Allow = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Sample parameters: frequencies, mass, responses, Q of every sample, and sensitivities.

    The same command continues a stopped study. Every finished sample is a line of
    samples.jsonl in --out.
    """
    settings = StudySettings(
        samples, sampler, seed, modes, tuple(output or ()), tuple(input or ()), limits(band),
        lines, damping, cast(Quantity, quantity), frf,
    )  # fmt: skip
    if frf and not (input or is_case(source)):
        raise FileError("--frf needs --input and --output, or a case with FRFs")
    place = place_of("study", source, out)
    with watched() as stage:
        progress = stage if sys.stderr.isatty() else _both(stage, _tenths())
        found = study(
            source, vary or (), settings, out=place, workers=workers, scheduler=scheduler,
            units=units, allow=allow or (), progress=progress,
        )  # fmt: skip
    from .study_page import as_page
    from .study_tables import write_netcdf

    with started("study", source, place, pictures=pictures) as job:
        job.json("study.json", to_json(found))
        write_samples(job.keep("samples.csv", "one line per sample"), found.table())
        job.notes += write_netcdf(job.keep("study.nc", "all results, for xarray"), found)
        job.files.append(("samples.jsonl", "the samples in the order they finished"))
        job.progress("pictures", 0.5)
        job.show(as_page(job.folder, found))
    if 2 * len(found.failed) > len(found.rows):
        number, why = found.failed[0]
        raise AccuracyError(
            f"{len(found.failed)} of {len(found.rows)} samples failed, the first of them, "
            f"{number}: {why}"
        )


def _both(one: Progress, other: Progress) -> Progress:
    def report_progress(what: str, share: float) -> None:
        one(what, share)
        other(what, share)

    return report_progress


def _tenths() -> Progress:
    """A line per tenth of the samples, and one of a wait, where there is no terminal for a bar."""
    said = {-1}

    def report_progress(what: str, share: float) -> None:
        tenth = int(10 * share)
        if what == NO_WORKER:
            say(what, error=True)
        elif tenth not in said and 0 < share <= 1:
            said.add(tenth)
            say(what, error=True)

    return report_progress
