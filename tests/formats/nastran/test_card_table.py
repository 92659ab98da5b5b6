"""Every card of the table is acted upon, and nothing says that it is not."""

import re
from collections import Counter
from pathlib import Path

from chladni.io.nastran import read
from chladni.io.nastran.read.analysis_requests import LEFT_OUT
from chladni.io.nastran.read.assembly_from_deck import _ELEMENTS
from chladni.io.nastran.text.cards import FIELDS, LEGACY
from chladni.io.nastran.text.known_cards import HARMLESS, REFUSED, SELECTED

SOURCE = "".join(p.read_text() for p in Path(read.__file__).parent.glob("*.py"))
TIES = ("RBE1", "RBE2", "RBE3", "RBAR", "RROD", "RSPLINE", "RTRPLT")  # ids of their own


def test_no_card_is_read_and_said_to_be_left_out():
    assert not FIELDS.keys() & LEFT_OUT.keys()


def test_no_card_stands_in_two_lists():
    """Read, read as a kin of today, passed over, refused, or refused where it is selected."""
    lists = (FIELDS.keys(), LEGACY, HARMLESS, REFUSED, SELECTED)
    count = Counter(name for names in lists for name in names)
    assert not [name for name, times in count.items() if times > 1]


def test_every_card_is_read():
    """Its name stands in a module of ``read``; coordinate systems are read by how they begin."""
    said = {name for name in FIELDS if re.search(rf"\b{name}\b", SOURCE)}
    systems = {f"CORD{k}{kind}" for k in (1, 2) for kind in "RCS"}
    assert FIELDS.keys() - systems == said - systems


def test_ids_of_all_elements_are_held_apart():
    """What has an EID is an element, a mass or a tie."""
    elements = {name for name, fields in FIELDS.items() if fields[0] == "EID"}
    assert elements - {*TIES} <= set().union(*_ELEMENTS)
