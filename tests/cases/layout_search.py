"""Twelve sensors on a panel: which method finds the layout that tells ten modes apart best?

python tests/cases/layout_search.py panel.bdf
"""

import sys

import gymnasium as gym

from chladni_envs import agents


def search(deck: str) -> dict[str, float]:
    """Log det of the information of each method's layout."""
    env = gym.make("chladni_envs:chladni/SensorPlacement-v0", case=deck, n_sensors=12, modes=10)
    players = {
        "random": agents.at_random(seed=1),
        "effective independence": agents.efi,
        "exchange": agents.exchange(env),
    }
    return {name: agents.play(env, agent)["log_det"] for name, agent in players.items()}


if __name__ == "__main__":
    for method, log_det in search(sys.argv[1]).items():
        print(f"{method:24}{log_det:8.3f}")
