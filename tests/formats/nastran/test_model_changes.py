"""A repaired deck, read again, is the structure that was found, and no other line moved."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.decks import alike, opened, rewritten
from tests.builders.refusals import says

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.element_groups import element_groups
from chladni.effects.orthotropy import orthotropic
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.ground_springs import with_springs
from chladni.model.point_masses import with_masses
from chladni.model.properties import Anisotropic, BeamSection, Isotropic, Part
from chladni.units import UNITS
from chladni_specimens.plates import folded_panel, plate


@pytest.fixture(params=["mm-t-s", "SI", "mm-kg-ms", "mm-kg-ms, WTMASS"])
def deck(request, tmp_path):
    """(deck, its assembly, units) of a folded panel; both parts share one MAT1."""
    units, _, weighed = request.param.partition(", ")
    more = "PARAM,WTMASS,2.59-3\n" if weighed else ""  # every mass counts 0.00259 times
    return opened(folded_panel(0.3, 0.2, 0.04, 0.01, 0.04), tmp_path, units, more)


def test_nothing_to_repair(deck):
    made, before, units = deck
    assert changes(made, before, before, units) == []


def calibrated(quantity, positions, x):
    def change(a):
        groups = element_groups(structure(a), 8)
        return calibration_parameter(groups, quantity, positions).apply(a, np.array([x]))

    return change


def grained(positions, axis, *values):
    def change(a):
        effect = orthotropic(element_groups(structure(a), 8), positions, np.array(axis))
        return effect.apply(a, np.array(values))

    return change


def thinner_at_corners(a):
    chosen, t = np.flatnonzero(a.shells.part == 0)[[2, 3, 7]], a.shells.thickness.copy()
    t[chosen] *= 1 - np.linspace(0.03, 0.2, 12).reshape(3, 4)
    return replace(a, shells=replace(a.shells, thickness=t))


def of_all(**values):
    """A change of the one material of all parts."""

    def change(a):
        new = replace(a.parts[0].section.membrane, **values)
        every = {"membrane": new, "bending": new, "shear": new}
        return a.with_parts(tuple(p.with_section(**every) for p in a.parts))

    return change


def weighted(*offset):
    at = np.array(offset) if offset else None
    return lambda a: with_masses(a, tuple(int(i) for i in a.ids[[3, 11]]), 0.0321, at)


def with_inertia(a):
    heavy = with_masses(a, (int(a.ids[0]),), 0.1)
    matrix = heavy.masses.matrix.copy()
    matrix[-1, 3:, 3:] += np.diag([1e-4, 1.5e-4, 2e-4])
    return replace(heavy, masses=replace(heavy.masses, matrix=matrix))


def loaded(a):
    """NSM of every sheet, and of one group of shells alone, which gets a property of its own."""
    heavy, part = [p.with_section(nonstructural=3.0) for p in a.parts], np.array(a.shells.part)
    part[np.flatnonzero(part == 0)[:5]] = len(heavy)
    more = replace(heavy[0].with_section(nonstructural=7.5), id=91)
    return replace(a, parts=(*heavy, more), shells=replace(a.shells, part=part))


def split(a, shells, **section):
    """Some shells of one part as a part of their own, with other section values."""
    part, parts = a.shells.part.copy(), list(a.parts)
    source = parts[part[shells][0]]
    part[shells] = len(parts)
    new = replace(source.with_section(**section), id=source.id, name="patch")  # its id is taken
    return replace(a, parts=(*parts, new), shells=replace(a.shells, part=part))


def of_part(a, k):
    return np.flatnonzero(a.shells.part == k)


def softer_and_thicker(a):
    """The patch names a material of its own; the rest keeps the deck's."""
    shells, t = of_part(a, 1)[:4], a.shells.thickness.copy()
    soft = Isotropic(7e10, 0.33, 2700.0, id=a.parts[1].section.membrane.id)
    t[shells] *= 1.5
    a = split(a, shells, membrane=soft, bending=soft, shear=soft)
    return replace(a, shells=replace(a.shells, thickness=t))


