"""Data of a picture of paired modes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import OneScreen


@dataclass(frozen=True, eq=False, repr=False)
class PairedShapes(OneScreen):
    """Paired modes at the sensors, each of largest entry 1, and the model's whole shape."""

    # points, directions: (k, 3) of the sensors [m], unit vectors
    points: np.ndarray
    directions: np.ndarray
    # test, model: (k, r) real, of the same sign and scale
    test: np.ndarray
    model: np.ndarray
    motion: np.ndarray  # (n, 3, r) of every point of the model
    # f_test, f_model: (r,) [Hz]
    f_test: np.ndarray
    f_model: np.ndarray
    numbers: Sequence[int]  # model's mode numbers
    mac: np.ndarray  # (r,)

    def first(self, count: int) -> "PairedShapes":
        """The pairs lowest in frequency."""
        r = slice(count)
        return PairedShapes(
            self.points, self.directions, self.test[:, r], self.model[:, r],
            self.motion[:, :, r], self.f_test[r], self.f_model[r], self.numbers[r], self.mac[r],
        )  # fmt: skip
