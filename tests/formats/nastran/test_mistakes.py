"""Every user mistake is one sentence: file, line, card, what is wrong, what there is instead."""

import re

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.errors import ChladniError
from chladni.fem.assemble import structure
from chladni.geometry.solid_shapes import jacobians
from chladni.io.nastran import assembly
from chladni.io.nastran.read.analysis_requests import remarks
from chladni.io.nastran.read.beam_profiles import SHAPES

from .conftest import PLATE

Z = "0.,0.,0.,0.,0.,1.,1."  # a CORD2R's points A, B and the first of C

BEAM, SIX = "CBEAM,8,1,1,2,0.,0.,1.\n", ",,,,,,,,\n"
MISTAKES = {
    "grid": (("1,2,3,4", "1,2,3,44"), r":5: CQUAD4 7: grid 44 does not exist.* 4 points, 1 to 4"),
    "property": (("CQUAD4,7,101", "CQUAD4,7,102"), r"no PSHELL or PCOMP 102; there are PSHELL 101"),
    "material": (("101,5,2.", "101,6,2."), r":6: PSHELL 101: material 6 does not .* are 5"),
    "foreign material": (("MAT1,5,2.1+5,,.3", "MAT9,5,1."), "material 5 is a MAT9"),
    "no thickness": (("101,5,2.", "101,5,"), "neither it nor its property gives a thickness"),
    "zero thickness": (("101,5,2.", "101,5,0."), r":6: PSHELL 101: the thickness is 0"),
    "negative thickness": (("101,5,2.", "101,5,-2."), "thickness is -2"),
    "no bending": (("101,5,2.,5,,5", "101,5,2.,5,0.,5"), r"the bending ratio 12I/T3 is 0"),
    "no shear": (("5,,5\n", "5,,5,0.\n"), r":6: PSHELL 101: the shear ratio TS/T is 0"),
    "lighter than nothing": (("5,,5\n", "5,,5,,-2.-8\n"), "its NSM is negative, and more"),
    "duplicate grid": (("GRID,2,,", "GRID,1,,"), r":2: GRID 1: .*already taken at .*:1"),
    "duplicate element": (("MAT1", "CQUAD4,7,101,1,2,4,3\nMAT1"), "CQUAD4 7: .*already taken"),
    "range backwards": (("MAT1", "SPC1,7,3,3,THRU,1\nMAT1"), "SPC1 7: 3 THRU 1 runs backwards"),
    "second GRDSET": (("MAT1", "GRDSET,,,,,,,12\nGRDSET,,,,,,,3\nMAT1"), r":8: a second GR.*:7"),
    "second BAROR": (("MAT1", "CBAR,8,1,1,2\nPBAR,1,5,1.\nBAROR,,,,,0.,0.,1.\nBAROR\nMAT1"),
                     r":10: a second BAROR"),
    "BAROR's vector": (("MAT1", "CBAR,8,1,1,2\nPBAR,1,5,1.\nBAROR,,,,,0.,x,1.\nMAT1"),
                       "BAROR.*X2 is 'X', not a number"),
    "THETA as a system": (("3,4\n", "3,4,-45\n"), "THETA is the integer -45, .* angle is -45[.]"),
    "duplicate across kinds": (("MAT1", "CELAS2,7,1.,1,1\nMAT1"), "id is already taken by CQUAD4"),
    "duplicate property": (("MAT1", "PCOMP,101\n,5,1.\nMAT1"), "PCOMP 101: .*already taken"),
    "duplicate material": (("MAT1", "MAT8,5,1.,1.,.3,1.\nMAT1"), r"id is already taken by MAT1"),
    "same corner": (("1,2,3,4", "1,2,3,3"), "CQUAD4 7: a corner is named twice"),
    "coincident nodes": (("2,,10.,0.", "2,,0.,0."), "CQUAD4 7: its area is zero"),
    "number": (("2,,10.,0.", "2,,1o.,0."), r":2: GRID 2: X1 is '1O.', not a number"),
    "integer": (("GRID,2", "GRID,2.5"), "ID is '2.5', not an integer"),
    "blank": (("1,2,3,4", "1,2,3"), r"CQUAD4 7: G4 is blank, the card is not complete"),
    "no stiffness": (("2.1+5", ""), "neither E nor G is given"),
    "negative E": (("2.1+5", "-2.1+5"), "cannot be negative"),
    "Poisson": ((".3,", ".7,"), "Poisson's ratio 0.7"),
    "negative density": (("7.85-9", "-7.85-9"), "density -7.85e-09 is negative"),
    "system": (("3,4\n", "3,4,77\n"), "coordinate system 77 does not exist"),
    "cyclic system": (("3,4\n", f"3,4,8\nCORD2R,8,9,{Z}\nCORD2R,9,8,{Z}\n"), "defined by itself"),
    "flat system": (("3,4\n", "3,4,8\nCORD2R,8,,0.,0.,0.,0.,0.,1.,0.,0.,2.\n"), "lie on one line"),
    "wtmass text": (("MAT1", "PARAM,WTMASS,HALF\nMAT1"), "WTMASS is 'HALF', not a number"),
    "wtmass": (("MAT1", "PARAM,WTMASS,0.\nMAT1"), "WTMASS is 0"),
    "k6rot": (("MAT1", "PARAM,K6ROT,-1.\nMAT1"), "K6ROT is -1"),
    "component": (("MAT1", "CELAS2,8,1.,1,7\nMAT1"), "not one of 1 to 6"),
    "spring to nothing": (("MAT1", "CELAS2,8,1.\nMAT1"), "joins nothing"),
    "negative inertia": (("MAT1", "CONM2,8,1,,1.,,,,,1.,,-1.\nMAT1"), "CONM2 8: its inertia is ne"),
    "no body": (("MAT1", "CONM1,8,1,,1.,,-1.\nMAT1"), "CONM1 8: its inertia is negative"),
    "PELAS": (("MAT1", "CELAS1,8,3,1,1\nMAT1"), "there is no PELAS 3; there are none"),
    "RBE2 itself": (("MAT1", "RBE2,8,1,123,1\nMAT1"), "grid 1 follows itself"),
    "RBE2 nothing": (("MAT1", "RBE2,8,1,123\nMAT1"), "ties no grids"),
    "digits": (("MAT1", "RBE2,8,1,1283,2\nMAT1"), "component '1283'"),
    "mid-side nodes": (("MAT1", "CTETRA,8,1,1,2,3,4,5,6\n,7\nMAT1"), "mid-side nodes"),
    "flat solid": (("MAT1", "CTETRA,8,1,1,2,3,4\nPSOLID,1,5\nMAT1"), "its volume is zero"),
    "parallel": (("MAT1", "CBAR,8,1,1,2,1.,0.,0.\nPBAR,1,5,1.\nMAT1"), "along its axis"),
    "no orientation": (("MAT1", "CBAR,8,1,1,2\nPBAR,1,5,1.\nMAT1"), "orientation vector .*missing"),
    "bush lateral": (("MAT1", "CBUSH,8,1,1,2\nPBUSH,1,K,1.,2.\nMAT1"), "neither orient"),
    "taper": (("MAT1", "CBEAM,8,1,1,2,0.,0.,1.\nPBEAM,1,5,1.,1.,1.\n,,,,,,,,\n,YESA,1.,2.\nMAT1"),
              "tapered"),
    "taper, small numbers": (("MAT1", f"{BEAM}PBEAM,1,5,1.-4,1.-9,1.-9\n{SIX},YESA,1.,1.-4,2.-9"
                              "\nMAT1"), "tapered"),
    "taper of mass": (("MAT1", f"{BEAM}PBEAM,1,5,1.,1.,1.,,,.1\n{SIX},NO,1.,,,,,,.2\nMAT1"),
                      "tapered"),
    "taper of axis": (("MAT1", f"{BEAM}PBEAM,1,5,1.,1.,1.\n{SIX}\n\n,,,,,.1,.0,.2\nMAT1"),
                      "tapered"),
    "taper of a profile": (("MAT1", f"{BEAM}PBEAML,1,5,,BAR\n,2.,1.,,YES,1.,3.,1.\nMAT1"),
                           "PBEAML 1: a tapered"),
    "profile": (("MAT1", "CBAR,8,1,1,2,0.,0.,1.\nPBARL,1,5,,OVAL\n,1.\nMAT1"), "TYPE 'OVAL'"),
    "profile sizes": (("MAT1", "CBAR,8,1,1,2,0.,0.,1.\nPBARL,1,5,,TUBE\n,1,2\nMAT1"), "no TUBE"),
    "moments of area": (("MAT1", "CBAR,8,1,1,2,0.,0.,1.\nPBAR,1,5,1.,2.,3.\n\n,,,,,,,,\n,,,2.5"
                         "\nMAT1"), "PBAR 1: I12 2.5 is too large"),
    "area": (("MAT1", "CONROD,8,1,2,5,-1.\nMAT1"), "CONROD 8: area -1"),
    "beam lighter than nothing": (("MAT1", "CROD,8,1,1,2\nPROD,1,5,1.,,,-1.-8\nMAT1"),
                                  "PROD 1: its NSM is negative, and more than the beam"),
    "no body's inertia": (("MAT1", "CONM2,8,1,,1.,,,,,1.,,1.,,,3.\nMAT1"),
                          r"CONM2 8: no body has its inertia: .* 3 exceeds 1 \+ 1"),
    "no body's inertia, askew": (("MAT1", "CONM2,8,1,,1.,,,,,2.,-.9,2.,,,.5\nMAT1"),
                                 "CONM2 8: no body has its inertia: .* 2.9 exceeds 0.5"),
    "spc set": (("MAT1", "SPC1,2,a,1\nMAT1"), "'A'"),
}  # fmt: skip


