"""Models of joints as a page: Q on fitted and held-out data, one row a model."""

from pathlib import Path
from typing import Any

from ..io.nastran import write_assembly
from ..workflows.joint_models import JointModelFit, JointModels
from .blocks import Items, PageParts, Section, Table
from .words import number

_HEADS = ("joints", "Q fitted", "after", "Q held out", "held out, after", "frequencies [%]",
          "frequencies, after", "mass [kg]")  # fmt: skip
_CAPTION = (
    "One kind of joint differs from the deck in each row; all rows free the same parameters and "
    "are fitted to the same data. After: calibrated. Frequencies: rms of ln(model/test). A model "
    "of a joint is better where the held-out Q is lower, with the same mass."
)


def as_page(folder: Path, found: JointModels) -> PageParts:
    """Sections of the page; a deck of every variant is written into the folder."""
    files = []
    for row in found.rows[1:]:
        if row.assembly is not None:
            name = f"{row.name.replace(' ', '_')}.bdf"
            write_assembly(row.assembly, folder / name, found.origin.units)
            files.append((name, f"{row.name}, not calibrated"))
    said = in_words(found)
    return PageParts(said.lead, said.sections, said.notes, files)


def in_words(found: JointModels) -> PageParts:
    """The page without its files."""
    refused = [f"{row.name}: {row.refused}." for row in found.rows if row.refused]
    doubts = [f"{row.name}: {why}" for row in found.rows for why in row.distrust]
    table = Table(_HEADS, [_row(r) for r in found.rows], ("joints",), _CAPTION)
    held = "no data were held out"
    if found.what:
        held = f"held out: {found.what}; the best model is chosen on these data"
    sections = [
        Section("Models of the joints", [table, Items([held])]),
        Section("Not possible in this deck", [Items(refused)]),
        Section("Reasons not to trust a fit", [Items(doubts)]),
    ]
    return PageParts(_lead(found), sections, found.notes)


def _lead(found: JointModels) -> str:
    best, deck = found.best, found.rows[0]
    q, own = (r.held_out.calibrated for r in (best, deck))
    if best is deck or q is None or own is None:
        return "No other model of the joints predicts the held-out data better than the deck."
    return (
        f"The deck with {best.name} predicts the held-out data best: Q {number(q, 3)}, the deck "
        f"itself {number(own, 3)}, both calibrated."
    )


def _row(row: JointModelFit) -> tuple[str, ...]:
    a, b = row.fitted, row.held_out
    values = (a.nominal, a.calibrated, b.nominal, b.calibrated, *row.frequency_rms)
    return (row.name, *(number(x, 3) for x in values), number(row.mass, 5))


def as_json(found: JointModels) -> dict[str, Any]:
    """Content of ``variants.json``."""
    return {
        "rows": [
            {k: v for k, v in vars(r).items() if k not in ("assembly", "fitted", "held_out")}
            | {"fitted": vars(r.fitted), "held_out": vars(r.held_out)}
            for r in found.rows
        ],
        "held_out": found.what,
        "best": found.best.name,
        "notes": found.notes,
    }
