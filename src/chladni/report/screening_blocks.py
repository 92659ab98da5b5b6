"""What the screening of a recording found, as tables of a page and as JSON."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..ema.finding import Check, Finding, Screening
from .blocks import Block, Items, Section, Table

_FINDING = ("finding", "channels", "is a", "what", "repair")
_CHECK = ("check", "result", "is")
_WORD = {True: "in order", False: "look at it", None: "not possible"}


def screening_section(*screenings: Screening | None) -> Section:
    """Findings first, then every check; nothing where nothing was screened."""
    blocks: list[Block] = []
    told = [s for s in screenings if s is not None and (s.checks or s.findings)]
    for s in told:
        of = s.name if len(told) > 1 else ""
        blocks.append(Items([s.sentence + "."]))
        if s.findings:
            rows = [
                (f.kind, ", ".join(f.channels) or "all", f.severity, f.text, f.repair)
                for f in s.findings
            ]
            blocks.append(Table(_FINDING, rows, _FINDING, of))
        looked = [(c.name, c.result, _WORD[c.passed]) for c in s.checks]
        blocks.append(Table(_CHECK, looked, _CHECK, of))
    return Section("The recording", blocks)


def screening_json(s: Screening) -> dict[str, Any]:
    """Findings and checks as plain data."""
    return {
        "name": s.name,
        "sentence": s.sentence,
        "findings": [{**vars(f), "channels": list(f.channels)} for f in s.findings],
        "checks": [dict(vars(c)) for c in s.checks],
    }


def read_screening(d: Mapping[str, Any]) -> Screening:
    """A screening from its JSON."""
    return Screening(
        str(d.get("name", "")),
        tuple(_finding(f) for f in _rows(d, "findings")),
        tuple(Check(str(c["name"]), str(c["result"]), c["passed"]) for c in _rows(d, "checks")),
    )


def _rows(d: Mapping[str, Any], key: str) -> Sequence[Mapping[str, Any]]:
    return d.get(key) or ()


def _finding(f: Mapping[str, Any]) -> Finding:
    value = f.get("value")
    return Finding(
        str(f["kind"]), str(f["text"]), f["severity"], tuple(f.get("channels") or ()),
        str(f.get("repair") or ""), float("nan") if value is None else float(value),
    )  # fmt: skip