CHANGES = {  # what is changed, and the cards whose lines go where they are known
    "E of all": (calibrated("E", (0, 1), 0.0712345678), ["MAT1"]),
    "rho of all": (calibrated("rho", (0, 1), 0.0712345678), ["MAT1"]),
    "t of all": (calibrated("t", (0, 1), 0.0712345678), ["PSHELL"] * 2),
    "nu of all": (of_all(nu=0.36), ["MAT1"]),
    "E of one": (calibrated("E", (1,), -0.2), ["PSHELL"]),
    "rho of one": (calibrated("rho", (1,), -0.2), ["PSHELL"]),
    "t of one": (calibrated("t", (1,), -0.2), ["PSHELL"]),
    "t at corners": (thinner_at_corners, None),  # in place, or on a continuation
    "grain of all": (grained((0, 1), (1.0, 0, 0), 0.15, -0.1, 0.05, 0.1), None),
    "grain of one": (grained((0,), (1.0, 0, 0), 0.15, -0.1, 0.05, 0.1), None),
    "slanting grain of all": (grained((0, 1), (0.6, 0.8, 0), 0.15, -0.1, 0.05, 0.1), None),
    "slanting grain of one": (grained((0,), (0.6, 0.8, 0), 0.15, -0.1, 0.05, 0.1), None),
    "masses": (weighted(), []),
    "masses beside grids": (weighted(0.004, -0.011, 0.02), []),
    "a mass with inertia": (with_inertia, []),
    "non-structural mass": (loaded, None),
    "bending of a part": (lambda a: a.with_parts(
        (a.parts[0], a.parts[1].with_section(bending_ratio=0.5))), ["PSHELL"]),
    "bending of some shells": (lambda a: split(a, of_part(a, 0)[3:9], bending_ratio=0.3), None),
    "another sheet of some shells": (softer_and_thicker, None),
}  # fmt: skip


@pytest.mark.parametrize("name", CHANGES)
def test_what_was_changed_is_in_the_deck(deck, name):
    """One line a card: a shared material is one line, thickness is one a part."""
    (made, before, units), (change, cards) = deck, CHANGES[name]
    after = change(before)
    with pytest.raises(AssertionError):
        alike(before, after)
    found, gone, _ = rewritten(made, before, after, units)
    assert len({p.id for p in found.parts}) == len(after.parts)
    for was, wanted, got in zip(before.parts, after.parts, found.parts, strict=False):
        assert was != wanted or got == was  # a part that keeps its values keeps its cards
    heads = [line[:6].strip().rstrip("*") for line in gone]
    assert cards is None or heads == cards


REFUSED = {
    "elements of patch come from 2 properties": lambda a: split(
        a, [of_part(a, 0)[0], of_part(a, 1)[0]], bending_ratio=0.5
    ),
    "from one property of the deck to another": lambda a: replace(
        a, shells=replace(a.shells, part=1 - a.shells.part)
    ),
    "Anisotropic": lambda a: a.with_parts(
        tuple(p.with_section(membrane=m, bending=m) for p in a.parts
              for m in [Anisotropic(1e9 * np.eye(3), id=p.section.membrane.id)])
    ),
}  # fmt: skip


@pytest.mark.parametrize("said", REFUSED)
def test_what_no_card_says_is_refused(deck, said):
    made, before, units = deck
    says(said, changes, made, before, REFUSED[said](before), units)


def test_springs_to_ground(deck):
    """An oblique spring is a bush in its own frame; element ids stay unique beside new masses."""
    made, before, units = deck
    grids = tuple(int(i) for i in before.ids[[0, 17]])
    after = with_springs(before, grids, np.array([[0, 0, 1.0], [0.6, 0, 0.8]]), 4321.0)
    after = with_masses(after, grids, 0.01)
    found, gone, _ = rewritten(made, before, after, units)
    np.testing.assert_allclose(found.springs.value, after.springs.value, rtol=1e-6)
    np.testing.assert_array_equal(found.springs.component[:, 0], after.springs.component[:, 0])
    np.testing.assert_allclose(found.bushes.frame[:, 0], [[0.6, 0, 0.8]], atol=1e-6)
    ids = {*found.springs.ids, *found.bushes.ids, *found.masses.ids, *found.shells.ids}
    assert len(ids) == 1 + 1 + 2 + len(found.shells)
    assert gone == []


