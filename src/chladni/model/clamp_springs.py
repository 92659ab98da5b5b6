"""Replacement of supports by springs: of a rigid clamp, or of each point by itself."""

from dataclasses import replace

import numpy as np

from .added_points import next_id, with_points
from .assembly import Assembly, RigidBody, appended
from .ground_springs import with_ground_bushes

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


def with_springs_for_supports(
    assembly: Assembly, rows: np.ndarray, axes: np.ndarray, k: np.ndarray, turning: bool,
    rigid: float,
) -> Assembly:  # fmt: skip
    """Replace supports of points by springs to ground along, or about, an axis at each.

    An axis of the point's own frame gives a CELAS2. Any other axis releases all components that it
    has a share in, and a CBUSH holds the motions across it as good as rigid.

    Parameters
    ----------
    rows : (n,) int     points
    axes : (n, 3)       unit vectors in the basic frame
    k : (n,)            [N/m], or [N m/rad] if ``turning``
    rigid : the spring that is as good as rigid
    """
    own = axes if assembly.axes is None else np.einsum("kij,kj->ki", assembly.axes[rows], axes)
    shift = 3 if turning else 0
    straight = np.abs(own).max(axis=1) > AN_AXIS
    component = shift + 1 + np.abs(own).argmax(axis=1)
    gone = np.zeros((len(assembly.points), 7), bool)
    gone[rows[straight], component[straight]] = True
    i, c = np.nonzero(np.abs(own[~straight]) > 1e-6)
    gone[rows[~straight][i], shift + 1 + c] = True
    stay = assembly.supports[~gone[assembly.supports[:, 0], assembly.supports[:, 1]]]
    n = int(straight.sum())
    new = appended(
        assembly.springs, ids=next_id(assembly) + np.arange(n),
        nodes=np.column_stack([rows[straight], np.full(n, -1)]),
        component=np.column_stack([component[straight], np.ones(n, int)]), value=k[straight],
    )  # fmt: skip
    made = replace(assembly, supports=stay, springs=new)
    about = np.zeros((len(rows) - n, 6))
    about[:, shift : shift + 3] = np.column_stack([k[~straight]] + 2 * [np.full(len(about), rigid)])
    return with_ground_bushes(made, rows[~straight], axes[~straight], about)
