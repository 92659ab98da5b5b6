"""Undo what is wrong with a recording beyond doubt, so that the diagnosis goes on."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from ..case import Case
from ..ema.finding import Finding, Screening
from ..ema.frf_maps import mapped
from ..ema.setup import Recording
from .screening_of_case import FITTED, RecordingAtFault

T = TypeVar("T")

UNDONE = "This was undone before the fit."


def undone(case: Case, screening: Screening, before: tuple[Finding, ...]) -> Case | None:
    """The case with every fault mapped away; None where a fault has no map, or comes back.

    Parameters
    ----------
    before : faults that were undone already
    """
    known = {(f.kind, f.channels) for f in before}
    faults = [f for f in screening.faults if f.kind not in FITTED or f.mend]
    if not faults or any(not f.mend or (f.kind, f.channels) in known for f in faults):
        return None
    for fault in faults:
        case = replace(case, recordings=tuple(_mapped(r, fault.mend) for r in case.recordings))
    return case


def mending(
    case: Case, search: Callable[[Case, tuple[Finding, ...]], T]
) -> tuple[T, tuple[Finding, ...]]:
    """Search a case, its faults undone one after another; return the faults too."""
    faults: tuple[Finding, ...] = ()
    while True:
        try:
            return search(case, faults), faults
        except RecordingAtFault as found:
            mended = undone(case, found.screening, faults)
            if mended is None:
                seen = with_undone(found.screening, faults)
                raise RecordingAtFault(seen or found.screening) from None
            case, faults = mended, (*faults, *(f for f in found.screening.faults if f.mend))


def with_undone(screening: Screening | None, faults: tuple[Finding, ...]) -> Screening | None:
    """A screening of the mended recording that lists first what was undone."""
    if screening is None or not faults:
        return screening
    mended = tuple(replace(f, severity="mended", text=f"{f.text} {UNDONE}") for f in faults)
    return replace(screening, findings=(*mended, *screening.findings))


def _mapped(r: Recording, mend: tuple[str, ...]) -> Recording:
    return r if r.frf is None else replace(r, frf=mapped(r.frf, mend))
