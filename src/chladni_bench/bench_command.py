"""``chladni bench``: a virtual test of a case or a deck, and the case it leaves."""

import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Annotated, cast

import typer

from chladni.arrays import real_number
from chladni.case import Case, load_case
from chladni.case.load import OUTSIDE
from chladni.case.sensor_places import placed
from chladni.cli.run import Allow, DeckOrCase, Out, Pictures, Units, limits, started
from chladni.errors import FileError, named
from chladni.fem.modelled import modelled
from chladni.io.tables.sensor_table import exciter, with_input
from chladni.output import write_text
from chladni.progress import Progress, within
from chladni.results import to_json
from chladni.search.silent_dofs import silent_sensors
from chladni.workflows.loaded_model import is_case, load_deck, similar_names
from chladni_planning import PlanSettings, plan_test, sensors_csv

from .bench_workflow import BenchSettings, virtual_test
from .drive_signals import Kind


def run(
    source: DeckOrCase,
    excitation: Annotated[
        str, typer.Option(help="burst-random, stepped-sine, multisine or hammer.")
    ] = "burst-random",
    band: Annotated[str, typer.Option(help="Band from:to [Hz]; default: that of the case.")] = "",
    level: Annotated[
        float | None,
        typer.Option(
            help="Force level [N]; default: the largest channel uses a quarter of its range.",
            min=1e-9,
        ),
    ] = None,
    levels: Annotated[str, typer.Option(help="Factors on the level, for example 0.5,1,2.")] = "1",
    articles: Annotated[
        int, typer.Option(help="Number of articles, each with its own scatter.")
    ] = 1,
    exact: Annotated[bool, typer.Option("--exact", help="Articles without scatter.")] = False,
    finer: Annotated[
        bool, typer.Option("--finer", help="Give the articles a mesh of half the element size.")
    ] = False,
    hide: Annotated[
        list[str] | None, typer.Option(help="Effect to conceal, by its name (repeatable).")
    ] = None,
    local: Annotated[
        list[str] | None,
        typer.Option(
            help="Conceal a local nonlinearity: clearance, cubic-spring or friction (repeatable)."
        ),
    ] = None,
    resolution: Annotated[
        float, typer.Option(help="Line spacing of bursts and multisines [Hz].", min=1e-3)
    ] = 0.05,
    averages: Annotated[
        int, typer.Option(help="Number of bursts, multisine periods or blows.", min=2)
    ] = 20,
    sweeps: Annotated[int, typer.Option(help="Number of sweeps of a stepped sine.", min=1)] = 5,
    delay: Annotated[
        float, typer.Option(help="Minimum wait of a stepped sine at every line [cycles].", min=0)
    ] = 0.0,
    rubber: Annotated[
        bool, typer.Option("--rubber", help="Add rubber at the cords' ends to damp them.")
    ] = False,
    room: Annotated[
        float,
        typer.Option(
            help="Motion of the median sensor from sound and floor [m/s² rms in the band].", min=0
        ),
    ] = 0.0,
    time: Annotated[bool, typer.Option("--time", help="Write the time data too.")] = False,
    seed: Annotated[int, typer.Option(help="Random seed.", min=0)] = 0,
    sensors: Annotated[
        Path | None,
        typer.Option(help="Table of sensors for a bare deck; default: a planned layout."),
    ] = None,
    input: Annotated[
        str,
        typer.Option(
            help="Drive point of a bare deck: 12:+Z, 12:n, or base:+Z for a shaker table that "
            "moves its supports; default: from the table of sensors or the plan."
        ),
    ] = "",
    add: Annotated[
        Path | None,
        typer.Option(
            help="plan.json of chladni next: test the same article again, in these places too."
        ),
    ] = None,
    units: Units = None,
    allow: Allow = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Test a structure on the virtual bench: articles, shaker, sensors, front end, recordings.

    It writes a case (--out/case) that every other command accepts, and next to it the sealed truth.
    """
    settings = BenchSettings(
        excitation=cast(Kind, excitation),
        band=limits(band) if band else None,
        level=level,
        levels=_factors(levels),
        articles=articles,
        seed=seed,
        hide=tuple(hide or ()),
        local=tuple(local or ()),
        exact=exact,
        finer=finer,
        resolution=resolution,
        averages=averages,
        sweeps=sweeps,
        delay=delay,
        rubber=rubber,
        room=room,
        keep_time=time,
    )
    from .bench_folder import write_bench
    from .bench_page import as_page

    with started("bench", source, out, pictures=pictures) as job:
        job.progress("reading", 0.0)
        with tempfile.TemporaryDirectory() as scratch:
            stage = within(job.progress, 0.0, 0.2)
            case = _case(source, units, allow or [], sensors, input, Path(scratch), stage)
            if add is not None:
                case, added = _with_added(case, add)
                settings = replace(settings, added=added)
            found = virtual_test(case, settings, progress=within(job.progress, 0.2, 0.95))
            job.progress("writing", 0.95)
            job.files += write_bench(job.folder, case, found)
        job.json("bench.json", to_json(found))
        job.show(as_page(job.folder, found))
        job.say(f"next: chladni diagnose {job.place / 'case'}")


def _with_added(case: Case, path: Path) -> tuple[Case, int]:
    """The case with the places of a plan of ``chladni next``, and how many sensors are new.

    A known mass is a sensor of that mass; a drive takes the place of the earlier one.
    """
    try:
        plan = json.loads(path.read_text(encoding="utf-8"))
        rows = [(str(m["label"]), float(m.get("mass_kg", 0.0)))
                for kind in ("sensors", "masses") for m in plan[kind]]  # fmt: skip
        drives, band = [str(m["label"]) for m in plan["drives"]], plan["band_hz"]
    except OSError as error:
        raise FileError(f"--add {path} cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise FileError(f"--add {path} is not a plan.json of chladni next ({error})") from error
    if band:
        raise FileError(
            f"--add {path}: lines up to {band[0]:.4g} Hz belong to a test of its own; run chladni "
            "next --without band"
        )
    where = f"--add {path.name}"
    sensors = [replace(exciter(n, where), role="output", mass=kg) for n, kg in rows]
    outputs = case.outputs.joined(placed(case.assembly, sensors, where))
    inputs = case.inputs
    if drives:
        inputs = placed(case.assembly, [exciter(drives[0], where)], where)
    added = len(outputs.labels) - len(case.outputs.labels)
    return replace(case, outputs=outputs, inputs=inputs), added


def _factors(text: str) -> tuple[float, ...]:
    """Levels as numbers.

    >>> _factors("0.5, 1,2")
    (0.5, 1.0, 2.0)
    """
    try:
        return tuple(real_number(x) for x in text.split(","))
    except ValueError:
        raise FileError(f"--levels {text!r} is not of the form 0.5,1,2") from None


def _case(
    source: Path,
    units: str | None,
    allow: list[str],
    sensors: Path | None,
    driven: str,
    scratch: Path,
    progress: Progress,
) -> Case:
    """The case itself; of a bare deck one that is drafted in a scratch folder."""
    if source.exists() and is_case(source):
        case = load_case(source)
        if sensors is not None or units is not None or allow or driven:
            raise FileError(
                f"{source} is a case, which already defines sensors, drive point, units and "
                "allowed cards"
            )
        return case
    bare = load_deck(source, units, allow)
    if units is None:
        raise FileError(
            f"{source} is a bare deck, so give its unit system, for example --units mm-t-s"
        )
    model = bare.model()
    if driven:
        placed(model.assembly, [exciter(driven, "--input")], "--input")
    table, hangers, f_max = scratch / "sensors.csv", "", 0.0
    if sensors is None:
        progress("planning the sensors", 0.1)
        made = plan_test(model.assembly, PlanSettings(draws=0))
        f_max = float(made.modal.frequency[-1])
        write_text(table, sensors_csv(made, driven))
        on_table = driven.startswith("base:")
        hangers = "" if on_table else f"hangers = {[int(h) for h in made.hangers]}\n"
    elif not sensors.is_file():
        raise FileError(f"no file {sensors}{similar_names(sensors)}")
    elif driven:
        write_text(table, with_input(sensors, driven))
    else:  # unchanged: its reader reports errors
        table = sensors.resolve()
    write_text(
        scratch / "case.toml",
        f"[model]\ndeck = {json.dumps(str(source.resolve()))}\noutside = true\n"
        f'units = "{units}"\n'
        + f"allow = {json.dumps(allow)}\n" * bool(allow)
        + f"[test]\nsensors = {json.dumps(str(table))}\n{hangers}",
    )
    case = load_case(scratch)
    still = silent_of_plan(case, f_max) if sensors is None else ()
    if still:  # a plan serves all modes, and one drive does not move them all
        rows = table.read_text(encoding="utf-8").splitlines(keepends=True)
        write_text(table, "".join(row for row in rows if row.split(",")[0] not in still))
        case = load_case(scratch)
    own = [note for note in case.notes if note != OUTSIDE]  # no word of the user's
    if still:
        own.append(
            f"sensors {named(still, 3)} of the plan are left out: {case.inputs.labels[0]} does not "
            "move them"
        )
    notes = tuple(dict.fromkeys((*model.notes, *own)))
    return replace(case, path=source, notes=notes)


def silent_of_plan(case: Case, f_max: float) -> tuple[str, ...]:
    """Labels of planned sensors that the drive of a case does not move, by modes to ``f_max``."""
    return silent_sensors(modelled(case.assembly, f_max), case.outputs, case.inputs)
