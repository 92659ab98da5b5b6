"""A repaired deck, read again, is the structure that was found, and no other line moved."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.decks import opened, rewritten, same

from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.element_groups import element_groups
from chladni.effects.orthotropy import orthotropic
from chladni.errors import ModelError
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.ground_springs import with_springs
from chladni.model.point_masses import with_masses
from chladni.model.properties import Anisotropic, BeamSection, Part, ShellSection
from chladni.units import UNITS
from chladni_specimens.plates import folded_panel, plate

WEIGHED = "PARAM,WTMASS,2.59-3\n"  # every mass counts 0.00259 times


@pytest.fixture(params=["mm-t-s", "SI", "mm-kg-ms", "mm-kg-ms, WTMASS"])
def deck(request, tmp_path):
    """(deck, its assembly, units) of a folded panel; both parts share one MAT1."""
    units, _, weighed = request.param.partition(", ")
    made = folded_panel(0.3, 0.2, 0.04, 0.01, 0.04)
    return opened(made, tmp_path, units, WEIGHED if weighed else "")


def test_nothing_to_repair(deck):
    made, before, units = deck
    assert changes(made, before, before, units) == []


@pytest.mark.parametrize(("quantity", "card"), [("E", "MAT1"), ("rho", "MAT1"), ("t", "PSHELL")])
def test_ordinary_value_of_all_parts(deck, quantity, card):
    """One line a card: a shared material is one line, thickness is one a part."""
    made, before, units = deck
    effect = calibration_parameter(element_groups(structure(before), 8), quantity, (0, 1))
    after = effect.apply(before, np.array([0.0712345678]))
    found, gone, _ = rewritten(made, before, after, units)
    same(found, after, before)
    assert [line[:6].strip().rstrip("*") for line in gone] == [card] * (2 if quantity == "t" else 1)
    np.testing.assert_allclose(found.shells.thickness, after.shells.thickness, rtol=1e-6)


@pytest.mark.parametrize("quantity", ["E", "rho", "t"])
def test_ordinary_value_of_one_part(deck, quantity):
    """A material two parts share is changed for the one that changed, not for the other."""
    made, before, units = deck
    effect = calibration_parameter(element_groups(structure(before), 8), quantity, (1,))
    after = effect.apply(before, np.array([-0.2]))
    found, gone, _ = rewritten(made, before, after, units)
    same(found, after, before)
    assert found.parts[0] == before.parts[0]
    assert len(gone) == 1


def test_thickness_at_corners(deck):
    made, before, units = deck
    chosen = np.flatnonzero(before.shells.part == 0)[[2, 3, 7]]
    t = before.shells.thickness.copy()
    t[chosen] *= 1 - np.linspace(0.03, 0.2, 12).reshape(3, 4)
    after = replace(before, shells=replace(before.shells, thickness=t))
    found, gone, _ = rewritten(made, before, after, units)
    same(found, after, before)
    np.testing.assert_allclose(found.shells.thickness, t, rtol=1e-6)
    assert len(gone) <= 3  # in place, or on a continuation of a line that stays


def test_thickness_of_triangles(tmp_path):
    made = plate(0.3, 0.2, 4, 3, 1e-3)
    nodes = made.shells.nodes.copy()
    nodes[5, 3] = nodes[5, 2]
    made = replace(made, shells=replace(made.shells, nodes=nodes))
    deck, before, units = opened(made, tmp_path)
    t = before.shells.thickness * (1 - 0.1 * before.points[before.shells.nodes][..., 0])
    after = replace(before, shells=replace(before.shells, thickness=t))
    found, *_ = rewritten(deck, before, after, units)
    same(found, after, before)


@pytest.mark.parametrize("positions", [(0, 1), (0,)])
@pytest.mark.parametrize("axis", [[1.0, 0, 0], [0.6, 0.8, 0]])
def test_grain(deck, positions, axis):
    """MAT1 becomes MAT8 along a direction; a part that keeps the MAT1 keeps it."""
    made, before, units = deck
    effect = orthotropic(element_groups(structure(before), 8), positions, np.array(axis))
    after = effect.apply(before, np.array([0.15, -0.1, 0.05, 0.1]))
    found, *_ = rewritten(made, before, after, units)
    same(found, after, before)
    for k in {0, 1} - set(positions):
        assert found.parts[k] == before.parts[k]


def test_grain_keeps_its_loss_factor(tmp_path):
    deck, before, units = opened(plate(0.3, 0.2, 4, 3, 1e-3), tmp_path)
    section = before.parts[0].section
    lossy = replace(section.membrane, damping=0.02)
    first = before.with_parts((before.parts[0].with_section(membrane=lossy, bending=lossy),))
    deck, before, units = opened(first, tmp_path)
    effect = orthotropic(element_groups(structure(before), 4), (0,), np.eye(3)[0])
    found, *_ = rewritten(deck, before, effect.apply(before, np.full(4, 0.1)), units)
    assert found.parts[0].section.membrane.damping == pytest.approx(0.02)


def test_grain_that_is_there_already(tmp_path):
    """A MAT8's moduli, nu12 and density."""
    deck, before, units = opened(plate(0.3, 0.2, 4, 3, 1e-3), tmp_path)
    effect = orthotropic(element_groups(structure(before), 4), (0,), np.eye(3)[1])
    first, second = (effect.apply(before, np.array(x)) for x in ([0.1] * 4, [0.3, 0.1, 0, 0.4]))
    deck, before, units = opened(first, tmp_path)
    id = before.parts[0].section.membrane.id
    material = replace(second.parts[0].section.membrane, rho=8000.0, id=id)
    after = before.with_parts((before.parts[0].with_section(membrane=material, bending=material),))
    found, *_ = rewritten(deck, before, after, units)
    same(found, after, before)
    assert found.parts[0].section.membrane.nu12 == pytest.approx(material.nu12, rel=1e-6)


