"""The held-out recordings as a table."""

from ..workflows.diagnosis_result import DiagnosisResult
from .blocks import Block, Table
from .words import number

_WHAT = (
    "Q of the decks on the held-out recordings, over all lines and channels. 'Apart' is the Q of "
    "the fitted recording on them: no deck can be expected to come closer."
)


def recording_scores(result: DiagnosisResult) -> list[Block]:
    """Tabulate Q of every deck on each repeat, article and level that was held out."""
    rows = [
        (r.name, r.relation, *map(number, (r.apart, r.nominal, r.calibrated, r.with_effect)))
        for r in result.recordings
    ]
    heads = ("recording", "is a", "apart", "nominal deck", "calibrated deck", "updated deck")
    return [Table(heads, rows, ("recording", "is a"), _WHAT)] if rows else []
