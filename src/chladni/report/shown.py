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
    """Data for the pictures of a result that its numbers do not contain.

    Attributes
    ----------
    seen : Surface                 of the model
    parts : names, by the numbers in ``seen.part``; ids of the points of ``seen``
    curves : {"test", "before", "after"} or {"test", "model"} to FRF, same channels and lines
    held_out : labels of outputs that were not fitted
    compared : False if frequencies were compared, so that responses are only shown
    fitted, excluded : bands [Hz]
    outputs, inputs, cords : sensors, shakers and hangers as markers
    """

    seen: Surface
    parts: Sequence[str] = ()
    ids: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    curves: Mapping[str, FRF] = field(default_factory=dict)
    held_out: Sequence[str] = ()
    compared: bool = True
    fitted: Bands = ()
    excluded: Bands = ()
    outputs: Sequence[Marker] = ()
    inputs: Sequence[Marker] = ()
    cords: Sequence[Marker] = ()