def test_poisson_ratio(deck):
    made, before, units = deck
    new = replace(before.parts[0].section.membrane, nu=0.36)
    every = {"membrane": new, "bending": new, "shear": new}
    after = before.with_parts(tuple(p.with_section(**every) for p in before.parts))
    found, gone, _ = rewritten(made, before, after, units)
    same(found, after, before)
    assert len(gone) == 1


def test_material_a_bar_shares(tmp_path):
    """The sheet's modulus changes; the bar with the same MAT1 keeps its own."""
    made = plate(0.3, 0.2, 4, 3, 1e-3)
    steel = made.parts[0].section.membrane
    bar = Part(9, "bar", BeamSection(steel, 1e-5, 1e-11, 1e-11, 0.0, 2e-11))
    nodes = np.array([[0, 4], [4, 8]])
    beams = replace(
        made.beams, ids=np.array([901, 902]), nodes=nodes, part=np.array([1, 1]),
        up=np.tile([0.0, 0, 1], (2, 1)), offset=np.zeros((2, 2, 3)), pins=np.zeros((2, 2, 6), bool),
    )  # fmt: skip
    made = replace(made, parts=(*made.parts, bar), beams=beams)
    deck, before, units = opened(made, tmp_path)
    k = next(k for k, p in enumerate(before.parts) if isinstance(p.section, ShellSection))
    effect = calibration_parameter(element_groups(structure(before), 4), "E", (k,))
    after = effect.apply(before, np.array([0.2]))
    found, *_ = rewritten(deck, before, after, units)
    same(found, after, before)
    assert found.parts[1 - k].section.material.E == pytest.approx(steel.E)


