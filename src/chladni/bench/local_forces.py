"""Local forces that are not linear: a gap that closes, a spring that hardens, a joint that slips.

Each answers x = a + S f with f = -law(x): a is where it would be without a force at the end of a
step, S > 0 what a unit of force moves it in that step. All three are solved in closed form or to
rounding, so that no step depends on an iteration's tolerance.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np


class LocalForce(Protocol):
    """A force along the opening x of one site."""

    name: str

    def solve(self, a: float, S: float, memory: float) -> tuple[float, float]:
        """(force [N], memory after the step) of x = a + S f."""
        ...

    @property
    def stiffness(self) -> float:
        """Its largest tangent within the motion it is made for [N/m]."""
        ...


@dataclass(frozen=True)
class Clearance:
    """A gap that closes at x = gap on a spring, on one side: rattle.

    f = -k max(x - gap, 0) (Worden and Tomlinson 2001, Nonlinearity in Structural Dynamics, 2.2).
    """

    gap: float  # [m]
    k: float  # [N/m]
    name = "clearance"

    def solve(self, a: float, S: float, memory: float) -> tuple[float, float]:
        """Closed where the free motion would go beyond the gap."""
        over = a - self.gap
        return (-self.k * over / (1 + S * self.k) if over > 0 else 0.0), memory

    @property
    def stiffness(self) -> float:
        """Closed."""
        return self.k


@dataclass(frozen=True)
class CubicSpring:
    """f = -k3 x³, with its tangent at ``reach``."""

    k3: float  # [N/m³]
    reach: float = 0.0  # [m]
    name = "cubic spring"

    def solve(self, a: float, S: float, memory: float) -> tuple[float, float]:
        """The one real root of x + S k3 x³ = a, by Newton's method from its linear side."""
        g, x = S * self.k3, a
        for _ in range(50):
            step = (x + g * x**3 - a) / (1 + 3 * g * x**2)
            x -= step
            if abs(step) <= 1e-15 * abs(x):
                break
        return -self.k3 * x**3, memory

    @property
    def stiffness(self) -> float:
        """3 k3 reach²."""
        return 3 * self.k3 * self.reach**2


@dataclass(frozen=True)
class JenkinsSlider:
    """A spring k in series with a slider that gives way at ``limit``: f = -k (x - s), |f| ≤ limit.

    Jenkins 1962; Gaul and Nitsche 2001, Applied Mechanics Reviews 54, 93-106. The memory is the
    place s of the slider.
    """

    k: float  # [N/m]
    limit: float  # [N]
    name = "friction"

    def solve(self, a: float, S: float, memory: float) -> tuple[float, float]:
        """It sticks unless its force would be beyond the limit."""
        f = -self.k * (a - memory) / (1 + S * self.k)
        if abs(f) <= self.limit:
            return f, memory
        f = float(np.sign(f)) * self.limit
        return f, a + S * f + f / self.k

    @property
    def stiffness(self) -> float:
        """Sticking."""
        return self.k
