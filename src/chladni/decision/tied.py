"""Equivalent explanations: which of them leads, and which are tied."""

from collections.abc import Sequence

from .decision_rules import TIED
from .hypotheses import Explanation

FOOT = 0.01  # of the gain (a tenth of the amplitude), by which a simpler effect may fall behind


def leading(rows: Sequence[Explanation], null: float) -> int:
    """Index of the leading row: the first, unless a later one is to be preferred.

    A resonator tuned above all spectral lines acts as a point mass. The simpler effect leads,
    unless the flank of that resonance brings more than a hundredth of the gain. If the interval of
    the tuning merely includes such values, the simpler effect leads only if it is tied. Likewise a
    tied row with physically possible values leads one without (a sealant as stiff as steel).

    Parameters
    ----------
    rows : best first
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


def same(row: Explanation, name: str) -> bool:
    """True if an explanation reduces to a named simpler one, as fitted or within its intervals."""
    return name in (row.becomes, row.nearly)


def tied(best: Explanation, rows: Sequence[Explanation], gap: float = TIED) -> tuple[str, ...]:
    """Names of the rows that explain the data as well as the best one, whose own name is first.

    A row that reduces to the best one, as fitted or within its intervals, is left out. A simpler
    effect to which the best one reduces within its intervals is included at any odds. Example: a
    point mass on a tailgate (tuning 561) was named a resonator of 253 Hz (interval 74 to 862).
    """
    behind = {
        r.name: r.neg2_log_evidence - best.neg2_log_evidence
        for r in rows
        if not same(r, best.names[0])
    }
    return tuple(n for n, b in behind.items() if b < gap or n == best.nearly)
