"""Which parts of a model hang together."""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ....errors import ModelError
from ....model.assembly import (
    Assembly,
    Average,
    Beams,
    Bushes,
    Equation,
    RigidBody,
    Scalars,
    Shells,
    Solids,
)


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
    groups = [model.shells.nodes, model.beams.nodes, *(s.nodes for s in model.solids)]
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


def refuse_loose(model: Assembly, source: str) -> None:
    """Refuse a part of the model that hangs on nothing, by name.

    A component with elements passes if it is the largest such, or is held: by a support, or by
    a spring to the ground.
    """
    label = components(model)
    _refuse_loose_masses(model, label, source)
    groups = [model.shells.nodes, model.beams.nodes, *(s.nodes for s in model.solids)]
    stiff = sorted({int(k) for nodes in groups for k in np.unique(label[nodes[:, 0]])})
    if len(stiff) < 2:
        return
    held = set(label[model.supports[:, 0]].tolist()) | _grounded(label, model.springs, model.bushes)
    for number in stiff[1:]:
        if number not in held:
            points = np.flatnonzero(label == number)
            raise ModelError(
                f"{source}: {_names(model, points)} is not connected: {len(points)} points, "
                f"including grid {model.ids[points[0]]}, are joined to neither "
                f"{_names(model, np.flatnonzero(label == stiff[0]))} nor a support"
            )


def _refuse_loose_masses(model: Assembly, label: np.ndarray, source: str) -> None:
    """Refuse a mass on a grid that nothing joins to anything: it would weigh and not vibrate."""
    rows = model.masses.node
    lone = np.flatnonzero(np.bincount(label)[label[rows]] == 1)
    if not len(lone) or not label.any():  # one grid is all there is
        return
    held = set(label[model.supports[model.supports[:, 1] <= 3, 0]].tolist())
    held |= _grounded(label, model.springs, model.bushes, model.scalar_masses)
    for k in lone:
        if label[rows[k]] not in held:
            raise ModelError(
                f"{source}: mass {model.masses.ids[k]} is on grid {model.ids[rows[k]]}, which is "
                "not connected to the rest; remove or tie it"
            )


def _grounded(label: np.ndarray, *joints: Scalars | Bushes) -> set[int]:
    """Components with a joint whose other end is the ground."""
    nodes = np.concatenate([j.nodes for j in joints])
    ends = nodes[(nodes < 0).any(axis=1)].max(axis=1, initial=-1)
    return set(label[ends[ends >= 0]].tolist())


def _names(model: Assembly, points: np.ndarray) -> str:
    """Names of the parts with elements on these points."""
    inside = np.zeros(len(model.ids), bool)
    inside[points] = True
    families: list[Shells | Beams | Solids] = [model.shells, model.beams, *model.solids]
    parts = sorted({int(p) for f in families for p in f.part[inside[f.nodes[:, 0]]]})
    names = [f"part {model.parts[p].name!r}" for p in parts]
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
