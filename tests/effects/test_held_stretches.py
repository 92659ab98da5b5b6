"""A clamp that gives by each grid: beam theory, the full structure, decks, a concealed one."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.structures import held_along_x0

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.held_stretches import HeldStretch
from chladni.inference.hypothesis_fit import fitted
from chladni.inference.pole_data import Poles
from chladni.io.nastran import assembly, read_deck, write_assembly, write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.assembly import Assembly, Solids
from chladni.model.ground_springs import with_springs
from chladni.model.properties import Isotropic, Part, SolidSection
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import grid, plate, sheet

from .test_compliant_support import RHO, B, E, L, T, bending, full, hertz, tried

WIDE = 0.25  # m, the held edge of the plate


def clamped(nx=10, ny=8):
    return held_along_x0(plate(0.3, WIDE, nx, ny, 1.5e-3))


def turned(made, *, frames=False):
    """The plate askew in space, its grids in its own frame or in the basic one."""
    a, b = 0.5, 0.8
    one = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1.0]])
    two = np.array([[1.0, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    R = two @ one
    axes = np.tile(R.T, (len(made.points), 1, 1)) if frames else None
    return replace(made, points=made.points @ R.T, axes=axes)


def block():
    """A blade of solids, held over one end."""
    x, y, z = (np.linspace(0, *ends) for ends in ((0.12, 13), (0.04, 5), (0.006, 2)))
    points = np.array([(a, b, c) for a in x for b in y for c in z])
    at = np.arange(len(points)).reshape(len(x), len(y), len(z))
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    cells = np.array([
        [at[i + a, j + b, c] for c in range(2) for a, b, _ in corners]
        for i in range(12) for j in range(4)
    ])  # fmt: skip
    n = len(cells)
    solids = Solids(np.arange(n) + 1, cells, np.zeros(n, int))
    part = Part(1, "blade", SolidSection(Isotropic(E, 0.3, RHO)))
    made = Assembly(np.arange(len(points)) + 1, points, (part,), solids=(solids,))
    return held_along_x0(made, (1, 2, 3))


def by_grid(made, top):
    problem = reduced_problem(made, top)
    return problem, [e for e in tried(problem) if isinstance(e.direction, HeldStretch)]


@pytest.mark.parametrize("ratio", [1e3, 1.0, 1e-2])
def test_a_root_that_turns_along_its_line_is_a_beam_on_a_torsional_spring(ratio):
    """The sum of the springs of all grids is that of the beam (Gorman 1975, ch. 1)."""
    points, nodes = grid(np.linspace(0, L, 41), np.linspace(0, B, 4))
    strip = held_along_x0(sheet(points, nodes, T, Isotropic(E, 0.0, RHO)))
    still = np.array([(row, 2) for row in np.flatnonzero(points[:, 0] > 0)])
    strip = replace(strip, supports=np.concatenate([strip.supports, still]))
    problem, (effect,) = by_grid(strip, 800.0)
    k = ratio * E * B * T**3 / 12 / L
    x = np.array([effect.parameters[0].nominal, np.log(k / effect.parameters[1].scale)])
    assert_allclose(hertz(problem, effect, x, 2), bending(ratio / L), rtol=3e-3)


@pytest.mark.parametrize("made", [clamped(), turned(clamped()), turned(clamped(), frames=True)])
def test_stretches_of_a_line_are_those_of_the_full_structure(made, tmp_path):
    """All of it, its halves and its middle; the deck read back is the structure."""
    problem, effects = by_grid(made, 300.0)
    assert [len(e.grids) for e in effects] == [9, 5, 5, 5]
    for effect, x in zip(effects, ([-2.0, -4.0], [-3, -1], [0, -3], [-2, -3]), strict=True):
        x = np.array(x, float)
        after = effect.apply(made, x)
        found, due, was = hertz(problem, effect, x, 5), full(after, 5), full(made, 5)
        assert_allclose(found, due, rtol=2e-3)
        assert np.abs(due / was - 1).max() > 0.01
    path = write_assembly(made, tmp_path / "deck.bdf")
    read = read_deck(path)
    write_deck(read, tmp_path / "new.bdf", changes(read, assembly(read, "SI"), after, "SI"))
    assert_allclose(full(assembly(read_deck(tmp_path / "new.bdf"), "SI"), 5), due, rtol=1e-5)


def test_every_grid_takes_the_share_of_its_length():
    _, effects = by_grid(clamped(), 300.0)
    made, x = effects[0].apply(clamped(), np.zeros(2)), np.zeros(2)
    about = made.springs.component[:, 0] == 5
    k = effects[0].springs(x)[1]
    assert_allclose(made.springs.value[about], k / 8 * np.r_[0.5, np.ones(7), 0.5])
    assert not np.isin(made.supports[:, 1], (3, 5)).any()
    assert np.isin([1, 2, 4, 6], made.supports[:, 1]).all()


def test_a_face_of_solids_moves_by_the_area_of_each_grid():
    problem, effects = by_grid(block(), 4000.0)
    assert "over the face" in effects[0].text
    for effect in effects:
        assert [p.name for p in effect.parameters] == ["K"]
        x = np.array([-2.0])
        due, was = full(effect.apply(block(), x), 4), full(block(), 4)
        assert_allclose(hertz(problem, effect, x, 4), due, rtol=2e-3)
        assert np.abs(due / was - 1).max() > 0.005


def test_a_concealed_clamp_that_gives_along_its_line_is_found():
    """Of one stiffness along the line; a rigid clamp that turns leaves ten times the misfit."""
    held, about = clamped(), 5
    edge = np.flatnonzero(held.points[:, 0] == 0)
    loose = replace(
        held, supports=held.supports[held.supports[:, 1] != about]
    )  # fmt: skip
    k = 6000.0 * WIDE / 8 * np.r_[0.5, np.ones(7), 0.5]
    springs = replace(
        with_springs(loose, loose.ids[edge], np.tile(np.eye(3)[2], (9, 1)), 0.0).springs,
        component=np.tile([about, 1], (9, 1)), value=k,
    )  # fmt: skip
    f = full(replace(loose, springs=springs), 8)
    problem = reduced_problem(held, 1.1 * f[-1])
    every = np.ones(8, bool)
    data = Poles(f, 1e-3 + 0 * f, every, every + 0.0, (5.0, 1.1 * f[-1]))
    modulus = calibration_parameter(problem.groups, "E", [0])
    rms = {}
    for effect in tried(problem)[:2]:
        model = problem.model_for(effect, np.zeros(2))
        fit = fitted(model, (modulus, effect), data.rebased(model), None, np.array([0, 2.0, -1.0]))
        rms[type(effect.direction)] = np.std(fit.state.lam[:8] ** 0.5 / (2 * np.pi) / f)
        value = effect.springs(fit.x[1:])[-1]
    assert_allclose(value, 6000.0 * WIDE, rtol=0.1)
    rigid, own = rms.values()
    assert own < 0.1 * rigid
