"""Comments of an updated deck: what cards cannot hold, and what of the recording was mended."""

from collections.abc import Sequence
from dataclasses import replace

from ..inference.hypothesis_fit import HypothesisFit
from ..io.nastran.edit.changes import Add
from .diagnosis_result import ChangedDeck


def with_remarks(deck: ChangedDeck, named: HypothesisFit | None) -> ChangedDeck:
    """Add to the deck, as comments, the parts of named effects that cards cannot hold."""
    if named is None or deck.changes is None:
        return deck
    said = [e.remarks(named.fit.of(e)).comment for e in named.effects]
    comments = tuple(Add((), text) for text in said if text)
    return replace(deck, changes=(*deck.changes, *comments))


def with_mended(deck: ChangedDeck, mended: Sequence[str]) -> ChangedDeck:
    """Add to a changed deck, as comments, the faults of the recording that were undone."""
    if deck.changes is None or not (deck.changes or deck.source):
        return deck
    comments = tuple(Add((), f"Recording mended: {text}") for text in mended)
    return replace(deck, changes=(*deck.changes, *comments))
