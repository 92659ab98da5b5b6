"""Effects at points of a structure of solids alone: their places, and the full structure."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.effect_context import EffectContext, Setup, surface
from chladni.effects.masses import PointMass
from chladni.effects.springs import ExtraSupport
from chladni.reduced.accuracy import accuracy
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

from .test_compliant_support import full
from .test_held_stretches import block

TOP = 4000.0


@pytest.fixture(scope="module")
def problem():
    return reduced_problem(block(), TOP)


@pytest.fixture(scope="module")
def where(problem):
    setup = Setup((), (), 0.08, TOP)
    shapes = problem.shapes
    f = problem.frequency[: shapes.shape[1]]
    return EffectContext(problem.groups, problem.grids, problem.candidates, setup, f, shapes)


def test_places_are_the_free_grids_of_the_surface_with_their_normals(where):
    made = block()
    held = made.points[:, 0] == 0
    assert set(where.grids.grids) == set(made.ids[~held])
    top = where.grids.point[:, 2] > 0.005
    inner = (np.abs(where.grids.point[:, 1] - 0.02) < 0.015) & (where.grids.point[:, 0] < 0.115)
    assert_allclose(np.abs(where.grids.normal[top & inner][:, 2]), 1.0, atol=1e-9)


@pytest.mark.parametrize(("kind", "x"), [
    (PointMass, [0.0, 0.0, 0.0]), (ExtraSupport, [-2.0, 0.0, 0.0, 0.0, 0.0]),
])  # fmt: skip
def test_a_mass_and_a_spring_have_the_modes_of_the_full_structure(problem, where, kind, x):
    tip = int(np.argmin(np.linalg.norm(where.grids.point - [0.1, 0.02, 0.006], axis=1)))
    effect, x = kind.near(where, tip), np.array(x)
    model = problem.model_for(effect, x)
    lam = evaluate(model, [effect], x, False).lam[:4]
    due = full(effect.apply(block(), x), 4)
    assert_allclose(np.sqrt(lam) / (2 * np.pi), due, rtol=1e-2)
    assert np.abs(due / full(block(), 4) - 1).max() > 0.005
    between = np.r_[x[0], 0.3, -0.2, x[3:]]
    assert_allclose(full(effect.apply(block(), between), 4), due, rtol=1e-9)


def test_where_there_are_shells_solids_are_no_surface():
    """Beads of adhesive between sheets are no places of a mass."""
    sheet = plate(0.1, 0.1, 2, 2, 1e-3)
    assert surface(replace(sheet, solids=block().solids)) is sheet.shells.nodes


def test_the_error_of_a_reduced_model_needs_no_shell(problem):
    """At the parameters of its own basis nothing is missing."""
    found = accuracy(problem, problem.model, [], np.zeros(0), TOP)
    assert found.frequency.size
    assert found.worst < 1e-6
