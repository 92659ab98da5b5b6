"""Local forces that are not linear: a gap that closes, a spring that hardens, a joint that slips.

Each solves x = a + S f with f = -law(x). Here a is the position without a force at the end of a
step, and S > 0 the displacement per unit force in that step. All three have a closed form or are
solved to rounding, so no step depends on the tolerance of an iteration.

A law of straight pieces names the one it is on, f = F - k x. Many steps on it are taken at once.
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

    def piece(self, f: float, memory: float) -> tuple[float, float] | None:
        """(k, F) of the straight piece f = F - k x it is on after a step; None of a curve."""
        ...

    def followed(
        self, k: float, a: np.ndarray, f: np.ndarray, S: float, memory: float
    ) -> tuple[int, float]:
        """How many steps a, f (n,) stay on the piece of slope k, and the memory after them."""
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

    def piece(self, f: float, memory: float) -> tuple[float, float]:
        """Closed or open."""
        return (self.k, self.k * self.gap) if f else (0.0, 0.0)

    def followed(
        self, k: float, a: np.ndarray, f: np.ndarray, S: float, memory: float
    ) -> tuple[int, float]:
        """Closed beyond the gap."""
        return _leading((a > self.gap) == bool(k)), memory

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

    def piece(self, f: float, memory: float) -> None:
        """It has none."""

    def followed(
        self, k: float, a: np.ndarray, f: np.ndarray, S: float, memory: float
    ) -> tuple[int, float]:
        """No step."""
        return 0, memory

    @property
    def stiffness(self) -> float:
        """3 k3 reach²."""
        return 3 * self.k3 * self.reach**2


@dataclass(frozen=True)
class JenkinsSlider:
    """A spring k in series with a slider that slips at ``limit``: f = -k (x - s), |f| ≤ limit.

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

    def piece(self, f: float, memory: float) -> tuple[float, float]:
        """It sticks, or slips under its limit."""
        return (self.k, self.k * memory) if abs(f) < self.limit else (0.0, f)

    def followed(
        self, k: float, a: np.ndarray, f: np.ndarray, S: float, memory: float
    ) -> tuple[int, float]:
        """It sticks within the limit; it slips on as long as it moves on."""
        if k:
            return _leading(np.abs(f) <= self.limit), memory
        slider = a + (S * f + f / self.k)
        before = np.concatenate([[memory], slider[:-1]])
        held = -self.k * (a - before) / (1 + S * self.k)
        n = _leading(np.sign(f) * held > self.limit)
        return n, float(slider[n - 1]) if n else memory

    @property
    def stiffness(self) -> float:
        """Sticking."""
        return self.k


def _leading(held: np.ndarray) -> int:
    """How many are true before the first that is not."""
    return len(held) if held.all() else int(held.argmin())
