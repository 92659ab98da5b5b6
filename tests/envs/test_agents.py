"""The known methods in the environments are the known methods, and score what theory says."""

from dataclasses import replace
from itertools import product

import gymnasium as gym
import numpy as np
import pytest

import chladni_envs  # noqa: F401
from chladni.errors import LabelError, ShapeError
from chladni.inference.expected_information import Predicted, Rivals
from chladni.output import write_npz
from chladni.search.next_measurement import arrays_of
from chladni_envs import agents
from chladni_envs.parameter_selection import drawn
from chladni_envs.small_specimens import plate, tied_plate
from chladni_planning import (
    Rules,
    Walk,
    best_layout,
    candidates,
    effective_independence,
    first_max,
    greedy,
    log_det_fisher,
    too_near,
    value,
)

SENSORS = "chladni/SensorPlacement-v0"


def random_shapes(n=60, p=6, seed=0):
    return np.random.default_rng(seed).normal(size=(n, p))


@pytest.mark.parametrize("seed", range(3))
def test_efi_agent_is_the_efi_function(seed):
    shapes = random_shapes(seed=seed)
    end = agents.play(gym.make(SENSORS, phi=shapes, n_sensors=9), agents.efi)
    np.testing.assert_array_equal(np.flatnonzero(end["kept"]), effective_independence(shapes, 9))


def test_efi_agent_on_the_symmetric_plate():
    """Mirrored places are decided by number in both."""
    env = gym.make(SENSORS)
    end = agents.play(env, agents.efi)
    core = effective_independence(plate().phi, env.unwrapped.n_sensors)
    np.testing.assert_array_equal(np.flatnonzero(end["kept"]), core)


def test_efi_agent_under_rules_and_noise():
    shapes, points = random_shapes(), np.random.default_rng(1).uniform(size=(60, 2))
    A = np.random.default_rng(2).normal(size=(60, 60))
    noise = A @ A.T / 60 + np.eye(60)
    rules = Rules([4], [7, 8], too_near(points, 0.1))
    end = agents.play(
        gym.make(SENSORS, phi=shapes, n_sensors=9, noise=noise, rules=rules), agents.efi
    )
    core = effective_independence(shapes, 9, noise=noise, rules=rules)
    np.testing.assert_array_equal(np.flatnonzero(end["kept"]), core)


def test_greedy_agent_is_the_greedy_function():
    shapes = random_shapes()
    end = agents.play(gym.make(SENSORS, phi=shapes, n_sensors=9, moves="add"), agents.greedy)
    np.testing.assert_array_equal(np.flatnonzero(end["kept"]), np.sort(greedy(shapes, 9)))


def test_log_det_is_that_of_the_layout():
    """Shrinking exactly; growing up to the faint prior of 1e-8."""
    shapes = random_shapes()
    for moves, close in (("delete", 1e-10), ("add", 1e-5)):
        end = agents.play(
            gym.make(SENSORS, phi=shapes, n_sensors=9, moves=moves), agents.at_random(3)
        )
        assert end["log_det"] == pytest.approx(log_det_fisher(shapes[end["kept"]]), abs=close)


def test_score_is_the_change_of_log_det():
    shapes = random_shapes()
    end = agents.play(gym.make(SENSORS, phi=shapes, n_sensors=9), agents.efi)
    due = log_det_fisher(shapes[end["kept"]]) - log_det_fisher(shapes)
    assert end["score"] == pytest.approx(due)


def test_agents_rank_as_the_methods_do():
    """Random < EFI <= exchange; the genetic search beats random."""
    env = gym.make(SENSORS, phi=random_shapes(40, 5), n_sensors=8)
    score = {
        name: agents.play(env, agent)["score"]
        for name, agent in {
            "random": agents.at_random(0),
            "efi": agents.efi,
            "exchange": agents.exchange(env),
            "genetic": agents.genetic(env, generations=20),
        }.items()
    }
    assert score["random"] < score["efi"] <= score["exchange"]
    assert score["random"] < score["genetic"] <= score["exchange"] + 0.1


@pytest.mark.parametrize("moves", ["delete", "add"])
def test_exchange_agent_walks_to_its_layout_under_rules(moves):
    shapes, points = random_shapes(), np.random.default_rng(1).uniform(size=(60, 2))
    rules = Rules([4], [7], too_near(points, 0.12), (points[:, 0] > 0.5).astype(int), {0: 5})
    env = gym.make(SENSORS, phi=shapes, n_sensors=9, rules=rules, moves=moves)
    end = agents.play(env, agents.exchange(env))
    kept = np.flatnonzero(end["kept"])
    assert len(kept) == 9
    rules.checked(60, 9).obeyed(kept)


def test_impossible_environments_are_refused_when_made():
    with pytest.raises(ShapeError, match="3 sensors cannot distinguish 6 modes"):
        gym.make(SENSORS, phi=random_shapes(), n_sensors=3)
    with pytest.raises(ShapeError, match="0 sensors cannot distinguish"):
        gym.make(SENSORS, n_sensors=0)
    with pytest.raises(LabelError, match="there are delete and add"):
        gym.make(SENSORS, moves="swap")
    with pytest.raises(ShapeError, match="access and rattle leave 0"):
        gym.make("chladni/ActuatorPlacement-v0", access=np.zeros(49, bool))


