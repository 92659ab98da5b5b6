"""``chladni diagnose``: where model and recording differ, and what was left out of the model."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..case import Case
from ..progress import Progress, within
from ..report.page import write_page
from ..report.verdict import sentence
from .case_model import markers
from .correlate import opened
from .model import Model
from .run import Out, Run, command_line, started

if TYPE_CHECKING:
    from ..updating.run import Answer


def run(source: Annotated[Path, typer.Argument(metavar="CASE")], out: Out = None) -> int:
    """Name the missing physics, put it in, show the fit improve on data the fit never saw."""
    with started("diagnose", source, out) as job:
        case, model = opened(source)
        return diagnosed(job, case, model)


def diagnosed(job: Run, case: Case, model: Model) -> int:
    """Diagnose and show it; the exit code."""
    from ..updating.run import diagnose_case

    return finished(job, case, model, diagnose_case, "Diagnosis")


def finished(
    job: Run,
    case: Case,
    model: Model,
    answering: "Callable[[Case, Path, Progress], Answer]",
    what: str,
) -> int:
    """Let ``answering`` write its files, then the JSON, the pictures and the page."""
    from ..view.probe import advice

    answer = answering(case, job.folder, within(job.progress, 0.0, 0.9))
    d = {**answer.diagnosis, "notes": list(answer.notes)}
    d["files"] = {**(d.get("files") or {}), "diagnosis": "diagnosis.json", "report": "report.html"}
    job.json("diagnosis.json", d)
    job.progress("pictures", 0.9)
    drawn = _drawn(job, case, model, d, answer)
    title = f"{what} – {job.source.resolve().name}"
    notes = [*case.notes, *answer.notes, *advice()]
    write_page(job.folder, d, drawn, notes, command=command_line(), title=title)
    job.say(sentence(d))
    return answer.exit_code


def _drawn(
    job: Run, case: Case, model: Model, d: dict[str, Any], answer: "Answer"
) -> dict[str, Path]:
    from .figures import Shown, figures

    shown = Shown(
        model.seen,
        parts=[p.name for p in model.assembly.parts],
        ids=model.assembly.ids,
        curves=answer.curves,
        held_out=answer.held_out,
        fitted=[case.band] if case.band else [],
        excluded=case.exclude,
        outputs=markers(case.outputs),
        inputs=markers(case.inputs),
        mac=answer.mac,
    )
    return figures(job.folder, d, shown)
