"""Grids added to a structure, and ids for the elements on them."""

from dataclasses import replace
from typing import Any

import numpy as np

from .assembly import Assembly


def next_id(assembly: Assembly) -> int:
    """The first id above those of all elements, rigid bodies and masses."""
    a = assembly
    families: tuple[Any, ...] = (
        a.shells, a.beams, a.springs, a.dampers, a.scalar_masses, a.bushes, a.masses, *a.solids
    )  # fmt: skip
    rigid = max((body.id for body in a.rigid), default=0)
    return 1 + max(rigid, *(int(family.ids.max(initial=0)) for family in families))


def with_points(assembly: Assembly, places: np.ndarray) -> tuple[Assembly, np.ndarray]:
    """Add grids at places (k, 3) [m]; return the assembly and the rows of the grids."""
    start, n = int(assembly.ids.max()) + 1 if len(assembly.ids) else 1, len(assembly.points)
    axes, scalar = assembly.axes, assembly.scalar_points
    if axes is not None:
        axes = np.concatenate([axes, np.tile(np.eye(3), (len(places), 1, 1))])
    if scalar is not None:
        scalar = np.r_[scalar, np.zeros(len(places), bool)]
    grown = replace(
        assembly,
        ids=np.r_[assembly.ids, start + np.arange(len(places))],
        points=np.vstack([assembly.points, places]),
        axes=axes,
        scalar_points=scalar,
    )
    return grown, n + np.arange(len(places))
