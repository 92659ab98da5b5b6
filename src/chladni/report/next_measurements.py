"""Tables of the measurements that would separate explanations, or narrow an interval."""

from collections.abc import Sequence

from ..inference.result import NextMeasurement
from ..search.next_measurement import ODDS
from .blocks import Table
from .words import number


def next_measurements(every: Sequence[NextMeasurement], odds: float = ODDS) -> Table:
    """Tabulate the measurements that would separate what the data cannot."""
    if every and every[0].about:
        return _narrowing(every)
    rows = [
        (m.what, number(m.bits, 2), f"{100 * m.settles:.0f} %", f"{100 * m.misleads:.0f} %")
        for m in every
    ]
    heads = ("measure", "bits", f"settles at {odds:.0f} : 1", "misleads")
    what = (
        "Each row counts the rows above it. Bits: information expected about which explanation is "
        "true. Settles: share of cases in which the true explanation gets these odds; misleads: in "
        "which a wrong one does."
    )
    return Table(heads, rows, ("measure",), what)


def _narrowing(every: Sequence[NextMeasurement]) -> Table:
    """Tabulate the measurements that would narrow one interval."""
    rows = [(m.what, number(m.bits, 2), f"{m.narrows:.0%}") for m in every]
    what = (
        f"Each row counts the rows above it. The least known quantity is {every[0].about}. Bits: "
        "information expected about it; left: width of its interval afterwards, of that now."
    )
    return Table(("measure", "bits", "left"), rows, ("measure",), what)
