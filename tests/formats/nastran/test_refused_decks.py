"""Every user mistake is one sentence: file, line, card, what is wrong, what there is instead."""

from functools import partial
from pathlib import Path

import pytest
from tests.builders.refusals import damaged, refusals, says

import chladni
from chladni.errors import FileError
from chladni.io.nastran import analysis, assembly, read_deck

from .conftest import CUBE, PLATE, SETS, folded
from .test_odd_properties import brick, control, line, sheet

BAR = "CBAR,8,1,1,2,0.,0.,1.\n"
DECKS = {
    "plate": PLATE,
    "plate and a bar": PLATE + BAR,
    "plate and a beam": PLATE + BAR.replace("BAR", "BEAM"),
    "plate with supports": f"CEND\nSPC = 1\nMPC = 1\nBEGIN BULK\n{PLATE}{SETS}",
    "plate without sets": PLATE,
    "cube": CUBE,
    "text": "",
    "sheet": control(sheet()),
    "line": control(line("PBAR,1,1,100.,800.,900.,9.")),
    "brick": control(brick()),
}
READERS = {
    "assembly": lambda path: assembly(read_deck(path)),
    "analysis": lambda path: analysis(read_deck(path)),
    "modes": partial(chladni.modes, units="mm-t-s"),
}


@refusals(Path(__file__).with_suffix(".txt"))
def test_every_mistake_is_one_sentence(tmp_path, kind, damage, said):
    reader, _, deck = kind.partition(" of a ")
    path = tmp_path / "deck.bdf"
    path.write_text(folded(damaged(DECKS[deck], damage)), encoding="utf-8")
    sentence = says(said, READERS[reader], path)
    assert "deck.bdf" in sentence or reader == "modes"


def test_a_subcase_that_is_not_there(bulk):
    deck = bulk(PLATE, before="CEND\nSUBCASE 1\n")
    says("there is no subcase 5; there are 1", assembly, deck, subcase=5)


@pytest.mark.parametrize(
    "card",
    """RBAR1,9,1,3,123456
    RBE22,9,1,123456,3 SPCC1,1,123456,1 MFLUID,1 MLIST,1 SESET,1,2 BCTABLE,1 TF,1,1,1
    BCPROP,1 XYZ,4 CSEAM,9,1 CQUAD,9,1 RJOINT,9""".split(),
)
def test_a_card_not_known_is_refused_unless_allowed(bulk, card):
    name = card.partition(",")[0]
    says(rf"deck.bdf:8: {name} .*--allow {name}$", bulk, f"{PLATE}{card}\n")
    assert len(bulk(f"{PLATE}{card}\n", allow=(name.lower(),))[name]) == 1


@pytest.mark.parametrize(
    "line",
    ["SPCC = 1", "MFLUID = 1", "BCONTACT = 1", "STATSUB = 1", "TFL = 3", "NOSUCH",
     "SUBCASE 1\n  LOADD = 3"],
)  # fmt: skip
def test_a_command_not_known_is_refused_unless_allowed(bulk, line):
    name, before = line.split("\n")[-1].split("=")[0].strip(), f"SOL 103\nCEND\n{line}\n"
    says(rf"deck.bdf:\d+: the command {name} .*--allow {name}$", bulk, PLATE, before)
    assert bulk(PLATE, before=before, allow=(name,)).case.sol == 103


def test_what_is_no_deck_is_refused(tmp_path):
    (tmp_path / "deck.op2").write_bytes(b"\0\1\2\3" * 100)
    for name, said in (("", "folder"), ("none.bdf", "cannot be read"), ("deck.op2", "binary")):
        says(said, read_deck, tmp_path / name, error=FileError)
