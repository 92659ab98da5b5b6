"""``chladni blind``: cases with an effect concealed, all of them, and the confusion matrix."""

from pathlib import Path
from typing import Annotated

import typer

from ..output import locked, make_folder, write_json, write_text
from .console import say
from .run import Out


def run(
    seeds: Annotated[str, typer.Option(help="First and last seed, as 100-109.")] = "100-101",
    effects: Annotated[str, typer.Option(help="Names, with commas; all where empty.")] = "",
    structures: Annotated[str, typer.Option(help="plate, panel.")] = "plate,panel",
    workers: Annotated[int, typer.Option(help="Processes.", min=1)] = 1,
    out: Out = None,
) -> None:
    """Conceal effects, diagnose every case blindly, open the seals, print who was called what."""
    from chladni_evidence.blind import answered_rows, blinds, line
    from chladni_evidence.evidence_sets import seed_range
    from chladni_evidence.score import Row, confusion, summary

    place, rows = out or Path("runs") / "blind", []
    make_folder(place)
    cases = blinds(place, seed_range(seeds), _names(effects), _names(structures))

    def told(row: Row) -> None:
        rows.append(row)
        say(line(row))
        write_json(place / "blind.json", rows)

    with locked(place):
        answered_rows(cases, workers, told)
    text = f"{confusion(rows)}\n\n{summary(rows)}"
    write_text(place / "confusion.txt", text + "\n")
    say(text)


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]