def thinned(a):
    t = a.shells.thickness * (1 - 0.1 * a.points[a.shells.nodes][..., 0])
    return replace(a, shells=replace(a.shells, thickness=t))


def with_triangle(a):
    nodes = a.shells.nodes.copy()
    nodes[5, 3] = nodes[5, 2]
    return replace(a, shells=replace(a.shells, nodes=nodes))


def with_bars(a):
    """Two bars of the sheet's own material."""
    bar = Part(9, "bar", BeamSection(a.parts[0].section.membrane, 1e-5, 1e-11, 1e-11, 0.0, 2e-11))
    beams = replace(
        a.beams, ids=np.array([901, 902]), nodes=np.array([[0, 4], [4, 8]]), part=np.array([1, 1]),
        up=np.tile([0.0, 0, 1], (2, 1)), offset=np.zeros((2, 2, 3)), pins=np.zeros((2, 2, 6), bool),
    )  # fmt: skip
    return replace(a, parts=(*a.parts, bar), beams=beams)


def skewed(a):
    """A sheet of a MAT2, without shear."""
    Q = a.parts[0].section.membrane.plane_stress()
    Q[0, 2] = Q[2, 0] = 0.03 * Q[0, 0]
    sheet = Anisotropic(Q, rho=7850.0)
    section = dict(membrane=sheet, bending=sheet, shear=None, rigid_shear=True)
    return a.with_parts((a.parts[0].with_section(**section),))


def another_grain(a):
    """A MAT8's moduli, nu12 and density."""
    old = a.parts[0].section.membrane
    new = replace(old, E1=1.1 * old.E1, E2=0.9 * old.E2, nu12=0.25, G12=1.2 * old.G12, rho=8000.0)
    return a.with_parts((a.parts[0].with_section(membrane=new, bending=new, shear=new),))


def of_the_sheet(a):
    """E of the sheet alone, whose MAT1 the bars share."""
    sheet = next(k for k, p in enumerate(a.parts) if not isinstance(p.section, BeamSection))
    return calibrated("E", (sheet,), 0.2)(a)


PLATES = {  # what the plate has, and what is changed
    "thickness of triangles": (with_triangle, thinned),
    "a material that a bar shares": (with_bars, of_the_sheet),
    "E of a MAT2": (skewed, calibrated("E", (0,), 0.1)),
    "rho of a MAT2": (skewed, calibrated("rho", (0,), 0.1)),
    "grain of a lossy sheet": (of_all(damping=0.02), grained((0,), (1.0, 0, 0), *[0.1] * 4)),
    "grain that is there already": (grained((0,), (0, 1.0, 0), *[0.1] * 4), another_grain),
}  # fmt: skip


@pytest.mark.parametrize("name", PLATES)
def test_what_a_plate_has_is_changed_where_it_stands(tmp_path, name):
    made, change = PLATES[name]
    deck, before, units = opened(made(plate(0.3, 0.2, 4, 3, 1e-3)), tmp_path)
    rewritten(deck, before, change(before), units)


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
    found = read_deck(path)
    before = assembly(found, UNITS["mm-t-s"])
    groups, tube = element_groups(structure(before)), before.part(7)
    stiff, wall = (calibration_parameter(groups, q, [tube]) for q in ("E", "wall"))
    after = wall.apply(stiff.apply(before, np.array([0.1])), np.array([-0.2]))
    again, gone, fresh = rewritten(found, before, after)
    section, due = again.parts[again.part(7)].section, after.parts[after.part(7)].section
    for name in ("area", "I1", "I2", "J", "shear"):
        assert getattr(section, name) == pytest.approx(getattr(due, name), rel=1e-6)
    assert not [line for line in (*fresh, *gone) if line.startswith(("GRID", "CB", "PBAR,8"))]
