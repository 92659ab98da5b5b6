"""Explanations that a layout tells apart, and the sensors that serve for it: page, JSON."""

from typing import Any

from chladni.errors import named
from chladni.report.blocks import Section, Table, Text
from chladni.report.measurement_table import next_measurements
from chladni.report.words import number, odds_of
from chladni.workflows.before_any_test import PlannedTests

from .whole_plan import Separation

_CAPTION = (
    "Predicted from the model alone. Each effect is concealed in an article, in a size and place "
    "of its family. The planned sensors record that article. All of these effects are then fitted. "
    "Odds: of the concealed effect."
)


def separation_section(found: Separation) -> Section:
    """The section of the page."""
    made = found.before
    table = next_measurements(found.steps) if made is None else _articles(made, found.after)
    said = Text(separation_in_words(found))
    return Section("Explanations this layout separates", [said, table])


def separation_in_words(found: Separation) -> list[str]:
    """Sensors that separate the explanations, and their use, in sentences."""
    out = []
    if found.before is not None:
        n = len(found.before.question.outputs.labels)
        what = f"{n} sensor{'s' * (n != 1)} for modes alone settle{'s' * (n == 1)}"
        out.append(f"{what} {_settled(found.before)}.")
    if not found.labels:
        return [*out, "So all sensors serve for the modes."]
    one = len(found.labels) == 1
    out.append(
        f"{named(found.labels)} {'was' if one else 'were'} chosen to tell "
        f"{named(found.names)} apart{f', which {found.folder} leaves open' if found.folder else ''}"
        f". With {'it' if one else 'them'} they differ by {number(found.apart, 2)} standard "
        "deviations of all that is not known. The other sensors serve for the modes."
    )
    if found.after is not None:
        out.append(f"This layout settles {_settled(found.after)}.")
    return out


def _settled(tests: PlannedTests) -> str:
    n, lost = len(tests.tests), len(tests.unsettled)
    wrong = lost - len(tests.open)
    said = f"{n - lost} of {n} articles at {tests.odds:.0f} : 1"
    return f"{said}, and {wrong} wrongly" if wrong else said


def _articles(before: PlannedTests, after: PlannedTests | None) -> Table:
    """The odds of the right name, article by article."""
    every = [before] if after is None else [before, after]
    rows = [
        (each[0].name, *(odds_of(t.of_truth) for t in each))
        for each in zip(*(made.tests for made in every), strict=True)
    ]
    heads = ("odds with sensors for modes", "with this layout")[: len(every)]
    return Table(("article with", *heads), rows, ("article with",), _CAPTION)


def separation_json(found: Separation) -> dict[str, Any]:
    """``separate.json``: the sensors, and article by article what the layout tells."""
    last = found.after or found.before
    articles = () if last is None else last.tests
    return {
        "explanations": found.names,
        "sensors": [{"label": m.label, "point_m": m.point_m, "bits": m.bits,
                     "settles": m.settles} for m in found.steps],
        "standard_deviations_apart": found.apart,
        "odds": None if last is None else last.odds,
        "articles": [
            {"effect": t.name, "probability": dict(zip(t.names, t.probability, strict=True))}
            for t in articles
        ],
    }  # fmt: skip
