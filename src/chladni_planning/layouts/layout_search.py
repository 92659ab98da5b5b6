"""Layouts by random-key evolution, a search that may leave a local optimum."""

import numpy as np

from .deletion import greedy, start
from .information import Candidates, candidates, value
from .layout_rules import Rules, keyed


def evolved(
    phi: np.ndarray | Candidates,
    n_sensors: int,
    *,
    seed: int = 0,
    generations: int = 60,
    population: int = 4,
    noise: np.ndarray | None = None,
    rules: Rules | None = None,
) -> np.ndarray:
    """Genetic search over random keys: every candidate has a key, the highest allowed are kept.

    The keys make any crossing of two layouts a layout (Bean 1994, ORSA J. Computing 6, 154-160);
    they are evolved by differential evolution (scipy), ``population`` times n individuals.
    """
    from scipy.optimize import differential_evolution

    c = candidates(phi, noise)
    _, checked = start(c, n_sensors, rules)

    def loss(keys: np.ndarray) -> float:
        layout = keyed(keys, n_sensors, checked)
        if len(layout) < n_sensors:
            return 1e6
        return float(-np.clip(value("D", c.fisher(layout)), -1e6, None))

    found = differential_evolution(
        loss,
        [(0.0, 1.0)] * len(c),
        maxiter=generations,
        popsize=population,
        init="random",
        rng=np.random.default_rng(seed),
        polish=False,
        tol=0,
    )
    layout = keyed(found.x, n_sensors, checked)
    return layout if len(layout) == n_sensors else np.sort(greedy(c, n_sensors, rules=rules))
