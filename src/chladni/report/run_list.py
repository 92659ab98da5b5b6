"""The runs below a folder: what each found, newest first, and the page that lists them."""

import json
import os
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from html import unescape
from pathlib import Path
from typing import Any

from ..errors import FileError
from ..inference.result import Agreement
from ..output import LIST, name_of
from ..workflows.diagnosis_result import DiagnosisResult
from .blocks import PageParts, Section, Table
from .diagnosis_json import read_diagnosis
from .sentence import sentence
from .words import number, percent

_LONGEST = 300  # letters of a lead
_LEAD = re.compile(r"<h1>(.*?)</h1>", re.DOTALL)
_HEADS = ("written", "command", "case", "result", "Q of", "Q before", "Q after", "change")


@dataclass(frozen=True)
class FinishedRun:
    """A folder with the results of one command, as its ``run.json`` lists them."""

    folder: Path
    command: str
    source: str  # name of the case or the deck
    written: datetime

    @cached_property
    def diagnosis(self) -> DiagnosisResult | None:
        """The result of ``diagnose`` or ``calibrate``; None of another command."""
        with suppress(FileError):
            return read_diagnosis(self.folder)
        return None

    @property
    def lead(self) -> str:
        """The result in one sentence, as its page begins."""
        if self.diagnosis is not None:
            return sentence(self.diagnosis)
        with suppress(OSError):
            found = _LEAD.search((self.folder / "report.html").read_text(encoding="utf-8"))
            return unescape(found[1])[:_LONGEST] if found else ""
        return ""

    def page_from(self, place: Path) -> str:
        """Link from ``place`` to the page, or to the folder of a run without one."""
        page = self.folder / "report.html"
        return Path(os.path.relpath(page if page.exists() else self.folder, place)).as_posix()

    def q(self) -> tuple[str, float | None, float | None]:
        """Data of Q, and Q of the given deck and of the last; a correlation has one.

        A diagnosis has it of held-out data, if there are any.
        """
        if self.diagnosis is not None:
            scores = self.diagnosis.agreement or Agreement()
            sides = {"held-out data": scores.held_out, "fitted data": scores.fitted}
            known = [(name, s.nominal, s.after) for name, s in sides.items()]
            return next((s for s in known if None not in s), ("", None, None))
        held = contents(self, "correlation.json").get("Q")
        return ("all data", held["mean"], None) if isinstance(held, dict) else ("", None, None)


def contents(run: FinishedRun, name: str) -> dict[str, Any]:
    """The data of a JSON file of a run; empty without one."""
    with suppress(OSError, ValueError, RecursionError):
        held = json.loads((run.folder / name).read_text(encoding="utf-8"))
        return held if isinstance(held, dict) else {}
    return {}


def finished_run(folder: Path) -> FinishedRun | None:
    """The run of a folder; None of one that chladni did not write."""
    path = folder / LIST
    try:
        held = json.loads(path.read_text(encoding="utf-8")) if not path.is_symlink() else {}
        command, files = held["command"], held["files"]
        own = isinstance(command, str) and LIST in files and isinstance(held["version"], str)
        when = path.stat().st_mtime
    except (OSError, ValueError, RecursionError, LookupError, TypeError):
        return None
    if not own:
        return None
    with suppress(TypeError, ValueError):
        when = datetime.fromisoformat(str(held.get("written"))).timestamp()
    source = Path(str(held.get("source") or folder.name.removeprefix(f"{command}-")))
    name = name_of(source.parent if source.name == "case.toml" else source)
    return FinishedRun(folder, command, name, datetime.fromtimestamp(when, UTC))


def finished_runs(folder: Path) -> Iterator[FinishedRun]:
    """Every run below a folder; links are not followed."""
    for place, names, _ in os.walk(folder):
        names[:] = sorted(n for n in names if not n.startswith("."))
        if (run := finished_run(Path(place))) is not None and run.command != "index":
            yield run


def index_page(folder: Path, place: Path) -> PageParts:
    """The runs below a folder, newest first, as a page in ``place``."""
    runs = sorted(finished_runs(folder), key=lambda r: r.written, reverse=True)
    if not runs:
        raise FileError(f"{folder} holds no run of chladni: no folder with a {LIST}")
    rows = []
    for run in runs:
        data, before, after = run.q()
        date = f"{run.written:%Y-%m-%d %H:%M}"
        cells = number(before, 3), number(after, 3), percent(after, before)
        rows.append((date, run.command, run.source, run.lead, data, *cells))
    caption = (
        "Times are UTC. Q of the given deck and of the last; on other data it is another number. A "
        "click on a head sorts. `chladni compare A B` puts two of these folders next to each other."
    )
    table = Table(_HEADS, rows, _HEADS[:5], caption, links=[r.page_from(place) for r in runs])
    counted = f"{len(runs)} run{'s' * (len(runs) > 1)} in {folder.resolve().name}"
    return PageParts(f"{counted}.", [Section("Runs", [table])])
