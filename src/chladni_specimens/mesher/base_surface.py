"""A base surface: a centre line in the plane y = 0, swept with a crown across.

P(y, s, d) = C(s) - c(s) y² e(s) - d n(y, s), where e = (cos φ, 0, sin φ) is the line's normal. A
point of a pressing lies the depth d below the surface along its outward normal n.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from chladni.arrays import readonly


def ramp(x: np.ndarray) -> np.ndarray:
    """Ramp min(max(x, 0), 1)."""
    return np.clip(x, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class CrownedSurface:
    """Centre line and crown."""

    line: np.ndarray  # (4, n) s, x, z [m] and slope φ from the vertical [rad] of the centre line
    crown: tuple[float, float]  # (2,) c = 1/2R at s = 0 and at s = height [1/m]
    height: float  # [m]

    @classmethod
    def of(
        cls, s: np.ndarray, slope: np.ndarray, radius: tuple[float, float], height: float
    ) -> Self:
        """The surface whose centre line has this slope φ(s) [rad], x = -∫ sin φ, z = ∫ cos φ."""
        step = s[1] - s[0]
        x, z = -np.cumsum(np.sin(slope)) * step, np.cumsum(np.cos(slope)) * step
        zero = np.argmin(np.abs(s))
        line = readonly(np.stack([s, x - x[zero], z - z[zero], slope]))
        return cls(line, (0.5 / radius[0], 0.5 / radius[1]), height)

    def _crown(self, s: np.ndarray) -> np.ndarray:
        bottom, top = self.crown
        return bottom + (top - bottom) * ramp(s / self.height)

    def normal(self, plan: np.ndarray) -> np.ndarray:
        """Outward unit normals (n, 3) at (y, s)."""
        y, s = plan[:, 0], plan[:, 1]
        phi = np.interp(s, self.line[0], self.line[3])
        n = np.column_stack([np.cos(phi), 2 * self._crown(s) * y, np.sin(phi)])
        return n / np.linalg.norm(n, axis=1, keepdims=True)

    def at(self, plan: np.ndarray) -> np.ndarray:
        """Places (n, 3) of the planform points (y, s, depth)."""
        y, s, depth = plan.T
        x, z, phi = (np.interp(s, self.line[0], row) for row in self.line[1:])
        drop = self._crown(s) * y**2
        base = np.column_stack([x - drop * np.cos(phi), y, z - drop * np.sin(phi)])
        return base - depth[:, None] * self.normal(plan)
