"""Data for the pictures of a result that its numbers do not contain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..dynamics.frf import FRF
    from ..view.annotations import Marker
    from ..view.surface import Surface

CALM = 27.0  # gain up to which a map of the residual stays pale: less names nothing
Bands = Sequence[tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Shown:
    """Data for the pictures of a result that its numbers do not contain."""

    seen: Surface  # of the model
    parts: Sequence[str] = ()  # names, by the numbers in ``seen.part``
    ids: np.ndarray = field(default_factory=lambda: np.zeros(0, int))  # of the points of ``seen``
    # {"test", "before", "after"} or {"test", "model"} to FRF, same channels and lines
    curves: Mapping[str, FRF] = field(default_factory=dict)
    held_out: Sequence[str] = ()  # labels of outputs that were not fitted
    compared: bool = True  # False if frequencies were compared, so that responses are only shown
    # fitted, excluded: bands [Hz]
    fitted: Bands = ()
    excluded: Bands = ()
    # outputs, inputs, cords: sensors, shakers and hangers as markers
    outputs: Sequence[Marker] = ()
    inputs: Sequence[Marker] = ()
    cords: Sequence[Marker] = ()
