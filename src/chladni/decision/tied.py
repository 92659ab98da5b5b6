"""When two explanations are one answer, and which of the two is told."""

from collections.abc import Sequence

from .decision_rules import TIED
from .hypothesis_table import Row

FOOT = 0.01  # of the gain, a tenth of an effect in amplitude: what a simpler one may leave of it


def leading(rows: Sequence[Row], null: float) -> int:
    """Which of the rows, best first, leads: the first but for one behind that is to be preferred.

    A lump on a spring that is tuned above all lines is a point mass: the simpler effect leads,
    unless the foot of a resonance that no line shows is more than a hundredth of what was gained.
    Where it may be tuned there, as well as it is known, the simpler leads that is as probable. A
    sealant as stiff as steel is no sealant: what has a value it can have leads.

    Parameters
    ----------
    null : -2 ln evidence without any of them
    """
    lead = rows[0]
    foot = FOOT * (null - lead.neg2_log_evidence)
    for k, row in enumerate(rows[1:], 1):
        behind = row.neg2_log_evidence - lead.neg2_log_evidence
        sounder = not lead.sound and row.sound
        near = behind < TIED and (sounder or row.name == lead.nearly)
        if near or (row.name == lead.becomes and behind < max(TIED, foot)):
            return k
    return 0


def same(row: Row, name: str) -> bool:
    """Whether an explanation, as it was fitted or within its intervals, is a simpler one's."""
    return name in (row.becomes, row.nearly)


def tied(best: Row, rows: Sequence[Row], gap: float = TIED) -> tuple[str, ...]:
    """Names of what explains the data as well, its own first.

    What as it was fitted is another name for the best, or may be, is none of them. What the best is
    somewhere in its intervals is one, whatever the odds: a point mass on a tailgate (tuning 561)
    was called a resonator of 253 Hz, 74 to 862.
    """
    behind = {
        r.name: r.neg2_log_evidence - best.neg2_log_evidence
        for r in rows
        if not same(r, best.names[0])
    }
    return tuple(n for n, b in behind.items() if b < gap or n == best.nearly)
