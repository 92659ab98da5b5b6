"""Replacement of supports by a rigid clamp on springs."""

from dataclasses import replace

import numpy as np

from .added_points import next_id, with_points
from .assembly import Assembly, RigidBody, appended

AN_AXIS = 1 - 1e-6  # cosine from which a direction is an axis of the basic frame


def with_clamp_on_springs(
    assembly: Assembly, grids: np.ndarray, held: np.ndarray, centre: np.ndarray,
    frame: np.ndarray, springs: dict[int, float],
) -> Assembly:  # fmt: skip
    """Replace supports by an RBE2 from a grid at the centre, whose other components are held.

    Parameters
    ----------
    grids : (k,) int       ids of the supported points
    held : (k, 6) bool     supported components of each
    centre : (3,)          of the clamp [m]
    frame : (3, 3)         rows are unit vectors in the basic frame
    springs : {component 1-6 along or about the axes of the frame: [N/m] or [N m/rad]}
    """
    if np.abs(frame).max(axis=1).min() > AN_AXIS:  # axes of the basic frame, in another order
        order = np.abs(frame).argmax(axis=1)
        springs = {3 * ((c - 1) // 3) + int(order[(c - 1) % 3]) + 1: k for c, k in springs.items()}
        frame = np.eye(3)
    rows = assembly.rows(grids)
    gone = np.zeros((len(assembly.points), 6), bool)
    gone[rows] = held
    stay = assembly.supports[~gone[assembly.supports[:, 0], assembly.supports[:, 1] - 1]]
    grown, (at,) = with_points(assembly, centre[None])
    if not np.array_equal(frame, np.eye(3)):
        axes = np.tile(np.eye(3), (len(grown.points), 1, 1)) if grown.axes is None else grown.axes
        grown = replace(grown, axes=np.concatenate([axes[:-1], frame[None]]))
    own = [[at, c] for c in range(1, 7) if c not in springs]
    bodies = []
    for k, pattern in enumerate(np.unique(held, axis=0)):
        led = tuple(int(r) for r in rows[(held == pattern).all(axis=1)])
        components = tuple(int(c) for c in np.flatnonzero(pattern) + 1)
        body = RigidBody(next_id(grown) + k, int(at), led, (components,) * len(led))
        bodies.append(body)
    grown = replace(
        grown, rigid=(*grown.rigid, *bodies),
        supports=np.concatenate([stay, np.array(own, np.int64).reshape(-1, 2)]),
    )  # fmt: skip
    n, old = len(springs), grown.springs
    new = appended(
        old, ids=next_id(grown) + np.arange(n), nodes=np.tile([int(at), -1], (n, 1)),
        component=[[c, 1] for c in springs], value=list(springs.values()),
    )  # fmt: skip
    return replace(grown, springs=new)
