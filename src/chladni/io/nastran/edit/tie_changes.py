"""Rigid elements that lead others than before, put into their cards."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import count

from ....errors import ModelError
from ....model.assembly import Assembly, RigidBody
from ....units import Units
from .. import Deck
from ..export.tie_cards import ties
from .changes import Change, Replace

_KINDS = ("RBE2", "RBAR")  # what becomes an RBE2 where it changes


def tie_changes(deck: Deck, before: Assembly, after: Assembly, units: Units) -> Iterator[Change]:
    """An RBE2 in place of every rigid element whose independent point or followers changed.

    Raises
    ------
    ModelError
        If the element is of another kind, or its followers do not all follow in the same motions.
    """
    for was, now in zip(before.rigid, after.rigid, strict=False):
        if not isinstance(was, RigidBody) or not isinstance(now, RigidBody):
            continue
        if (was.independent, was.dependent) == (now.independent, now.dependent):
            continue
        kinds = [kind for kind in _KINDS for c in deck.present(kind) if now.id in c.integers(1)]
        if len(kinds) != 1:
            raise ModelError(
                f"{deck.path}: rigid element {now.id} is not an RBE2 and cannot be split"
            )
        alone = replace(after, rigid=(now,))
        card, *more = ties(alone, units, iter([now.id]), count(now.id + 1))
        if more:
            raise ModelError(f"the followers of rigid element {now.id} follow in different motions")
        yield Replace(kinds[0], now.id, card)
