"""A learned layout beside the known methods: MaskablePPO on the plate (extra ``rl``).

python tests/cases/train_placement.py --steps 60000

Log det after 60 000 steps (a minute and a half of one processor), 64 candidates, 8 modes, 10
sensors: random, best of 30: 12.75; the policy 14.26 (best of 30 draws 13.03); greedy 15.54;
effective independence 15.75; with exchange 15.79. Learning is not worth its time here: the
methods that know the structure of the problem are better and a thousand times faster.
"""

import argparse
from typing import Any

import gymnasium as gym
import numpy as np

from chladni_envs import agents

ID = "chladni_envs:chladni/SensorPlacement-v0"


def train(steps: int, seed: int = 0, **options: Any) -> Any:
    """A MaskablePPO policy after some steps in the environment."""
    from sb3_contrib import MaskablePPO

    env = gym.wrappers.TransformReward(gym.make(ID, moves="add", **options), lambda r: 0.05 * r)
    policy = {"net_arch": [128, 128]}
    model = MaskablePPO(
        "MlpPolicy", env, seed=seed, n_steps=2000, batch_size=200, gamma=1.0,
        ent_coef=0.001, learning_rate=1e-3, policy_kwargs=policy, device="cpu",
    )  # fmt: skip
    return model.learn(steps)


def learned(model: Any, *, sure: bool = True) -> agents.Agent:
    """The policy as an agent; not ``sure``: it draws its actions."""

    def agent(observation: np.ndarray, info: dict[str, Any]) -> np.int64:
        mask = info["action_mask"].astype(bool)
        action, _ = model.predict(observation, action_masks=mask, deterministic=sure)
        return np.int64(action)

    return agent


def compare(steps: int, draws: int = 30, **options: Any) -> dict[str, float]:
    """Log det of the layouts of every method; the learned one also as the best of some draws."""
    shrink, grow = gym.make(ID, **options), gym.make(ID, moves="add", **options)
    model = train(steps, **options)
    loose = learned(model, sure=False)
    layouts = {
        "random, best of 30": [agents.play(grow, agents.at_random(k)) for k in range(draws)],
        "greedy": [agents.play(grow, agents.greedy)],
        "MaskablePPO": [agents.play(grow, learned(model))],
        "MaskablePPO, best of 30": [agents.play(grow, loose) for _ in range(draws)],
        "effective independence": [agents.play(shrink, agents.efi)],
        "EFI and exchange": [agents.play(shrink, agents.exchange(shrink))],
    }
    return {name: max(end["log_det"] for end in ends) for name, ends in layouts.items()}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=60_000)
    for method, log_det in compare(parser.parse_args().steps).items():
        print(f"{method:28}{log_det:9.3f}")
