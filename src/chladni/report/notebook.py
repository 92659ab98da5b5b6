"""A diagnosis as a notebook shows it: its page in a frame, without pictures and without scripts."""

from html import escape

from ..workflows.diagnosis_result import DiagnosisResult

_FRAME = (
    '<iframe srcdoc="{}" sandbox="" title="diagnosis" '
    'style="width:100%;height:36rem;border:1px solid #ccc;border-radius:8px"></iframe>'
)


def shown_in_notebooks() -> None:
    """Give results the method by which Jupyter asks for HTML."""
    DiagnosisResult._repr_html_ = _frame  # type: ignore[attr-defined]


def _frame(result: DiagnosisResult) -> str:
    """The frame keeps styles apart; its sandbox runs nothing."""
    from .page import diagnosis_page

    return _FRAME.format(escape(diagnosis_page(result)))
