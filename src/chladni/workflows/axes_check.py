"""Sensors declared along one axis that measured along another: X for Z."""

from dataclasses import replace
from itertools import permutations

import numpy as np

from ..case import Case
from ..dynamics.modes import rigid_modes
from ..ema.correlation import mac
from ..ema.identification import Identified
from ..ema.mode_pairing import pair
from ..ema.shapes import driven_shapes
from ..errors import FileError
from ..fem.modelled import Modelled
from .identify import firm

OUTPUTS = 8  # fewer, and shapes of other axes are alike by chance
SHARE = 0.5  # of the test's modes that must find a partner along the other axes
ALIKE = 0.8  # mean MAC of these pairs
BETTER = 2.0  # times the sum of MAC along the axes declared


def refuse_turned_axes(case: Case, found: Identified, model: Modelled) -> None:
    """Refuse a table of sensors whose axes are exchanged, all of them in the same way.

    The shapes of the test are held against the model's along the axes declared, and along the five
    other orders of X, Y and Z.

    Raises
    ------
    FileError
        Naming the axes along which they fit.
    """
    found = found.sel(firm(found))
    if len(case.outputs.labels) < OUTPUTS or not found.order:
        return
    declared, _, _ = _fit(case, found, model, (0, 1, 2))
    others = [(_fit(case, found, model, p), p) for p in list(permutations(range(3)))[1:]]
    (total, pairs, mean), order = max(others, key=lambda one: one[0][0])
    if pairs < SHARE * found.order or mean < ALIKE or total < BETTER * declared:
        return
    axes = np.abs(case.outputs.directions)
    main = int(np.bincount(axes.argmax(axis=1), minlength=3).argmax())
    raise FileError(
        f"{case.path}: the sensors are declared along {'XYZ'[main]}, but {pairs} of {found.order} "
        f"modes have the model's shapes along {'XYZ'[order.index(main)]} (mean MAC {mean:.2f}): "
        "mend the directions of sensors.csv, or of the labels"
    )


def _fit(
    case: Case, found: Identified, model: Modelled, order: tuple[int, ...]
) -> tuple[float, int, float]:
    """(sum of MAC, pairs, mean MAC) with component k of every direction taken from order[k]."""
    near = model.modes.sel(~rigid_modes(model.modes))
    turned = replace(case.outputs, directions=case.outputs.directions[:, list(order)])
    phi, psi = turned.rows(model.structure) @ near.shapes, driven_shapes(found)
    paired = pair(near.frequency, found.frequency, mac(phi, psi))
    mean = float(paired.mac.mean()) if len(paired) else 0.0
    return float(paired.mac.sum()), len(paired), mean
