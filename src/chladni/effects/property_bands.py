"""A smooth field over shells in a deck: one new property for each band of values."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..model.assembly import Assembly
from ..model.properties import Part

BANDS = 6  # properties between zero and the largest value of the field


def levels(value: np.ndarray) -> tuple[np.ndarray, float]:
    """Round a field to integer levels (m,) of equal steps; return levels and step."""
    step = float(np.abs(value).max(initial=0.0)) / BANDS
    return np.round(value / step).astype(int) if step else np.zeros(len(value), int), step


def with_bands(
    assembly: Assembly, value: np.ndarray, changed: Callable[[Part, float], Part]
) -> Assembly:
    """Put the shells into parts changed by ``value`` (m,), in equal steps.

    ``changed`` returns a part changed by a value; name and id are set here.
    """
    level, step = levels(value)
    return in_bands(assembly, level, lambda part, n: changed(part, n * step))


def in_bands(
    assembly: Assembly, level: np.ndarray, changed: Callable[[Part, int], Part]
) -> Assembly:
    """Put the shells into parts changed by their integer level (m,); 0 leaves them as they are."""
    old, parts = assembly.shells.part, list(assembly.parts)
    part = old.copy()
    pairs = set(zip(old.tolist(), level.tolist(), strict=True))
    for k, n in sorted((k, n) for k, n in pairs if n):
        part[(old == k) & (level == n)] = len(parts)
        new = changed(assembly.parts[k], n)
        name = f"{assembly.parts[k].name}, band {n}"
        parts.append(replace(new, id=1 + max(p.id for p in parts), name=name))
    return replace(assembly, parts=tuple(parts), shells=replace(assembly.shells, part=part))
