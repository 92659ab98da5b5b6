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


def folded(text):
    """Free-field cards of any length, broken into lines of eight fields."""
    out = []
    for line in text.splitlines():
        tokens = line.split(",") if not line.startswith("$") else [line]
        out.append(",".join(tokens[:9]))
        out += ["," + ",".join(tokens[k : k + 8]) for k in range(9, len(tokens), 8)]
    return "\n".join(out)


@pytest.fixture
def bulk(tmp_path):
    """Write bulk data (and what stands before it) to a file and read it."""

    def read(text, before="", name="deck.bdf", fold=True, **options):
        path = tmp_path / name
        text = folded(text) if fold else text
        path.write_text(f"{before}BEGIN BULK\n{text}\nENDDATA\n" if before else text)
        return read_deck(path, **options)

    return read


@pytest.fixture
def deck(request, tmp_path):
    """(deck, its assembly) of the text DECK of a module, in mm, t, s."""
    path = tmp_path / "deck.bdf"
    path.write_text(request.module.DECK)
    found = read_deck(path)
    return found, assembly(found, UNITS["mm-t-s"])


def real_decks():
    """(folder, main file) of every reference deck; none where the folder is absent."""
    file = ANCHORS / "anchors.json"
    if not file.exists():
        return []
    entries = json.loads(file.read_text())["anchors"]
    return [(e["folder"], e["deck_main"]) for e in entries]


def real_files():
    """Paths of all reference decks and the files they include."""
    kinds = ("*.bdf", "*.dat", "*.nas", "*.inp")
    return sorted(p for kind in kinds for p in ANCHORS.glob(f"*/{kind}"))
