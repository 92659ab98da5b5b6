"""Decks written by the tests themselves, and the real ones where they are at hand."""

import json
from pathlib import Path

import pytest

from chladni.io.nastran import assembly, read_deck
from chladni.units import UNITS

ANCHORS = Path(__file__).resolve().parents[3] / "../shared/anchors"

PLATE = """\
GRID,1,,0.,0.,0.
GRID,2,,10.,0.,0.
GRID,3,,10.,10.,0.
GRID,4,,0.,10.,0.
CQUAD4,7,101,1,2,3,4
PSHELL,101,5,2.,5,,5
MAT1,5,2.1+5,,.3,7.85-9
"""
SETS = "SPC1,1,123456,1\nMPC,1,2,1,1.,3,1,-1.\n"
CUBE = """\
GRID,1,,0.,0.,0.
GRID,2,,2.,0.,0.
GRID,3,,2.,3.,0.
GRID,4,,0.,3.,0.
GRID,5,,0.,0.,5.
GRID,6,,2.,0.,5.
GRID,7,,2.,3.,5.
GRID,8,,0.,3.,5.
CHEXA,9,1,1,2,3,4,5,6,7,8
PSOLID,1,5
MAT1,5,1.,,.3
"""


def folded(text):
    """Free-field cards of any length, broken into lines of eight fields."""
    out = []
    for line in text.splitlines():
        tokens = line.split(",") if not line.startswith("$") else [line]
        out.append(",".join(tokens[:9]))
        out += ["," + ",".join(tokens[k : k + 8]) for k in range(9, len(tokens), 8)]
    return "\n".join([*out, ""])


@pytest.fixture
def bulk(tmp_path):
    """Write bulk data (and what stands before it) to a file and read it."""

    def read(text, before="", fold=True, **options):
        path = tmp_path / "deck.bdf"
        text = folded(text) if fold else text.rstrip("\n") + "\n"
        path.write_text(f"{before}BEGIN BULK\n{text}ENDDATA\n" if before else text)
        return read_deck(path, **options)

    return read


@pytest.fixture
def deck(request, tmp_path):
    """(deck, its assembly) of the text DECK of a module, in mm, t, s."""
    path = tmp_path / "deck.bdf"
    path.write_text(request.module.DECK)
    found = read_deck(path)
    return found, assembly(found, UNITS["mm-t-s"])


needs_decks = pytest.mark.skipif(not ANCHORS.exists(), reason="reference decks are not at hand")


def real_decks():
    """The paths of all reference decks, as cases of a test; none where the folder is absent."""
    file = ANCHORS / "anchors.json"
    entries = json.loads(file.read_text())["anchors"] if file.exists() else []
    paths = [ANCHORS / e["folder"] / e["deck_main"] for e in entries]
    return pytest.mark.parametrize("path", paths, ids=[p.parent.name for p in paths])


def read_real(path):
    return read_deck(path, allow=("CTRPLT1",))
