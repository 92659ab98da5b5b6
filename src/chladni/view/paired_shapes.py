"""Data of a picture of modes of test and model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import OneScreen


@dataclass(frozen=True, eq=False, repr=False)
class PairedShapes(OneScreen):
    """Modes of test and model at the sensors, and the model's whole shapes; which are partners."""

    # points, directions: (k, 3) of the sensors [m], unit vectors
    points: np.ndarray
    directions: np.ndarray
    # (k, r_test), (k, r_model) real, of largest entry 1; a test's of the scale of its partner
    test: np.ndarray
    model: np.ndarray
    motion: np.ndarray  # (n, 3, r_model) of every point of the model
    # f_test, f_model: (r_test,), (r_model,) [Hz]
    f_test: np.ndarray
    f_model: np.ndarray
    numbers: Sequence[int]  # model's mode numbers
    pairs: Sequence[tuple[int, int]]  # (test, model), lowest first
    mac: np.ndarray  # of each pair
