"""The case of a call: one that was loaded, one in a folder, or a deck with its recordings."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

from ..case import Case, load_case
from ..case.make_case import CaseWords, Measured, make_case
from ..errors import FileError
from ..io.nastran import Deck, assembly
from ..io.nastran.edit.model_changes import changes
from ..model.assembly import Assembly
from .loaded_model import (
    DeckModels,
    Model,
    exported_deck,
    is_case,
    load_deck,
    opened,
    similar_names,
)
from .unit_guess import guessed_units

Source = Case | Model | DeckModels | Assembly | Deck | str | Path
"""A case (or its folder), a deck (or its path), a model that was loaded, or a structure in SI."""


def given_case(
    source: Source, recording: Measured | Sequence[Measured] = (), words: CaseWords | None = None
) -> Case:
    """Resolve the arguments of a call into a case."""
    words = {} if words is None else words
    if isinstance(source, str | Path):
        source = Path(source)
        if not source.exists():
            raise FileError(f"no file or folder {source}{similar_names(source)}")
        if not is_case(source):
            source = load_deck(source, allow=words.get("allow", ())).deck
        else:
            source = load_case(source)
    if isinstance(source, Case):
        none = isinstance(recording, tuple | list) and not recording
        extra = [*([] if none else ["recording"]), *words]
        if extra:
            raise FileError(
                f"{source.path} says everything itself; leave out {', '.join(extra)}, or give the "
                "deck in place of the case"
            )
        return source
    if isinstance(source, Deck):
        return _of_deck(source, recording, None, words)
    model = opened(source)
    assert isinstance(model, Model | DeckModels)
    if model.units is not None:
        if words.get("units", model.units.name) != model.units.name:
            raise FileError(f"argument units: the model was loaded in {model.units.name}")
        words = cast(CaseWords, {**words, "units": model.units.name})
    deck = model.deck
    if deck is None:
        assert isinstance(model, Model)
        deck = exported_deck(model.assembly)
    return _of_deck(deck, recording, _changed(model), words)


def _of_deck(
    deck: Deck,
    recording: Measured | Sequence[Measured],
    made: Assembly | None,
    words: CaseWords,
) -> Case:
    """The case of a deck; without ``units`` its materials say them, and a note says why."""
    if words.get("units") is not None:
        return make_case(deck, recording, made, words)
    guess = guessed_units(assembly(deck), deck.path.name)
    if not guess.sure:
        raise FileError(f"{deck.path}: {guess.why}; another system fits too: state units")
    case = make_case(deck, recording, made, cast(CaseWords, {**words, "units": guess.units.name}))
    return replace(case, notes=(f"units = {guess.units.name}: {guess.why}", *case.notes))


def _changed(source: Model | DeckModels) -> Assembly | None:
    """The structure of a model, where it has other numbers than its deck."""
    if isinstance(source, DeckModels) or source.deck is None or source.units is None:
        return None
    own = assembly(source.deck, source.units)
    return source.assembly if changes(source.deck, own, source.assembly, source.units) else None
