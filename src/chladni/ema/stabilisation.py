"""Stabilisation diagram: poles of every order of the subspace method, and their stability.

Classes and their limits are those in use since Heylen, Lammens and Sas (1997), Modal Analysis
Theory and Testing, section A.3: 1 % in frequency, 5 % in damping, 0.95 of MAC against the order
before.
"""

from dataclasses import dataclass

import numpy as np

from ..dynamics.frf import FRF
from .correlation import mac
from .identification import Identified, kept_lines, pole_data
from .pole_search_by_parts import few_channels
from .subspace import subspace

CLASSES = "ofdvs"  # new; steady in frequency; and damping; and shape; in all three
FREQUENCY, DAMPING, MAC = 0.01, 0.05, 0.95
STEP = 2  # states, one pair of poles
LEAST_STATES, MOST_STATES = 40, 160  # states of the highest order
COMBINATIONS = 12
CONFIRMED = 1 / 3  # of the orders that could hold all poles found


@dataclass(frozen=True, eq=False)
class Stabilisation:
    """Poles of every order."""

    states: np.ndarray  # (k,) int; order of the system each pole comes from
    frequency: np.ndarray  # (k,) [Hz]
    damping: np.ndarray  # (k,) [-]
    kind: np.ndarray  # (k,) str; o new, f frequency, d and damping, v and shape, s all three
    sigma: np.ndarray  # (n,) singular values, over the largest

    def seen(self, found: Identified) -> np.ndarray:
        """Share of the orders rich enough for all poles found in which each of them stands (r,)."""
        orders = np.unique(self.states)
        rich = orders[orders >= min(2 * found.order, orders.max(initial=0))]
        if not len(rich):
            return np.zeros(found.order)
        half = np.maximum(found.damping * found.frequency, 1e-3 * found.frequency)
        near = np.abs(self.frequency[:, None] - found.frequency) < half
        held = [near[self.states == n].any(axis=0) for n in rich]
        return np.mean(held, axis=0)


def stabilisation(
    frf: FRF, found: Identified, use: np.ndarray | None = None, averages: int = 1
) -> Stabilisation:
    """Poles of orders up to three times what was found, classed against the order before.

    Parameters
    ----------
    found : identified from ``frf``; its band is kept to
    use, averages : as :func:`.identification.identify` had them
    """
    data, omega_max = pole_data(frf, kept_lines(frf, found.band, use), averages)
    few = few_channels(data, COMBINATIONS)
    top = min(max(LEAST_STATES, 6 * found.order), MOST_STATES, 2 * (len(data.s) // 6))
    space = subspace(few, top)
    rows: list[tuple[int, np.ndarray, str]] = []
    before = (np.zeros(0, complex), np.zeros((few.y.shape[1], 0), complex))
    for n in range(STEP, min(top, len(space.sigma)) + 1, STEP):
        now = space.modes(n)
        rows.append((n, now[0], _classes(now, before)))
        before = now
    p = omega_max * np.concatenate([p for _, p, _ in rows])
    return Stabilisation(
        np.concatenate([np.full(len(p), n) for n, p, _ in rows]),
        np.abs(p) / (2 * np.pi),
        -p.real / np.abs(p),
        np.array([c for _, _, kinds in rows for c in kinds]),
        space.sigma / space.sigma[0],
    )


def _classes(now: tuple[np.ndarray, np.ndarray], before: tuple[np.ndarray, np.ndarray]) -> str:
    """A letter of ``CLASSES`` for every pole, against the nearest of the order before."""
    p, shapes = now
    if not len(before[0]):
        return "o" * len(p)
    k = np.abs(p[:, None] - before[0]).argmin(axis=1)
    q = before[0][k]
    zeta, its = -p.real / np.abs(p), -q.real / np.abs(q)
    f = np.abs(np.abs(p) / np.abs(q) - 1) < FREQUENCY
    d = f & (np.abs(zeta - its) < DAMPING * its)
    v = f & (mac(shapes, before[1])[np.arange(len(p)), k] > MAC)
    return "".join("s" if a and b else "v" if b else "d" if a else "f" if c else "o"
                   for a, b, c in zip(d, v, f, strict=True))  # fmt: skip


def prominence(found: Identified) -> np.ndarray:
    """Each mode at its peak over all that the others put there, rms over channels (r,).

    Below one no peak stands where the pole does.
    """
    p, R = found.poles, found.by_channel
    at = 1j * np.abs(p)[:, None]
    matrix = 1 / (at - p)
    own = np.abs(np.diag(matrix)) * np.linalg.norm(R, axis=1)
    np.fill_diagonal(matrix, 0)
    rest = matrix @ R + (1 / (at - p.conj())) @ R.conj()
    rest += found.lower.ravel() / at**2 + found.upper.ravel()
    return own / np.maximum(np.linalg.norm(rest, axis=1), 1e-300)


def ghosts(found: Identified, diagram: Stabilisation) -> np.ndarray:
    """True for poles where no peak stands and the other road sees none (r,)."""
    return (prominence(found) < 1) & (diagram.seen(found) < CONFIRMED)
