"""``diagnosis.json``: the result of a diagnosis as other programs read it, and back."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, cast

from ..effects.estimate import Estimate, Location
from ..errors import FileError
from ..inference.level_effects import LinearJoint
from ..inference.result import (
    Adequacy,
    Agreement,
    Alternative,
    CalibratedParameter,
    FitStatistic,
    FrequencyError,
    FrequencyRow,
    LeftPlace,
    MassComparison,
    NamedEffect,
    RecordingScore,
    Remainder,
    Scores,
)
from ..workflows.diagnosis_result import Compared, DiagnosisResult, StateResult
from .calibration_blocks import read_study, study_json
from .level_blocks import level_json, read_levels
from .screening_blocks import read_screening, screening_json
from .typed_fields import wrong_field

Row = TypeVar("Row")
_Q = {  # key: field of Scores
    "Q_nominal": "nominal",
    "Q_calibrated": "calibrated",
    "Q_with_effect": "with_effect",
    "Q_floor": "floor",
    "Q_calibrated_with_mesh_error": "calibrated_with_mesh_error",
    "Q_with_mesh_error": "with_mesh_error",
    "Q_with_scatter": "with_scatter",
}


def diagnosis_json(result: DiagnosisResult) -> dict[str, Any]:
    """The contract of ``diagnosis.json``."""
    r, s, m = result, result.structured, result.mass
    error = r.frequency_error
    return {
        "verdict": r.verdict,
        "effects": [_effect(e) for e in r.effects],
        "alternatives": [_alternative(a) for a in r.alternatives],
        "fit": None if r.agreement is None else _fit(r.agreement),
        "calibrated": [_calibrated(c) for c in r.calibrated],
        "adequate": None if r.adequate is None else _adequate(r.adequate),
        "one_of": [list(names) for names in r.one_of],
        "mass": None if m is None else vars(m),
        "frequencies": [dict(vars(row)) for row in r.frequencies],
        "structured": None
        if s is None
        else {"is": s.structured, "left": s.left, "known": s.known, "sentence": s.sentence},
        "screening": None if r.screening is None else screening_json(r.screening),
        "notes": list(r.notes),
        "distrust": list(r.distrust),
        "compared": r.compared,
        "searched": r.searched,
        "files": dict(r.files),
        "frequency_rms_percent": None if error is None else vars(error),
        "recordings": [dict(vars(row)) for row in r.recordings],
        "levels": level_json(r.levels),
        "joints": [dict(vars(j)) for j in r.joints],
        "states": [{"state": s.name, **diagnosis_json(s.result)} for s in r.states],
        "shared": [_calibrated(c) for c in r.shared],
        "study": study_json(r.study),
    }


def _calibrated(c: CalibratedParameter) -> dict[str, Any]:
    values = {"deck_value": c.deck_value, "written_value": c.written_value}
    return {"where": c.where, **_estimate(c.estimate), **values}


def _effect(e: NamedEffect) -> dict[str, Any]:
    return {
        "name": e.name,
        "claim": e.claim,
        "log_evidence": e.log_evidence,
        "gain": e.gain,
        "where": _lists(e.where),
        "parameters": [_estimate(p) for p in e.parameters],
    }


def _estimate(p: Estimate) -> dict[str, Any]:
    return dict(vars(p))


def _lists(place: Location | LeftPlace) -> dict[str, Any]:
    return {k: list(v) if isinstance(v, tuple) else v for k, v in vars(place).items()}


def _tuples(place: Mapping[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in place.items() if v is not None}


def _alternative(a: Alternative) -> dict[str, Any]:
    row: dict[str, Any] = {"name": a.name, "log_evidence": a.log_evidence, "why_not": a.why_not}
    return row if a.where is None else {**row, "where": _lists(a.where)}


def _fit(a: Agreement) -> dict[str, Any]:
    return {
        **_scores(a.fitted),
        "held_out": {**_scores(a.held_out), "what": a.what},
        "gain_over_calibration": a.two_log_bayes_factor,
        "largest_gain": a.largest_two_log_bayes_factor,
        "threshold": a.threshold,
    }


def _scores(scores: Scores) -> dict[str, float | None]:
    return {key: getattr(scores, name) for key, name in _Q.items()}


def _adequate(found: Adequacy) -> dict[str, Any]:
    return {
        **vars(found),
        "where": [_lists(place) for place in found.where],
        "statistics": [dict(vars(row)) for row in found.statistics],
    }


def _read_adequate(d: Mapping[str, Any]) -> Adequacy:
    rows = tuple(_known(FitStatistic, row) for row in d.get("statistics") or ())
    where = tuple(_known(LeftPlace, _tuples(place)) for place in d.get("where") or ())
    return Adequacy(d["passes"], d["p"], d["what"], where, rows, d.get("something_else"))


def from_json(d: Mapping[str, Any]) -> DiagnosisResult:
    """Read a result from its JSON; missing fields stay empty."""
    mass, error, left, good = (
        d.get(k) for k in ("mass", "frequency_rms_percent", "structured", "adequate")
    )
    alternatives = d.get("alternatives")
    return DiagnosisResult(
        verdict=str(d.get("verdict", "")),
        effects=tuple(_read_effect(e) for e in d.get("effects") or ()),
        alternatives=tuple(_read_alternative(a) for a in alternatives or ()),
        agreement=_read_fit(d["fit"]) if d.get("fit") else None,
        calibrated=_read_calibrated(d.get("calibrated")),
        mass=MassComparison(**mass) if mass else None,
        frequencies=tuple(_known(FrequencyRow, r) for r in d.get("frequencies") or ()),
        frequency_error=_known(FrequencyError, error) if error else None,
        structured=Remainder(left["is"], left["left"], left["known"], left["sentence"])
        if left
        else None,
        adequate=_read_adequate(good) if good else None,
        one_of=tuple(tuple(names) for names in d.get("one_of") or ()),
        notes=tuple(str(n) for n in d.get("notes") or ()),
        distrust=tuple(str(n) for n in d.get("distrust") or ()),
        screening=read_screening(d["screening"]) if d.get("screening") else None,
        compared=cast(Compared, d.get("compared", "responses")),
        searched=bool(d.get("searched", alternatives is None or len(alternatives) > 0)),
        files=dict(d.get("files") or {}),
        recordings=tuple(_known(RecordingScore, r) for r in d.get("recordings") or ()),
        levels=read_levels(d.get("levels")),
        joints=tuple(_known(LinearJoint, j) for j in d.get("joints") or ()),
        states=tuple(
            StateResult(str(s.get("state", "")), from_json(s)) for s in d.get("states") or ()
        ),
        shared=_read_calibrated(d.get("shared")),
        study=read_study(d.get("study")),
    )


def _read_calibrated(rows: Sequence[Mapping[str, Any]] | None) -> tuple[CalibratedParameter, ...]:
    return tuple(
        CalibratedParameter(
            c.get("where", ""), _read_estimate(c), c.get("deck_value"), c.get("written_value")
        )
        for c in rows or ()
    )


def _known(kind: type[Row], row: Mapping[str, Any]) -> Row:
    fields = kind.__dataclass_fields__  # type: ignore[attr-defined]
    return kind(**{k: v for k, v in row.items() if k in fields})


def _read_effect(e: Mapping[str, Any]) -> NamedEffect:
    return NamedEffect(
        str(e.get("name", "?")),
        str(e.get("claim") or ""),
        e.get("log_evidence"),
        _read_location(e.get("where") or {}),
        tuple(_read_estimate(p) for p in e.get("parameters") or ()),
        e.get("gain"),
    )


def _read_estimate(p: Mapping[str, Any]) -> Estimate:
    name, unit = str(p.get("name", "")), str(p.get("unit") or "")
    return Estimate(name, p.get("value", float("nan")), unit, p.get("low"), p.get("high"))


def _read_location(where: Mapping[str, Any]) -> Location:
    held = {k: tuple(v) if isinstance(v, Sequence) and not isinstance(v, str) else v
            for k, v in where.items() if v is not None}  # fmt: skip
    return _known(Location, held)


def _read_alternative(a: Mapping[str, Any]) -> Alternative:
    where = _read_location(a["where"]) if a.get("where") else None
    return Alternative(
        str(a.get("name", "")), a.get("log_evidence"), str(a.get("why_not") or ""), where
    )


def _read_fit(fit: Mapping[str, Any]) -> Agreement:
    held = fit.get("held_out") or {}
    return Agreement(
        _read_scores(fit),
        _read_scores(held),
        str(held.get("what") or ""),
        fit.get("gain_over_calibration"),
        fit.get("largest_gain"),
        fit.get("threshold"),
    )


def _read_scores(q: Mapping[str, Any]) -> Scores:
    return Scores(**{name: q.get(key) for key, name in _Q.items()})


def read_diagnosis(folder: Path | str) -> DiagnosisResult:
    """Read the result of a run from its ``diagnosis.json``.

    Parameters
    ----------
    folder : of the run; the result has no structure, hence no pictures

    Raises
    ------
    FileError
        If it is not there, or is no diagnosis.
    """
    path = Path(folder) / "diagnosis.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}; `chladni diagnose` writes this file") from error
    except (ValueError, RecursionError) as error:
        raise FileError(f"{path} is no JSON: {error}") from error
    if not isinstance(found, dict) or "verdict" not in found:
        raise FileError(f"{path} has no verdict, so it is not a diagnosis")
    try:
        result = from_json(found)
    except (LookupError, TypeError, AttributeError, ValueError, ArithmeticError) as error:
        why = f"no key {error}" if isinstance(error, KeyError) else str(error)
        raise FileError(f"{path} does not have the form of a diagnosis: {why}") from error
    if wrong := wrong_field(result):
        raise FileError(f"{path} does not have the form of a diagnosis: {wrong}")
    return result
