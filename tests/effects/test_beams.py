"""Beams have the fields of sheets, and things sit on them as they do on sheets."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.reduction import Basis
from chladni.effects.calibration_parameters import calibration_parameter, defaults, random_field
from chladni.effects.effect import WIDER
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.masses import LocalResonator, PointMass
from chladni.effects.registry import families
from chladni.effects.springs import ExtraSupport, suspension
from chladni.effects.user_parameters import user_parameter, with_factor
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.model.assembly import Beams
from chladni.model.free_parameter import FreeParameter
from chladni.model.properties import BeamSection, Part
from chladni.reduced.accuracy import products
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.forms import FORMS
from chladni_specimens.forms.tube_frame import STEEL, pipe
from chladni_specimens.plates import plate

TOP = 150.0


def frame():
    return FORMS["tube frame"].made(1)


@pytest.fixture(scope="module")
def reduced():
    return reduced_problem(frame(), TOP)


@pytest.fixture(scope="module")
def where(reduced):
    setup = Setup((), (8, 12), mass_properties(reduced.structure.assembly)[0], TOP)
    return EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)


def full(assembly, count):
    return normal_modes(structure(assembly).system, count).frequency


def test_the_groups_have_all_that_the_beams_have(reduced):
    groups, system = reduced.groups, reduced.structure.system
    q = np.random.default_rng(0).normal(size=(len(system.dofs), 3))
    for kind, A in ((groups.linear, system.elastic), (groups.mass, system.M)):
        (stack,) = groups.project([kind], Basis((q,)))
        assert_allclose(stack.sum(axis=0), q.T @ (A @ q), rtol=1e-9)
    assert_allclose(groups.weight.sum(), mass_properties(frame())[0], rtol=1e-12)
    assert not groups.sheet.any()


@pytest.mark.parametrize("quantity", ["E", "rho", "wall"])
def test_a_factor_on_a_part_is_exact(reduced, quantity):
    effect, x = calibration_parameter(reduced.groups, quantity, [1]), np.array([0.3])
    written = structure(effect.apply(frame(), x)).system
    q = np.random.default_rng(0).normal(size=(len(written.dofs), 3))
    K, M = products(reduced.model, [effect], x, q)
    assert_allclose(K, written.K.real @ q, rtol=1e-9, atol=1e-12 * abs(K).max())
    assert_allclose(M, written.M @ q, rtol=1e-9, atol=1e-12 * abs(M).max())
    weight = evaluate(reduced.model, [effect], x).weight
    assert_allclose(weight, mass_properties(effect.apply(frame(), x))[0], rtol=1e-9)


def test_what_a_user_frees_of_beams_is_what_the_study_writes(reduced):
    free = FreeParameter("w", "wall", positions=(0, 1))
    effect = user_parameter(reduced.groups, free)
    one, two = effect.apply(frame(), np.array([0.2])), with_factor(frame(), free, np.exp(0.2))
    assert one.parts == two.parts
    assert one.parts[0].section.J == pytest.approx(np.exp(0.2) * frame().parts[0].section.J)


def test_tubes_have_a_wall_and_solid_or_open_sections_have_none(reduced):
    assert [e.text for e in defaults(reduced.groups)] == [
        "E of rails", "E of braces", "rho of rails, braces", "wall of rails", "wall of braces",
    ]  # fmt: skip
    bar = BeamSection(STEEL, 4e-4, 1.3e-8, 1.3e-8, 0.0, 2.2e-8)
    channel = BeamSection(STEEL, 4e-4, 2e-7, 8e-8, 0.0, 5e-10)
    assert pipe(0.025, 1.5e-3).tube
    assert not bar.tube
    assert not channel.tube
    with pytest.raises(TypeError, match="no t"):
        calibration_parameter(reduced.groups, "t", [0])


def test_non_structural_mass_stays_when_rho_changes():
    heavy = tuple(replace(p, section=replace(p.section, nonstructural=0.5)) for p in frame().parts)
    made = frame().with_parts(heavy)
    reduced = reduced_problem(made, TOP)
    effect, x = calibration_parameter(reduced.groups, "rho", [0, 1]), np.array([-0.5])
    due = mass_properties(effect.apply(made, x))[0]
    assert_allclose(evaluate(reduced.model, [effect], x).weight, due, rtol=1e-9)
    assert due > mass_properties(frame())[0] * np.exp(-0.5) + 1.0


def test_scatter_keeps_each_tubes_mean(reduced):
    field = random_field(reduced.groups, "E", 0.01)
    assert len(field.parameters) > 4
    for p in (0, 1):
        mine = reduced.groups.part == p
        mean = reduced.groups.area[mine] @ field.functions[mine]
        assert abs(mean).max() < 1e-9 * reduced.groups.area.sum()


SIZES = {  # so strong that the first modes move by several per cent
    PointMass: lambda e: [np.log(0.2 / e.parameters[0].scale), 0.4, 0.0],
    ExtraSupport: lambda e: [np.log(2e4 / e.parameters[0].scale), 0.4, 0.0, 0.2, -0.3],
    LocalResonator: lambda e: [np.log(0.1 / e.parameters[0].scale), 0.4, 0.0, 0.1],
}


@pytest.mark.parametrize("kind", SIZES, ids=lambda k: k.name)
def test_what_sits_on_a_tube_moves_the_modes_as_the_deck_with_it(reduced, where, kind):
    effect = kind.near(where, reduced.grids.position(20))
    x = np.array(SIZES[kind](effect))
    at = effect.at(x)
    a, b = (frame().points[frame().rows([g])[0]] for g in (20, effect.nearest(x)))
    along = reduced.grids.along[reduced.grids.position(20)]
    assert_allclose(np.cross(at - a, along), 0, atol=1e-12)  # it stays on the tube
    assert np.linalg.norm(at - b) <= np.linalg.norm(at - a) + 1e-12
    state = evaluate(reduced.model_for(effect, x), [effect], x)
    found = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
    due = full(effect.apply(frame(), x), 30)
    flexible = (due > 5) & (due < TOP)
    assert flexible.sum() > 4
    assert_allclose(found[: len(due)][flexible], due[flexible], rtol=2e-3)
    assert abs(due[flexible] / full(frame(), 30)[flexible] - 1).max() > 0.02


def test_a_place_on_a_tube_has_one_way_to_go(reduced, where):
    effect = PointMass.near(where, reduced.grids.position(20))
    one, two = (effect.patch.weights(effect.patch.size * np.array([0.3, v])) for v in (0.0, 0.7))
    assert_allclose(one, two, atol=1e-12)
    assert_allclose(one.sum(), 1, rtol=1e-7)
    assert_allclose(one @ effect.patch.flat[:, 0], 0.3 * effect.patch.size, rtol=1e-6)


def test_every_direction_across_a_tube_is_near_one_that_is_tried(reduced):
    grids = reduced.grids
    assert len(set(reduced.candidates.grids)) == 100
    for g, n in ((20, 2), (5, 3)):  # on a rail, at a corner of two tubes
        normal = grids.normal[grids.grids == g]
        assert len(normal) == n
        assert_allclose(normal @ normal.T, np.eye(n), atol=0.2)
        k = grids.position(g, normal[1] + 0.3 * normal[0])
        assert_allclose(grids.normal[k], normal[1])


def test_cords_of_a_tube_may_pull_along_any_axis(where):
    texts = [e.text.removeprefix("at hangers 8, 12") for e in suspension(where)]
    assert texts == [", every direction", ", along x", ", along y", ", along z"]


def test_what_acts_on_sheets_proposes_nothing_for_a_frame(where):
    class Context:
        pass

    context = Context()
    context.where = where
    alone = [f for f in families() if f.on_sheets]
    assert {"crack", "thickness-distribution", "orthotropic-material"} <= {f.name for f in alone}
    assert all(f.proposed(context) == [] for f in alone)
    assert not any(f.on_sheets for f in families() if f.name in ("point-mass", "sensor-fault"))


def stiffened():
    """A plate with a tube along one edge."""
    made = plate(0.4, 0.3, 4, 3, 1.5e-3)
    row = np.flatnonzero(made.points[:, 1] == 0)
    ends = np.column_stack([row[:-1], row[1:]])
    m = len(ends)
    tube = Beams(
        900 + np.arange(m), ends, np.full(m, 1), np.tile([0, 0, 1.0], (m, 1)),
        np.zeros((m, 2, 3)), np.zeros((m, 2, 6), bool),
    )  # fmt: skip
    part = Part(30, "tube", pipe(0.012, 1e-3, STEEL))
    return replace(made, parts=(*made.parts, part), beams=tube)


def test_a_stiffened_plate_frees_both_and_its_sheet_alone_is_patched():
    reduced = reduced_problem(stiffened(), 200.0)
    groups = reduced.groups
    texts = [e.text for e in defaults(groups)]
    assert "wall of tube" in texts
    assert sum(t.startswith("t of") for t in texts) == 1
    assert groups.sheet.sum() < len(groups)
    assert (reduced.grids.line < 0).all()  # the tube's grids are the sheet's
    system = reduced.structure.system
    split = reduced.model.with_components()
    K = sum(A.weighted(np.ones(len(groups))) for A in split.linear.values())
    K = K + sum(A.weighted(np.ones(len(groups))) for A in split.cubic.values())
    Phi = reduced.model.basis
    due = Phi.T @ (system.K.real @ Phi) - reduced.model.K0
    assert_allclose(K, due, atol=1e-8 * abs(due).max())


@pytest.mark.parametrize("effect", [PointMass, ExtraSupport, LocalResonator])
def test_nothing_sits_beside_a_frame(where, effect):
    """A fit that goes far along a tube has the place at its end, where going on changes nothing."""
    for k in (0, len(where.grids) // 2):
        one = effect.near(where, k)
        ends = one.patch.origin + one.patch.flat @ one.patch.plane
        x = np.array([p.mean for p in one.parameters])
        for way in (-40.0, 40.0):
            x[1] = way
            spot = np.array(one.location(x).point_m)
            assert np.linalg.norm(ends - spot, axis=1).min() < 1e-9
            along = [term.moving[1] for term in one.terms(x) if term.moving]
            assert along
            assert not any(abs(slope).sum() for slope in along)


def test_across_a_tube_nothing_is_known_and_nothing_counts(where):
    """The second parameter of a place does nothing on a line of beams: its prior is no doubt."""
    mass = PointMass.near(where, len(where.grids) // 2)
    sd = np.array([0.1, 0.6, 1.5])
    radius = mass.location(np.zeros(3), sd).radius_m
    assert radius == pytest.approx(1.96 * WIDER * 0.6 * mass.patch.size)


def test_at_the_end_of_a_tube_the_slope_is_that_inwards(where):
    k = int(np.flatnonzero(np.bincount(where.grids.line[where.grids.line >= 0]) > 0)[0])
    patch = PointMass.near(where, int(np.flatnonzero(where.grids.line == k)[0])).patch
    end, h = patch.flat.max(axis=0), 1e-6 * patch.size * np.eye(2)[0]
    due = (patch.at(end) - patch.at(end - h)) / h[0]
    assert_allclose(patch.slope(end, 0).toarray(), due.toarray(), atol=1e-2 * abs(due).max())
