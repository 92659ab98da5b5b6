"""Results as plain data, which every command writes with its page."""

from collections.abc import Callable
from functools import singledispatch
from importlib import import_module
from typing import Any

from ..ema.level_table import level_tables
from ..ema.shapes import shape_spread, shapes
from ..workflows.case_check import CaseCheck
from ..workflows.correlate import Correlation
from ..workflows.diagnosis_result import DiagnosisResult
from ..workflows.evaluation import Evaluation, RecordingEvaluation
from ..workflows.identify import Identification, RecordingModes
from ..workflows.joint_models import JointModels
from ..workflows.map import MappedDeck
from ..workflows.modes import NormalModes
from ..workflows.other_modes import OtherModes
from .diagnosis_json import diagnosis_json
from .other_modes_page import other_modes_json
from .screening_blocks import screening_json
from .typed_fields import as_data


@singledispatch
def to_json(result: Any) -> dict[str, Any]:
    """Convert a result of a workflow to the JSON that its command writes.

    Another package registers the function of its own results: ``to_json.register``.
    """
    raise TypeError(f"{type(result).__name__} is no result of a workflow")


def of_page(module: str, name: str) -> Callable[[Any], dict[str, Any]]:
    """A function of a module of pages, which is imported when a result is written."""

    def made(result: Any) -> dict[str, Any]:
        return dict(getattr(import_module(module), name)(result))

    return made


to_json.register(DiagnosisResult, diagnosis_json)
to_json.register(OtherModes, other_modes_json)
to_json.register(MappedDeck, of_page(f"{__package__}.map_page", "map_json"))
to_json.register(CaseCheck, of_page(f"{__package__}.check_page", "check_json"))
to_json.register(JointModels, of_page(f"{__package__}.joint_models_page", "joint_models_json"))


@to_json.register
def _(result: NormalModes) -> dict[str, Any]:
    """``modes.json``; without a unit system mass and centre are under names that claim none."""
    mass, centre = (
        ("mass_kg", "centre_of_gravity_m") if result.in_si else ("mass", "centre_of_gravity")
    )
    return {
        "frequency_hz": result.modal.frequency,
        "generalized_mass": result.generalized_mass,
        mass: result.mass,
        centre: result.centre_of_gravity,
        "rigid": result.rigid,
        "parts": {
            name: {"id": id, "strain_energy": share}
            for (name, id), share in zip(result.parts, result.strain_energy, strict=True)
        },
    }


@to_json.register
def _(result: Identification) -> dict[str, Any]:
    held: dict[str, Any] = {"recordings": [_recording(r) for r in result.recordings]}
    if result.levels:
        held["levels"] = [as_data(level_tables(study)) for study in result.levels]
    return held


def _recording(r: RecordingModes) -> dict[str, Any]:
    m = r.modes
    return {
        "name": r.recording.name,
        "band_hz": m.band,
        "frequency_hz": m.frequency,
        "frequency_sd_hz": m.frequency_sd,
        "damping": m.damping,
        "damping_sd": m.damping_sd,
        "firm": r.firm,
        "struck_out": r.struck,
        "mpc": shapes(m).collinearity if m.order else [],
        "shape_spread": shape_spread(m),
        "share_of_orders": r.diagram.seen(m),
        "chi": m.chi,
        "outputs": m.outputs,
        "inputs": m.inputs,
        "screening": screening_json(r.screening),
    }


@to_json.register
def _(result: Evaluation) -> dict[str, Any]:
    return {"recordings": [_evaluated(r) for r in result.recordings]}


def _evaluated(r: RecordingEvaluation) -> dict[str, Any]:
    e, frf = r.estimate, r.recording.frf
    assert frf is not None
    found: dict[str, Any] = {
        "name": r.recording.name,
        "quantity": frf.quantity,
        "outputs": frf.outputs,
        "inputs": frf.inputs,
        "band_hz": frf.frequency[[0, -1]],
        "screening": screening_json(r.screening),
        "free_decays": [dict(vars(d)) for d in r.decays],
        "levels": as_data(level_tables(r.levels)),
    }
    if e is not None:
        found |= {
            "excitation": e.excitation,
            "method": e.method,
            "averages": e.averages,
            "added_damping_1_s": e.added_damping,
            "how": e.notes,
        }
    return found


@to_json.register
def _(result: Correlation) -> dict[str, Any]:
    p, q, f, test = result.pairs, result.quality, result.f_model, result.f_test
    held: dict[str, Any] = {
        "modes": [
            {
                "test_hz": test[j],
                "model_hz": f[i],
                "model_mode": result.numbers[i],
                "deviation": f[i] / test[j] - 1,
                "mac": value,
            }
            for i, j, value in zip(p.model, p.test, p.mac, strict=True)
        ],
        "alone_test_hz": test[p.alone_test],
        "alone_model_hz": f[p.alone_model],
    }
    for mode, worth in zip(held["modes"], result.likeness, strict=False):
        mode["shape"] = vars(worth)
    if result.screening is not None:
        held["screening"] = screening_json(result.screening)
    if result.comac is not None:
        held["comac"] = dict(zip(result.sensors, result.comac, strict=True))
    if q is not None:
        held["Q"] = {
            "mean": q.Q,
            "total": q.total,
            "magnitude": q.magnitude,
            "phase": q.phase,
            "channel": dict(zip(result.channels, q.channel.ravel(), strict=True)),
            "band": [{"band_hz": b, "Q": x} for b, x in zip(q.bands, q.band, strict=True)],
        }
    return held
