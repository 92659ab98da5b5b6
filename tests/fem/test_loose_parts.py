"""Modes without strain: those of the whole structure are none of a part that a part is loose."""

import pytest
from tests.builders.elements import CUBE

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.modes import rigid_modes
from chladni.fem.assemble import structure
from chladni.fem.loose_parts import loose_grids
from chladni_specimens.plates import plate

DECK = """SOL 103
CEND
{held}
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,.1,0.,0.
GRID,3,,.1,.1,0.
GRID,4,,0.,.1,0.
CQUAD4,1,1,1,2,3,4
PSHELL,1,1,2.-3,1,,1
MAT1,1,2.+11,,.3,7800.
GRID,8,,.2,.1,0.
GRID,9,,.3,.1,0.
CBAR,8,2,3,8,0.,0.,1.
,{pins}
CBAR,9,2,8,9,0.,0.,1.
PBAR,2,1,1.-4,1.-9,1.-9,2.-9
SPC1,1,123456,1,THRU,4
ENDDATA
"""


@pytest.mark.parametrize("held", ["", "SPC = 1"])
@pytest.mark.parametrize(("pins", "loose"), [("", ()), ("5", (9,)), ("56", (9, 9))])
def test_a_hinge_lets_the_end_of_the_bar_go(tmp_path, held, pins, loose):
    """One mechanism a released turn, whatever holds the plate; its far end moves most."""
    deck = tmp_path / "deck.bdf"
    deck.write_text(DECK.format(held=held, pins=pins))
    model = chladni.load(deck, "SI")
    found = chladni.modes(model, 14)
    said = [n for n in found.notes if "a part is loose" in n]
    assert found.rigid.sum() == len(loose) + (0 if held else 6)
    assert bool(said) == bool(loose)
    if said:
        assert said[0].startswith("1 motion " if len(loose) == 1 else "2 motions ")
        assert said[0].endswith("a stiffness is zero; grid 9 moves most")


def test_a_scalar_point_that_follows_is_not_loose(tmp_path):
    """A mass on a spring goes with a free plate that turns, though a scalar point has no place."""
    deck = tmp_path / "deck.bdf"
    more = "SPOINT,90\nCMASS2,12,.01,90,1\nCELAS2,11,2000.,90,1,3,3\nENDDATA"
    deck.write_text(DECK.format(held="", pins="").replace("ENDDATA", more))
    found = chladni.modes(chladni.load(deck, "SI"), 14)
    assert found.rigid.sum() == 6
    assert not [n for n in found.notes if "a part is loose" in n]


def test_a_free_plate_is_whole_and_two_are_not():
    """Rigid modes of one body are rigid motions; six of two bodies are not."""
    s = structure(plate(0.3, 0.2, 3, 2, 1e-3))
    modal = normal_modes(s.system, 9)
    assert rigid_modes(modal).sum() == 6
    assert loose_grids(s, modal.shapes[:, :6]) == ()
    assert len(loose_grids(s, modal.shapes[:, :7])) == 1


def blocks(shared: str, turned: bool) -> str:
    """Two cubes of steel that share a face, an edge or a corner; in turned frames where said."""
    step = {"face": (1, 0, 0), "edge": (1, 1, 0), "corner": (1, 1, 1)}[shared]
    cubes = [[tuple(x) for x in (CUBE + at).tolist()] for at in ((0, 0, 0), step)]
    points = list(dict.fromkeys(cubes[0] + cubes[1]))
    grids = [f"GRID,{k},,{x},{y},{z},{8 * turned}" for k, (x, y, z) in enumerate(points, 1)]
    solids = []
    for k, body in enumerate(cubes, 1):
        corners = [str(points.index(p) + 1) for p in body]
        solids += [f"CHEXA,{k},1,{','.join(corners[:6])}", f",{','.join(corners[6:])}"]
    other = ["PSOLID,1,1", "MAT1,1,2.+11,,.3,7800.", "CORD2R,8,,0.,0.,0.,1.,2.,3.", ",2.,0.,1."]
    return "\n".join(["SOL 103", "CEND", "BEGIN BULK", *grids, *solids, *other, "ENDDATA"])


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("shared", "motions"), [("face", 0), ("edge", 1), ("corner", 3)])
def test_free_solids_are_whole_unless_they_hinge(tmp_path, shared, motions, turned):
    """Grids of solids do not turn, and no grid misses it: an edge is a hinge, a corner a ball."""
    deck = tmp_path / "deck.bdf"
    deck.write_text(blocks(shared, turned))
    found = chladni.modes(chladni.load(deck, "SI"), 14)
    assert found.rigid.sum() == 6 + motions
    said = [n for n in found.notes if "a part is loose" in n]
    assert len(said) == bool(motions)
    assert not said or said[0].startswith(f"{motions} motion")
