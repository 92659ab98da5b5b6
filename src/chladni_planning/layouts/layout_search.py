"""Layouts by searches that may leave a local optimum: annealing and random-key evolution."""

import numpy as np

from .deletion import greedy, start
from .exchange import _joinable, _regular, _swapped, exchange
from .information import Candidates, candidates, value
from .layout_rules import Rules


def annealed(
    phi: np.ndarray | Candidates,
    n_sensors: int,
    *,
    seed: int = 0,
    steps: int = 4000,
    hot: float = 1.0,
    cold: float = 1e-3,
    noise: np.ndarray | None = None,
    rules: Rules | None = None,
) -> np.ndarray:
    """Simulated annealing over single swaps: a loss Δ of log det is accepted with odds e^(Δ/T).

    T falls from ``hot`` to ``cold`` geometrically. The best layout found is returned (increasing)
    after single exchange until no swap improves it.
    Kirkpatrick, Gelatt and Vecchi (1983), Science 220, 671-680.
    """
    c, rng = candidates(phi, noise), np.random.default_rng(seed)
    _, checked = start(c, n_sensors, rules)
    kept = np.sort(greedy(c, n_sensors, rules=rules))
    now = value("D", c.fisher(kept))
    best, found = now, kept
    for T in np.geomspace(hot, cold, steps):
        swap = _random_swap(c, kept, checked, rng)
        if swap is None:
            continue
        after, new = swap
        if after >= now or rng.random() < np.exp((after - now) / T):
            kept, now = new, after
        if now > best:
            best, found = now, kept
    return exchange(c, found, rules=rules)


def _random_swap(
    c: Candidates, kept: np.ndarray, rules: Rules, rng: np.random.Generator
) -> tuple[float, np.ndarray] | None:
    """log det and layout after a random sensor has moved to a random place."""
    k = int(rng.integers(len(kept)))
    mask = np.zeros(len(c), bool)
    mask[kept] = True
    others = np.flatnonzero(_joinable(rules, mask, kept[k]))
    if rules.fixed[kept[k]] or len(others) == 0:
        return None
    j, rest = others[[rng.integers(len(others))]], np.delete(kept, k)
    after = _swapped(c, _regular(c, kept), rest, j, c.leaving(kept)[:, k], "D")
    return float(after[0]), np.sort(np.r_[rest, j])


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


def keyed(keys: np.ndarray, n_sensors: int, rules: Rules) -> np.ndarray:
    """The layout (increasing) of the highest keys that the rules allow, one after the other."""
    if rules.free:
        return np.sort(np.argpartition(-keys, n_sensors - 1)[:n_sensors])
    kept = np.zeros(len(keys), bool)
    while kept.sum() < n_sensors:
        may = rules.addable(kept, n_sensors)
        if not may.any():
            break
        kept[int(np.argmax(np.where(may, keys, -np.inf)))] = True
    return np.flatnonzero(kept)
