"""A region of solids of another material: what a body is, which solids a ball holds, the search."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.solid_patch import Ball, Bodies, SolidPatch, candidates
from chladni.inference.hypothesis_fit import HypothesisFit, fitted
from chladni.model.assembly import Assembly, Solids
from chladni.model.properties import Isotropic
from chladni.reduced.reduced_model import evaluate
from chladni.search.candidates import UpdatingContext
from chladni_contract.effect_ground import GROUNDS
from chladni_specimens import plate, solid_plate


def two(gap: float, part: int) -> Assembly:
    """Two blocks one above the other, the second of another part where ``part`` is 1."""
    one = solid_plate(0.2, 0.1, 0.01, 8, 4)
    (s,), n = one.solids, len(one.points)
    both = Solids(
        np.concatenate([s.ids, s.ids + 100]), np.concatenate([s.nodes, s.nodes + n]),
        np.concatenate([s.part, s.part + part]),
    )  # fmt: skip
    points = np.concatenate([one.points, one.points + np.array([0, 0, 0.01 + gap])])
    parts = one.parts + (replace(one.parts[0], id=2, name="other"),) * part
    return replace(one, ids=np.arange(2 * n) + 1, points=points, parts=parts, solids=(both,))


@pytest.mark.parametrize("made", [two(0.001, 0), two(0.001, 1), two(0.0, 1)])
def test_a_ball_stays_in_one_piece_of_one_part(made):
    """Across a gap of a tenth of a solid, and across a border of parts, nothing belongs to it."""
    bodies = Bodies.of(made)
    ball = bodies.ball(12, 0.06)
    assert len(ball) > 8
    assert (bodies.ids[ball] < 100).all()
    assert np.linalg.norm(bodies.centre[ball] - bodies.centre[12], axis=1).max() <= 0.06
    assert_allclose(bodies.size[0], np.sqrt(0.2 * 0.1 + 0.01 * 0.3), rtol=0.5)


@pytest.mark.parametrize(("nx", "E", "count"), [(8, 70e9, 32), (4, 70e9, 0), (8, 2e9, 0)])
def test_beside_sheets_small_or_soft_solids_are_joints(nx, E, count):
    """A casting is a body; a weld of a few solids and a bead of adhesive are none."""
    block = solid_plate(0.2, 0.1, 0.01, nx, 4, material=Isotropic(E, 0.3, 2700.0))
    sheet = plate(1.0, 1.0, 2, 2, 1e-3)
    (s,) = block.solids
    nodes = s.nodes + len(sheet.points)
    both = replace(
        sheet, points=np.concatenate([sheet.points, block.points]),
        ids=np.arange(len(sheet.points) + len(block.points)) + 1,
        parts=(*sheet.parts, replace(block.parts[0], id=2)),
        solids=(replace(s, nodes=nodes, part=s.part + 1),),
    )  # fmt: skip
    assert len(Bodies.of(both)) == count
    assert len(Bodies.of(block)) == 4 * nx


def test_a_ball_leaves_half_of_its_part():
    """All of a part is not a region of it: its E and rho are calibrated."""
    bodies = Bodies.of(solid_plate(0.2, 0.1, 0.01, 8, 4))
    every = [*bodies.balls(9, [0.2, 0.5, 3.0]), *bodies.moved(12, 0.3)]
    assert {len(ball.rows) <= 16 for ball in every} == {True}
    assert len(bodies.balls(9, [0.2])) == 9
    assert bodies.balls(9, [3.0]) == []


def test_a_concealed_region_is_found():
    """Solids of half the modulus: the best fit is about them and has their modulus."""
    ground = GROUNDS["block"]()
    deck, problem = ground.deck, ground.by_responses.problem
    bodies = Bodies.of(deck)
    middle = int(np.argmin(np.linalg.norm(bodies.centre - [0.13, 0.07, 0.01], axis=1)))
    region = bodies.ball(middle, 0.1)
    true = SolidPatch.on(problem.where, bodies, Ball(middle, 0.1, region), 1)
    x = np.array([np.log(0.5), 0.0])
    own = problem.reduced.model_for(true, x)
    state = evaluate(own, [true], x, False)
    known = replace(problem.data, values=problem.data.rebased(own).model(state))
    problem = replace(problem, data=known)
    null = fitted(problem.reduced.model, problem.base, known, None, problem.mean())
    fit = HypothesisFit(problem.base[0], null, problem.reduced.model)
    found = candidates(UpdatingContext(problem, fit))
    every = [problem.fitted_with(c.effect, c.start, c.base) for c in found]
    best = min(every, key=lambda e: e.neg2_log_evidence)
    inside = np.isin(best.effect.ids, bodies.ids[region])
    assert inside.mean() > 0.6
    assert inside.sum() > 0.6 * len(region)
    assert_allclose(best.effect.factors(best.fit.of(best.effect))["E"], 0.5, rtol=0.2)
