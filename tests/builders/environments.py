"""Environments stepped as a learner does."""

from typing import Any

import gymnasium as gym
import numpy as np


def story(mode: str, steps: int, id: str, **options: Any) -> np.ndarray:
    """Observations and rewards of two environments in a vector, one after the other."""
    envs = gym.make_vec(id, num_envs=2, vectorization_mode=mode, **options)
    observed, _ = envs.reset(seed=5)
    envs.action_space.seed(5)
    held = [np.ravel(observed)]
    for _ in range(steps):
        observed, reward, *_ = envs.step(envs.action_space.sample())
        held += [np.ravel(observed), reward]
    envs.close()
    return np.concatenate(held)
