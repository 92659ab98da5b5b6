"""Ties that were split, and springs that came beside them, are in the deck as in the structure."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.membrane_prestress import prestressed
from chladni.effects.rigid_ties import rigid_ties, sprung
from chladni.errors import ModelError
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck, write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.assembly import RigidBody
from chladni.units import UNITS

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


def written(deck, made, tmp_path):
    read, before = deck
    write_deck(read, tmp_path / "new.bdf", changes(read, before, made, UNITS["mm-t-s"]))
    return assembly(read_deck(tmp_path / "new.bdf"), UNITS["mm-t-s"])


def alike(one, two):
    """The same stiffness and mass over the same free motions."""
    one, two = structure(one).system, structure(two).system
    assert np.array_equal(one.dofs, two.dofs)
    for a, b in ((one.K, two.K), (one.M, two.M)):
        assert_allclose(b.toarray(), a.toarray(), atol=2e-6 * np.abs(a.toarray()).max())


@pytest.mark.parametrize("k", range(4))
def test_a_tie_let_loose_comes_back(deck, tmp_path, k):
    """RBE2 and RBAR whose one follower moves over, an RBE2 split by its sheets."""
    ties = rigid_ties(deck[1])
    assert sorted(len(tie.rows) for tie in ties) == [1, 1, 1, 1, 2]
    made = sprung(deck[1], ties[k], 2e5)
    again = written(deck, made, tmp_path)
    alike(made, again)
    assert len(again.bushes) == 1


def test_a_membrane_force_comes_back(deck, tmp_path):
    """Springs between grids and between the turns of one, each in its unit."""
    tensor = np.array([[1.0, 0.4, 0.1], [0.4, 0.8, 0.3], [0.1, 0.3, 0.2]])
    made = prestressed(deck[1], 1, tensor, -800.0)
    again = written(deck, made, tmp_path)
    alike(made, again)
    assert (again.springs.value < 0).any()
    assert (again.springs.component > 3).any()


def test_followers_in_different_motions_are_refused(deck, tmp_path):
    body = next(b for b in deck[1].rigid if isinstance(b, RigidBody) and len(b.dependent) > 1)
    odd = replace(body, dependent=body.dependent[:2], components=((1, 2, 3), (1, 2)))
    rigid = tuple(odd if b is body else b for b in deck[1].rigid)
    with pytest.raises(ModelError, match="follow in different motions"):
        written(deck, replace(deck[1], rigid=rigid), tmp_path)


def test_a_new_body_of_several_motions_comes_back(deck, tmp_path):
    """It is one RBE2 for each set of motions."""
    tie = next(t for t in rigid_ties(deck[1]) if len(t.rows) == 2)
    made = sprung(deck[1], tie, 2e5)
    odd = [replace(b, components=((1, 2, 3), (1, 2))) if len(b.dependent) == 2 else b
           for b in made.rigid]  # fmt: skip
    made = replace(made, rigid=tuple(odd))
    alike(made, written(deck, made, tmp_path))
