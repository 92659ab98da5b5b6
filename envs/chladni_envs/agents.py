"""Agents, functions ``(observation, info) -> action``, that play the known methods.

``efi`` and ``greedy`` read the observation alone. The searches see the whole problem, compute a
layout first and then walk to it. A call such as ``exchange(env)`` makes them for one environment,
after its reset where a reset changes the candidates.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np

from chladni.errors import ShapeError
from chladni_planning import Candidates, Rules, best_layout, evolved, first_max, first_min
from chladni_planning import best_actuators as best_shakers

from .actuator_placement import ActuatorPlacementEnv
from .calibration_env import STRIDE, CalibrationEnv
from .next_measurement_env import NextMeasurementEnv
from .parameter_selection import ParameterSelectionEnv
from .sensor_placement import SensorPlacementEnv

Agent = Callable[[np.ndarray, dict[str, Any]], Any]


def efi(observation: np.ndarray, info: dict[str, Any]) -> np.int64:
    """Kammer's method: delete the least independent candidate."""
    return np.int64(first_min(np.where(info["action_mask"] == 1, observation, np.inf)))


def greedy(observation: np.ndarray, info: dict[str, Any]) -> np.int64:
    """Add the candidate of largest present worth."""
    return np.int64(first_max(np.where(info["action_mask"] == 1, observation, -np.inf)))


def at_random(seed: int = 0) -> Agent:
    """An agent that takes random legal actions."""
    rng = np.random.default_rng(seed)

    def agent(observation: np.ndarray, info: dict[str, Any]) -> np.int64:
        return np.int64(rng.choice(np.flatnonzero(info["action_mask"])))

    return agent


def towards(layout: np.ndarray, env: gym.Env[Any, Any]) -> Agent:
    """An agent that walks to a given layout."""
    assert isinstance(env.action_space, gym.spaces.Discrete)
    target = np.zeros(int(env.action_space.n), dtype=np.bool_)
    target[np.asarray(layout, dtype=np.int64)] = True
    deleting = isinstance(env.unwrapped, SensorPlacementEnv) and not env.unwrapped.grow

    def agent(observation: np.ndarray, info: dict[str, Any]) -> np.int64:
        wanted = info["action_mask"] == 1
        return np.int64(np.flatnonzero(wanted & (target != deleting))[0])

    return agent


def _problem(env: gym.Env[Any, Any]) -> tuple[Candidates, int, Rules]:
    inner = env.unwrapped
    if not isinstance(inner, SensorPlacementEnv):
        raise ShapeError("this agent places sensors; make it for SensorPlacement-v0")
    rules = inner.walk.rules
    within = replace(rules, forbidden=rules.forbidden | ~inner.walk.reachable)
    return inner.candidates, inner.n_sensors, within


def exchange(env: gym.Env[Any, Any], *, starts: int = 10, seed: int = 0) -> Agent:
    """Exchange from the layout of effective independence and from random ones."""
    c, n_sensors, rules = _problem(env)
    return towards(best_layout(c, n_sensors, rules=rules, starts=starts, seed=seed), env)


def genetic(env: gym.Env[Any, Any], *, seed: int = 0, generations: int = 60) -> Agent:
    """Evolution of random keys."""
    c, n, rules = _problem(env)
    return towards(evolved(c, n, seed=seed, generations=generations, rules=rules), env)


def best_actuators(env: gym.Env[Any, Any]) -> Agent:
    """The actuators of the lowest joint condition number."""
    inner = env.unwrapped
    if not isinstance(inner, ActuatorPlacementEnv):
        raise ShapeError("this agent places actuators; make it for ActuatorPlacement-v0")
    return towards(best_shakers(inner.shaker, inner.n_actuators, inner.allowed, even=True), env)


def held_back(threshold: float = 0.1) -> Agent:
    """Free the parameter that explains most of the misfit, if more than a threshold share."""

    def agent(observation: np.ndarray, info: dict[str, Any]) -> np.int64:
        explained = np.where(info["action_mask"][:-1] == 1, observation[2], -np.inf)
        k = first_max(explained)
        return np.int64(k if explained[k] > threshold else len(explained))

    return agent