@pytest.mark.parametrize(("change", "match"), MISTAKES.values(), ids=MISTAKES)
def test_every_mistake_is_one_sentence(bulk, change, match):
    with pytest.raises(ChladniError, match=match) as caught:
        assembly(bulk(PLATE.replace(*change, 1)))
    assert "\n" not in str(caught.value)
    assert "deck.bdf" in str(caught.value)


def test_missing_selected_set(bulk):
    with pytest.raises(ChladniError, match="SPC set 9 is selected but there is no such set"):
        assembly(bulk(PLATE + SETS, before="CEND\nSPC = 9\n"))
    with pytest.raises(ChladniError, match="there is no subcase 5; there are 1"):
        assembly(bulk(PLATE, before="CEND\nSUBCASE 1\n"), subcase=5)
    with pytest.raises(ChladniError, match="there is no GRID"):
        assembly(bulk("MAT1,1,1.,,.3\n"))


SETS = "SPC1,1,123456,1\nMPC,1,2,1,1.,3,1,-1.\n"


@pytest.mark.parametrize("kind", ["SPC", "MPC"])
@pytest.mark.parametrize("before", ["CEND\n{} = 7\n", ""], ids=["selected", "no case control"])
@pytest.mark.parametrize(
    ("cards", "said"),
    [
        ("{}ADD,7,7", r"ADD 7: the set joins itself \(7 -> 7\)"),
        ("{}ADD,7,1,8\n{}ADD,8,7", r"ADD [78]: the set joins itself \([78] -> [78] -> [78]\)"),
        ("{}ADD,7,9,10", r"ADD 7: none of the sets it joins exists \(9, 10\); there are .*7"),
        ("{}ADD,7,8\n{}ADD,8,9", r"ADD 7: none of the sets it joins exists \(9\)"),
        ("{}ADD,7", "ADD 7: it joins no sets"),
    ],
    ids=["itself", "a ring", "nothing there", "nothing one deeper", "none"],
)
def test_sets_that_join_others_end_in_sets_that_are_there(bulk, kind, before, cards, said):
    """Else supports or ties would vanish without a word."""
    own = "" if not before and "9" in cards else SETS  # the only set is taken then
    text = PLATE + own + cards.replace("{}", kind) + "\n"
    with pytest.raises(ChladniError, match=rf"deck.bdf:\d+: {kind}{said}"):
        assembly(bulk(text, before=before.replace("{}", kind)))


