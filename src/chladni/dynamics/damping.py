"""Sources of damping ratios, and damping matrices."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..errors import ShapeError
from .modes import ModalModel

Kind = Literal["g", "crit", "q"]


@dataclass(frozen=True, eq=False)
class DampingTable:
    """Modal damping against frequency (Nastran's TABDMP1)."""

    # (k,) Hz, not decreasing; a repeated frequency is a jump, with the mean value there
    frequency: np.ndarray
    # (k,) structural damping g (``kind`` "g", Nastran's default when TYPE is absent), fraction of
    # critical ("crit") or quality factor ("q")
    value: np.ndarray
    kind: Kind = "g"

    def __post_init__(self) -> None:
        if np.shape(self.frequency) != np.shape(self.value) or len(self.frequency) < 1:
            raise ShapeError(
                f"{np.shape(self.frequency)} frequencies, {np.shape(self.value)} values"
            )
        if np.any(np.diff(self.frequency) < 0):
            raise ShapeError(f"frequencies of a damping table must not fall: {self.frequency}")

    def ratio(self, frequency: np.ndarray) -> np.ndarray:
        """ζ = g/2 or 1/2Q, linear between the points and beyond the ends."""
        y = _piecewise(np.asarray(frequency, float), self.frequency, self.value)
        return {"g": y / 2, "crit": y, "q": 1 / (2 * np.where(y == 0, np.inf, y))}[self.kind]


def _piecewise(x: np.ndarray, knots: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Linear interpolation; beyond the ends along the last segment of nonzero length."""
    u = np.unique(knots)
    if len(u) == 1:
        return np.full(x.shape, float(np.mean(value)))
    left = np.array([value[knots == a][0] for a in u])
    right = np.array([value[knots == a][-1] for a in u])
    k = np.clip(np.searchsorted(u, x, side="right") - 1, 0, len(u) - 2)
    y = right[k] + (x - u[k]) * (left[k + 1] - right[k]) / (u[k + 1] - u[k])
    at = np.searchsorted(u, x)
    hit = (at < len(u)) & (u[np.minimum(at, len(u) - 1)] == x)
    at = np.minimum(at, len(u) - 1)
    return np.where(hit, (left[at] + right[at]) / 2, y)


def with_table(modal: ModalModel, table: DampingTable) -> ModalModel:
    """Set damping ratios of modes from a table at their frequencies."""
    return modal.with_damping(table.ratio(modal.frequency))
