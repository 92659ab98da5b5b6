"""Sample points in the unit cube: space-filling, full factorial, one at a time, for indices.

Sources: Sobol' (1967) with Owen's scrambling, McKay, Beckman and Conover (1979), both by
scipy.stats.qmc; Saltelli et al. (2010), Computer Physics Communications 181, 259-270, and
Morris (1991), Technometrics 33, 161-174, both by SALib (Iwanaga, Usher and Herman 2022).
"""

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from chladni.errors import FileError

LEVELS = 4  # of the grid of Morris' elementary effects: the usual choice


@dataclass(frozen=True, eq=False)
class Design:
    """Points (n, d) in the unit cube.

    ``block`` consecutive points belong together; it is 1 where all points are independent.
    """

    points: np.ndarray
    block: int = 1
    notes: tuple[str, ...] = ()


def design(sampler: str, n: int, d: int, seed: int, own: np.ndarray) -> Design:
    """At most ``n`` points of a sampler.

    Parameters
    ----------
    own : (d,)      the deck's own values in the unit cube, where ``oat`` starts; a value outside is
                    moved to the nearest end

    Raises
    ------
    FileError
        If ``n`` is too few for the sampler.
    """
    found = {
        "sobol": _sobol, "lhs": _lhs, "grid": _grid, "oat": _oat,
        "saltelli": _saltelli, "morris": _morris,
    }[sampler](n, d, seed, np.clip(own, 0.0, 1.0))  # fmt: skip
    if len(found.points) == n:
        return found
    note = f"{sampler} takes {len(found.points)} samples of {d} parameters, {n} were allowed."
    return Design(found.points, found.block, (note,))


def _sobol(n: int, d: int, seed: int, own: np.ndarray) -> Design:
    from scipy.stats import qmc

    whole = qmc.Sobol(d, rng=seed).random_base2(int(np.ceil(np.log2(n))))
    return Design(whole[:n])


def _lhs(n: int, d: int, seed: int, own: np.ndarray) -> Design:
    from scipy.stats import qmc

    return Design(qmc.LatinHypercube(d, rng=seed).random(n))


def _grid(n: int, d: int, seed: int, own: np.ndarray) -> Design:
    levels = int(np.floor(n ** (1 / d) + 1e-9))
    if levels < 2:
        raise FileError(f"a grid of {d} parameters needs at least {2**d} samples, not {n}")
    axes = np.meshgrid(*[np.linspace(0, 1, levels)] * d, indexing="ij")
    return Design(np.stack([a.ravel() for a in axes], axis=1))


def _oat(n: int, d: int, seed: int, own: np.ndarray) -> Design:
    """The deck's own values, then each parameter alone through its range."""
    levels = (n - 1) // d
    if levels < 2:
        raise FileError(f"one at a time, {d} parameters need at least {2 * d + 1} samples, not {n}")
    points = np.tile(own, (1 + levels * d, 1))
    for k in range(d):
        points[1 + levels * k : 1 + levels * (k + 1), k] = np.linspace(0, 1, levels)
    return Design(points)


def problem(d: int) -> dict[str, Any]:
    """The unit cube as a SALib problem."""
    return {"num_vars": d, "names": [str(k) for k in range(d)], "bounds": [[0.0, 1.0]] * d}


def _saltelli(n: int, d: int, seed: int, own: np.ndarray) -> Design:
    from SALib.sample import sobol

    rows = n // (d + 2)
    if rows < 4:
        raise FileError(f"Sobol' indices of {d} parameters need at least {4 * (d + 2)} samples")
    rows = 2 ** int(np.log2(rows))  # a Sobol' sequence is balanced at powers of two
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SALib's own warnings on d = 1 and numpy's generators
        X = sobol.sample(problem(d), rows, calc_second_order=False, seed=seed)
    return Design(X, d + 2)


def _morris(n: int, d: int, seed: int, own: np.ndarray) -> Design:
    from SALib.sample import morris

    if n < 2 * (d + 1):
        raise FileError(f"elementary effects of {d} parameters need at least {2 * (d + 1)} samples")
    X = morris.sample(problem(d), n // (d + 1), num_levels=LEVELS, seed=seed)
    return Design(X, d + 1)
