"""Speed of placement against peers, as ratios within one run: python benchmarks/placement.py.

Effective independence of 400 candidates and 24 modes down to 30 sensors beside the textbook loop
(one determinant for every candidate at every deletion), the projector loop and PySensors' QR;
exchange to its optimum; steps of the environments.
"""

import argparse
import importlib.util
from collections.abc import Callable
from time import process_time
from typing import Any

import gymnasium as gym
import numpy as np

import chladni_envs  # noqa: F401
from chladni_planning import (
    best_layout,
    effective_independence,
    exchange,
    greedy,
    independence,
    log_det_fisher,
)
from timing import timed

Shapes = np.ndarray


def determinant_loop(phi: Shapes, n: int) -> Shapes:
    """Delete the candidate whose loss leaves the largest determinant, one determinant each."""
    kept = list(range(len(phi)))
    while len(kept) > n:
        F = phi[kept].T @ phi[kept]
        left = [np.linalg.slogdet(F - np.outer(phi[i], phi[i]))[1] for i in kept]
        kept.pop(int(np.argmax(left)))
    return np.array(kept)


def projector_loop(phi: Shapes, n: int) -> Shapes:
    """Kammer's formula at every deletion."""
    kept = np.arange(len(phi))
    while len(kept) > n:
        kept = np.delete(kept, independence(phi[kept]).argmin())
    return kept


def pysensors(phi: Shapes, n: int) -> Shapes:
    """PySensors' pivoted QR."""
    from pysensors.optimizers import QR

    return QR().fit(phi).get_sensors()[:n]


def methods(phi: Shapes, n: int) -> None:
    """Times and determinants of all methods."""
    layouts: dict[str, Callable[[], Shapes]] = {
        "effective independence": lambda: effective_independence(phi, n),
        "determinant loop": lambda: determinant_loop(phi, n),
        "projector loop": lambda: projector_loop(phi, n),
        "greedy": lambda: greedy(phi, n),
    }
    if importlib.util.find_spec("pysensors"):
        layouts["PySensors QR"] = lambda: pysensors(phi, n)
    results = {k: timed(f, 1 if "det" in k else 5) for k, f in layouts.items()}
    efi_time, efi = results["effective independence"]
    results["+ 1-exchange"] = timed(lambda: exchange(phi, efi), 1)
    results["20 random starts"] = timed(lambda: best_layout(phi, n, starts=20), 1)
    same = np.array_equal(efi, results["determinant loop"][1])
    print(f"EFI {phi.shape[0]} x {phi.shape[1]} -> {n}; same set as the determinant loop: {same}")
    print(f"{'method':26}{'CPU [ms]':>10}{'x EFI':>9}{'log det':>10}")
    for name, (seconds, kept) in results.items():
        ratio = seconds / efi_time
        print(f"{name:26}{1e3 * seconds:10.2f}{ratio:9.2f}{log_det_fisher(phi[kept]):10.3f}")


def steps_per_second(id: str, seconds: float, **options: Any) -> float:
    """Legal random steps a second, resets included."""
    env, rng = gym.make(id, **options), np.random.default_rng(0)
    _, info = env.reset(seed=0)
    count, start = 0, process_time()
    while process_time() - start < seconds:
        if "action_mask" in info:
            legal = np.flatnonzero(info["action_mask"])
            action = legal[int(rng.random() * len(legal))]
        else:
            action = rng.uniform(-1, 1, env.action_space.shape)
        _, _, terminated, truncated, info = env.step(action)
        count += 1
        if terminated or truncated:
            _, info = env.reset()
    return count / (process_time() - start)


def environments(phi: Shapes, n: int, seconds: float, case: str | None) -> None:
    """Steps a second of every environment, on a case too where one is given."""
    print("\nsteps a second, agent's random choice included (CPU time)")
    cases: dict[str, tuple[str, dict[str, Any]]] = {
        "sensors, 64 x 8": ("chladni/SensorPlacement-v0", {}),
        "sensors, 64 x 8, adding": ("chladni/SensorPlacement-v0", {"moves": "add"}),
        f"sensors, {phi.shape[0]} x {phi.shape[1]}": (
            "chladni/SensorPlacement-v0",
            {"phi": phi, "n_sensors": n},
        ),
        **on_case(case),
        "actuators, 49 x 6": ("chladni/ActuatorPlacement-v0", {}),
        "parameters, 8": ("chladni/ParameterSelection-v0", {}),
        "calibration, 4": ("chladni/Calibration-v0", {}),
    }
    for name, (id, options) in cases.items():
        print(f"{name:26}{steps_per_second(id, seconds, **options):10.0f}")


def on_case(case: str | None) -> dict[str, tuple[str, dict[str, Any]]]:
    """Thirty sensors for fifteen modes, and two shakers, of a case folder or deck."""
    if case is None:
        return {}
    both = {"case": case, "modes": 15}
    return {
        "sensors of the case": ("chladni/SensorPlacement-v0", {**both, "n_sensors": 30}),
        "the same, adding": (
            "chladni/SensorPlacement-v0",
            {**both, "n_sensors": 30, "moves": "add"},
        ),
        "actuators of the case": ("chladni/ActuatorPlacement-v0", both),
    }


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=1.0, help="for each environment")
    parser.add_argument("--case", help="folder or deck whose mesh gives candidates and modes")
    args = parser.parse_args()
    phi = np.random.default_rng(0).normal(size=(400, 24))
    methods(phi, 30)
    environments(phi, 30, args.seconds, args.case)


if __name__ == "__main__":
    main()
