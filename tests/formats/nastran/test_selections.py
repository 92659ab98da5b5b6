"""Sets that the case control selects; what is read with a note."""

import re

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.geometry.solid_shapes import jacobians
from chladni.io.nastran import assembly
from chladni.io.nastran.read.analysis_requests import remarks
from chladni.io.nastran.read.beam_profiles import SHAPES

from .conftest import PLATE, SETS


def noted(deck, said):
    return [note for note in remarks(deck, ()) if re.search(said, note)]


def test_sets_of_which_there_is_no_card_select_nothing(bulk):
    """Nothing is to select in a deck without such a card; one of other numbers is a mistake."""
    deck = bulk(PLATE, before="CEND\nSPC = 9\nMPC = 2\n")
    assert not len(assembly(deck).supports)
    assert noted(deck, "SPC = 9 selects nothing")
    assert noted(deck, "MPC = 2 selects nothing")


@pytest.mark.parametrize(
    ("chosen", "cards", "more", "note"),
    [
        (1, "SPCADD,1,1", [], ""),  # itself: the cards of its number
        (7, "SPC1,2,3,2\nSPCADD,7,8,1\nSPCADD,8,1,2", [[1, 3]], ""),  # twice, over two levels
        (7, "SPCADD,7,1,9", [], "SPCADD 7 joins set 9, of which there"),  # as Patran writes it
    ],
)
def test_sets_that_join_sets_hold_what_those_hold(bulk, chosen, cards, more, note):
    deck = bulk(f"{PLATE}{SETS}{cards}\n", before=f"CEND\nSPC = {chosen}\n")
    assert assembly(deck).supports.tolist() == [[0, c] for c in range(1, 7)] + more
    assert bool(noted(deck, note or "SPCADD")) == bool(note)


@pytest.mark.parametrize(
    ("control", "held", "said"),
    [
        ("METHOD = 1\nSUBCASE 1\nSPC = 2\nSUBCASE 2\nSPC = 1\n", 12, "subcases 1, 2 select SPC"),
        ("SUBCASE 1\nSPC = 1\nSUBCASE 2\nSPC = 2\nMETHOD = 1\n", 12, ""),
        ("SUBCASE 1\nSPC = 1\nSUBCASE 2\nSPC = 2\n", 6, "subcase 1 is taken"),
        ("SUBCASE 1\nSTEP 1\nSPC = 1\nSTEP 2\nSPC = 2\n", 6, "subcases 1, 1 select SPC sets 1, 2"),
        ("SPC = 2\nSUBC 1\nMETH = 1\nSUBC 2\nMETH = 1\n", 12, ""),
    ],
)
def test_subcases_with_other_supports_are_noted(bulk, control, held, said):
    """The first that looks for modes is taken, as before, and the others are named."""
    two = "SPC1,1,123456,1\nSPC1,2,123456,1,2\n"
    deck = bulk(PLATE + two, before=f"SOL 103\nCEND\n{control}")
    assert len(assembly(deck).supports) == held
    notes = noted(deck, "select SPC sets")
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


def test_numbers_that_may_be_the_same_or_be_left_out(bulk):
    """A damper may have the id of a spring; a shell's property has the number of the shell."""
    cards = "CELAS2,8,5.,1,3\nCVISC,8,,1,2\nPVISC,8,1.,1.\nCMASS2,8,1.,1,1\n"
    own = PLATE.replace("CQUAD4,7,101", "CQUAD4,7,").replace("PSHELL,101", "PSHELL,7")
    made = assembly(bulk(own + cards))
    assert len(made.springs.value) == 1
    assert made.parts[0].id == 7


def test_commands_of_an_included_case_control_are_held_to_the_same(bulk, tmp_path):
    (tmp_path / "case.inc").write_text("MPC = 1\nSPC = ALL\n")
    before = "CEND\nINCLUDE 'case.inc'\n"
    says(r"case.inc:2: 'SPC = ALL' selects no set", bulk, PLATE + SETS, before)


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
    assert noted(deck, "CONM2 8 and 1 others have inertia about some axes alone")


@pytest.mark.parametrize(("G", "named"), [("8.0769+5", True), ("8.1+4", False), ("", False)])
def test_moduli_that_contradict_one_another_are_noted(bulk, G, named):
    """G is E/2(1+NU) but for rounding; ten times it may be meant, as of a core, and is said."""
    deck = bulk(PLATE.replace("2.1+5,,.3", f"2.1+5,{G},.3"))
    assembly(deck)
    said = r"deck.bdf:7: MAT1 5: G 807690 is 10 times E/2\(1\+NU\) = 80769"
    assert bool(noted(deck, said)) == named


def solid(corners, name):
    """A deck of one solid with these corners (k, 3)."""
    rows = [",".join(map(str, map(float, x))) for x in corners]
    grids = "".join(f"GRID,{k},,{row}\n" for k, row in enumerate(rows, 1))
    ids = ",".join(map(str, range(1, len(corners) + 1)))
    return f"{grids}{name},1,1,{ids}\nPSOLID,1,5\nMAT1,5,2.1+5,,.3,7.85-9\n"


def prism(m):
    """Corners of a prism over a regular polygon of m corners (2m, 3)."""
    a = 2 * np.pi * (np.arange(m) + 0.5) / m
    face = np.stack([np.cos(a), np.sin(a), np.zeros(m)], axis=1)
    return np.concatenate([face, face + np.eye(3)[2]])


def elastic(made):
    """Frequencies of a free solid that are no rigid motion's."""
    f = normal_modes(structure(made).system, 12).frequency
    assert np.all(f[6:] > 1e3 * f[:6].max())
    return f[6:]


SHEAR = np.array([[1.0, 0.2, 0.0], [0.0, 0.05, 0.0], [3.0, 1.0, 0.3]])
PRISMS = pytest.mark.parametrize(("name", "m"), [("CHEXA", 4), ("CPENTA", 3)])


@PRISMS
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
            says(rf"{name} 1: it turns inside out: det J vanishes", assembly, deck)
            continue
        assert len(elastic(assembly(deck, "mm-t-s")))
        assert noted(deck, f"{name} 1 has a face warped") or shape is SHEAR


@pytest.mark.parametrize("hand", [1, -1])
def test_a_slim_bead_of_a_hem_is_a_body(bulk, hand):
    """Its faces are turned by 40 degrees; det J has one sign, and a mirror image has the other."""
    corners = [(7.4, 1.6, 2.4), (6.7, 6.5, 1.5), (5.0, 7.3, 7.4), (3.4, 1.6, 5.1),
               (7.9, 1.8, 3.2), (10.1, 7.8, 6.4), (8.7, 8.8, 12.8), (3.9, 1.8, 5.9)]  # fmt: skip
    deck = bulk(solid(np.array(corners) * [hand, 1, 1], "CHEXA"))
    made = assembly(deck, "mm-t-s")
    assert len({*np.sign(jacobians(made.points[made.solids[0].nodes])).ravel()}) == 1
    assert len(elastic(made))
    assert noted(deck, "warped by more than 45 degrees")


@PRISMS
def test_a_distorted_solid_is_not_taken_for_a_turned_one(bulk, name, m):
    """Corners by a sixth of an edge out of place, then any linear map."""
    rng = np.random.default_rng(1)
    edge = np.linalg.norm(np.diff(prism(m)[:2], axis=0))
    for _ in range(20):
        X = (prism(m) + edge / 6 * rng.uniform(-1, 1, (2 * m, 3))) @ rng.normal(size=(3, 3))
        assert len(assembly(bulk(solid(X, name))).solids[0].ids) == 1
