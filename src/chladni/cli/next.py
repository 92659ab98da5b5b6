"""``chladni next``: measurements that would separate what is open, after a diagnosis or before."""

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from ..case.files_of_source import files_of
from ..errors import FileError
from ..inference.result import NextMeasurement
from ..output import run_folder, write_json, write_text
from ..report.blocks import Code, Links, Section, drawings, write_pictures
from ..report.information_map import information_map, shown_of_run
from ..report.measurement_table import next_measurements
from ..report.mesh_drawings import mesh_of
from ..report.page import write_sections
from ..report.run_list import finished_run
from ..report.shown import Shown
from ..report.typed_fields import as_data
from ..report.words import odds_of
from ..search.next_measurement import (
    ADVISED,
    FILE,
    ODDS,
    Outlook,
    advised,
    read_outlook,
)
from ..workflows.before_any_test import PlannedTests, before_any_test
from ..workflows.loaded_model import model_in_si, opened
from .console import say, say_results, say_table, watched
from .run import Allow, Pictures, Units, command_line, folder_named

_FILES = (
    ("next.json", "the measurements for other programs"),
    ("sensors.csv", "further sensors"),
    ("plan.json", "further sensors, drives, masses and bands, for chladni bench --add"),
)


def run(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RUN_DECK_or_CASE", help="Folder of a diagnosis; with --effects a deck or case."
        ),
    ],
    count: Annotated[int, typer.Option(help="Number of measurements.", min=1)] = ADVISED,
    odds: Annotated[float, typer.Option(help="Odds that settle an explanation.", min=1.0)] = ODDS,
    without: Annotated[
        str, typer.Option(help="Kinds or dofs that cannot be measured, for example drive,614:n.")
    ] = "",
    effects: Annotated[
        str,
        typer.Option(
            help="Before any test: effects that must not be tied, for example "
            "weld-missing,adhesive-stiffness."
        ),
    ] = "",
    sensors: Annotated[
        str,
        typer.Option(
            help="With --effects: number of planned sensors, a table of sensors or a plan.json; "
            "default: those of the case."
        ),
    ] = "",
    top: Annotated[
        float | None, typer.Option(help="With --effects: highest frequency [Hz].", min=1e-3)
    ] = None,
    articles: Annotated[
        int, typer.Option(help="With --effects: articles drawn with each effect.", min=1)
    ] = 1,
    seed: Annotated[int, typer.Option(help="With --effects: of the articles.", min=0)] = 0,
    units: Units = None,
    allow: Allow = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="Folder for the page, next.json, sensors.csv and plan.json (chladni bench --add).",
            metavar="DIR",
            parser=folder_named,
        ),
    ] = None,
    pictures: Pictures = False,
) -> None:
    """Say which further measurements would probably tell the open explanations apart.

    After a diagnosis each explanation predicts the data of every candidate, with all that is not
    known under it. With nothing tied, the list narrows the interval of the least known quantity.
    Before any test, articles are drawn with each of the effects, and the planned test of each is
    diagnosed.
    """
    if pictures and out is None:
        raise FileError("--pictures needs --out, the folder that they are written to")
    barred = [word.strip() for word in without.split(",") if word.strip()]
    if not effects:
        if not source.is_dir() or (source / "case.toml").is_file():
            raise FileError(
                f"{source} is no folder of a diagnosis; before any test give --effects, for "
                "example --effects weld-missing,adhesive-stiffness"
            )
        run = finished_run(source)
        if run is not None and run.command == "calibrate":
            raise FileError(
                f"{source} is a calibration; next needs the folder of a diagnosis, which "
                "chladni diagnose writes"
            )
        known = read_outlook(source)
        say(f"open: {', '.join(known.names)}" if known.unknown is None else "nothing is tied")
        _known([known], barred)
        every = advised([known], count, odds, barred)
        _tell(known, every, odds)
        drawn = _page(shown_of_run(source) if out else None, [known], every, odds)
        _write(out, source / FILE, known.names, every, drawn, pictures)
        return
    names = tuple(dict.fromkeys(word.strip() for word in effects.split(",") if word.strip()))
    with watched() as progress:
        found = opened(source, units, allow or ())
        layout = Path(sensors) if sensors else None
        if sensors.isdecimal():
            words = {"sensors": int(sensors), "modes": max(1, 4 * int(sensors) // 5), "draws": 0}
            layout = import_module("chladni").plan(model_in_si(found, "next")[0], **words)
        made = before_any_test(
            found, names, layout, top=top, articles=articles, seed=seed, odds=odds,
            progress=progress,
        )  # fmt: skip
        together = made.outlooks()
        _known(together, barred)
        every = advised(together, count, odds, barred) if together else ()
    _planned(made)
    if together:
        _tell(together[0], every, odds)
    drawn = list[Section]()
    if out and together:
        model = model_in_si(found, "next")[0]
        drawn = _page(mesh_of(model.seen, model.assembly), together, every, odds)
    _write(out, source, names, every, drawn, pictures)


def _planned(made: PlannedTests) -> None:
    """Say what the planned test alone would tell of each article."""
    question = made.question
    low, high = question.band
    say(
        f"planned: {len(question.outputs.labels)} sensors, driven at "
        f"{', '.join(question.inputs.labels)}, {low:.4g} to {high:.4g} Hz"
    )
    for t in made.tests:
        say(f"an article with {t.name}: odds of the right name {odds_of(t.of_truth)}")
    n, wrong = len(made.tests) - len(made.unsettled), len(made.unsettled) - len(made.open)
    said = f"the planned test settles {n} of {len(made.tests)} articles at {made.odds:g} : 1"
    say(said + (f", and {wrong} wrongly" if wrong else ""))


def _known(every: Sequence[Outlook], barred: Sequence[str]) -> None:
    """Refuse words that are neither kinds nor dofs of the candidates."""
    candidates = [c for known in every for c in known.candidates]
    kinds, labels = {c.kind for c in candidates}, {c.label for c in candidates}
    if every and (unknown := [word for word in barred if word not in kinds | labels]):
        raise FileError(
            f"--without {unknown[0]}: this is no candidate; kinds are {', '.join(sorted(kinds))}"
        )


def _tell(known: Outlook, every: Sequence[NextMeasurement], odds: float) -> None:
    """Tabulate the advice."""
    if every:
        table = next_measurements(every, odds)
        say(table.caption)
        say_table(table)
    else:
        say(known.nothing_left)


def _page(
    shown: Shown | None, outlooks: Sequence[Outlook], every: Sequence[NextMeasurement], odds: float
) -> list[Section]:
    """The advice, and the map of what a sensor would tell."""
    if not every:
        return []
    drawn = [] if shown is None else information_map(shown, outlooks)
    return [Section("Next measurement", [next_measurements(every, odds), *drawn])]


def _write(
    out: Path | None, source: Path, names: Sequence[str], every: Sequence[NextMeasurement],
    drawn: Sequence[Section], pictures: bool,
) -> None:  # fmt: skip
    """Write the advice with its page, and the places for a test or the bench."""
    if out is None:
        return
    by_kind = {kind: [m for m in every if m.kind == kind] for kind in ("sensor", "mass", "drive")}
    read = files_of(source) if source.name != FILE else [source]
    with run_folder(out, "next", read) as part:
        write_json(part / "next.json", {"open": names, "measurements": as_data(every)})
        labels = [m.label for m in by_kind["sensor"]]
        write_text(part / "sensors.csv", "label\n" + "".join(f"{n}\n" for n in labels))
        plan = {
            "sensors": [{"label": n} for n in labels],
            "masses": [{"label": m.label, "mass_kg": m.amount} for m in by_kind["mass"]],
            "drives": [{"label": m.label} for m in by_kind["drive"]],
            "band_hz": [m.amount for m in every if m.kind == "band"],
        }
        write_json(part / "plan.json", plan)
        if drawn:
            title = f"next – {source.name if source.name != FILE else source.parent.name}"
            lead = f"Nothing is tied; the least known quantity is {every[-1].about}."
            if len(names) > 1:
                lead = f"To tell apart: {', '.join(names)}."
            made = write_pictures(part, drawings(drawn), pictures)
            figures = {Path(name).stem: part / name for name, _ in made}
            body = [*drawn, Section("Files", [Links([*_FILES, *made])]),
                    Section("Run it again", [Code([command_line()])])]  # fmt: skip
            write_sections(part / "report.html", title, body, lead=lead, figures=figures)
    say_results(out)
