"""Beams that a change adds are written with all they need, and come back as they were."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.decks import alike, opened, rewritten
from tests.builders.refusals import says

from chladni.fem.assemble import structure
from chladni.fem.energy import only
from chladni.io.nastran.edit.model_changes import changes
from chladni.io.nastran.edit.written_assembly import written_assembly
from chladni.model.added_beams import with_beam_line
from chladni.model.point_masses import with_masses
from chladni.model.properties import BeamSection, Isotropic
from chladni_specimens.plates import STEEL, plate

ALUMINIUM = Isotropic(7e10, 0.33, 2700.0)
UP = (0.0, 0.0, 1.0)


def section(material, kind="bar"):
    more = {} if kind == "rod" else {"I1": 2e-10, "I2": 3e-10}
    return BeamSection(material, 3e-5, J=1e-10, kind=kind, **more)


@pytest.fixture(params=["SI", "mm-t-s"])
def deck(tmp_path, request):
    """(deck, assembly, units) of a plate, and the grids of a line across it."""
    made = opened(plate(0.3, 0.2, 6, 4, 1e-3), tmp_path, request.param)
    return *made, made[1].ids[np.isclose(made[1].points[:, 0], 0.15)]


@pytest.mark.parametrize("kind", ["bar", "beam", "rod"])
@pytest.mark.parametrize("material", [STEEL, ALUMINIUM])
def test_a_line_of_beams_is_written(deck, kind, material):
    """The deck with the cards is the structure with the beams, whatever else changed with them."""
    read, before, units, line = deck
    offset = (0, 0, 0 if kind == "rod" else 2e-3)
    after = with_beam_line(before, line, section(material, kind), UP, "stringer", offset)
    after = with_masses(after, (int(before.ids[0]),), 0.05)
    again, _, fresh = rewritten(read, before, after, units)
    alike(written_assembly(read, changes(read, before, after, units), units), after)
    assert len(again.beams) == len(line) - 1
    assert len({*again.beams.ids, *again.shells.ids, *again.masses.ids}) == 24 + len(line)
    own = material != before.parts[0].section.membrane
    assert sum(card.startswith("MAT1") for card in fresh) == own


def test_a_material_that_changes_is_not_shared(deck):
    """The beams keep the deck's steel where the sheet's becomes softer."""
    read, before, units, line = deck
    steel = before.parts[0].section.membrane
    after = with_beam_line(before, line, section(steel), UP)
    softer = replace(steel, E=0.9 * steel.E)
    sheet = after.parts[0].with_section(membrane=softer, bending=softer, shear=softer)
    rewritten(read, before, after.with_parts((sheet, *after.parts[1:])), units)


def test_what_beams_add_is_the_difference(deck):
    """Tᵀ K T and Tᵀ M T of the line are K and M with it less K and M without."""
    _, before, _, line = deck
    after = with_beam_line(before, line, section(STEEL), UP)
    built, whole = structure(before), structure(after)
    added = built.contribution(only(after, len(after.parts) - 1))
    for ours, name in zip(added, "KM", strict=True):
        without, with_it = getattr(built.system, name), getattr(whole.system, name)
        gap = (without + ours - with_it).toarray()
        np.testing.assert_allclose(gap, 0, atol=1e-9 * abs(without).max())
    says("points", built.contribution, plate(0.1, 0.1, 2, 2, 1e-3))


def test_every_beam_has_a_direction_across_itself(deck):
    """Along two edges of a plate one after the other."""
    _, before, *_ = deck
    x, y = before.points[:, 0], before.points[:, 1]
    corners = [((x - a) ** 2 + (y - b) ** 2).argmin() for a, b in ((0, 0), (0.3, 0), (0.3, 0.2))]
    made = with_beam_line(before, before.ids[corners], section(STEEL))
    along = np.diff(made.points[made.beams.nodes], axis=1)[:, 0]
    np.testing.assert_allclose(np.einsum("ij,ij->i", along, made.beams.up), 0)
    np.testing.assert_allclose(np.linalg.norm(made.beams.up, axis=1), 1)


def test_a_line_that_is_none_is_refused(deck):
    _, before, _, line = deck
    for grids, up in ((line[:1], UP), (line[[0, 0]], UP), (line[:2], (0.0, 1.0, 0.0))):
        said = "two grids apart, and a direction across itself"
        says(said, with_beam_line, before, grids, section(STEEL), up)
    rod = before, line, section(STEEL, "rod"), UP, "rib", (0, 0, 1e-3)
    says("only bars and beams have offsets", with_beam_line, *rod)
