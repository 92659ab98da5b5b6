"""A stinger and a gauge at the drive point: limits, the full structure, and only there."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import Effect
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.search_context import best_starts
from chladni.effects.springs import MOST_DRIVES, ExtraSupport, shaker_restraint
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.inference.hypothesis_fit import UpdatingProblem
from chladni.inference.likelihood import Responses
from chladni.model.point_masses import with_masses
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

TOP = 300.0  # Hz; six flexible modes of the plate lie below
FLEXIBLE = slice(6, 12)
DRIVE = 25
NONE = -30.0
UP = (0.0, 0.0, 1.0)


@pytest.fixture(scope="module")
def problem():
    return reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), TOP)


def setup(problem, drives):
    return Setup((), (), mass_properties(problem.structure.assembly)[0], TOP, drives)


def where(problem, drives):
    return EffectContext(problem.groups, problem.grids, problem.candidates, setup(problem, drives))


@pytest.fixture(scope="module")
def restraint(problem):
    (found,) = shaker_restraint(where(problem, ((((DRIVE, 1.0),), UP),)))
    return found


def hertz(problem, effect, x):
    lam = evaluate(problem.model_for(effect, x), [effect], x, False).lam
    return np.sqrt(np.maximum(lam[FLEXIBLE], 0)) / (2 * np.pi)


def full(made, count=12):
    return normal_modes(structure(made).system, count).frequency


def test_springs_and_mass_are_those_of_the_written_structure(problem, restraint):
    x = np.array([0.5, -0.4, 0.8])
    due = full(restraint.apply(problem.structure.assembly, x))[FLEXIBLE]
    assert_allclose(hertz(problem, restraint, x), due, rtol=2e-3)
    assert np.abs(due / problem.frequency[FLEXIBLE] - 1).max() > 0.01


def test_a_stinger_that_is_very_stiff_lets_the_drive_point_neither_turn_nor_slide(
    problem, restraint
):
    """It may still move along the drive; the plate then has one rigid motion left."""
    deck = problem.structure.assembly
    row = deck.rows([DRIVE])[0]
    held = replace(deck, supports=np.array([(row, c) for c in (1, 2, 4, 5)]))
    x = np.array([12.0, 12.0, NONE])
    lam = evaluate(problem.model_for(restraint, x), [restraint], x, False).lam
    found = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
    due = full(held, 8)
    rigid = due < 1.0
    assert_allclose(found[: len(due)][~rigid], due[~rigid], rtol=5e-3)
    assert found[: len(due)][rigid].max() < 1.0


def test_a_gauge_alone_is_a_mass_at_the_drive_point_that_is_not_weighed(problem, restraint):
    x = np.array([NONE, NONE, 1.0])
    m = restraint.parameters[2].value(x[2])
    due = full(with_masses(problem.structure.assembly, [DRIVE], m))[FLEXIBLE]
    assert_allclose(hertz(problem, restraint, x), due, rtol=2e-3)
    state = evaluate(problem.model_for(restraint, x), [restraint], x)
    assert_allclose(state.weight, mass_properties(problem.structure.assembly)[0], rtol=1e-9)


def test_only_where_it_is_driven_and_by_few_enough_to_be_shakers(problem):
    grids = problem.grids.grids[:: len(problem.grids) // (MOST_DRIVES + 1)].tolist()
    drives = tuple(((((int(g), 1.0),), UP)) for g in grids)
    some = shaker_restraint(where(problem, drives[:MOST_DRIVES]))
    assert [e.grids for e in some] == [(g,) for g in grids[:MOST_DRIVES]]
    assert all(e.trials_factor == MOST_DRIVES for e in some)
    assert shaker_restraint(where(problem, drives[: MOST_DRIVES + 1])) == []
    assert shaker_restraint(where(problem, ())) == []


def test_a_place_between_grids_shares_its_corners(problem):
    """The mass is spread by their weights; where the rod bends the plate it is led to the place."""
    shares = ((DRIVE, 0.6), (DRIVE + 1, 0.4))
    (found,) = shaker_restraint(where(problem, ((shares, UP),)))
    x = np.array([0.0, 0.0, 1.0])
    due = full(found.apply(problem.structure.assembly, x))[FLEXIBLE]
    assert_allclose(hertz(problem, found, x), due, rtol=0.01)


def test_a_support_elsewhere_is_none_of_its_doing(problem, restraint):
    """Its fit gains far less than that of a support where there is one."""
    on = where(problem, ((((DRIVE, 1.0),), UP),))
    support = ExtraSupport.near(on, problem.grids.position(11))
    x = np.array([0.5, 0.0, 0.0, 0.0, 0.0])
    rows = problem.grids.rows[[problem.grids.position(g) for g in (1, 7, 57, 63, 39, DRIVE)]]
    s = 2 * np.pi * np.linspace(30, TOP, 60) * (0.05 + 1j)
    empty = Responses(np.ones((60, 6, 1), complex), s, rows, rows[[5]], np.ones((60, 6), bool))
    model = problem.model_for(support, x)
    truth = evaluate(model, [support], x)
    data = replace(empty, values=empty.rebased(model).model(truth))
    base = (calibration_parameter(problem.groups, "E", [0]),)
    asked = UpdatingProblem(
        problem, data.rebased(problem.model), None, base, (), setup(problem, on.setup.drives)
    )
    start = np.zeros(1)
    plain = asked.fitted_with(Effect(), np.zeros(0), start)
    right = asked.fitted_with(support, x - 0.3 * np.eye(5)[0], start)
    other = min(
        (asked.fitted_with(restraint, y, start) for y in restraint.starts()),
        key=lambda t: t.neg2_log_evidence,
    )
    gain = [plain.neg2_log_evidence - t.neg2_log_evidence for t in (right, other)]
    assert gain[0] > 0
    assert gain[1] < 0.5 * gain[0]


def test_a_gauge_is_not_on_the_scales(problem, restraint):
    """All that it adds to the deck is off when the structure is weighed."""
    x, deck = np.array([0.5, -0.4, 0.8]), problem.structure.assembly
    added = mass_properties(restraint.apply(deck, x))[0] - mass_properties(deck)[0]
    assert_allclose(restraint.weight(x).removed, added)
    assert restraint.weight(x).mass == 0.0


def test_it_begins_at_its_prior_mean_as_well(restraint):
    """Scores about a model without a strong effect misjudge its several numbers."""
    context = SimpleNamespace(
        scan=object(), bases=(np.zeros(1), np.ones(1)),
        scores=lambda effect, starts: np.arange(len(starts))[None],
    )  # fmt: skip
    scored, mean = best_starts(context, [restraint])
    np.testing.assert_array_equal(scored.start, restraint.starts()[0])
    np.testing.assert_array_equal(mean.start, [p.mean for p in restraint.parameters])
    assert mean.base is context.bases[0]
