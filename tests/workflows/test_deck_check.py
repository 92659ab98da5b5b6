"""The table of a deck's cards: what is read, left out, passed over, not understood."""

import json

import pytest
from tests.builders.commands import ran

from chladni.workflows.deck_check import check_deck

CARDS = """\
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,1.,1.,0.
GRID,4,,0.,1.,0.
CQUAD4,7,101,1,2,3,4
PSHELL,101,5,2.-3,5
MAT1,5,7.+10,,.3,2700.
DESVAR,1,A,1.
RFORCE,1,1,,2.
TF,1,1,1
"""
STRANGE = "CSEAM,1,2\nCSEAM,2,2\n"


@pytest.fixture
def deck(tmp_path):
    def made(cards, control=""):
        path = tmp_path / "deck.bdf"
        path.write_text(f"SOL 103\nCEND\n{control}BEGIN BULK\n{cards}ENDDATA\n")
        return path

    return made


def test_every_card_has_its_use(deck):
    found = check_deck(deck(CARDS))
    uses = {row.name: (row.count, row.use) for row in found.cards}
    assert not found.refused
    assert uses["GRID"] == (4, "read")
    assert uses["RFORCE"] == (1, "left out")
    assert uses["DESVAR"] == uses["TF"] == (1, "passed over")


def test_what_is_not_understood_stands_first_with_its_meaning(deck, tmp_path):
    path = deck(CARDS + STRANGE, "STATSUB = 2\n")
    ran("check", path, "--out", tmp_path / "out", code=3)
    rows = json.loads((tmp_path / "out" / "check.json").read_text())["cards"]
    assert [(r["name"], r["count"], r["use"]) for r in rows[:3]] == [
        ("CSEAM", 2, "not understood"),
        ("STATSUB", 1, "not understood"),
        ("RFORCE", 1, "left out"),
    ]
    assert "spot welds" in rows[0]["meaning"]
    assert "2 kinds of cards and commands are not" in (tmp_path / "out/report.html").read_text()
    assert "CSEAM (2 cards" in check_deck(path).refused
    found = check_deck(path, ("CSEAM", "STATSUB"))
    assert not found.refused
    assert found.cards[0].use == "allowed"


def test_units_add_content_size_and_mass(deck):
    """A square metre of aluminium 2 mm thick weighs 5.4 kg; of no material, it is doubted."""
    found = check_deck(deck(CARDS), units="SI")
    assert found.facts[0] == ("holds", "4 grids, 1 shells")
    assert found.facts[1:] == (("size", "1 x 1 x 0 m"), ("mass", "5.4 kg in the deck"))
    assert not found.doubt
    odd = check_deck(deck(CARDS.replace("2700.", "270.")), units="SI")
    assert "no unit system makes its materials known ones" in odd.doubt


def test_a_deck_of_known_cards_that_is_no_structure_is_refused_as_everywhere(deck, tmp_path):
    ran("check", deck(CARDS.replace("1,2,3,4\n", "1,2,3,9\n")), "--out", tmp_path / "x", code=2)
    assert not (tmp_path / "x").exists()
