"""Error for a request of an environment's state before its first reset."""

import gymnasium as gym
from gymnasium.error import ResetNeeded


def refuse_before_reset(env: gym.Env, state: str, call: str) -> None:
    """Raise while the environment has no ``state`` yet.

    Raises
    ------
    ResetNeeded
        It names the request and the call that is needed first.
    """
    if not hasattr(env, state):
        raise ResetNeeded(f"{call}: call reset() first; there is no state before")
