"""The cords an article hangs on: springs with a mass and resonances of their own.

Echaniz Granado (2015), section 4.2.4.1: after a tap the left cord resonated at 23 Hz, the
right one at 24.5 Hz. Both appeared in the responses of the nearest sensors.
"""

from dataclasses import dataclass, replace

import numpy as np

GRAVITY = 9.80665
THESIS = (23.0, 24.5)  # [Hz]
BOUNCE = 2.5  # of the article on its cords [Hz]: the highest rigid motion stays below 5 Hz
LENGTH = 1.0  # [m]
RUBBER = 0.5  # damping of a cord with soft rubber taped to its end: its peak is gone
INNER = 1  # modelled resonances of a cord in each direction; higher ones are not reported


@dataclass(frozen=True)
class Cord:
    """A cord under tension; tapped across, it rings at ``frequency``.

    Attributes
    ----------
    tension : [N]
    stiffness : along it [N/m]
    mass : [kg]
    length : [m]
    damping : of its resonances, fraction of critical
    """

    tension: float
    stiffness: float
    mass: float
    length: float
    damping: float = 0.02

    @property
    def frequency(self) -> float:
        """f = √(T / (μ L²)) / 2 of a string [Hz], μ L its mass."""
        return float(np.sqrt(self.tension / (self.mass * self.length)) / 2)


def cord(weight: float, number: int, frequency: float, length: float = LENGTH) -> Cord:
    """One of ``number`` cords that carry a weight [kg], tuned to a frequency by its mass."""
    tension = weight * GRAVITY / number
    return Cord(
        tension=tension,
        stiffness=weight * (2 * np.pi * BOUNCE) ** 2 / number,
        mass=tension / (4 * length * frequency**2),
        length=length,
    )


def cords_for(weight: float, number: int, rubber: bool = False) -> tuple[Cord, ...]:
    """Cords whose resonances are those of the thesis in turn, with rubber at their ends or not."""
    bare = (cord(weight, number, THESIS[k % len(THESIS)]) for k in range(number))
    return tuple(replace(c, damping=RUBBER) if rubber else c for c in bare)


def cord_matrices(one: Cord, along: bool, inner: int = INNER) -> tuple[np.ndarray, ...]:
    """M, C, K (1 + n, 1 + n) of a cord in one direction, over its end and its inner modes.

    A line held at the top has the shapes s/L and sin(nπs/L) (Craig and Bampton 1968). Across its
    axis it is a string (k = T/L), along its axis a bar (k its stiffness). M is m/3 for the end, m/2
    for a mode and m (-1)ⁿ⁺¹/(nπ) between them. K is k for the end and k (nπ)²/2 for a mode.
    """
    k = one.stiffness if along else one.tension / one.length
    n = np.arange(1, inner + 1)
    M = np.diag(np.r_[1 / 3, np.full(inner, 0.5)])
    M[0, 1:] = M[1:, 0] = (-1.0) ** (n + 1) / (n * np.pi)
    M *= one.mass
    K = k * np.diag(np.r_[1.0, (n * np.pi) ** 2 / 2])
    omega = np.pi * np.sqrt(k / one.mass)  # its first resonance
    return M, 2 * one.damping / omega * K, K
