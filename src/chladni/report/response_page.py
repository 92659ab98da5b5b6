"""Frequency responses as a page: the outputs that move most."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from ..dynamics.frf import FRF, UNIT
from ..workflows.frf import FrequencyResponses
from . import frf_charts
from .blocks import Drawing, PageParts, Section, Table, still
from .words import counted, number

_MOTION = {"receptance": "m", "mobility": "m/s", "accelerance": "m/s²"}  # under a deck's own loads
_SHOWN = 12  # outputs in the table


def response_page(found: FRF) -> PageParts:
    """Sections of the page."""
    peak, shown = np.abs(found.values).max(axis=0), _shown(found)
    chart, _ = frf_charts.responses({"model": found}, unit=_unit(found))
    drawn = [(f"{found.outputs[i]} from {drive}", _name(found.outputs[i], drive))
             for j, drive in enumerate(found.inputs) for i in shown if peak[i, j] > 0]  # fmt: skip
    stills = {"frf": frf_charts.overview(chart)}
    stills |= {file: still(chart.at(name)) for name, file in drawn if name in chart.views}
    notes = []
    if len(found.outputs) > len(shown):
        notes.append(
            f"The {len(shown)} outputs that move most are in the table; all "
            f"{len(found.outputs)} are in the arrays."
        )
    said = _words(found)
    block = Drawing("frf", chart, frf_charts.CAPTION, stills, "a response")
    sections = [Section("Responses", [block, *said.sections[0].blocks])]
    return PageParts(said.lead, sections, notes)


def as_page(folder: Path, found: FrequencyResponses) -> PageParts:
    """The pages of all sets of responses as one."""
    parts = [response_page(one) for one in found.frfs]
    notes = [*found.notes, *(text for p in parts for text in p.notes)]
    return PageParts(parts[0].lead, [s for p in parts for s in p.sections], notes)


def in_words(found: FrequencyResponses) -> PageParts:
    """The page of one or several sets of responses without its pictures."""
    each = [_words(one) for one in found.frfs]
    sections = [section for one in each for section in one.sections]
    return PageParts(" ".join(one.lead for one in each), sections, found.notes)


def _words(found: FRF) -> PageParts:
    """The page of one set without its pictures."""
    unit, size = _unit(found), np.abs(found.values)
    peak, at = size.max(axis=0), found.frequency[size.argmax(axis=0)]
    rows = [
        (found.outputs[i], drive, number(peak[i, j]), number(at[i, j]))
        for i in _shown(found)
        for j, drive in enumerate(found.inputs)
    ]
    heads = ("output", "input", f"largest [{unit}]" if unit else "largest", "at [Hz]")
    f, count = found.frequency, len(found.outputs) * len(found.inputs)
    functions = counted(count, f"{found.quantity} function", f"{found.quantity} functions")
    lead = f"{functions} from {number(f[0])} to {number(f[-1])} Hz."
    return PageParts(lead, [Section("Responses", [Table(heads, rows, ("output", "input"))])])


def _shown(found: FRF) -> list[int]:
    """Positions of the outputs that move most."""
    peak = np.abs(found.values).max(axis=(0, 2))
    count = max(1, _SHOWN // len(found.inputs))
    return sorted(np.argsort(-peak, kind="stable")[:count].tolist())


def _unit(found: FRF) -> str:
    """Return the unit: of motion for a deck's own loads, else of motion per unit force."""
    return (_MOTION if found.inputs[0].startswith("subcase") else UNIT).get(found.quantity, "")


def response_json(found: FRF, in_si: bool) -> dict[str, Any]:
    """Return ``frf.json``: a description of the arrays, and level and peak of every channel.

    The unit is None for a bare deck without a unit system.
    """
    size = np.abs(found.values)
    return {
        "quantity": found.quantity,
        "unit": _unit(found) if in_si else None,
        "outputs": found.outputs,
        "inputs": found.inputs,
        "band_hz": [found.frequency[0], found.frequency[-1]],
        "lines": len(found.frequency),
        "channels": [
            {
                "output": output,
                "input": input,
                "rms": np.sqrt((size[:, i, j] ** 2).mean()),
                "peak": size[:, i, j].max(),
                "peak_hz": found.frequency[size[:, i, j].argmax()],
            }
            for j, input in enumerate(found.inputs)
            for i, output in enumerate(found.outputs)
        ],
    }


def _name(output: str, drive: str) -> str:
    text = f"frf_{output}_from_{drive}".replace("-", "m")
    return re.sub(r"[^A-Za-z0-9]+", "_", text)
