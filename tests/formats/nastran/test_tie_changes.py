"""Ties that were split, and springs that came beside them, are in the deck as in the structure."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.decks import rewritten
from tests.builders.refusals import says

from chladni.effects.membrane_prestress import prestressed
from chladni.effects.rigid_ties import rigid_ties, sprung

DECK = """\
SOL 103
CEND
BEGIN BULK
MAT1,1,210000.,,.3,7.85-9
PSHELL,1,1,1.0,1,,1
PSHELL,2,1,1.5,1,,1
GRID,1,,0.,0.,0.
GRID,2,,100.,0.,0.
GRID,3,,100.,80.,0.
GRID,4,,0.,90.,0.
GRID,5,,0.,0.,30.
GRID,6,,100.,0.,30.
GRID,7,,100.,80.,30.
GRID,8,,0.,80.,30.
GRID,9,,0.,0.,15.
CQUAD4,1,1,1,2,3,4
CQUAD4,2,2,5,6,7,8
RBE2,11,3,123456,7
RBAR,12,2,6,123456
RBE2,13,9,123456,1,4,5
RBE2,14,9,123,8
ENDDATA
"""


@pytest.mark.parametrize("k", range(4))
def test_a_tie_let_loose_comes_back(deck, k):
    """RBE2 and RBAR whose one follower moves over, an RBE2 split by its sheets."""
    ties = rigid_ties(deck[1])
    assert sorted(len(tie.rows) for tie in ties) == [1, 1, 1, 1, 2]
    assert len(rewritten(*deck, sprung(deck[1], ties[k], 2e5)).found.bushes) == 1


def test_a_membrane_force_comes_back(deck):
    """Springs between grids and between the turns of one, each in its unit."""
    tensor = np.array([[1.0, 0.4, 0.1], [0.4, 0.8, 0.3], [0.1, 0.3, 0.2]])
    again = rewritten(*deck, prestressed(deck[1], 1, tensor, -800.0)).found
    assert (again.springs.value < 0).any()
    assert (again.springs.component > 3).any()


def with_odd_body(made, k):
    """A structure whose bodies of so many followers tie two of them in different motions."""
    odd = tuple(
        replace(b, dependent=b.dependent[:2], components=((1, 2, 3), (1, 2)))
        if len(b.dependent) == k else b for b in made.rigid
    )  # fmt: skip
    return replace(made, rigid=odd)


def test_followers_in_different_motions_are_refused(deck):
    says("follow in different motions", rewritten, *deck, with_odd_body(deck[1], 3))


def test_a_new_body_of_several_motions_comes_back(deck):
    """It is one RBE2 for each set of motions."""
    tie = next(t for t in rigid_ties(deck[1]) if len(t.rows) == 2)
    rewritten(*deck, with_odd_body(sprung(deck[1], tie, 2e5), 2))
