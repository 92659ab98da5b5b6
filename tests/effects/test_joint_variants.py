"""Joints by other elements: free to move rigidly, as heavy, as stiff as theory says."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.effects.joint_variants import joint_variants
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.io.nastran import assembly as read_assembly
from chladni.io.nastran import read_deck, write_assembly
from chladni_evidence.recovery import panel
from chladni_specimens.forms.mesh_pieces import of_pieces, rectangle, stops
from chladni_specimens.joints.builders import STEEL, spot_welds

NAMES = ["deck", "welds as bars", "welds as springs", "welds rigid", "adhesive as springs",
         "screws rigid", "screws on RBE3"]  # fmt: skip


def frequencies(made):
    return normal_modes(structure(made).system, 12).frequency


@pytest.fixture(scope="module")
def made():
    return {v.name: v for v in joint_variants(panel(0.025))}


@pytest.fixture(scope="module")
def f_of(made):
    """Frequencies of a variant by its name [Hz], each computed once."""
    return cache(lambda name: frequencies(made[name].assembly))


def test_every_joint_has_its_variants(made):
    """Welds, adhesive and screws, the deck first; this deck allows all."""
    assert list(made) == NAMES
    assert not any(v.refused for v in made.values())


@pytest.mark.parametrize("name", NAMES[1:])
def test_a_variant_is_free_and_as_heavy(made, f_of, name):
    """Six rigid motions without stiffness, the same mass: only the joint's elements differ."""
    v = made[name].assembly
    f = f_of(name)
    assert f[5] < 1e-2 * f[6]
    assert mass_properties(v)[0] == pytest.approx(mass_properties(made["deck"].assembly)[0], 1e-4)


def test_constraints_only_raise_frequencies(f_of):
    """A rigid weld holds the same grids in a smaller space of motions; an RBE3 in a larger one."""
    deck = f_of("deck")[6:]
    assert (f_of("welds rigid")[6:] >= deck * (1 - 1e-6)).all()
    assert (f_of("screws rigid")[6:] >= deck * (1 - 1e-6)).all()
    assert (f_of("screws on RBE3")[6:] <= deck * (1 + 1e-6)).all()


def test_bars_and_springs_of_steel_act_as_the_solid(f_of):
    """Metal between sheets is all but rigid, in whichever elements: the footprint decides."""
    deck = f_of("deck")[6:]
    for name in ("welds as bars", "welds as springs"):
        np.testing.assert_allclose(f_of(name)[6:], deck, rtol=0.01)


def test_soft_adhesive_as_springs_is_a_layer_in_shear(made, f_of):
    """A thin layer is sheared: its springs have G A/h, M A/h, and follow E."""
    v = made["adhesive as springs"].assembly
    k = v.bushes.stiffness
    glue = panel(0.025).parts[panel(0.025).part("glue")].section.material
    M = glue.E * (1 - glue.nu) / ((1 + glue.nu) * (1 - 2 * glue.nu))
    np.testing.assert_allclose(k[:, 0] / k[:, 1], M / glue.shear_modulus, rtol=1e-9)
    deck = f_of("deck")[6:]
    np.testing.assert_allclose(
        f_of("adhesive as springs")[6:], deck, rtol=0.05
    )  # a solid bulges at its sides


@pytest.mark.parametrize("name", NAMES[1:])
def test_a_variant_is_a_deck(made, f_of, name, tmp_path):
    """Written and read again it has the same frequencies."""
    path = tmp_path / "variant.bdf"
    write_assembly(made[name].assembly, path)
    again = read_assembly(read_deck(path), "SI")
    f = f_of(name)
    np.testing.assert_allclose(frequencies(again)[6:], f[6:], rtol=1e-4)


def test_beads_of_two_parts_are_all_replaced():
    """Two strings of adhesive in one family of solids: none stays with its springs."""
    made = panel(0.025)
    k, glue = made.part("glue"), made.solids[0]
    mine = np.flatnonzero(glue.part == k)[::2]
    other = replace(made.parts[k], id=99, name="other glue")
    part = glue.part.copy()
    part[mine] = len(made.parts)
    two = replace(made, parts=(*made.parts, other), solids=(replace(glue, part=part),))
    springs = {v.name: v for v in joint_variants(two)}["adhesive as springs"].assembly
    assert len(springs.bushes) == (glue.part == k).sum()
    assert len(springs.solids[0]) == (glue.part != k).sum()
    assert mass_properties(springs)[0] == pytest.approx(mass_properties(made)[0], 1e-4)


def test_the_faces_of_a_tall_block_are_on_the_sheets():
    """A block higher than wide is a spring from sheet to sheet, not from side to side."""
    low, high = (rectangle(name, (0, 0, z), stops([0.0, 0.2], 0.01), stops([0.0, 0.1], 0.01))
                 for name, z in (("low", 0.0), ("high", 0.03)))  # fmt: skip
    made = of_pieces([low, high], {"low": (1e-3, STEEL), "high": (1e-3, STEEL)})
    place = np.array([(0.1, 0.05, 0.015)])
    made = spot_welds(made, place, ("low", "high"), side=0.02, reach=0.05)[0]
    bars = next(v for v in joint_variants(made) if v.name == "welds as bars").assembly
    ends = bars.points[bars.beams.nodes[0]]
    np.testing.assert_allclose(np.abs(ends[1] - ends[0]), [0, 0, 0.03], atol=1e-9)


def test_joints_that_cannot_be_changed_say_why():
    """A grid cannot follow two rigid bodies; an incompressible layer is no spring."""
    coarse = {v.name: v for v in joint_variants(panel(0.1))}
    assert "would follow two rigid bodies; a finer mesh" in coarse["welds rigid"].refused
    soft = panel(0.025)
    k = soft.part("glue")
    glue = soft.parts[k].with_section(material=replace(soft.parts[k].section.material, nu=0.5))
    wet = replace(soft, parts=tuple(glue if n == k else p for n, p in enumerate(soft.parts)))
    found = {v.name: v for v in joint_variants(wet)}
    assert "incompressible" in found["adhesive as springs"].refused
