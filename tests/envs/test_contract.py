"""What every environment owes its users, checked on every registered one."""

import inspect
import re
from itertools import pairwise

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.testing import assert_array_equal
from tests.builders.environments import story

import chladni_envs

IDS = list(chladni_envs.IDS)
VARIANTS = [
    *((id, {}) for id in IDS),
    ("chladni/SensorPlacement-v0", {"moves": "add"}),
    ("chladni/SensorPlacement-v0", {"unusable": 0.3}),
    ("chladni/ActuatorPlacement-v0", {"n_actuators": 1}),
]


def legal(env, info):
    if "action_mask" in info:
        return env.action_space.sample(mask=info["action_mask"])
    return env.action_space.sample()


def rollout(env, seed, steps=300, act=legal):
    obs, info = env.reset(seed=seed)
    env.action_space.seed(seed)
    steps_made = [(obs, 0.0, info)]
    for _ in range(steps):
        obs, reward, terminated, truncated, info = env.step(act(env, info))
        steps_made.append((obs, reward, info))
        if terminated or truncated:
            break
    return steps_made


@pytest.mark.parametrize("id", IDS)
def test_the_docstring_is_the_specification(id):
    text = inspect.getdoc(type(gym.make(id).unwrapped))
    for word in ("Observation", "Action", "Reward", "End", "Parameters"):
        assert re.search(rf"^{word}$", text, re.MULTILINE), f"{id}: says nothing under {word}"


@pytest.mark.parametrize(("id", "options"), VARIANTS)
@pytest.mark.filterwarnings("ignore:.*render:UserWarning")
def test_gymnasium_contract(id, options):
    check_env(gym.make(id, render_mode="rgb_array", **options).unwrapped)


@pytest.mark.parametrize(("id", "options"), VARIANTS)
def test_stable_baselines_contract(id, options):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(gym.make(id, **options).unwrapped, warn=False)


@pytest.mark.parametrize(("id", "options"), VARIANTS)
def test_same_seed_same_story(id, options):
    a, b = (rollout(gym.make(id, **options), seed=3) for _ in range(2))
    assert len(a) == len(b)
    assert all(np.array_equal(x[0], y[0]) and x[1] == y[1] for x, y in zip(a, b, strict=True))


@pytest.mark.parametrize(("id", "options"), VARIANTS)
def test_rewards_add_up_to_the_score(id, options):
    for seed in range(3):
        story = rollout(gym.make(id, **options), seed=seed)
        total = sum(reward for _, reward, _ in story)
        assert total == pytest.approx(story[-1][2]["score"], abs=1e-9)


@pytest.mark.parametrize(("id", "options"), VARIANTS)
def test_results_are_python_numbers_in_finite_boxes(id, options):
    env = gym.make(id, **options)
    boxes = [s for s in (env.observation_space, env.action_space) if isinstance(s, gym.spaces.Box)]
    assert all(np.isfinite([s.low, s.high]).all() for s in boxes)
    obs, _ = env.reset(seed=0)
    obs, reward, terminated, truncated, info = env.step(legal(env, env.reset(seed=0)[1]))
    assert [type(x) for x in (reward, terminated, truncated)] == [float, bool, bool]
    assert type(info["score"]) is float
    assert obs in env.observation_space


@pytest.mark.parametrize(("id", "options"), VARIANTS)
def test_observations_do_not_share_memory(id, options):
    story = rollout(gym.make(id, **options), seed=0, steps=2)
    for a, b in pairwise(story):
        assert not np.may_share_memory(a[0], b[0])
        shared = [np.may_share_memory(a[2][k], b[2][k]) for k in ("kept", "x") if k in a[2]]
        assert not any(shared)


@pytest.mark.parametrize(("id", "options"), VARIANTS)
def test_illegal_actions_change_nothing_and_end(id, options):
    """An agent blind to the mask is never rewarded for it, never crashes, and is cut short."""
    env = gym.make(id, **options)
    if not isinstance(env.action_space, gym.spaces.Discrete):
        pytest.skip("every action is legal")
    obs, info = env.reset(seed=0)
    first = legal(env, info)
    obs, _, over, _, info = env.step(first)
    for _ in range(2000):
        if over:
            return
        wrong = np.flatnonzero(info["action_mask"] == 0)
        again, reward, terminated, truncated, info = env.step(wrong[0])
        assert reward == 0
        assert_array_equal(again, obs)
        over = terminated or truncated
    raise AssertionError("the episode never ended")


@pytest.mark.parametrize(("id", "options"), VARIANTS)
def test_masks_agree(id, options):
    env = gym.make(id, **options)
    if not isinstance(env.action_space, gym.spaces.Discrete):
        pytest.skip("every action is legal")
    for _, _, info in rollout(env, seed=1, steps=5):
        assert info["action_mask"].shape == (env.action_space.n,)
    masks = env.unwrapped.action_masks()
    assert masks.dtype == bool
    assert_array_equal(masks, info["action_mask"].astype(bool))
    masks[:] = False  # the caller's own copy
    assert_array_equal(env.unwrapped.action_masks(), info["action_mask"].astype(bool))


@pytest.mark.parametrize(("id", "options"), VARIANTS)
def test_pictures(id, options):
    env = gym.make(id, render_mode="rgb_array", **options)
    _, info = env.reset(seed=0)
    env.action_space.seed(0)  # else the first draw may end the episode with nothing changed
    before = env.render()
    for _ in range(3):
        _, _, terminated, _, info = env.step(legal(env, info))
        if terminated:
            break
    after = env.render()
    assert before.shape == after.shape
    assert before.dtype == np.uint8
    assert np.any(before != after)
    env.close()


@pytest.mark.parametrize(("id", "options"), VARIANTS)
def test_sync_and_async_vectors_are_identical(id, options):
    assert_array_equal(story("sync", 12, id, **options), story("async", 12, id, **options))


@pytest.mark.parametrize("id", IDS)
def test_before_the_first_reset_a_sentence_says_what_is_due(id):
    env = gym.make(id, render_mode="rgb_array").unwrapped
    asked = [env.render, *([env.action_masks] if hasattr(env, "action_masks") else [])]
    for ask in asked:
        with pytest.raises(gym.error.ResetNeeded, match="call reset"):
            ask()
    env.reset(seed=0)
    assert env.render().shape == (256, 320, 3)