@pytest.mark.parametrize("value", ["ALL", "7, 8", "7.", "-1", ""])
@pytest.mark.parametrize("kind", ["SPC", "MPC", "LOAD", "METHOD"])
def test_a_selection_names_one_set(bulk, kind, value):
    """A word that is no number selected nothing, so that a cantilever floated."""
    with pytest.raises(ChladniError, match=rf"deck.bdf:2: '{kind} ?= ?.*selects no set; write"):
        bulk(PLATE + SETS, before=f"CEND\n{kind} = {value}\n")
    with pytest.raises(ChladniError, match=r"deck.bdf:2: 'SPC 1' selects no set.* there are 1$"):
        bulk(PLATE + SETS, before="CEND\nSPC 1\n")


def test_sets_of_which_there_is_no_card_select_nothing(bulk):
    """Nothing is to select in a deck without such a card; one of other numbers is a mistake."""
    deck = bulk(PLATE, before="CEND\nSPC = 9\nMPC = 2\n")
    assert not len(assembly(deck).supports)
    notes = list(remarks(deck, ()))
    assert [n for n in notes if "SPC = 9 selects nothing" in n]
    assert [n for n in notes if "MPC = 2 selects nothing" in n]


def test_a_set_that_joins_itself_is_the_cards_of_its_number(bulk):
    deck = bulk(PLATE + SETS + "SPCADD,1,1\n", before="CEND\nSPC = 1\n")
    assert len(assembly(deck).supports) == 6


