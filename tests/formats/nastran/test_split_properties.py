"""Shells that take a property of their own are the structure that was found, read again."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.decks import opened, rewritten, same

from chladni.errors import ModelError
from chladni.io.nastran import assembly, read_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.properties import Isotropic
from chladni.units import UNITS
from chladni_specimens.plates import folded_panel


@pytest.fixture(params=["mm-t-s", "SI", "mm-kg-ms"])
def panel(request, tmp_path):
    """(deck, its assembly, units) of a folded panel; both parts share one MAT1."""
    return opened(folded_panel(0.3, 0.2, 0.04, 0.01, 0.04), tmp_path, request.param)


def split(made, shells, **section):
    """Some shells of one part as a part of their own, with other section values."""
    part, parts = made.shells.part.copy(), list(made.parts)
    source = parts[part[shells][0]]
    part[shells] = len(parts)
    new = replace(source.with_section(**section), id=source.id, name="patch")  # its id is taken
    return replace(made, parts=(*parts, new), shells=replace(made.shells, part=part))


def test_bending_alone_of_some_shells(panel):
    deck, before, units = panel
    shells = np.flatnonzero(before.shells.part == 0)[3:9]
    after = split(before, shells, bending_ratio=0.3)
    found, *_ = rewritten(deck, before, after, units)
    same(found, after, before, 1e-3)
    moved = {int(i) for p, i in zip(found.shells.part, found.shells.ids, strict=True) if p == 2}
    assert moved == set(before.shells.ids[shells].tolist())
    assert len({p.id for p in found.parts}) == 3


def test_bending_of_a_whole_part(panel):
    deck, before, units = panel
    one = before.parts[1].with_section(bending_ratio=0.5)
    after = before.with_parts((before.parts[0], one))
    found, *_ = rewritten(deck, before, after, units)
    assert [p.section.bending_ratio for p in found.parts] == pytest.approx([1.0, 0.5])


def test_another_material_and_thickness_of_some_shells(panel):
    """The patch names a material of its own; the rest keeps the deck's."""
    deck, before, units = panel
    shells = np.flatnonzero(before.shells.part == 1)[:4]
    soft = Isotropic(7e10, 0.33, 2700.0, id=before.parts[1].section.membrane.id)
    after = split(before, shells, membrane=soft, bending=soft, shear=soft)
    t = after.shells.thickness.copy()
    t[shells] *= 1.5
    after = replace(after, shells=replace(after.shells, thickness=t))
    found, *_ = rewritten(deck, before, after, units)
    same(found, after, before)
    moduli = sorted(p.section.membrane.E for p in found.parts)
    assert moduli == pytest.approx([7e10, 2.1e11, 2.1e11])


def test_shells_of_two_properties_have_no_common_copy(panel):
    deck, before, units = panel
    both = [int(np.flatnonzero(before.shells.part == k)[0]) for k in (0, 1)]
    with pytest.raises(ModelError, match="elements of patch come from 2 properties"):
        changes(deck, before, split(before, both, bending_ratio=0.5), units)


def test_a_shell_cannot_change_to_another_property_of_the_deck(panel):
    deck, before, units = panel
    part = before.shells.part.copy()
    part[0] = 1 - part[0]
    with pytest.raises(ModelError, match="from one property of the deck to another"):
        changes(deck, before, replace(before, shells=replace(before.shells, part=part)), units)


def test_a_laminate_has_no_copy(tmp_path):
    text = """BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,1.,1.,0.
GRID,4,,0.,1.,0.
GRID,5,,2.,0.,0.
GRID,6,,2.,1.,0.
CQUAD4,1,1,1,2,3,4
CQUAD4,2,1,2,5,6,3
PCOMP,1
,1,0.001,0.,,1,0.001,90.
MAT1,1,7.+10,,0.3,2700.
ENDDATA
"""
    (tmp_path / "deck.bdf").write_text(text)
    deck = read_deck(tmp_path / "deck.bdf")
    before = assembly(deck, UNITS["SI"])
    with pytest.raises(ModelError, match="property 1 is none of PSHELL"):
        changes(deck, before, split(before, [1], bending_ratio=0.5), UNITS["SI"])
