"""A laminate's calibration is put into its layers, and the deck read again is what was found."""

import re
from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from tests.builders.decks import flat_sheet, rewritten
from tests.builders.refusals import says

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.element_groups import element_groups
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck, write_assembly
from chladni.io.nastran.edit.laminate_changes import laminate_changes
from chladni.io.nastran.edit.model_changes import changes
from chladni.units import UNITS
from chladni_specimens.plates import folded_panel

MM = UNITS["mm-t-s"]
PLY = "MAT8,7,1.3+5,9.+3,.31,5.+3,4.5+3,3.5+3,1.6-9\n"
STACKS = {
    "angles": "PCOMP,{0},,2.-9\n,7,.3,30.,,,,-40.\n,1,.2,0.,,7,.25,90.\n",
    "off its plane": "PCOMP,{0},.1\n,7,.4,0.,,7,.4,60.\n",
    "symmetric": "PCOMP,{0},,,,,,,SYM\n,7,.2,0.,,7,.3,45.\n",
    "smeared": "PCOMP,{0},,,,,,,SMEAR\n,7,.2,0.,,7,.3,45.\n",
    "core": "PCOMP,{0},,,,,,,SMCORE\n,7,.2,0.,,7,.3,45.\n,7,3.,20.\n",
    "numbered": "PCOMPG,{0}\n,1,7,.4,0.\n,2,7,.3,90.\n",
}


@pytest.fixture(params=STACKS.values(), ids=STACKS)
def deck(request, tmp_path):
    """A panel whose two parts are laminates of the same ply."""
    return opened(tmp_path, request.param, request.param)


def opened(folder, *stacks):
    """Deck and assembly; an empty stack leaves a part its PSHELL."""
    path = write_assembly(folded_panel(0.3, 0.2, 0.04, 0.01, 0.04), folder / "plain.bdf", MM)
    text = path.read_text().replace("ENDDATA", PLY + "ENDDATA")
    for id, stack in enumerate(stacks, start=1):
        if stack:
            text = re.sub(rf"PSHELL  .{{7}}{id}.*\n", stack.format(id), text)
    path = path.with_name("deck.bdf")
    path.write_text(text)
    found = read_deck(path)
    return found, assembly(found, MM)


def calibrated(before, quantities, positions):
    groups = element_groups(structure(before), 8)
    for quantity, x in quantities.items():
        before = calibration_parameter(groups, quantity, positions).apply(before, np.array([x]))
    return before


@pytest.mark.parametrize(("quantities", "positions"), [
    ({"E": 0.07}, (1,)), ({"rho": -0.06}, (1,)), ({"t": 0.05}, (1,)),
    ({"E": -0.03, "rho": 0.04, "t": -0.08}, (0, 1)),
])  # fmt: skip
def test_common_factors_are_written_exactly(deck, quantities, positions):
    made, before = deck
    assert changes(made, before, before, MM) == []
    after = calibrated(before, quantities, positions)
    found, *_ = rewritten(made, before, after)
    np.testing.assert_allclose(found.shells.offset, after.shells.offset, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(("stack", "position"), [
    ("PCOMP,{0}\n,1,.4,0.,,7,.4,0.\n", 0),  # MAT1 1 is a layer of one part, the whole of the other
    (STACKS["symmetric"], 1),  # the smeared material goes by the property's id, a MAT1's too
])  # fmt: skip
def test_a_ply_that_a_plain_sheet_uses_too_is_copied(tmp_path, stack, position):
    made, before = opened(tmp_path, stack, "")
    rewritten(made, before, calibrated(before, {"E": 0.1}, (position,)))


def test_what_layers_cannot_take_on_together_is_refused(deck):
    made, before = deck
    t = before.shells.thickness.copy()
    t[np.flatnonzero(before.shells.part == 0)[3]] *= 0.9
    thin = replace(before, shells=replace(before.shells, thickness=t))
    section = before.parts[0].section
    stiff = replace(section.bending, Q=1.1 * section.bending.Q)
    bent = before.with_parts((before.parts[0].with_section(bending=stiff), before.parts[1]))
    for after in (thin, bent):
        said = r"laminate .* changed in a way that its layers cannot"
        says(said, laminate_changes, made, before, after, MM, count(900))


def test_a_laminate_has_no_copy(tmp_path):
    cards = ["BEGIN BULK", *flat_sheet(2, 1, 2.0, 1.0), "PCOMP,1", ",1,0.001,0.,,1,0.001,90."]
    (tmp_path / "deck.bdf").write_text("\n".join([*cards, "MAT1,1,7.+10,,0.3,2700.", "ENDDATA"]))
    made = read_deck(tmp_path / "deck.bdf")
    before = assembly(made, UNITS["SI"])
    patch = replace(before.parts[0].with_section(bending_ratio=0.5), name="patch")
    shells = replace(before.shells, part=np.array([0, 1]))
    after = replace(before, parts=(*before.parts, patch), shells=shells)
    says("property 1 is none of PSHELL", changes, made, before, after, UNITS["SI"])