TWO = "SPC1,1,123456,1\nSPC1,2,123456,1,2\n"


@pytest.mark.parametrize(
    ("control", "held", "said"),
    [
        ("METHOD = 1\nSUBCASE 1\nSPC = 2\nSUBCASE 2\nSPC = 1\n", 12, "subcases 1, 2 select SPC"),
        ("SUBCASE 1\nSPC = 1\nSUBCASE 2\nSPC = 2\nMETHOD = 1\n", 12, ""),
        ("SUBCASE 1\nSPC = 1\nSUBCASE 2\nSPC = 2\n", 6, "subcase 1 is taken"),
        ("SUBCASE 1\nSTEP 1\nSPC = 1\nSTEP 2\nSPC = 2\n", 6, "subcases 1, 1 select SPC sets 1, 2"),
        ("SPC = 2\nSUBC 1\nMETH = 1\nSUBC 2\nMETH = 1\n", 12, ""),
    ],
)  # fmt: skip
def test_subcases_with_other_supports_are_noted(bulk, control, held, said):
    """The first that looks for modes is taken, as before, and the others are named."""
    deck = bulk(PLATE + TWO, before=f"SOL 103\nCEND\n{control}")
    assert len(assembly(deck).supports) == held
    notes = [note for note in remarks(deck, ()) if "select SPC sets" in note]
    assert len(notes) == bool(said)
    assert all(said in note for note in notes)


@pytest.mark.parametrize("word", ["12 456", "1 2456", "124 56", " 12456"])
def test_components_may_stand_apart(bulk, word):
    deck = bulk(f"{PLATE}SPC1    7       {word:8}1\n", before="CEND\nSPC = 7\n", fold=False)
    assert assembly(deck).supports.tolist() == [[0, c] for c in (1, 2, 4, 5, 6)]


@pytest.mark.parametrize("vector", ["0.,0.,1.-3", "0,0,1", "0,0.,1.+0"])
def test_the_usual_vector_of_bars_is_written_as_any_other(bulk, vector):
    """Short exponents; an integer X1 is a grid only where X2 and X3 are blank."""
    bar = "CBAR,8,1,1,2\nPBAR,1,5,1.,1.,1.,1.\n"
    up = assembly(bulk(f"{PLATE}{bar}BAROR,,,,,{vector}\n")).beams.up[0]
    assert np.allclose(up / np.linalg.norm(up), [0, 0, 1])


def test_a_damper_may_have_the_id_of_a_spring(bulk):
    cards = "CELAS2,8,5.,1,3\nCVISC,8,,1,2\nPVISC,8,1.,1.\nCMASS2,8,1.,1,1\n"
    made = assembly(bulk(PLATE + cards))
    assert len(made.springs.value) == 1


def test_a_shell_without_a_property_number_has_its_own(bulk):
    made = assembly(
        bulk(PLATE.replace("CQUAD4,7,101", "CQUAD4,7,").replace("PSHELL,101", "PSHELL,7"))
    )
    assert made.parts[0].id == 7


def test_commands_of_an_included_case_control_are_held_to_the_same(bulk, tmp_path):
    (tmp_path / "case.inc").write_text("MPC = 1\nSPC = ALL\n")
    with pytest.raises(ChladniError, match=r"case.inc:2: 'SPC = ALL' selects no set"):
        bulk(PLATE + SETS, before="CEND\nINCLUDE 'case.inc'\n")


def test_a_set_that_is_not_there_beside_others_that_are_is_noted(bulk):
    """Patran joins an empty set of its own, which Nastran passes over."""
    deck = bulk(PLATE + SETS + "SPCADD,7,1,9\n", before="CEND\nSPC = 7\n")
    assert len(assembly(deck).supports) == 6
    assert [n for n in remarks(deck, ()) if re.search("SPCADD 7 joins set 9, of which there", n)]


