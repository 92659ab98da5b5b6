"""Places with a direction: a sensor glued flat, or on a block along the sheet."""

from dataclasses import dataclass

import numpy as np

from chladni.dofs import label

from .sensor_candidates import SensorCandidates

TANGENT = 0.6  # a direction this far off the normal (cosine) needs a mounting block


@dataclass(frozen=True, eq=False)
class Mount:
    """A place and a direction in which a sensor may measure: rows of ``phi`` of a :class:`Plan`."""

    ids: np.ndarray  # (m,) int; grids, or numbers of centres as in :class:`SensorCandidates`
    place: np.ndarray  # (m,) int; position among the places
    # points, directions: (m, 3)
    points: np.ndarray
    directions: np.ndarray
    labels: tuple[str, ...]  # 412:+Z along an axis, else 412:n
    normal: np.ndarray  # (m,) bool glued flat, or fixed; False: on a block, along the sheet
    side: np.ndarray  # (m,) +1, -1: side of the surface normal


def seen_at(places: SensorCandidates, mounts: Mount, moving: np.ndarray) -> np.ndarray:
    """Motion along the mounts' directions (m, r), from that of all points (n_points, 3, r)."""
    at = places.moving(moving, mounts.place)
    return np.einsum("mir,mi->mr", at, mounts.directions)


def mounts_at(places: SensorCandidates) -> Mount:
    """Normals of all places, then the two axes of the basic frame most along each sheet."""
    place, directions = [np.arange(len(places))], [places.normals]
    across = np.argsort(np.abs(places.normals), axis=1)[:, :2]
    for k in range(2):
        axes = np.eye(3)[across[:, k]]
        good = np.abs(np.einsum("ij,ij->i", axes, places.normals)) < TANGENT
        good &= places.fixed == ""
        place.append(np.flatnonzero(good))
        directions.append(axes[good])
    at, along = np.concatenate(place), np.concatenate(directions)
    labels = _labels(places.ids[at], along)
    labels[: len(places)] = [f or n for f, n in zip(places.fixed, labels, strict=False)]
    once = np.sort(np.unique(labels, return_index=True)[1])  # beams already have both directions
    once = np.union1d(np.arange(len(places)), once)
    at, along, labels = at[once], along[once], [labels[k] for k in once]
    ids = places.ids[at]
    return Mount(
        ids,
        at,
        places.points[at],
        along,
        tuple(labels),
        np.arange(len(at)) < len(places),
        places.side[at],
    )


def _labels(ids: np.ndarray, directions: np.ndarray) -> list[str]:
    """412:+Z where the direction is an axis, else 412:n."""
    axis = np.abs(directions).argmax(axis=1)
    value = directions[np.arange(len(ids)), axis]
    return [
        label(int(i), int(a) + 1, 1 if v > 0 else -1) if abs(v) > 1 - 1e-6 else f"{i}:n"
        for i, a, v in zip(ids, axis, value, strict=True)
    ]
