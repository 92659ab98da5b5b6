"""A rigid tie that gives: reduced against full, its limits, which ties there are, the deck."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.joints import fasteners
from chladni.effects.rigid_ties import on_firm_springs, rigid_ties
from chladni.effects.welds import RIGID, over_constraint
from chladni.fem.assemble import structure
from chladni.fem.modelled import modelled
from chladni.model.added_points import next_id, with_points
from chladni.model.assembly import RigidBody
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.search.fastener_scan import loosened_rows, singles
from chladni.workflows.decks_of_diagnosis import as_it_is
from chladni_specimens.forms.mesh_pieces import of_pieces, rectangle, stops
from chladni_specimens.joints.bolts import screw
from chladni_specimens.plates import STEEL

TOP = 250.0
ALL = (1, 2, 3, 4, 5, 6)
FLEXIBLE = slice(6, 14)


def _nearest(made, part, place):
    """Rows of the four grids of a part nearest to a place."""
    rows = np.unique(made.shells.nodes[made.shells.part == part])
    return rows[np.argsort(np.linalg.norm(made.points[rows] - place, axis=1), kind="stable")[:4]]


def tied_plates(h=0.05, ties=((0.08, 0.08), (0.32, 0.08), (0.2, 0.22)), lead="point"):
    """Two plates 20 mm apart, held by rigid elements alone."""
    pieces = [
        rectangle(name, (0, 0, z), stops([0.0, 0.4], h), stops([0.0, 0.3], h))
        for name, z in (("lower", 0.0), ("upper", 0.02))
    ]
    made = of_pieces(pieces, {"lower": (1.5e-3, STEEL), "upper": (1e-3, STEEL)})
    for x, y in ties:
        place = np.array([x, y, 0.01])
        near = [_nearest(made, p, place) for p in (0, 1)]
        if lead == "point":
            made, at = with_points(made, place[None])
            first, rows = int(at[0]), np.concatenate(near)
        else:
            first, rows = int(near[0][0]), near[1]
        body = RigidBody(next_id(made), first, tuple(rows.tolist()), (ALL,) * len(rows))
        made = replace(made, rigid=(*made.rigid, body))
    return made


@pytest.fixture(scope="module", params=["point", "grid"])
def plates(request):
    return tied_plates(lead=request.param)


@pytest.fixture(scope="module")
def reduced(plates):
    return reduced_problem(on_firm_springs(plates), TOP)


@pytest.fixture(scope="module")
def effect(reduced):
    every = singles(loosened_rows(reduced))
    assert [each.joint.rigid for each in every] == [True] * 3
    return over_constraint(reduced.structure.assembly, every[1].joint, every[1].share, 3)


def frequencies(assembly):
    return normal_modes(structure(assembly).system, band=2 * TOP).frequency


def hertz(reduced, effect, x):
    x = np.array([x])
    lam = evaluate(reduced.model_for(effect, x), [effect], x, False).lam
    return np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)


@pytest.mark.parametrize("x", [-6.0, -2.0, 0.0, 2.0, 5.0])
def test_reduced_agrees_with_the_released_structure(reduced, effect, plates, x):
    """From next to no hold to nearly rigid, to what a basis may miss."""
    due = frequencies(effect.apply(plates, np.array([x])))
    got = hertz(reduced, effect, x)[: len(due)]
    below = due < TOP
    assert_allclose(got[below][6:], due[below][6:], rtol=2e-3)
    assert below.sum() > 9


def test_rigid_where_nothing_gives(reduced, effect, plates):
    due = frequencies(plates)
    got = hertz(reduced, effect, RIGID)
    assert_allclose(got[FLEXIBLE], due[FLEXIBLE], rtol=1e-4)
    stiff = frequencies(effect.apply(plates, np.array([14.0])))
    assert_allclose(stiff[FLEXIBLE], due[FLEXIBLE], rtol=1e-4)


def test_the_softer_the_lower(reduced, effect):
    """Rayleigh: a spring taken away lowers every frequency."""
    f = np.array([hertz(reduced, effect, x)[FLEXIBLE] for x in (-4.0, -2, 0, 2, 4, RIGID)])
    assert np.all(np.diff(f, axis=0) > -1e-6 * f[:-1])
    assert f[0, 0] < 0.98 * f[-1, 0]


def test_firm_springs_change_nothing_and_are_no_fasteners_of_the_deck(plates, reduced):
    due = frequencies(plates)
    got = frequencies(reduced.structure.assembly)
    assert_allclose(got[FLEXIBLE], due[FLEXIBLE], rtol=1e-4)
    assert fasteners(structure(plates)) == []


@pytest.mark.parametrize("x", [-3.0, 0.0, 3.0])
def test_positive_whatever_the_sheets_are_made_of(reduced, effect, x):
    """Half and twice the modulus of both sheets: what is let loose is the spring's alone."""
    softer = calibration_parameter(reduced.groups, "E", [0, 1])
    model = reduced.model_for(effect, np.array([x]))
    for e in (-0.7, 0.7):
        lam = evaluate(model, [softer, effect], np.array([e, x]), False).lam
        assert lam[0] > -1e-6 * lam[6]


def test_which_ties_there_are():
    """One of a floating point's two sheets; what a grid leads; none of a screw or of one sheet."""
    floating, led = tied_plates(), tied_plates(lead="grid")
    assert len(rigid_ties(floating)) == len(rigid_ties(led)) == 3
    assert all(len(tie.rows) == 4 for tie in rigid_ties(floating))
    place = np.array([0.2, 0.15, 0.01])
    screwed = screw(tied_plates(ties=()), place, ("lower", "upper"), reach=0.02)[0]
    assert screwed.rigid
    assert rigid_ties(screwed) == []
    body = floating.rigid[0]
    on_one = replace(body, dependent=body.dependent[:4], components=body.components[:4])
    assert rigid_ties(replace(floating, rigid=(on_one,))) == []


def test_what_is_scored_is_the_deck_without_firm_springs(plates):
    """Q and frequencies of the deck are its own: a firm spring is of the search alone."""
    asked = SimpleNamespace(assembly=plates, tested=lambda assembly: assembly)
    own = as_it_is(asked, modelled(on_firm_springs(plates), TOP))
    assert own.assembly is plates
    assert own.band == TOP
    assert as_it_is(asked, own) is own
