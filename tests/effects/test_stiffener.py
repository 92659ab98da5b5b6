"""A rib along a line of grids: closed forms, the lines that are tried, a concealed one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.sheets import Doubler, MassPatch, thickened
from chladni.effects.stiffener import GridLines, Stiffener, candidates
from chladni.fem.assemble import structure
from chladni.inference.hypothesis_fit import fitted
from chladni.inference.pole_data import Poles
from chladni.model.added_beams import with_beam_line
from chladni.model.properties import BeamSection
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import bulge, plate

T, TOP = 1.2e-3, 250.0


@pytest.fixture(scope="module")
def problem():
    return reduced_problem(plate(0.4, 0.3, 12, 9, T), TOP)


@pytest.fixture(scope="module")
def where(problem):
    setup = Setup((), (), float(problem.groups.weight.sum()), TOP)
    return EffectContext(problem.groups, problem.grids, problem.candidates, setup)


def row_at(assembly, place):
    return int(np.linalg.norm(assembly.points - place, axis=1).argmin())


def across(assembly, x, half=0.1):
    """Grids of a line across the plate at x."""
    lines = GridLines.of(assembly)
    return lines.through(row_at(assembly, [x, 0.15, 0.0]), np.eye(3)[1], half)


def test_a_rib_bends_as_a_beam_of_its_second_moment(problem, where):
    """E I L κ²: the energy of its cylindrical bending, and of none across it."""
    made = problem.structure.assembly
    rib = Stiffener.along(where, across(made, 0.2), 1)
    X, kappa = made.points, 0.3
    E, L = rib.section.material.E, rib.length
    for axis, share in ((1, 1.0), (0, 0.0)):
        u = np.zeros((len(X), 6))
        u[:, 2] = 0.5 * kappa * X[:, axis] ** 2
        u[:, 3 if axis == 1 else 4] = kappa * X[:, axis] * (1 if axis == 1 else -1)
        q = u.ravel()[problem.structure.T.tocsc().indices]
        K = rib.bending
        energy = q @ (K @ q) if len(q) == K.shape[0] else np.nan
        due = share * E * rib.section.I1 * L * kappa**2
        assert_allclose(energy, due, rtol=1e-6, atol=1e-9 * E * rib.section.I1 * L)


def test_the_fit_has_the_modes_of_the_full_structure(problem, where):
    """Also where it weighs much; the article weighs what the fit says."""
    rib = Stiffener.along(where, across(problem.structure.assembly, 0.2), 1)
    for x in (np.array([1.0, 0.0]), np.array([-1.0, 1.5])):
        model = problem.model_for(rib, x)
        state = evaluate(model, [rib], x, False)
        made = rib.apply(problem.structure.assembly, x)
        due = normal_modes(structure(made).system, 14).frequency[6:]
        assert_allclose(np.sqrt(state.lam[6:14]) / (2 * np.pi), due, rtol=3e-3)


def test_lines_follow_edges_and_their_neighbours_differ_by_a_step():
    made = plate(0.4, 0.3, 12, 9, T)
    lines = GridLines.of(made)
    line = across(made, 0.2, 0.09)
    X = made.points[made.rows(np.array(line))]
    assert np.ptp(X[:, 0]) < 1e-9
    assert (np.diff(X[:, 1]) > 0).all()
    near = lines.moved(line)
    assert {len(n) - len(line) for n in near} >= {-1, 1}
    assert any(np.ptp(made.points[made.rows(np.array(n))][:, 0]) < 1e-9 and
               not set(n) & set(line) for n in near)  # fmt: skip
    assert len(lines.through(row_at(made, [0.2, 0.15, 0]), np.array([1.0, 1, 0]) / 2**0.5, 1.0)) < 3


def test_a_line_on_a_curved_sheet_stands_on_it():
    flat = plate(0.4, 0.3, 12, 9, T)
    x, y, _ = flat.points.T
    curved = replace(flat, points=np.column_stack([x, y, bulge(x / 0.4, y / 0.3, 0.03)]))
    grids = across(curved, 0.1)
    context = reduced_problem(curved, TOP)
    setup = Setup((), (), float(context.groups.weight.sum()), TOP)
    rib = Stiffener.along(
        EffectContext(context.groups, context.grids, context.candidates, setup), grids, 1
    )
    along = np.diff(curved.points[curved.rows(np.array(grids))], axis=0)
    assert_allclose(np.einsum("ki,ki->k", rib.up, along), 0, atol=1e-12)
    assert (rib.up[:, 2] > 0.9).all()


def concealed(problem, made, count=9):
    f = normal_modes(structure(made).system, 6 + count).frequency[6:]
    every = np.ones(count, bool)
    return Poles(f, 1e-3 + 0 * f, every, every + 0.0, (5.0, 1.02 * f[-1]))


def rms(problem, data, effect, x):
    """Of the relative errors in frequency with E and the effect free, and the fitted effect."""
    E = calibration_parameter(problem.groups, "E", [0])
    model = problem.model_for(effect, x)
    fit = fitted(model, (E, effect), data.rebased(model), None, np.r_[0.0, x])
    f = np.sqrt(fit.state.lam[6 : 6 + len(data.frequency)]) / (2 * np.pi)
    return np.sqrt(np.mean((f / data.frequency - 1) ** 2)), fit.x[1:]


def test_a_concealed_rib_is_told_from_another_line_and_from_a_thicker_region(problem, where):
    """The true line leaves nothing and has its second moment; others leave several times more."""
    made = problem.structure.assembly
    grids = across(made, made.points[row_at(made, [0.13, 0.15, 0.0]), 0])
    sheet = Stiffener.along(where, grids, 1)
    section = BeamSection(sheet.section.material, 4e-6, I1=40e-12)
    data = concealed(problem, with_beam_line(made, grids, section, np.eye(3)[2]))
    left, x = rms(problem, data, sheet, np.array([0.0, 0.0]))
    assert_allclose(sheet.parameters[0].value(x[0]), 40e-12, rtol=0.1)
    other = Stiffener.along(where, across(made, 0.3), 1)
    group = int(np.argmin(np.linalg.norm(problem.groups.centre - sheet.point, axis=1)))
    patch = Doubler.on(problem.groups, group, 1)
    start = np.array([-0.7, np.log(0.2), 0, 0, np.log(2.0)])
    assert rms(problem, data, other, np.array([0.0, 0.0]))[0] > 3 * left
    assert rms(problem, data, patch, start)[0] > 2 * left


def test_a_concealed_doubler_is_told_from_a_mass(problem):
    """It is as heavy and as stiff as its thickness says."""
    made = problem.structure.assembly
    centre = np.array([0.12, 0.15, 0.0])
    far = np.linalg.norm(made.points - centre, axis=1)
    q = np.exp(-((far**2 / (2 * 0.07**2)) ** 2))
    data = concealed(problem, thickened(made, 0.6 * q, np.ones(len(made.shells), bool)))
    group = int(np.argmin(np.linalg.norm(problem.groups.centre - centre, axis=1)))
    start = np.array([-0.3, np.log(0.2), 0, 0, np.log(2.0)])
    left, x = rms(problem, data, Doubler.on(problem.groups, group, 1), start)
    assert 0.5 * np.exp(x[0]) == pytest.approx(0.6, rel=0.3)
    assert rms(problem, data, MassPatch.on(problem.groups, group, 1), start)[0] > 2 * left


def test_a_heavy_rib_is_sought_where_a_mass_explains_most(where):
    """No line of shells wants more bending: the line through the heaviest place is proposed."""
    made = where.groups.structure.assembly
    place = where.places.point[len(where.places) // 3]

    def bending(about, sets):
        return -np.ones(len(sets)), np.zeros(len(sets))

    def masses(about, matrix, strengths):
        far = np.linalg.norm(where.places.point - place, axis=1)
        return far[:, None] + (strengths != np.median(strengths))

    def scores(line, starts, extended):
        X = made.points[made.rows(np.array(line.grids))]
        far = np.linalg.norm(X - place, axis=1).min() + np.ptp(X[:, 0])
        return np.full((1, len(starts)), far)

    context = SimpleNamespace(
        where=where, bases=(None, "null"), scores=scores,
        scan=SimpleNamespace(bending_scores=bending, point_scores=masses),
        own=lambda line, x: (float(scores(line, [x], True)[0, 0]), x), idle=np.inf,
    )  # fmt: skip
    best = candidates(context)[0]
    X = made.points[made.rows(np.array(best.effect.grids))]
    assert np.linalg.norm(X - place, axis=1).min() < 0.05
    assert np.ptp(X[:, 0]) < 1e-9
    assert best.base == "null"


@pytest.mark.parametrize(("height", "edges", "what"), [
    (0.9, 2, "point-mass"), (0.9, 4, "mass-patch"), (1.1, 2, ""), (4.0, 4, ""),
])  # fmt: skip
def test_a_blade_lower_than_the_sheet_is_thick_is_a_mass(problem, where, height, edges, what):
    """Of thickness b on a sheet of thickness t: A = b h, I = b h³/3, at any b."""
    assembly = where.groups.structure.assembly
    lines = GridLines.of(assembly)
    rows = lines.walk(0, np.array([1.0, 0, 0]), 10.0)[: edges + 1]
    rib = Stiffener.along(where, assembly.ids[rows].tolist(), 1)
    t = float(assembly.shells.thickness.mean())
    for b in (0.5 * t, 20 * t):
        sizes = b * (height * t) ** 3 / 3, b * height * t
        x = np.array([np.log(v / p.scale) for v, p in zip(sizes, rib.parameters, strict=True)])
        assert rib.remarks(x).becomes == what
