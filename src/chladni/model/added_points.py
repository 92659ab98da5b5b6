"""Grids added to a structure."""

from dataclasses import replace

import numpy as np

from .assembly import Assembly


def with_points(assembly: Assembly, places: np.ndarray) -> tuple[Assembly, np.ndarray]:
    """The assembly with grids added at places (k, 3) [m], and their rows."""
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
