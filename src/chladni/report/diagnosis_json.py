"""``diagnosis.json``: the result of a diagnosis as other programs read it, and back."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from ..arguments import checked
from ..errors import FileError
from ..output import plain
from ..workflows.diagnosis_result import DiagnosisResult
from .screening_blocks import screening_json
from .typed_fields import as_data, made

Json = Mapping[str, Any]
_UNWRITTEN = ("origin", "models", "residual_localisation", "outlook", "posterior")
_Q = {  # key: field of Scores
    "Q_nominal": "nominal",
    "Q_calibrated": "calibrated",
    "Q_with_effect": "with_effect",
    "Q_floor": "floor",
    "Q_with_nuisances": "with_nuisances",
}
_FIT = {  # key: field of Agreement
    "gain_over_calibration": "two_log_bayes_factor",
    "largest_gain": "largest_two_log_bayes_factor",
    "threshold": "threshold",
}


def diagnosis_json(result: DiagnosisResult) -> dict[str, Any]:
    """The contract of ``diagnosis.json``: the fields of the result, some under other names."""
    states = [{"state": s.name, **diagnosis_json(s.result)} for s in result.states]
    held = {
        f.name: as_data(getattr(result, f.name))
        for f in fields(result)
        if f.name not in (*_UNWRITTEN, "states")
    }
    fit, error, left = (held.pop(k) for k in ("agreement", "frequency_error", "structured"))
    return plain(  # type: ignore[no-any-return]
        {
            **held,
            "fit": None if fit is None else _fit(fit),
            "calibrated": _flat(held["calibrated"]),
            "shared": _flat(held["shared"]),
            "alternatives": [_without_place(a) for a in held["alternatives"]],
            "frequency_rms_percent": error,
            "structured": None if left is None else {"is": left.pop("structured"), **left},
            "screening": None if result.screening is None else screening_json(result.screening),
            "states": states,
        }
    )


def _fit(a: Json) -> Json:
    fitted, held = ({key: a[of][name] for key, name in _Q.items()} for of in ("fitted", "held_out"))
    gains = {key: a[name] for key, name in _FIT.items()}
    return {**fitted, "held_out": {**held, "what": a["what"]}, **gains}


def _flat(rows: Iterable[Json]) -> list[Json]:
    return [{**{k: v for k, v in c.items() if k != "estimate"}, **c["estimate"]} for c in rows]


def _without_place(a: Json) -> Json:
    """An alternative; no key ``where`` if it has no place."""
    return {k: v for k, v in a.items() if k != "where" or v is not None}


def from_json(d: Json) -> DiagnosisResult:
    """Read a result from its JSON; missing fields keep their defaults.

    Raises
    ------
    ValueError
        If a value is not of the type of its field.
    """
    return made(DiagnosisResult, _fields(d))


def _fields(d: Json) -> Json:
    """The JSON of a result under the names of the fields of the dataclasses."""
    fit, left = d.get("fit"), d.get("structured")
    searched = "alternatives" not in d or bool(d["alternatives"])
    return {
        "searched": searched,
        **{k: v for k, v in d.items() if k not in _UNWRITTEN},
        "agreement": _agreement(fit) if fit else None,
        "frequency_error": d.get("frequency_rms_percent"),
        "structured": {"structured": left["is"], **left} if left else None,
        "calibrated": [{**c, "estimate": c} for c in d.get("calibrated") or ()],
        "shared": [{**c, "estimate": c} for c in d.get("shared") or ()],
        "states": [{"name": s["state"], "result": _fields(s)} for s in d.get("states") or ()],
    }


def _agreement(fit: Json) -> Json:
    held = fit.get("held_out") or {}
    fitted, other = ({name: q.get(key) for key, name in _Q.items()} for q in (fit, held))
    gains = {name: fit.get(key) for key, name in _FIT.items()}
    return {"fitted": fitted, "held_out": other, "what": held.get("what"), **gains}


@checked
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
        return from_json(found)
    except (LookupError, TypeError, AttributeError, ValueError) as error:
        why = f"no key {error}" if isinstance(error, KeyError) else str(error)
        raise FileError(f"{path} does not have the form of a diagnosis: {why}") from error
