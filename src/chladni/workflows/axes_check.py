"""Detect sensors that measured along another axis than declared, as X for Z."""

from dataclasses import replace
from itertools import permutations

import numpy as np

from ..case import Case
from ..case.label_directions import surface_normals
from ..dynamics.modes import rigid_modes
from ..ema.correlation import mac
from ..ema.identification import Identified
from ..ema.mode_pairing import pair
from ..ema.shapes import driven_shapes
from ..errors import FileError
from ..fem.modelled import Modelled

OUTPUTS = 8  # with fewer, shapes along other axes are similar by chance
SHARE = 0.5  # of the test's modes that must find a partner along the other axes
ALIKE = 0.8  # mean MAC of these pairs
SURE, MOST = 0.95, 0.7  # or: so like these pairs are, and what declared axes reach of them at most
LEANS = 0.5  # cosine: a direction that leans so far against a normal is its other side
BETTER = 2.0  # times the sum of MAC along the axes declared


def refuse_turned_axes(case: Case, found: Identified, model: Modelled) -> None:
    """Refuse a table of sensors whose axes are exchanged, all of them in the same way.

    Measured shapes are compared with the model's along the declared axes. The comparison is
    repeated for the five other orders of X, Y and Z, and for the normals of the surface.
    """
    found = found.sel(found.firm)
    if len(case.outputs.labels) < OUTPUTS or not found.order:
        return
    ways = case.outputs.directions
    declared, _, _ = _fit(case, found, model, ways)
    turned = [ways[:, order] for order in list(permutations(range(3)))[1:]]
    others = [(_where_declared(ways, turned_one), turned_one) for turned_one in turned]
    # surface normals with the declared sign; the declared direction off the surface
    normal = surface_normals(case.assembly, case.outputs)
    normal *= np.where((normal * ways).sum(axis=1) < -LEANS, -1.0, 1.0)[:, None]
    others.append(("across the surface", np.where(normal.any(axis=1, keepdims=True), normal, ways)))
    fits = [(_fit(case, found, model, turned_one), said) for said, turned_one in others]
    (total, pairs, mean), said = max(fits, key=lambda one: one[0][0])
    beaten = total >= BETTER * declared or (mean > SURE and total * MOST > declared)
    if pairs < SHARE * found.order or mean < ALIKE or not beaten:
        return
    declared_along = " and ".join(sorted(set(_axes(ways))))
    raise FileError(
        f"{case.path}: the sensors are declared along {declared_along}, but {pairs} of "
        f"{found.order} modes have the model's shapes {said} (mean MAC {mean:.2f}): correct the "
        "directions in sensors.csv, or in the labels"
    )


def _axes(ways: np.ndarray) -> list[str]:
    """Return the axis nearest to each direction (k, 3)."""
    return ["XYZ"[k] for k in np.abs(ways).argmax(axis=1)]


def _where_declared(ways: np.ndarray, others: np.ndarray) -> str:
    """Describe in words which axes replace which declared ones."""
    differ = sorted({(a, b) for a, b in zip(_axes(ways), _axes(others), strict=True) if a != b})
    return ", ".join(f"along {other} where {said} is declared" for said, other in differ)


def _fit(
    case: Case, found: Identified, model: Modelled, ways: np.ndarray
) -> tuple[float, int, float]:
    """(sum of MAC, pairs, mean MAC) with the outputs along these directions (k, 3)."""
    near = model.modes.sel(~rigid_modes(model.modes))
    turned = replace(case.outputs, directions=ways)
    phi, psi = turned.rows(model.structure) @ near.shapes, driven_shapes(found)
    paired = pair(near.frequency, found.frequency, mac(phi, psi))
    mean = float(paired.mac.mean()) if len(paired) else 0.0
    return float(paired.mac.sum()), len(paired), mean
