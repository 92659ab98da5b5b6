"""Findings of the screening of a recording, as tables of a page and as JSON."""

from collections.abc import Sequence
from typing import Any

from ..ema.finding import Finding, Screening, of_all, which
from ..errors import named
from .blocks import Block, Items, Section, Table
from .typed_fields import as_data

_FINDING = ("finding", "channels", "is a", "what", "repair")
_CHECK = ("check", "result", "is")
SEVERAL = 2  # recordings, beyond which equal findings are reported once
_WORD = {True: "in order", False: "check it", None: "not possible"}


def screening_section(*screenings: Screening | None, folded: bool = False) -> Section:
    """Tabulate findings first, then every check; nothing without a screening.

    A folded section shows its summary, unless there is a finding.
    """
    done = [s for s in screenings if s is not None and (s.checks or s.findings)]
    calm = folded and not any(s.findings for s in done)
    said = f"{sum(len(s.checks) for s in done)} checks, no fault found" if calm else ""
    if len(done) > SEVERAL:
        return Section("The recordings", _of_several(done), said)
    blocks: list[Block] = []
    for s in done:
        of = s.name if len(done) > 1 else ""
        blocks.append(Items([s.sentence + "."]))
        if s.findings:
            blocks.append(Table(_FINDING, [_found(f) for f in s.findings], _FINDING, of))
        looked = [(c.name, c.result, _WORD[c.passed]) for c in s.checks]
        blocks.append(Table(_CHECK, looked, _CHECK, of))
    return Section("The recording", blocks, said)


def lead_of(screenings: Sequence[Screening]) -> str:
    """Return a sentence for each recording if they are few, else one for all."""
    if len(screenings) <= SEVERAL:
        return "; ".join(s.sentence for s in screenings)
    return f"{len(screenings)} recordings; {of_all(screenings) or 'no fault found'}"


def _of_several(done: Sequence[Screening]) -> list[Block]:
    """Return one table of findings and one of checks, with equal rows merged."""
    blocks: list[Block] = [Items([(of_all(done) or "no fault found") + "."])]
    found: dict[tuple[str, ...], list[str]] = {}
    looked: dict[tuple[str, str], dict[str, list[str]]] = {}
    for s in done:
        for f in s.findings:
            found.setdefault(_found(f), []).append(s.name)
        for c in s.checks:
            of = looked.setdefault((c.name, _WORD[c.passed]), {})
            of.setdefault(c.result, []).append(s.name)
    if found:
        rows = [(which(names, done), *row) for row, names in found.items()]
        blocks.append(Table(("in", *_FINDING), rows, ("in", *_FINDING)))
    rows = [
        (name, named(results, 2), word, which([n for each in results.values() for n in each], done))
        for (name, word), results in sorted(looked.items(), key=lambda one: _order(done, one[0][0]))
    ]
    return [*blocks, Table((*_CHECK, "in"), rows, (*_CHECK, "in"))]


def _order(done: Sequence[Screening], name: str) -> int:
    """Return the position of a check in the first recording that has it."""
    return next(k for s in done for k, c in enumerate(s.checks) if c.name == name)


def _found(f: Finding) -> tuple[str, ...]:
    return f.kind, ", ".join(f.channels) or "all", f.severity, f.text, f.repair


def screening_json(s: Screening) -> dict[str, Any]:
    """Findings and checks as plain data."""
    return {**as_data(s), "sentence": s.sentence}