def test_sets_that_join_sets_hold_what_those_hold(bulk):
    """By two ways, and over two levels, a set counts once."""
    cards = "SPC1,2,3,2\nSPCADD,7,8,1\nSPCADD,8,1,2\n"
    held = assembly(bulk(PLATE + SETS + cards, before="CEND\nSPC = 7\n")).supports
    assert held.tolist() == [[0, c] for c in range(1, 7)] + [[1, 3]]


PROFILES = {
    "BOX": ("10.,10.,6.,6.", "10.,10.,1.,6.", "10.,10.,6.,1.", "10.,10.,5.,1.", "10.,10.,0.,1."),
    "BOX1": ("10.,10.,6.,6.,1.,1.", "10.,10.,1.,1.,5.,6.", "10.,10.,1.,0.,1.,1."),
    "TUBE": ("5.,6.", "5.,5."),
    "TUBE2": ("5.,6.", "5.,0."),
    "I": ("10.,5.,5.,1.,6.,6.",),
    "I1": ("4.,1.,12.,10.",),
    "CHAN": ("10.,10.,1.,6.", "10.,10.,11.,1."),
    "CHAN1": ("4.,1.,12.,10.",),
    "CHAN2": ("6.,1.,10.,10.", "1.,11.,10.,10."),
    "T": ("10.,5.,6.,1.",),
    "L": ("10.,10.,11.,1.",),
    "Z": ("4.,1.,12.,10.",),
    "HAT": ("10.,6.,20.,5.", "10.,2.,3.,5."),
}


@pytest.mark.parametrize("card", ["CBAR,8,1,1,2,0.,0.,1.\nPBARL", "CBEAM,8,1,1,2,0.,0.,1.\nPBEAML"])
@pytest.mark.parametrize(("shape", "sizes"), [(s, x) for s, xs in PROFILES.items() for x in xs])
def test_walls_that_no_section_has_room_for_are_refused(bulk, card, shape, sizes):
    text = f"{PLATE}{card},1,5,,{shape}\n,{sizes}\n"
    with pytest.raises(ChladniError, match=rf"PB\w+L 1: the dimensions .* make no {shape}: "):
        assembly(bulk(text))


def test_walls_may_touch():
    """A profile of walls that just fill it is the solid bar of the same outline."""
    bar = SHAPES["BAR"][0](10.0, 6.0)
    for shape, sizes in (
        ("CHAN", (10, 6, 1, 3)), ("L", (10, 6, 6, 10)), ("L", (10, 6, 6, 3)),
        ("CHAN2", (5, 2, 6, 10)), ("T", (10, 6, 6, 1)), ("I", (6, 10, 10, 1, 3, 3)),
    ):  # fmt: skip
        found = SHAPES[shape][0](*map(float, sizes))
        assert (found.area, found.I1, found.I2) == pytest.approx((bar.area, bar.I1, bar.I2))


def test_inertia_about_one_axis_alone_is_taken_with_a_note(bulk):
    """A disc of a shaft that turns; a rod's (0, J, J) and rounding are as bodies have them."""
    moments = ("2.", "1.,-1.,1.", ",,2.,,,2.", "1.,,1.,,,2.02")
    cards = "".join(f"CONM2,{8 + k},{k + 1},,1.,,,,,{J}\n" for k, J in enumerate(moments))
    deck = bulk(PLATE + cards)
    assert len(assembly(deck).masses) == 4
    said = "CONM2 8 and 1 others have inertia about some axes alone"
    assert [n for n in remarks(deck, ()) if said in n]


@pytest.mark.parametrize(("G", "noted"), [("8.0769+5", True), ("8.1+4", False), ("", False)])
def test_moduli_that_contradict_one_another_are_noted(bulk, G, noted):
    """G is E/2(1+NU) but for rounding; ten times it may be meant, as of a core, and is said."""
    deck = bulk(PLATE.replace("2.1+5,,.3", f"2.1+5,{G},.3"))
    assembly(deck)
    said = r"deck.bdf:7: MAT1 5: G 807690 is 10 times E/2\(1\+NU\) = 80769"
    assert any(re.search(said, note) for note in remarks(deck, ())) == noted


HEXA = "GRID,{},,{},{},{}\n"


