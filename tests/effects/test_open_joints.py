"""An open joint of a beam: beam theory, the full structure, where joints are, a concealed one."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.open_joints import effects, hinged
from chladni.fem.assemble import structure
from chladni.inference.hypothesis_fit import fitted
from chladni.inference.pole_data import Poles
from chladni.model.assembly import Assembly, Beams
from chladni.model.properties import BeamSection, Isotropic, Part
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_contract.effect_ground import tubes

STEEL = Isotropic(210e9, 0.3, 7850.0)
L, SIDE = 0.6, 0.01
I = SIDE**4 / 12
TOP = 700.0


def bar(n=30, corner=False):
    """A slender bar held at x = 0, alone or as one leg of a corner."""
    points = [(L * k / n, 0.0, 0.0) for k in range(n + 1)]
    nodes = [(k, k + 1) for k in range(n)]
    if corner:
        points += [(L, 0.5 * L * k / n, 0.0) for k in range(1, n + 1)]
        nodes += [(k, k + 1) for k in range(n, 2 * n)]
    m = len(nodes)
    section = BeamSection(STEEL, SIDE**2, I, I, 0.0, 0.1406 * SIDE**4)
    beams = Beams(
        np.arange(m) + 1, np.array(nodes), np.zeros(m, int), np.tile(np.eye(3)[2], (m, 1)),
        np.zeros((m, 2, 3)), np.zeros((m, 2, 6), bool),
    )  # fmt: skip
    made = Assembly(
        np.arange(len(points)) + 1, np.array(points), (Part(1, "bar", section),), beams=beams
    )
    return replace(made, supports=np.array([(0, c) for c in range(1, 7)]))


def problem_of(made, top=TOP):
    problem = reduced_problem(made, top)
    setup = Setup((), (), float(problem.groups.weight.sum()), top)
    return problem, EffectContext(problem.groups, problem.grids, problem.candidates, setup)


def hertz(made, count):
    return normal_modes(structure(made).system, count).frequency


@pytest.mark.parametrize("ratio", [100.0, 1.0, 0.05])
def test_a_beam_on_a_hinge_at_its_root_has_its_closed_form(ratio):
    """cos bL cosh bL + 1 = (bL / ratio) (sin bL cosh bL - cos bL sinh bL) (Gorman 1975, ch. 1)."""
    EI = STEEL.E * I

    def determinant(b):
        hinge = b * (np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b))
        return ratio * (1 + np.cos(b) * np.cosh(b)) - hinge

    b = brentq(determinant, 1e-3, 1.876)
    due = b**2 / (2 * np.pi * L**2) * np.sqrt(EI / (STEEL.rho * SIDE**2))
    assert_allclose(hertz(hinged(bar(), 1, 0, ratio * EI / L), 1), due, rtol=3e-3)


@pytest.mark.parametrize("ln_k", [3.0, 0.0, -4.0])
def test_the_fit_has_the_modes_of_the_full_structure(ln_k):
    problem, where = problem_of(bar(corner=True))
    every = effects(where)
    assert [(e.beam, e.end) for e in every] == [(30, 1), (31, 0)]
    for effect in every:
        x = np.array([ln_k])
        lam = evaluate(problem.model_for(effect, x), [effect], x, False).lam[:6]
        due = hertz(effect.apply(bar(corner=True), x), 6)
        assert_allclose(np.sqrt(lam) / (2 * np.pi), due, rtol=2e-3)


def test_beams_that_run_on_have_no_joint_and_tubes_have_one_at_every_corner():
    assert effects(problem_of(bar())[1]) == []
    made = tubes()
    _, where = problem_of(made)
    corners = set(made.ids[:8].tolist())
    assert {e.grids[0] for e in effects(where)} == corners


def test_a_concealed_hinge_of_a_frame_is_found_among_all_ends():
    """By nine frequencies and E free; no other end but those of its node leaves as little."""
    made = tubes()
    problem, where = problem_of(made)
    every = effects(where)
    true = every[9]
    x = np.array([-1.0])
    f = hertz(true.apply(made, x), 15)[6:]
    on = np.ones(len(f), bool)
    data = Poles(f, 1e-3 + 0 * f, on, on + 0.0, (5.0, 1.02 * f[-1]))
    E = calibration_parameter(problem.groups, "E", [0])

    def rms(effect):
        model = problem.model_for(effect, x)
        fit = fitted(model, (E, effect), data.rebased(model), None, np.array([0.0, 0.0]))
        found = np.sqrt(fit.state.lam[6:15]) / (2 * np.pi)
        return np.sqrt(np.mean((found / f - 1) ** 2)), fit.x[1]

    left, found = rms(true)
    assert found == pytest.approx(-1.0, abs=0.3)
    elsewhere = [e for e in every if e.grids != true.grids]
    assert min(rms(e)[0] for e in elsewhere[::3]) > 2 * left
