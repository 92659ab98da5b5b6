"""``chladni check-effect``: an effect against the contract of effects, in seconds."""

from pathlib import Path
from typing import Annotated

import typer

from chladni.cli.run import Allow, Out, Units, started
from chladni.progress import within
from chladni.results import to_json
from chladni.workflows.loaded_model import load_model

from . import check_effect


def run(
    effect: Annotated[
        str, typer.Argument(metavar="NAME", help="Name of an effect: installed, or of chladni.")
    ],
    deck: Annotated[
        Path | None,
        typer.Option(help="Deck or case to check it on; default: a generated plate."),
    ] = None,
    units: Units = None,
    allow: Allow = None,
    out: Out = None,
) -> None:
    """Check an effect in seconds: its slopes, deck, cards, places, bench and visibility.

    The exit code is 3 if the effect breaks a rule.
    """
    from chladni.effects import registry

    from .effect_check_page import as_page

    family = registry.family(effect)
    with started("check-effect", deck or Path(effect), out) as job:
        model = None if deck is None else load_model(deck, units, allow or (), None, "check-effect")
        job.note(() if model is None else model.notes)
        found = check_effect(family, model, progress=within(job.progress, 0.0, 0.95))
        job.json("effect.json", to_json(found))
        job.show(as_page(job.folder, found))
    found.trusted()
