"""Points of an assembly that hang together, over elements and rigid links."""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ..model.assembly import Assembly, Average, Equation, RigidBody


def components(model: Assembly) -> np.ndarray:
    """Number (n,) of the connected component of every point, over all elements and rigid links.

    The largest (most points) is 0; a point that nothing uses is a component of its own.
    """
    pairs = np.concatenate([np.zeros((0, 2), np.int64), *_pairs(model)])
    pairs = pairs[(pairs >= 0).all(axis=1)]
    n = len(model.ids)
    graph = sp.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    order = np.argsort(-np.bincount(label), kind="stable")
    return np.argsort(order)[label]


def _pairs(model: Assembly) -> Iterator[np.ndarray]:
    """Pairs of points (k, 2) that something joins."""
    shells = np.hstack([model.shells.nodes, model.shells.middle])
    groups = [shells, model.beams.nodes, *(s.nodes for s in model.solids)]
    for nodes in groups:
        yield np.concatenate([nodes[:, [0, k]] for k in range(1, nodes.shape[1])])
    for joints in (model.springs, model.dampers, model.scalar_masses, model.bushes):
        yield joints.nodes.reshape(-1, 2)
    star = [(rows[0], r) for rows in map(_tied, model.rigid) for r in rows[1:]]
    yield np.array(star, np.int64).reshape(-1, 2)


def _tied(tie: RigidBody | Average | Equation) -> list[int]:
    """Points of a rigid link."""
    if isinstance(tie, Equation):
        return list(tie.nodes)
    if isinstance(tie, Average):
        return [tie.reference, *(t[0] for t in tie.terms), *(m[0] for m in tie.moved)]
    return [tie.independent, *tie.dependent]