def test_a_mode_cannot_be_lost():
    """The only candidate that sees a mode is never a legal deletion."""
    shapes = random_shapes(12, 3)
    shapes[:, 2] = 0
    shapes[5, 2] = 1.0
    env = gym.make(SENSORS, phi=shapes, n_sensors=4)
    for seed in range(5):
        assert agents.play(env, agents.at_random(seed))["kept"][5]


@pytest.mark.parametrize("grow", [False, True])
@pytest.mark.parametrize("kind", ["draws", "blocks", "noise"])
def test_walk_follows_the_definition(grow, kind):
    """Worth is what the move does to log det, computed from scratch; in every kind of problem."""
    rng = np.random.default_rng(4)
    A = rng.normal(size=(20, 20))
    c = {
        "draws": lambda: candidates(rng.normal(size=(3, 20, 4))),
        "blocks": lambda: candidates(rng.normal(size=(2, 20, 2, 4))),
        "noise": lambda: candidates(rng.normal(size=(20, 4)), A @ A.T / 20 + np.eye(20)),
    }[kind]()
    walk = Walk(c, 8, None, grow)
    while not walk.done():
        i = first_max(np.where(walk.may(), walk.worth if grow else -walk.worth, -np.inf))
        due = walk.full * walk.worth[i] if grow else np.log1p(-walk.worth[i])
        change = walk.move(i)
        assert change == pytest.approx(due, rel=1e-6, abs=1e-7)
        assert walk.log_det == pytest.approx(walk.exact(), rel=1e-9, abs=1e-7)
    if not grow:
        assert walk.log_det == pytest.approx(value("D", c.fisher(walk.kept)))


def test_best_actuators_agent():
    """No other agent comes to a lower condition number, whatever it tries."""
    env = gym.make("chladni/ActuatorPlacement-v0")
    best = agents.play(env, agents.best_actuators(env))
    others = [agents.play(env, agents.at_random(k))["score"] for k in range(40)]
    others.append(agents.play(env, agents.greedy)["score"])
    assert best["score"] >= max(others)
    assert best["return"] == pytest.approx(-np.log10(best["condition"]))


def test_rattling_places_are_vetoed():
    """The legal places are those whose peak motion leaves the gap open; the best of them wins."""
    specimen = plate(7, 7, 6)
    gap, clearance = specimen.phi[[10]] - specimen.phi[[40]], np.array([1e-3])
    options = {"gap_shapes": gap, "clearance": clearance, "n_actuators": 1}
    margin = gym.make("chladni/ActuatorPlacement-v0", **options).unwrapped.margin
    force = float(np.median(margin))
    env = gym.make("chladni/ActuatorPlacement-v0", force=force, **options)
    legal = env.reset()[1]["action_mask"].astype(bool)
    np.testing.assert_array_equal(legal, margin / force >= 1)
    assert 10 < legal.sum() < 40
    end = agents.play(env, agents.best_actuators(env))
    conditions = env.unwrapped.shaker.conditions()
    assert end["condition"] == pytest.approx(conditions[legal].min())


def test_freeing_what_explains_the_misfit_pays():
    """On drawn problems: all subsets bound the agents; freeing everything or at random is worse."""
    env = gym.make("chladni/ParameterSelection-v0")
    seeds = range(40)
    cross_validated = agents.cross_validated(env)
    sober = [agents.play(env, agents.held_back(), seed=s)["score"] for s in seeds]
    foreseen = [agents.play(env, cross_validated, seed=s)["score"] for s in seeds]
    possible = [best_of_all_subsets(env, s) for s in seeds]

    def everything(observation, info):
        return np.int64(np.flatnonzero(info["action_mask"])[0])

    greedy_ones = [agents.play(env, everything, seed=s)["score"] for s in seeds]
    chance = [agents.play(env, agents.at_random(s), seed=s)["score"] for s in seeds]
    assert np.mean(sober) > np.mean(greedy_ones)
    assert np.mean(sober) > np.mean(chance)
    assert np.mean(sober) > 0
    assert np.mean(foreseen) > 0.9 * np.mean(possible)
    assert np.all(np.array(foreseen) <= np.array(possible) + 1e-9)


def best_of_all_subsets(env, seed):
    env.reset(seed=seed)
    inner = env.unwrapped
    return max(inner.score_of(np.array(s, bool)) for s in product((0, 1), repeat=inner.p))


def test_held_out_data_do_not_reach_the_observation():
    """Other held-out data, the same observations: the agent cannot peek."""
    problem = drawn(np.random.default_rng(0), 5)
    other = np.random.default_rng(1).normal(size=problem.held_residual.shape)
    blind = type(problem)(
        problem.residual, problem.jacobian, other, 2 * problem.held_jacobian[::-1]
    )
    stories = []
    for p in (problem, blind):
        env = gym.make("chladni/ParameterSelection-v0", problem=p)
        obs, _ = env.reset(seed=0)
        stories.append([obs, *(env.step(k)[0] for k in (1, 3))])
    np.testing.assert_array_equal(*stories)


