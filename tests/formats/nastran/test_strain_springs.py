"""Panels, arcs and splines in a deck: written as they were, and as a new deck of springs."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.decks import alike, opened, rewritten

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck
from chladni.units import UNITS
from chladni_studies.variation import of_parts
from chladni_studies.vary_text import vary_text

BEFORE = "SOL 103\nCEND\nSPC = 1\nBEGIN BULK\n"
DECK = (
    BEFORE
    + """\
CORD2R,6,,0.,0.,0.,1.,2.,3.
,3.,-1.,1.
GRID,1,,0.,0.,0.
GRID,2,,100.,0.,0.,6
GRID,3,,100.,80.,0.
GRID,4,,0.,80.,0.
GRID,5,,160.,0.,0.
GRID,6,,160.,80.,20.
GRID,7,,220.,60.,0.,6
GRID,11,,0.,20.,0.
GRID,12,,0.,55.,0.
CQUAD4,1,1,1,2,3,4
PSHELL,1,1,2.,1,,1
CSHEAR,2,2,2,5,6,3
PSHEAR,2,1,1.,3.-9,1.,20.
CBEND,3,3,5,7,1.,0.,0.,2
PBEND,3,1,30.,200.,300.,400.
RSPLINE,4,,1,11,123456,12,123456,4
CONM2,5,11,,1.-6
CONM2,6,12,,2.-6
MAT1,1,210000.,,.3,7.85-9
SPC1,1,123456,4,6
SPC1,1,6,1,3
ENDDATA
"""
)


def frequencies(made):
    return normal_modes(structure(made).system, 8).frequency


def test_the_cards_stay_where_something_else_changes(deck):
    """A thinner sheet changes its PSHELL alone; the deck read again has the changed structure."""
    found, before = deck
    thinner = replace(before.shells, thickness=0.8 * before.shells.thickness)
    section = before.parts[0].with_section(thickness=0.8 * before.parts[0].section.thickness)
    after = replace(before, shells=thinner).with_parts((section,))
    _, gone, fresh = rewritten(found, before, after)
    assert [line.split(",")[0] for line in gone] == ["PSHELL"]
    assert len(fresh) == 1


def test_a_new_deck_of_the_structure_has_the_same_modes(deck, tmp_path):
    """Scalar points, equations and springs stand for panel and arc; units of another system."""
    _, before = deck
    _, again, _ = opened(before, tmp_path, "mm-kg-s")
    np.testing.assert_allclose(frequencies(again), frequencies(before), rtol=1e-6, atol=1e-2)


def test_numbers_without_units_are_those_of_the_deck(deck):
    """The same stiffness in N/mm as in N/m, rotations of RSPLINE and CBEND included."""
    found, before = deck
    plain, scale = assembly(found), 1000.0
    K, due = (structure(a).system for a in (plain, before))
    unit = np.where(due.dofs[:, 1] <= 3, 1.0, 1 / scale)
    d = np.sqrt(due.K.diagonal())
    gap = K.K.toarray() * scale * np.outer(unit, unit) - due.K.toarray()
    assert np.abs(gap / np.outer(d, d)).max() < 1e-9
    with pytest.raises(AssertionError):
        alike(
            before,
            replace(before, springs=replace(before.springs, value=0.9 * before.springs.value)),
        )


def test_elements_that_are_allowed_are_passed_over(deck):
    """--allow of a card that has been read since stays what it was: the structure without it."""
    found, before = deck
    names = ("CSHEAR", "CBEND", "RSPLINE")
    bare = assembly(read_deck(found.path, names), "mm-t-s", loose=True)
    assert not len(bare.springs)
    assert not bare.rigid
    assert len(bare.masses) == 2
    assert len(before.springs) == 1 + 2 + 2 + 6


def test_what_is_freed_stands_on_a_card_of_its_own(deck):
    """K without parts means springs and bushes, not the deformations of a panel; PFAST has a K."""
    found, before = deck
    more = (
        "CELAS2,81,5.,3,3\nGRID,8,,50.,40.,5.\nGRID,9,,50.,40.,-5.\nCFAST,82,83,ELEM,1,1,,8,9\n"
        "PFAST,83,5.,,,1.+5,1.+5,1.+5,1.+7\n,1.+7,1.+7,.5-6\n"
    )
    found.path.write_text(found.path.read_text().replace("ENDDATA", f"{more}ENDDATA"))
    again = read_deck(found.path)
    made = assembly(again, "mm-t-s")
    assert len(made.springs) == len(before.springs) + 1
    for text, springs in (("K=90%:110%", [0]), ("K of PFAST 83=90%:110%", [])):
        varied = of_parts(vary_text(text), made, again, UNITS["mm-t-s"])
        changed = varied.applied(made, 1.1)
        moved = np.flatnonzero(changed.springs.value != made.springs.value)
        assert moved.tolist() == springs
        np.testing.assert_allclose(changed.bushes.stiffness, 1.1 * made.bushes.stiffness)
        rewritten(again, made, changed)
