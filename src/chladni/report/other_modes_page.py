"""Modes of a model compared with those of another program, as a page."""

from pathlib import Path
from typing import Any

import numpy as np

from ..view import charts
from ..workflows.other_modes import OtherModes
from .blocks import Block, Drawing, PageParts, Section, Table
from .mesh_drawings import mesh_of, two_models
from .words import criterion, hertz, percent

_SHOWN = 12  # shapes in a picture
_MOST = 60  # modes of a MAC matrix that can be read
_HEADS = ("its mode", "its [Hz]", "model's mode", "model's [Hz]", "off", "MAC", "in the span")
_CAPTION = (
    "In the span: share of its shape that the model's modes within 1 % of its frequency can "
    "represent. Modes with one frequency may mix; then each MAC is low and this share is 1."
)


def as_page(folder: Path, found: OtherModes) -> PageParts:
    """Sections of the page."""
    p, other, model = found.pairs, found.source.name, found.origin
    shown = mesh_of(model.seen, model.assembly)
    pairs = list(zip(p.test.tolist(), p.model.tolist(), strict=True))
    notes = list(found.notes)
    blocks: list[Block] = []
    if max(found.mac.shape) <= _MOST:
        both = {"model": (found.mac.T, found.f_model, pairs)}
        caption = f"MAC, {other} against the model; framed: the pairs."
        caption += " Click one to see it." if found.whole else ""
        chart = charts.mac(found.f_other, both, other, "shapes" if found.whole else "")
        blocks.append(Drawing("mac", chart, caption, what="MAC", wide=not found.whole))
    if found.whole:
        blocks += two_models(shown, other, found.shapes, found.f_other, found.numbers_other,
                             found.motion, found.f_model, found.numbers_model, pairs, found.mac.T,
                             _SHOWN)  # fmt: skip
    else:
        notes.append(
            f"{other} does not move every grid of the model, and its points cannot tell the modes "
            "of the model apart, so its shapes are not drawn."
        )
    if found.expanded and found.whole:
        notes.append(
            f"{other} lacks {found.expanded} grids of elements: in the picture they move with the "
            "mixture of the model's modes that fits the others best."
        )
    return PageParts(_lead(found), [Section("Modes", [*blocks, _table(found, True)])], notes)


def in_words(found: OtherModes) -> PageParts:
    """The page without its pictures."""
    return PageParts(_lead(found), [Section("Modes", [_table(found)])], found.notes)


def _lead(found: OtherModes) -> str:
    p, count = found.pairs, len(found.f_other)
    if not len(p):
        return f"None of the {count} elastic modes of {found.source.name} has a partner."
    off = np.abs(found.f_model[p.model] / found.f_other[p.test] - 1)
    alike = np.maximum(p.mac, found.in_span[p.test])
    return (
        f"{len(p)} of {count} elastic modes of {found.source.name} have a partner in the model; "
        f"the largest frequency error is {100 * float(off.max()):.2g} %, the lowest MAC "
        f"{criterion(alike.min())}, close modes taken together."
    )


def _table(found: OtherModes, drawn: bool = False) -> Table:
    """Tabulate every elastic mode of the file, with its partner if it has one."""
    p = found.pairs
    found_for = zip(p.model.tolist(), p.mac.tolist(), strict=True)
    partner = dict(zip(p.test.tolist(), found_for, strict=True))
    rows = []
    for j, (number, f) in enumerate(zip(found.numbers_other, found.f_other, strict=True)):
        i, value = partner.get(j, (None, None))
        own = ("–", "–", "–")
        if i is not None:
            off = percent(found.f_model[i], f)
            own = (str(found.numbers_model[i]), hertz(found.f_model[i]), off)
        rows.append(
            (str(number), hertz(f), *own, criterion(value), criterion(found.in_span[j] or None))
        )
    opens = "shapes" if drawn and found.whole else ""
    return Table(_HEADS, rows, caption=_CAPTION, opens=opens, at=range(len(rows)))


def as_json(found: OtherModes) -> dict[str, Any]:
    """``correlation.json`` of two sets of normal modes."""
    p, f, other = found.pairs, found.f_model, found.f_other
    return {
        "source": found.source.name,
        "grids": found.grids,
        "modes": [
            {
                "other_mode": found.numbers_other[j],
                "other_hz": other[j],
                "model_mode": found.numbers_model[i],
                "model_hz": f[i],
                "deviation": f[i] / other[j] - 1,
                "mac": value,
                "in_span": found.in_span[j],
            }
            for i, j, value in zip(p.model, p.test, p.mac, strict=True)
        ],
        "alone_other_hz": other[p.alone_test],
        "alone_model_hz": f[p.alone_model],
    }
