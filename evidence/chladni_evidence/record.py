"""Recording of cases: diagnose a folder once, keep all that any decision may request."""

import json
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from chladni.case import load_case
from chladni.decision.decide import RULES
from chladni.decision.decision_rules import DecisionRules
from chladni.decision.hypothesis_table import NULL
from chladni.decision.reasons import Decision
from chladni.errors import ChladniError
from chladni.parallel import one_blas_thread
from chladni.search.deciding import Measured, begun, decided_by
from chladni.workflows.diagnosis_pipeline import Explained, searched
from chladni.workflows.output_only import with_natural_frequencies

from .recorded_case import RecordedCase, write_case
from .recorded_rows import packed, rows_kept

Say = Callable[[str], None]


def record(folders: Sequence[Path], out: Path, say: Say) -> list[Path]:
    """Record some cases, each into a file of its own; existing files are kept.

    A refused case is reported and left out.
    """
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for folder in folders:
        path = out / f"{_name(folder)}.npz"
        if not path.exists():
            try:
                write_case(recorded_case(folder), path)
            except ChladniError as error:
                say(f"{folder}: not recorded: {error}")
                continue
            say(f"{path}: {path.stat().st_size / 1e6:.1f} MB")
        written.append(path)
    return written


def recorded_case(folder: Path) -> RecordedCase:
    """A case with the rows of its decision, and of its decisions without each of the rules."""
    with one_blas_thread():
        made = searched(with_natural_frequencies(load_case(folder)), True, lambda text, share: None)
        known = replace(begun(made.prepared, made.found), whole=True)
        given = made.prepared, made.found, made.refine
        found, known = decided_by(RULES, *given, known)
        for f in fields(DecisionRules):
            _, known = decided_by(RULES.without(f.name), *given, known)
    return kept(folder, made, found, known)


def kept(folder: Path, made: Explained, found: Decision, known: Measured) -> RecordedCase:
    """A decided case with its rows and its reduced problem."""
    mass, arrays = made.prepared.problem.mass_measurement, dict[str, np.ndarray]()
    for key, row in rows_kept(known, made.found, mass, NULL):
        arrays |= packed(key, row)
    names = known.table.rows[found.order[0]].names if found.named else ()
    return RecordedCase(
        _name(folder), truth_of(folder), known.table, found.verdict, names, found.one_of, arrays
    )


def truth_of(folder: Path) -> dict[str, Any]:
    """The truth of a case of a blind folder for tuning; empty where there is no truth."""
    sealed = folder.resolve().parents[1] / "sealed" / f"{folder.name}.json"
    if not sealed.exists():
        return {}
    truth = json.loads(sealed.read_text(encoding="utf-8"))
    return {k: truth[k] for k in ("effect", "seed", "structure", "mesh") if k in truth}


def _name(folder: Path) -> str:
    """Name of a record, from the set and the case."""
    folder = folder.resolve()
    return f"{folder.parents[1].name}-{folder.name}" if truth_of(folder) else folder.name
