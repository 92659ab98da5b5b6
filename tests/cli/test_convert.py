"""``chladni convert``: a deck, what it holds, what it lacks; nothing is replaced."""

import pytest
from tests.builders.commands import ran, refused

SHEET = """*NODE
1, 0., 0.
2, 300., 0.
3, 300., 200.
4, 0., 200.
*ELEMENT, TYPE=S4R, ELSET=Door
1, 1, 2, 3, 4
"""
SECTION = """*MATERIAL, NAME=STEEL
*ELASTIC
210000., .3
*DENSITY
7.85e-9
*SHELL SECTION, ELSET=Door, MATERIAL=STEEL
1.
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_deck_and_what_it_lacks(here):
    (here / "door.inp").write_text(SHEET + SECTION + "*GAP, ELSET=G\n0.1\n")
    said = " ".join(ran("convert", "door.inp").output.split())
    assert "door.bdf: 4 grids, 1 shell; its mass is 0.471 kg." in said
    assert "units = mm-t-s: in mm-t-s" in said
    assert "1 Door shell 1" in said
    assert "*GAP 1" in said
    assert "next: chladni modes door.bdf --units mm-t-s" in said
    deck = (here / "door.bdf").read_text()
    assert "210000." in deck  # the numbers of the file
    ran("modes", "door.bdf", "--units", "mm-t-s", "--count", "7", "--out", "modes")


def test_a_mesh_alone_needs_its_parts_and_units(here):
    (here / "door.inp").write_text(SHEET)
    words = ("convert", "door.inp", "--out", "new.bdf")
    assert "has no elements with a section; give --part" in refused(*words)
    words = (*words, "--part", "Door: t=1 mm, steel")
    assert "give it by --units" in refused(*words)
    ran(*words, "--units", "mm-t-s")
    assert "exists and is not replaced" in ran(*words, "--units", "mm-t-s", code=2).stderr


def test_units_that_the_materials_contradict_are_refused(here):
    (here / "door.inp").write_text(SHEET + SECTION)
    said = refused("convert", "door.inp", "--units", "SI", "--out", "door.bdf")
    assert "give --units mm-t-s, not SI" in said


def test_a_deck_needs_no_conversion(here):
    (here / "a.bdf").write_text("BEGIN BULK\nGRID,1,,0.,0.,0.\nENDDATA\n")
    assert "a Nastran deck needs no conversion" in refused("convert", "a.bdf", "--out", "b.bdf")