@pytest.mark.parametrize("offset", [None, [0.004, -0.011, 0.02]])
def test_masses(deck, offset):
    made, before, units = deck
    grids = tuple(int(i) for i in before.ids[[3, 11]])
    after = with_masses(before, grids, 0.0321, None if offset is None else np.array(offset))
    found, gone, fresh = rewritten(made, before, after, units)
    same(found, after, before)
    np.testing.assert_allclose(found.masses.matrix, after.masses.matrix, rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(found.masses.node, after.masses.node)
    assert gone == []
    assert sum(line.startswith("CONM2") for line in fresh) == 2


def test_non_structural_mass(deck):
    """NSM of every sheet, and of one group of shells alone, which gets a property of its own."""
    made, before, units = deck
    heavy = [p.with_section(nonstructural=3.0) for p in before.parts]
    part = np.array(before.shells.part)
    part[np.flatnonzero(part == 0)[:5]] = len(heavy)
    more = replace(heavy[0].with_section(nonstructural=7.5), id=91)
    after = replace(before, parts=(*heavy, more), shells=replace(before.shells, part=part))
    found, *_ = rewritten(made, before, after, units)
    same(found, after, before)
    loads = sorted(p.section.nonstructural for p in found.parts)
    assert loads == pytest.approx([3.0] * len(heavy) + [7.5], rel=1e-6)


def test_springs_to_ground(deck):
    """An oblique spring is a bush in its own frame; element ids stay unique beside new masses."""
    made, before, units = deck
    grids = tuple(int(i) for i in before.ids[[0, 17]])
    after = with_springs(before, grids, np.array([[0, 0, 1.0], [0.6, 0, 0.8]]), 4321.0)
    after = with_masses(after, grids, 0.01)
    found, gone, _ = rewritten(made, before, after, units)
    due, got = normal_modes(structure(after).system, 12), normal_modes(structure(found).system, 12)
    np.testing.assert_allclose(got.frequency[2:], due.frequency[2:], rtol=1e-6, atol=0.05)
    np.testing.assert_allclose(found.springs.value, after.springs.value, rtol=1e-6)
    np.testing.assert_array_equal(found.springs.component[:, 0], after.springs.component[:, 0])
    np.testing.assert_allclose(found.bushes.frame[:, 0], [[0.6, 0, 0.8]], atol=1e-6)
    ids = {*found.springs.ids, *found.bushes.ids, *found.masses.ids, *found.shells.ids}
    assert len(ids) == 1 + 1 + 2 + len(found.shells)
    assert gone == []


@pytest.mark.parametrize("quantity", ["E", "rho"])
def test_plane_stiffness(tmp_path, quantity):
    """A MAT2's six moduli or its density."""
    Q = plate(0.3, 0.2, 4, 3, 1e-3).parts[0].section.membrane.plane_stress()
    Q[0, 2] = Q[2, 0] = 0.03 * Q[0, 0]
    made = plate(0.3, 0.2, 4, 3, 1e-3, Anisotropic(Q, rho=7850.0))
    made = made.with_parts((made.parts[0].with_section(rigid_shear=True),))
    deck, before, units = opened(made, tmp_path)
    effect = calibration_parameter(element_groups(structure(before), 4), quantity, (0,))
    after = effect.apply(before, np.array([0.1]))
    found, *_ = rewritten(deck, before, after, units)
    same(found, after, before)


def test_a_mass_with_inertia_comes_back(deck):
    made, before, units = deck
    heavy = with_masses(before, (int(before.ids[0]),), 0.1)
    turned = heavy.masses.matrix.copy()
    turned[-1, 3:, 3:] += np.diag([1e-4, 1.5e-4, 2e-4])
    heavy = replace(heavy, masses=replace(heavy.masses, matrix=turned))
    found, *_ = rewritten(made, before, heavy, units)
    np.testing.assert_allclose(found.masses.matrix, turned, rtol=1e-5, atol=1e-12)


def test_what_no_card_says_is_refused(deck):
    made, before, units = deck
    odd = Anisotropic(1e9 * np.eye(3), id=before.parts[0].section.membrane.id)
    after = before.with_parts(
        tuple(p.with_section(membrane=odd, bending=odd) for p in before.parts)
    )
    with pytest.raises(ModelError, match="Anisotropic"):
        changes(made, before, after, units)


TUBES = {  # cards of a property 7 in mm-t-s, of a tube of 20 mm with a wall of 1.5 mm or alike
    "PBAR": "PBAR,7,1,87.2,3754.,3754.,7508.,,,\n+,,,,,,,,,\n+,.5,.5",
    "PBARL": "PBARL,7,1,,TUBE\n+,10.,8.5",
    "PBEAM": "PBEAM,7,1,87.2,3754.,3754.,,7508.",
    "PBEAML": "PBEAML,7,1,,BOX\n+,20.,16.,1.5,1.2",
}


@pytest.mark.parametrize("kind", TUBES)
def test_the_wall_of_a_tube_stands_in_its_card(tmp_path, kind):
    element = "CBEAM" if kind.startswith("PBEAM") else "CBAR"
    lines = ["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,210000.,,.3,7.85-9", TUBES[kind]]
    lines += ["MAT1,2,70000.,,.33,2.7-9", "PBAR,8,1,100.,900.,900.,1500."]
    lines += [f"GRID,{k + 1},,{100.0 * k},{20.0 * k * k},0." for k in range(8)]
    lines += [f"{element},{k},7,{k},{k + 1},0.,0.,1." for k in range(1, 6)]
    lines += [f"CBAR,{k},8,{k},{k + 1},0.,0.,1." for k in range(6, 8)]
    path = tmp_path / "deck.bdf"
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    units, found = UNITS["mm-t-s"], read_deck(path)
    before = assembly(found, units)
    tube = before.part(7)
    groups = element_groups(structure(before))
    stiff, wall = (calibration_parameter(groups, q, [tube]) for q in ("E", "wall"))
    after = wall.apply(stiff.apply(before, np.array([0.1])), np.array([-0.2]))
    again, gone, fresh = rewritten(found, before, after, units)
    same(again, after, before)
    section, due = again.parts[again.part(7)].section, after.parts[after.part(7)].section
    for name in ("area", "I1", "I2", "J"):
        assert getattr(section, name) == pytest.approx(getattr(due, name), rel=1e-6)
    assert section.shear == pytest.approx(due.shear)
    assert not [line for line in (*fresh, *gone) if line.startswith(("GRID", "CB", "PBAR,8"))]
