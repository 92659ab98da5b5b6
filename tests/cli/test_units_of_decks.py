"""A bare deck in a unit system in which it cannot be meant: refused, or said where none fits."""

import itertools
import re

import pytest
from tests.builders.commands import ran
from tests.builders.decks import flat_sheet
from tests.builders.refusals import says

from chladni.units import UNITS
from chladni.workflows.loaded_model import load_deck

from .test_command_contract import READERS

SIDE, THICK, E, RHO = 0.3, 1e-3, 2.1e11, 7850.0  # SI


def written(path, u, E=E, rho=RHO, side=SIDE):
    """A plate of 4 by 4 shells whose numbers are those of a unit system."""
    lines = [f"MAT1,1,{E / u.stress:.5e},,.3,{rho / u.density:.5e}"]
    lines += [f"PSHELL,1,1,{THICK / u.length:.5e},1,,1", "SPC1,1,123456,1"]
    sheet = flat_sheet(4, 4, side / u.length, side / u.length)
    path.write_text("\n".join(["BEGIN BULK", *lines, *sheet, "ENDDATA", ""]))
    return path


def test_a_deck_of_known_materials_is_read_in_their_system_alone(tmp_path):
    for meant, said in itertools.product(UNITS.values(), repeat=2):
        deck = load_deck(written(tmp_path / "plate.bdf", meant), said)
        if said == meant:
            assert deck.model().notes == ()
            continue
        says(rf"give --units {meant.name}, not {said.name}: .*steel", deck.model)


@pytest.mark.parametrize(
    ("more", "noted"),
    [
        ({"rho": 7850e12}, "no unit system makes its materials known ones; .* with E = 210 GPa"),
        ({"E": 1.0, "rho": 1.0}, "no unit system makes its materials known ones"),
        ({"side": 3e-4}, "the deck is 0.000424 m across, weighs .* check --units"),
        ({"side": 300.0}, "the deck is 424 m across"),
    ],
)
def test_what_no_system_mends_is_a_note(tmp_path, more, noted):
    """A density in another system than E; numbers without units; a deck too small or large."""
    deck = written(tmp_path / "plate.bdf", UNITS["mm-t-s"], **more)
    (note,) = load_deck(deck, "mm-t-s").model().notes
    assert re.search(noted, note)
    assert load_deck(deck).model().notes == ()  # numbers are kept: nothing was said of units


@pytest.mark.parametrize("command", [c for c in READERS if c not in ("bench", "study")])
def test_commands_say_what_looks_odd(tmp_path, command):
    """On the terminal and on the page."""
    deck = written(tmp_path / "plate.bdf", UNITS["SI"], E=7e10, rho=270.0)
    words = [command, deck, *READERS[command], "--units", "SI", "--out", tmp_path / "out"]
    done = ran(*words)
    for said in (done.output, (tmp_path / "out" / "report.html").read_text()):
        assert "no unit system makes its materials known ones" in " ".join(said.split())
