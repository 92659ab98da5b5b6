"""``chladni diagnose``: the name of the physics a deck left out, and the deck with it."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from threadpoolctl import threadpool_limits

from ..case import Case, load_case
from ..dynamics.frf import FRF
from ..errors import FileError, LabelError, ModelError
from ..io.nastran import assembly, read_deck, write_deck
from ..io.nastran.edit.model_changes import changes
from ..model.assembly import Assembly
from ..progress import Progress, within
from ..report.page import write_page
from ..updating.diagnosis import Diagnosis, diagnose
from ..updating.likelihood import Responses
from ..updating.outcome import Models, as_dict, judged, models, rms
from ..updating.preparation import prepare
from ..updating.question import Prepared, Question
from ..updating.renewal import renewed
from ..workflows.case_model import DAMPING, markers
from ..workflows.loaded_model import Model, is_case
from ..workflows.question_of_case import question
from .frf import modelled
from .run import Out, Run, command_line, started

if TYPE_CHECKING:
    from ..report.figures import Shown


def run(
    source: Annotated[Path, typer.Argument(metavar="CASE")],
    out: Out = None,
) -> None:
    """Name the missing physics, write the updated deck, diagnosis.json and a page."""
    with started("diagnose", source, out) as job:
        answer(job, opened(source))


def opened(source: Path) -> Case:
    """The case of a folder or a case.toml."""
    if source.exists() and not is_case(source):
        raise FileError(f"{source} is no case; give a folder with case.toml")
    return load_case(source)


def answer(job: Run, case: Case, search: bool = True) -> dict[str, Any]:
    """Diagnose (or only calibrate) a case into the folder of the run, on one BLAS thread."""
    with threadpool_limits(1):
        return _answered(job, case, search)


def _answered(job: Run, case: Case, search: bool) -> dict[str, Any]:
    job.progress("identifying the recording", 0.02)
    asked = question(case)
    prepared = prepare(asked)
    found = diagnose(prepared.search, within(job.progress, 0.1, 0.8), search)
    if found.found is not None:
        first, note = renewed(asked, prepared, found.found)
        found = replace(found, trials=(first, *found.trials[1:]), notes=(*found.notes, note))
        found = judged(prepared, found)
    stages = models(asked, found)
    job.progress("writing the deck", 0.82)
    updated, lost = written(job, case, stages.final)
    if updated is not None:
        stages = Models(stages.nominal, stages.calibrated, assembly(read_deck(updated), case.units))
    d = as_dict(asked, prepared, found, stages)
    d["notes"] += lost
    name = None if updated is None else updated.name
    d["files"] = {"deck": name, "report": "report.html", "diagnosis": "diagnosis.json"}
    d["frequency_rms_percent"] = {
        k: rms(d["frequencies"], f"{k}_hz") for k in ("before", "calibrated", "after")
    }
    job.json("diagnosis.json", d)
    page(job, case, asked, prepared, found, stages, d, within(job.progress, 0.85, 1.0))
    return d


def written(job: Run, case: Case, final: Assembly) -> tuple[Path | None, list[str]]:
    """The updated deck; where no card can hold the change, none and a sentence."""
    path = job.folder / case.deck.path.with_name("updated.bdf").name
    try:
        edits = changes(case.deck, case.assembly, final, case.units)
        return write_deck(case.deck, path, edits), []
    except (FileError, LabelError, ModelError) as error:
        return None, [f"no updated deck was written: {error}"]


def page(
    job: Run, case: Case, asked: Question, prepared: Prepared, found: Diagnosis, stages: Models,
    d: dict[str, Any], progress: Progress,
) -> None:  # fmt: skip
    """Pictures and report.html."""
    from ..report.figures import figures

    progress("pictures", 0.0)
    drawn = figures(job.folder, d, shown(case, prepared, stages))
    write_page(
        job.folder, d, drawn, [*d["notes"], *case.notes], command=command_line(),
        title=f"Diagnosis – {case.path.parent.name}",
    )  # fmt: skip
    job.say(said(d))


def shown(case: Case, prepared: Prepared, stages: Models) -> "Shown":
    """What the pictures need: the mesh, the sensors, test and model responses."""
    from ..report.figures import Shown

    model = Model(case.path, case.assembly)
    curves: dict[str, FRF] = {}
    if case.frfs:
        low, high = case.band or (0.0, 1e9)
        if case.held_band is not None:
            high = max(high, case.held_band[1])
        test = case.frfs[0].sel(band=(max(low, 1e-6), high))
        damping = case.damping or DAMPING
        curves = {"test": test, "before": modelled(case, stages.nominal, test, damping)}
        curves["after"] = modelled(case, stages.final, test, damping)
    held = [label for label, h in zip(case.outputs.labels, _held(prepared, case), strict=True) if h]
    return Shown(
        model.seen,
        [p.name for p in case.assembly.parts],
        case.assembly.ids,
        curves,
        held,
        [case.band] if case.band else [],
        list(case.exclude),
        markers(case.outputs),
        markers(case.inputs),
    )


def _held(prepared: Prepared, case: Case) -> list[bool]:
    data, n = prepared.search.data, len(case.outputs.labels)
    if not isinstance(data, Responses):
        return [False] * n
    return [not data.use[:, k].any() for k in range(n)]


def said(d: dict[str, Any]) -> str:
    """The verdict for a terminal."""
    from ..report.verdict import sentence

    return sentence(d)