def cross_validated(env: gym.Env[Any, Any]) -> Agent:
    """Free the parameter that raises the expected score most, while one does.

    The fitted data alone estimate Q of held-out data, by generalised cross-validation
    (Golub, Heath and Wahba 1979, Technometrics 21, 215-223): Q/(1 - ν/m)² with ν the effective
    number of parameters and m that of the residuals.
    """
    inner = env.unwrapped
    if not isinstance(inner, ParameterSelectionEnv):
        raise ShapeError("this agent frees parameters; make it for ParameterSelection-v0")

    def expected(freed: np.ndarray) -> float:
        problem = inner.problem
        r = problem.residual + problem.jacobian @ problem.fitted(freed)
        unlearned = problem.unlearned(freed)
        Q = np.mean(r**2) / (1 - (freed.sum() - unlearned) / len(r)) ** 2
        return float(np.log10(np.mean(problem.residual**2) / Q) - inner.cost * unlearned)

    def agent(observation: np.ndarray, info: dict[str, Any]) -> np.int64:
        kept, left = info["kept"], np.flatnonzero(info["action_mask"][:-1])
        more = np.array([expected(kept | (np.arange(inner.p) == k)) for k in left])
        pays = len(left) > 0 and more.max() > expected(kept)
        return np.int64(left[more.argmax()] if pays else inner.p)

    return agent


def gauss_newton(env: gym.Env[Any, Any], *, damping: float = 1e-3) -> Agent:
    """Levenberg-Marquardt steps on δ, derivatives by central differences."""
    inner = env.unwrapped
    if not isinstance(inner, CalibrationEnv):
        raise ShapeError("this agent calibrates; make it for Calibration-v0")

    def residual(x: np.ndarray) -> np.ndarray:
        delta = inner.deviation(x).ravel()
        return np.concatenate([delta.real, delta.imag])

    def agent(observation: np.ndarray, info: dict[str, Any]) -> np.ndarray:
        x, h = info["x"], 1e-5
        J = np.stack(
            [(residual(x + h * e) - residual(x - h * e)) / (2 * h) for e in np.eye(len(x))]
        )
        A = J @ J.T
        step = -np.linalg.solve(A + damping * np.diag(np.diag(A)), J @ residual(x))
        step /= max(1.0, float(np.abs(step).max()) / STRIDE)
        return np.asarray(step / STRIDE, dtype=np.float32)

    return agent


def most_informative(env: gym.Env[Any, Any], *, ahead: int = 1, best: int = 4) -> Agent:
    """Measure what is expected to tell most about the name of the explanation for its cost.

    With ``ahead`` = 2, the ``best`` few are judged by the pair that each makes with its best
    follower.
    """
    inner = _measuring(env)

    def agent(observation: np.ndarray, info: dict[str, Any]) -> np.int64:
        known, legal = inner.open, np.flatnonzero(info["action_mask"]).tolist()
        worth = {k: known.information([k]) / inner.cost[k] for k in legal}
        order = sorted(legal, key=lambda k: -worth[k])
        if ahead < 2 or len(order) < 2:
            return np.int64(order[0])
        pairs = {
            k: max(known.information([k, q]) / (inner.cost[k] + inner.cost[q])
                   for q in order[: best + 1] if q != k)
            for k in order[:best]
        }  # fmt: skip
        return np.int64(max(pairs, key=lambda k: (pairs[k], worth[k])))

    return agent


def most_determined(env: gym.Env[Any, Any]) -> Agent:
    """Measure what determines the unknown of the explanations best, whichever is true.

    That is effective independence on their unknowns: the largest growth of Σ_j p_j log det of the
    information.
    """
    inner = _measuring(env)

    def agent(observation: np.ndarray, info: dict[str, Any]) -> np.int64:
        known, growth = inner.open, np.full(len(info["action_mask"]), -np.inf)
        for k in np.flatnonzero(info["action_mask"]):
            F = known.seen[k].factors
            growth[k] = sum(
                p * np.linalg.slogdet(np.eye(len(f)) + f @ f.T)[1]
                for p, f in zip(known.rivals.probability, F, strict=True)
            )
        return np.int64(first_max(growth / inner.cost))

    return agent


def _measuring(env: gym.Env[Any, Any]) -> NextMeasurementEnv:
    inner = env.unwrapped
    if not isinstance(inner, NextMeasurementEnv):
        raise ShapeError("this agent measures; make it for NextMeasurement-v0")
    return inner


def play(env: gym.Env[Any, Any], agent: Agent, *, seed: int | None = None) -> dict[str, Any]:
    """Play one episode; return the last info, with the sum of rewards as ``return``."""
    observation, info = env.reset(seed=seed)
    total, over = 0.0, False
    while not over:
        observation, reward, terminated, truncated, info = env.step(agent(observation, info))
        total, over = total + float(reward), terminated or truncated
    return {**info, "return": total}
