"""Explanations that a layout separates, and the sensors that it lacks: tables, JSON."""

from collections.abc import Sequence
from typing import Any

from chladni.inference.result import NextMeasurement
from chladni.report.blocks import Block, Section, Table
from chladni.report.measurement_table import next_measurements
from chladni.report.words import odds_of
from chladni.workflows.before_any_test import PlannedTests

_CAPTION = (
    "Predicted from the model alone. Each effect is concealed in an article, in a size and place "
    "of its family. The planned sensors record that article. All of these effects are then fitted."
)


def separation_section(made: PlannedTests, every: Sequence[NextMeasurement]) -> Section:
    """The section of the page."""
    rows = [(t.name, odds_of(t.of_truth), "no" if t in made.open else "yes") for t in made.tests]
    heads = ("article with", "odds of the right name", f"settled at {made.odds:g} : 1")
    blocks: list[Block] = [Table(heads, rows, (heads[0], heads[2]), _CAPTION)]
    if every:
        blocks.append(next_measurements(every, made.odds))
    return Section("Explanations this layout separates", blocks)


def separation_json(made: PlannedTests, every: Sequence[NextMeasurement]) -> dict[str, Any]:
    """``separate.json``: article by article, and the sensors that would settle what is open."""
    return {
        "odds": made.odds,
        "articles": [
            {"effect": t.name, "probability": dict(zip(t.names, t.probability, strict=True))}
            for t in made.tests
        ],
        "sensors": [{"label": m.label, "point_m": m.point_m, "bits": m.bits,
                     "settles": m.settles} for m in every],
    }  # fmt: skip
