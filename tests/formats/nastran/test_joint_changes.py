"""Changed solids, bars, springs, bushes and masses are written into the cards that hold them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.decks import rewritten

from chladni.effects.element_groups import element_groups
from chladni.effects.user_parameters import user_parameter
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck
from chladni.model.assembly import Beams, Bushes
from chladni.model.free_parameter import FreeParameter
from chladni.units import UNITS

DECK = """\
SOL 103
CEND
BEGIN BULK
MAT1,1,210000.,,.3,7.85-9
MAT1,2,2000.,,.4,1.2-9
PSHELL,1,1,1.0,1,,1
PSOLID,2,2
PSOLID,3,2
PROD,4,1,10.,5.
GRID,1,,0.,0.,0.
GRID,2,,100.,0.,0.
GRID,3,,100.,100.,0.
GRID,4,,0.,100.,0.
GRID,5,,0.,0.,10.
GRID,6,,100.,0.,10.
GRID,7,,100.,100.,10.
GRID,8,,0.,100.,10.
GRID,9,,0.,0.,20.
GRID,10,,100.,0.,20.
GRID,11,,100.,100.,20.
GRID,12,,0.,100.,20.
CQUAD4,1,1,1,2,3,4
CHEXA,2,2,1,2,3,4,5,6,+
+,7,8
CHEXA,3,3,5,6,7,8,9,10,+
+,11,12
CROD,4,4,1,3
CELAS1,21,5,1,3
CELAS1,22,6,2,3
PELAS,5,100.,,,6,250.,0.02
CELAS2,23,40.,3,3
CBUSH,31,7,4,,,,,0
CBUSH,32,7,3,,,,,0
PBUSH,7,K,10.,20.,,,,5.,+
+,,B,0.1
CONM2,41,12,,0.003,1.,2.,3.,,+
+,0.4,,0.5,,,0.6
ENDDATA
"""


def position(made, id):
    return next(k for k, p in enumerate(made.parts) if p.id == id)


KINDS = {  # the free parameter, and the cards whose lines change
    "E of both solids": (dict(field="E", parts=(2, 3)), ["MAT1"]),
    "E of one solid": (dict(field="E", parts=(2,)), ["PSOLID"]),
    "nu of one solid": (dict(field="nu", parts=(3,)), ["PSOLID"]),
    "E of the bar": (dict(field="E", parts=(4,)), ["PROD"]),
    "rho of sheet and bar": (dict(field="rho", parts=(1, 4)), ["MAT1"]),
    "K of one PELAS": (dict(field="K", springs=(1,)), ["PELAS"]),
    "K of a CELAS2": (dict(field="K", springs=(2,)), ["CELAS2"]),
    "K of the PBUSH": (dict(field="K", bushes=(0, 1)), ["PBUSH"]),
    "M": (dict(field="M", masses=(0,)), ["CONM2", "+"]),
}


@pytest.mark.parametrize("kind", KINDS)
def test_what_was_freed_is_in_the_deck(deck, kind):
    """The deck read again has the K and M of the changed structure; other lines stay."""
    found, before = deck
    given, cards = KINDS[kind]
    at = tuple(position(before, id) for id in given.get("parts", ()))
    groups = element_groups(structure(before), 4)
    what = {k: v for k, v in given.items() if k != "parts"}
    effect = user_parameter(groups, FreeParameter(kind, positions=at, **what))
    after = effect.apply(before, np.array([0.05]))
    got, gone, _ = rewritten(found, before, after)
    due, was, is_now = (structure(a).system for a in (after, before, got))
    for name in ("K", "M"):
        A, B, C = (getattr(s, name).toarray() for s in (due, was, is_now))
        assert_allclose(C, A, atol=1e-7 * np.abs(A).max())
        if (name == "M") == (given["field"] in ("rho", "M")):
            assert np.abs(A - B).max() > 1e-6 * np.abs(B).max()
    assert [line.split(",")[0] for line in gone] == cards


def test_a_bush_that_changed_alone_gets_a_property_of_its_own(deck):
    """The other bush of PBUSH 7 keeps the card as it was; a short field holds seven digits."""
    found, before = deck
    effect = user_parameter(
        element_groups(structure(before), 4), FreeParameter("K", "K", bushes=(0,))
    )
    after = effect.apply(before, np.array([0.2]))
    got, *_ = rewritten(found, before, after)
    due, is_now = (structure(a).system.K.toarray() for a in (after, got))
    assert_allclose(is_now, due, atol=1e-7 * np.abs(due).max())
    assert_allclose(got.bushes.stiffness, after.bushes.stiffness, rtol=1e-6)
    assert_allclose(got.bushes.stiffness[1], before.bushes.stiffness[1], rtol=1e-9)


def test_new_properties_of_every_kind_have_ids_of_their_own(deck):
    """A solid and a bush that changed alone, and a bush that was added, in one deck."""
    found, before = deck
    parts, solids = list(before.parts), before.solids[0]
    changed = parts[position(before, 3)]
    stiffer = replace(changed.section.material, E=2 * changed.section.material.E)
    own = replace(changed, section=replace(changed.section, material=stiffer), name="own")
    part = np.where(solids.ids == 3, len(parts), solids.part)
    one = {name: column[:1].copy() for name, column in vars(before.bushes).items()}
    for name, value in (("ids", 99), ("viscous", 0.0), ("loss", 0.0)):
        one[name][:] = value
    one["stiffness"][:, 3:] = 0.0
    columns = {n: np.concatenate([c, one[n]]) for n, c in vars(before.bushes).items()}
    columns["stiffness"][0] *= 2.0
    after = replace(
        before, parts=(*parts, own), solids=(replace(solids, part=part),), bushes=Bushes(**columns)
    )
    got, *_ = rewritten(found, before, after)
    assert_allclose(got.bushes.stiffness, after.bushes.stiffness, rtol=1e-6)
    due, is_now = (structure(a).system.K.toarray() for a in (after, got))
    assert_allclose(is_now, due, atol=1e-7 * np.abs(due).max())


def test_a_bush_that_was_taken_out_is_a_card_less(deck):
    found, before = deck
    kept = {name: column[1:] for name, column in vars(before.bushes).items()}
    after = replace(before, bushes=Bushes(**kept))
    got, gone, _ = rewritten(found, before, after)
    assert got.bushes.ids.tolist() == after.bushes.ids.tolist()
    assert [line.split(",")[0] for line in gone] == ["CBUSH"]


@pytest.mark.parametrize("card", ["CONROD,51,1,3,1,10.,5.", "CROD,51,4,1,3", "CTUBE,51,8,1,3"])
def test_a_bar_that_was_taken_out_is_a_card_less(tmp_path, card):
    path = tmp_path / "deck.bdf"
    path.write_text(DECK.replace("ENDDATA", f"{card}\nPTUBE,8,1,5.,1.\nENDDATA"))
    found = read_deck(path)
    before = assembly(found, UNITS["mm-t-s"])
    stays = before.beams.ids != 51
    kept = {name: column[stays] for name, column in vars(before.beams).items()}
    got, gone, _ = rewritten(found, before, replace(before, beams=Beams(**kept)))
    assert got.beams.ids.tolist() == [4]
    assert gone == [card]


@pytest.mark.parametrize("rows", [[0], [0, 1]])
def test_the_loss_factor_of_a_bush_goes_into_its_property(deck, rows):
    """Of one bush of PBUSH 7, and of both; dashpots and the other's stiffness stay."""
    found, before = deck
    loss, stiffness = before.bushes.loss.copy(), before.bushes.stiffness.copy()
    loss[rows], stiffness[rows] = 0.25, 0.5 * stiffness[rows]
    after = replace(before, bushes=replace(before.bushes, loss=loss, stiffness=stiffness))
    got, *_ = rewritten(found, before, after)
    for name in ("loss", "stiffness", "viscous"):
        assert_allclose(getattr(got.bushes, name), getattr(after.bushes, name), rtol=1e-6)


@pytest.mark.parametrize("names", [(2,), (2, 3)])
def test_the_loss_factor_of_a_material_goes_into_its_card(deck, names):
    """Of one part of two that share MAT1 2, and of both."""
    found, before = deck
    parts = list(before.parts)
    for pid in names:
        k = position(before, pid)
        lossy = replace(parts[k].section.material, damping=0.3)
        parts[k] = parts[k].with_section(material=lossy)
    got, *_ = rewritten(found, before, before.with_parts(tuple(parts)))
    for pid in (1, 2, 3):
        section = got.parts[position(got, pid)].section
        lost = getattr(section, "material", None) or section.membrane
        assert lost.damping == (0.3 if pid in names else 0.0)
