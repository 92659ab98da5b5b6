"""The case of a call: one that was loaded, one in a folder, or a deck with its recordings."""

from collections.abc import Sequence
from pathlib import Path
from typing import cast

from ..case import Case, load_case
from ..case.make_case import CaseWords, Measured, make_case
from ..errors import FileError
from ..io.nastran import Deck, assembly
from ..io.nastran.edit.model_changes import changes
from ..model.assembly import Assembly
from .loaded_model import DeckModels, Model, exported_deck, is_case, opened, similar_names

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
            return make_case(source, recording, words=words)
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
        return make_case(source, recording, words=words)
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
    return make_case(deck, recording, _changed(model), words)


def _changed(source: Model | DeckModels) -> Assembly | None:
    """The structure of a model, where it has other numbers than its deck."""
    if isinstance(source, DeckModels) or source.deck is None or source.units is None:
        return None
    own = assembly(source.deck, source.units)
    return source.assembly if changes(source.deck, own, source.assembly, source.units) else None