def solid(corners, name):
    """A deck of one solid with these corners (k, 3)."""
    grids = "".join(HEXA.format(k, *map(float, x)) for k, x in enumerate(corners, 1))
    ids = ",".join(map(str, range(1, len(corners) + 1)))
    return f"{grids}{name},1,1,{ids}\nPSOLID,1,5\nMAT1,5,2.1+5,,.3,7.85-9\n"


def prism(m):
    """Corners of a prism over a regular polygon of m corners (2m, 3)."""
    a = 2 * np.pi * (np.arange(m) + 0.5) / m
    face = np.stack([np.cos(a), np.sin(a), np.zeros(m)], axis=1)
    return np.concatenate([face, face + np.eye(3)[2]])


SHEAR = np.array([[1.0, 0.2, 0.0], [0.0, 0.05, 0.0], [3.0, 1.0, 0.3]])


@pytest.mark.parametrize(("name", "m"), [("CHEXA", 4), ("CPENTA", 3)])
@pytest.mark.parametrize("shape", [np.eye(3), SHEAR], ids=["straight", "sheared and flat"])
def test_a_face_turned_against_its_opposite_is_refused_if_det_j_vanishes(bulk, name, m, shape):
    """Det J is cos² of half the turn at the centre, whatever linear map the element went through.

    A solver computes what has volume at every point of integration. A note names what is warped.
    """
    straight = prism(m)
    for k in range(1, m):
        turned = np.concatenate([straight[:m], np.roll(straight[m:], k, axis=0)])
        deck = bulk(solid(turned @ shape, name))
        if 2 * k == m:
            with pytest.raises(
                ChladniError, match=rf"{name} 1: it turns inside out: det J vanishes"
            ):
                assembly(deck)
            continue
        modes = normal_modes(structure(assembly(deck, "mm-t-s")).system, 12).frequency
        assert np.all(modes[6:] > 1e3 * modes[:6].max())
        assert any(re.search(f"{name} 1 has a face warped", n) for n in remarks(deck, ())) or (
            shape is SHEAR
        )


@pytest.mark.parametrize("hand", [1, -1])
def test_a_slim_bead_of_a_hem_is_a_body(bulk, hand):
    """Its faces are turned by 40 degrees; det J has one sign, and a mirror image has the other."""
    corners = [(7.4, 1.6, 2.4), (6.7, 6.5, 1.5), (5.0, 7.3, 7.4), (3.4, 1.6, 5.1),
               (7.9, 1.8, 3.2), (10.1, 7.8, 6.4), (8.7, 8.8, 12.8), (3.9, 1.8, 5.9)]  # fmt: skip
    deck = bulk(solid(np.array(corners) * [hand, 1, 1], "CHEXA"))
    made = assembly(deck, "mm-t-s")
    assert len({*np.sign(jacobians(made.points[made.solids[0].nodes])).ravel()}) == 1
    assert np.sum(normal_modes(structure(made).system, 12).frequency < 1) == 6
    assert [n for n in remarks(deck, ()) if "warped by more than 45 degrees" in n]


@pytest.mark.parametrize(
    ("moved", "said"),
    [((0.3, 0.3), "inner angle at grid 3 is 180"), ((0.5, 0.5), "inner angle at grid 3 is 180")],
)
def test_a_quadrilateral_folded_in_is_named_with_its_line(bulk, moved, said):
    """Nastran stops at an inner angle of 180 degrees or more (Quick Reference, CQUAD4)."""
    x, y = (10 * m for m in moved)
    with pytest.raises(ChladniError, match=rf"deck.bdf:5: CQUAD4 7: its {said}"):
        assembly(bulk(PLATE.replace("3,,10.,10.", f"3,,{x},{y}")))


@pytest.mark.parametrize(("name", "m"), [("CHEXA", 4), ("CPENTA", 3)])
def test_a_distorted_solid_is_not_taken_for_a_turned_one(bulk, name, m):
    """Corners by a sixth of an edge out of place, then any linear map."""
    rng = np.random.default_rng(1)
    edge = np.linalg.norm(np.diff(prism(m)[:2], axis=0))
    for _ in range(20):
        X = (prism(m) + edge / 6 * rng.uniform(-1, 1, (2 * m, 3))) @ rng.normal(size=(3, 3))
        assert len(assembly(bulk(solid(X, name))).solids[0].ids) == 1
