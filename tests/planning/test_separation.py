"""Sensors that separate explanations: closed forms, the walk, the environment."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.testing import assert_allclose

import chladni_envs  # noqa: F401
from chladni.errors import ShapeError
from chladni.inference.expected_information import Predicted, Rivals
from chladni.search.next_measurement import FurtherTest, Outlook
from chladni_envs import agents
from chladni_envs.small_specimens import tied_plate
from chladni_planning import Walk, greedy, separating, value
from chladni_planning.layouts.information import changed

RNG = np.random.default_rng(3)


def drawn(n=5, readings=4, unknown=(3, 2), p=(0.5, 0.5)):
    """Candidates of random predictions under two explanations, one of them with fewer readings."""
    seen = tuple(
        Predicted(
            np.stack([np.zeros(m), RNG.normal(size=m)]),
            tuple(RNG.normal(size=(m, k)) for k in unknown),
        )
        for m in [readings - 1, *[readings] * (n - 1)]
    )
    tests = tuple(FurtherTest("sensor", f"a sensor at {k}", f"{k}:n") for k in range(n))
    return Outlook(("a", "b"), Rivals(np.array(p)), tests, seen)


def distance(known, layout):
    """d² = Δᵀ (I + (F_1 F_1ᵀ + F_2 F_2ᵀ)/2)⁻¹ Δ of some sensors together."""
    made = known.made(layout)
    S = np.eye(made.mean.shape[1]) + sum(F @ F.T for F in made.factors) / 2
    off = made.mean[1] - made.mean[0]
    return float(off @ np.linalg.solve(S, off))


def test_the_criterion_is_the_distance_of_the_explanations():
    known = drawn()
    c = separating(known)
    for layout in ([0], [1, 3], [0, 2, 4]):
        assert_allclose(value("S", c.fisher(np.array(layout))), np.log1p(distance(known, layout)))


def test_a_joining_sensor_changes_it_as_it_does():
    known = drawn()
    c, at, others = separating(known), np.array([1]), np.array([0, 2, 3, 4])
    U = c.joining(at, others)
    found = changed("S", c.fisher(at), U, np.ones(U.shape[2]))
    assert_allclose(found, [np.log1p(distance(known, [1, k])) for k in others])


def test_a_walk_ends_where_greedy_does():
    known = drawn(7)
    c = separating(known)
    walk = Walk(c, 3, None, True, "S")
    gains = [walk.move(int(np.argmax(np.where(walk.may(), walk.worth, -1)))) for _ in range(3)]
    best = greedy(c, 3, criterion="S")
    assert set(np.flatnonzero(walk.kept)) == set(best)
    assert_allclose(sum(gains), np.log1p(distance(known, best)))


def test_what_is_not_known_hides_a_difference():
    """Two sensors of one difference; the one whose unknowns look like it tells less."""
    off, none = np.array([[0.0, 0.0], [3.0, 1.0]]), np.zeros((2, 1))
    alike = Predicted(off, (10 * off[1][:, None], none))
    clear = Predicted(off, (none, none))
    tests = tuple(FurtherTest("sensor", n, n) for n in ("alike", "clear"))
    known = Outlook(("a", "b"), Rivals(np.full(2, 0.5)), tests, (alike, clear))
    assert greedy(separating(known), 1, criterion="S").tolist() == [1]


@pytest.mark.parametrize("every", [drawn(p=(0.999, 0.001)), replace(drawn(), names=("a", "b"))])
def test_only_open_pairs_count(every):
    if every.rivals.probability[0] > 0.9:
        with pytest.raises(ShapeError, match="nothing is tied"):
            separating(every)
    else:
        assert len(separating([every, every]).rows) == 2


def test_sensor_placement_separates_what_is_tied():
    """Its sensors settle the tied plate better than those in the order of the grid."""
    known = tied_plate()
    env = gym.make("chladni_envs:chladni/SensorPlacement-v0", outlook=known, n_sensors=2)
    end = agents.play(env, agents.greedy)
    assert len(end["labels"]) == 2
    assert end["log_det"] > 0
    sensors = known.without(("mass",))
    at = [k for k, c in enumerate(sensors.candidates) if c.label in end["labels"]]
    assert sensors.information(at) > sensors.information([0, 1])
    check_env(env.unwrapped, skip_render_check=True)


def test_a_walk_by_this_criterion_only_adds():
    with pytest.raises(ShapeError, match="sensors are added"):
        Walk(separating(drawn()), 2, None, False, "S")
