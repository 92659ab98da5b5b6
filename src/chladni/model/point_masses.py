"""Masses at grids of a structure."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .assembly import Assembly, appended


def with_masses(
    assembly: Assembly,
    grids: Sequence[int],
    m: float | np.ndarray,
    offset: np.ndarray | None = None,
) -> Assembly:
    """Add m [kg] (one for all, or one for each) at each grid, with an ``offset`` (3,) [m]."""
    old = assembly.masses
    first = int(old.ids.max(initial=0)) + 1
    x, y, z = np.zeros(3) if offset is None else offset
    arm = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])  # motion of the mass
    each = np.broadcast_to(np.asarray(m, float), len(grids))[:, None, None]
    new = appended(
        old, ids=first + np.arange(len(grids)), node=assembly.rows(list(grids)),
        matrix=each * (arm.T @ arm),
    )  # fmt: skip
    return replace(assembly, masses=new)


def with_mass_pairs(
    assembly: Assembly, pairs: Sequence[tuple[int, float]], factor: float = 1.0
) -> Assembly:
    """Add the mass of each (grid, kg) pair, times ``factor``; without pairs, the same assembly."""
    if not pairs:
        return assembly
    grids, m = zip(*pairs, strict=True)
    return with_masses(assembly, grids, factor * np.array(m))
