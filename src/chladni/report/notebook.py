"""A diagnosis in a notebook: its page in a frame, without pictures and without scripts."""

from html import escape

from ..workflows.diagnosis_result import DiagnosisResult

_FRAME = (
    '<iframe srcdoc="{}" sandbox="" title="diagnosis" '
    'style="width:100%;height:36rem;border:1px solid #ccc;border-radius:8px"></iframe>'
)


def shown_in_notebooks() -> None:
    """Give results the method that Jupyter calls for HTML."""
    DiagnosisResult._repr_html_ = _frame  # type: ignore[attr-defined]


def _frame(result: DiagnosisResult) -> str:
    """Put the page into a frame: it separates styles, and its sandbox runs no scripts."""
    from .page import diagnosis_page

    return _FRAME.format(escape(diagnosis_page(result)))