def test_gauss_newton_calibrates():
    """The textbook agent comes to the truth, but for the local minima every FRF metric has."""
    env = gym.make("chladni/Calibration-v0")
    ends = [agents.play(env, agents.gauss_newton(env), seed=seed) for seed in range(20)]
    found = [end["Q"] < 1e-5 for end in ends]
    assert np.mean(found) >= 0.8
    assert all(end["score"] > 2 for end, ok in zip(ends, found, strict=True) if ok)


def test_agents_are_made_for_their_environment():
    env = gym.make("chladni/Calibration-v0")
    for maker in (agents.exchange, agents.best_actuators, agents.cross_validated):
        with pytest.raises(ShapeError, match=r"this agent .*; make it for"):
            maker(env)


def test_withheld_candidates_are_not_in_the_layout():
    env = gym.make(SENSORS, unusable=0.4)
    _, info = env.reset(seed=2)
    out = ~info["kept"]
    assert out.sum() == int(0.4 * 64)
    end = agents.play(env, agents.efi, seed=2)
    assert not np.any(end["kept"] & out)
    agent = agents.exchange(env)
    assert agents.play(env, agent, seed=2)["log_det"] >= end["log_det"] - 1e-9


def test_exchange_is_what_the_core_finds():
    env = gym.make(SENSORS, phi=random_shapes(), n_sensors=9)
    end = agents.play(env, agents.exchange(env))
    core = best_layout(random_shapes(), 9, starts=10)
    np.testing.assert_array_equal(np.flatnonzero(end["kept"]), core)


NEXT = "chladni/NextMeasurement-v0"


@pytest.mark.parametrize("of", [agents.most_informative, agents.most_determined])
def test_measuring_what_tells_most_beats_chance(of):
    """Over the same truths; and information about the name beats that about the unknowns."""
    env = gym.make(NEXT)
    mean = {
        name: np.mean([agents.play(env, agent, seed=k)["score"] for k in range(10)])
        for name, agent in (("of", of(env)), ("random", agents.at_random(0)))
    }
    assert mean["of"] > mean["random"]


def test_odds_are_those_of_the_data_so_far():
    """Odds are calibrated: over many episodes the true name has the probability it was given."""
    env, given, true = gym.make(NEXT, odds=1e9, budget=2.0), [], []
    for k in range(200):
        end = agents.play(env, agents.at_random(k), seed=k)
        given.append(end["probability"])
        true.append(np.arange(4) == end["truth"])
    given, true = np.concatenate(given), np.concatenate(true)
    order = np.argsort(given)
    for some in np.array_split(order, 4):
        p = given[some].mean()
        assert abs(true[some].mean() - p) < 4 * np.sqrt(p * (1 - p) / len(some)) + 0.01


def test_data_after_others_are_the_conditional_gaussian():
    """Odds from all data at once, and from the last after the first."""
    env = gym.make(NEXT, odds=1e9).unwrapped
    env.reset(seed=1)
    env.step(16)
    known, first = env.open, env.made
    env.step(18)
    y = env.data[first.mean.shape[1] :, None]
    again = known.rivals.posterior(known.seen[18], y)[:, 0]
    np.testing.assert_allclose(again, env.probability, rtol=1e-8)


def test_looking_ahead_takes_the_best_pair():
    env = gym.make(NEXT)
    observation, info = env.reset(seed=0)
    k = agents.most_informative(env, ahead=2)(observation, info)
    assert info["action_mask"][k]
    one = agents.most_informative(env)(observation, info)
    known, cost = env.unwrapped.open, env.unwrapped.cost
    others = np.flatnonzero(info["action_mask"])

    def best(k):
        return max(known.information([k, q]) / (cost[k] + cost[q]) for q in others[::6] if q != k)

    assert best(k) >= best(one) - 0.05


def test_nothing_tied_is_no_game(tmp_path):
    single = replace(
        tied_plate(), names=("alone",), rivals=Rivals(np.ones(1)),
        seen=tuple(Predicted(s.mean[:1], s.factors[:1]) for s in tied_plate().seen),
    )  # fmt: skip
    with pytest.raises(ShapeError, match="nothing is tied"):
        gym.make(NEXT, outlook=single)
    with pytest.raises(ShapeError, match="give case="):
        gym.make(NEXT, effects=("crack", "point-mass"))


def test_a_run_is_played(tmp_path):
    """An outlook as a diagnosis leaves it."""
    write_npz(tmp_path / "outlook.npz", **arrays_of(tied_plate()))
    env = gym.make(NEXT, outlook=tmp_path)
    end = agents.play(env, agents.at_random(0), seed=0)
    assert end["names"] == tied_plate().names
    assert len(end["labels"]) == len(end["kept"])
