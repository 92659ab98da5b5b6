"""Rigid elements that lead others than before, put into their cards."""

from collections.abc import Iterator

from ....errors import ModelError
from ....model.assembly import Assembly, RigidBody
from .. import Deck
from .changes import Change, Replace

_KINDS = ("RBE2", "RBAR")  # what becomes an RBE2 where it changes


def tie_changes(deck: Deck, before: Assembly, after: Assembly) -> Iterator[Change]:
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
        yield Replace(kinds[0], now.id, rbe2(after, now))


def rbe2(assembly: Assembly, body: RigidBody) -> list[int | str]:
    """The card of a rigid element whose followers all follow in the same motions."""
    motions = {"".join(map(str, sorted(c))) for c in body.components}
    if len(motions) != 1:
        raise ModelError(f"the followers of rigid element {body.id} follow in different motions")
    ids = assembly.ids
    return ["RBE2", body.id, int(ids[body.independent]), int(motions.pop()),
            *(int(ids[row]) for row in body.dependent)]  # fmt: skip
