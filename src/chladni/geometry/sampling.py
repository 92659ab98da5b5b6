"""Selection of points: a sample that covers many points, or the nearest ones to places."""

import numpy as np


def farthest_point_sample(points: np.ndarray, count: int) -> np.ndarray:
    """Order of ``count`` points in which each is the farthest from the previous ones (k,) int.

    The largest distance from any point to the sample is at most twice the least possible
    (Gonzalez 1985, Theoretical Computer Science 38, 293-306). The first point is the farthest from
    the mean. If points are equally far, to rounding, the first one is selected.

    Parameters
    ----------
    points : (n, d) [m]
    count : maximum number; all points, in this order, if there are fewer
    """
    if not len(points):
        return np.zeros(0, dtype=int)
    far: np.ndarray = np.linalg.norm(points - points.mean(axis=0), axis=1)
    order: list[int] = []
    for _ in range(min(count, len(points))):
        order.append(int(np.argmax(far >= (1 - 1e-9) * far.max())))
        away: np.ndarray = np.linalg.norm(points - points[order[-1]], axis=1)
        far = np.minimum(far, away) if len(order) > 1 else away
        far[order] = -1.0  # coincident points: never select a point twice
    return np.array(order, dtype=int)


def nearest_points(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Row of the point (n, d) nearest to each place (k, d); the first of equally near points.

    >>> nearest_points(np.array([[0.0], [1.0], [3.0]]), np.array([[2.0], [-9.0]]))
    array([1, 0])
    """
    return np.array([((points - x) ** 2).sum(axis=1).argmin() for x in places], dtype=int)
