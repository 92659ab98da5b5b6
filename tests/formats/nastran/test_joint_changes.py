"""Changed solids, bars, springs, bushes and masses are written into the cards that hold them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.decks import alike, rewritten

from chladni.effects.element_groups import element_groups
from chladni.effects.user_parameters import user_parameter
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck
from chladni.model.assembly import Bushes
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


def freed(field, x=0.05, parts=(), **rows):
    """A change of a parameter that the user freed, of parts by their numbers."""

    def change(a):
        at = tuple(a.part(id) for id in parts)
        free = FreeParameter("free", field, positions=at, **rows)
        return user_parameter(element_groups(structure(a), 4), free).apply(a, np.array([x]))

    return change


def without(family, id):
    """A change that takes one element out."""

    def change(a):
        table = getattr(a, family)
        kept = {name: column[table.ids != id] for name, column in vars(table).items()}
        return replace(a, **{family: type(table)(**kept)})

    return change


def lossy(*names):
    """A change of the loss factor of parts."""

    def change(a):
        parts = list(a.parts)
        for k in map(a.part, names):
            material = replace(parts[k].section.material, damping=0.3)
            parts[k] = parts[k].with_section(material=material)
        return a.with_parts(tuple(parts))

    return change


def lossy_bushes(*rows):
    """A change of loss and stiffness of bushes."""

    def change(a):
        loss, stiffness = a.bushes.loss.copy(), a.bushes.stiffness.copy()
        loss[list(rows)], stiffness[list(rows)] = 0.25, 0.5 * stiffness[list(rows)]
        return replace(a, bushes=replace(a.bushes, loss=loss, stiffness=stiffness))

    return change


def of_every_kind(a):
    """A solid and a bush that changed alone, and a bush that was added."""
    changed, solids = a.parts[a.part(3)], a.solids[0]
    stiffer = replace(changed.section.material, E=2 * changed.section.material.E)
    own = replace(changed, section=replace(changed.section, material=stiffer), name="own")
    part = np.where(solids.ids == 3, len(a.parts), solids.part)
    one = {name: column[:1].copy() for name, column in vars(a.bushes).items()}
    for name, value in (("ids", 99), ("viscous", 0.0), ("loss", 0.0)):
        one[name][:] = value
    one["stiffness"][:, 3:] = 0.0
    columns = {n: np.concatenate([c, one[n]]) for n, c in vars(a.bushes).items()}
    columns["stiffness"][0] *= 2.0
    bushes = Bushes(**columns)
    return replace(a, parts=(*a.parts, own), solids=(replace(solids, part=part),), bushes=bushes)


CHANGES = {  # what is changed, and the cards whose lines change where they are known
    "E of both solids": (freed("E", parts=(2, 3)), ["MAT1"]),
    "E of one solid": (freed("E", parts=(2,)), ["PSOLID"]),
    "nu of one solid": (freed("nu", parts=(3,)), ["PSOLID"]),
    "E of the bar": (freed("E", parts=(4,)), ["PROD"]),
    "rho of sheet and bar": (freed("rho", parts=(1, 4)), ["MAT1"]),
    "K of one PELAS": (freed("K", 1.0, springs=(1,)), ["PELAS"]),
    "K of a CELAS2": (freed("K", 1.0, springs=(2,)), ["CELAS2"]),
    "K of the PBUSH": (freed("K", 2.0, bushes=(0, 1)), ["PBUSH"]),
    "K of one bush of two": (freed("K", 0.2, bushes=(0,)), None),  # a short field of seven digits
    "M": (freed("M", masses=(0,)), ["CONM2", "+"]),
    "new properties of every kind": (of_every_kind, None),
    "a bush is taken out": (without("bushes", 31), ["CBUSH"]),
    "loss of one bush of two": (lossy_bushes(0), None),
    "loss of both bushes": (lossy_bushes(0, 1), None),
    "loss of one part of two": (lossy(2), None),
    "loss of both parts": (lossy(2, 3), None),
}


@pytest.mark.parametrize("name", CHANGES)
def test_what_was_changed_is_in_the_deck(deck, name):
    """The deck read again has the K, M and losses of the changed structure; other lines stay."""
    (found, before), (change, cards) = deck, CHANGES[name]
    after = change(before)
    with pytest.raises(AssertionError):
        alike(before, after)
    got, gone, _ = rewritten(found, before, after)
    for column in ("stiffness", "viscous", "loss"):
        assert_allclose(getattr(got.bushes, column), getattr(after.bushes, column), rtol=1e-6)
    assert_allclose(got.springs.value, after.springs.value, rtol=1e-6)
    assert cards is None or [line.split(",")[0] for line in gone] == cards


@pytest.mark.parametrize("card", ["CONROD,51,1,3,1,10.,5.", "CROD,51,4,1,3", "CTUBE,51,8,1,3"])
def test_a_bar_that_was_taken_out_is_a_card_less(tmp_path, card):
    path = tmp_path / "deck.bdf"
    path.write_text(DECK.replace("ENDDATA", f"{card}\nPTUBE,8,1,5.,1.\nENDDATA"))
    found = read_deck(path)
    before = assembly(found, UNITS["mm-t-s"])
    got, gone, _ = rewritten(found, before, without("beams", 51)(before))
    assert got.beams.ids.tolist() == [4]
    assert gone == [card]
