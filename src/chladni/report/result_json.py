"""Results as plain data, which every command writes with its page."""

from collections.abc import Callable
from functools import singledispatch
from importlib import import_module
from typing import Any

from ..results import full_name


def of_page(module: str, name: str) -> Callable[[Any], dict[str, Any]]:
    """A function of a module of pages, which is imported when a result is written."""

    def made(result: Any) -> dict[str, Any]:
        return dict(getattr(import_module(module, __package__), name)(result))

    return made


_PAGES = {  # type of result: function of this room
    "case_check.CaseCheck": of_page(".check_page", "check_json"),
    "correlate.Correlation": of_page(".correlation_page", "correlation_json"),
    "diagnosis_result.DiagnosisResult": of_page(".diagnosis_json", "diagnosis_json"),
    "evaluation.Evaluation": of_page(".evaluation_page", "evaluation_json"),
    "identify.Identification": of_page(".identification_page", "identification_json"),
    "joint_models.JointModels": of_page(".joint_models_page", "joint_models_json"),
    "map.MappedDeck": of_page(".map_page", "map_json"),
    "modes.NormalModes": of_page(".modes_page", "modes_json"),
    "other_modes.OtherModes": of_page(".other_modes_page", "other_modes_json"),
}


@singledispatch
def to_json(result: Any) -> dict[str, Any]:
    """Convert a result of a workflow to the JSON that its command writes.

    Another package registers the function of its own results: ``to_json.register``.
    """
    names = (full_name(kind).removeprefix("chladni.workflows.") for kind in type(result).__mro__)
    page = next((_PAGES[name] for name in names if name in _PAGES), None)
    if page is None:
        raise TypeError(f"{type(result).__name__} is no result of a workflow")
    return page(result)
