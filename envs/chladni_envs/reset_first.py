"""Whoever asks an environment for its state before there is one is told so in a sentence."""

import gymnasium as gym
from gymnasium.error import ResetNeeded


def refuse_before_reset(env: gym.Env, state: str, asked: str) -> None:
    """Raise while the environment has no ``state`` yet.

    Raises
    ------
    ResetNeeded
        It names what was asked and the call that is due.
    """
    if not hasattr(env, state):
        raise ResetNeeded(f"{asked}: call reset() first; there is no state to tell of before")
