from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.refusals import says

from chladni.fem.rigid import transformation
from chladni.model.assembly import Assembly, Average, Equation, RigidBody

ALL = (1, 2, 3, 4, 5, 6)
MOVES = (1, 2, 3)


def turned(rng, n):
    """n random right-handed frames, rows are the unit vectors."""
    Q = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    return Q * np.linalg.det(Q)[:, None, None]


def structure(rigid, n=8, seed=0, framed=True, **more):
    rng = np.random.default_rng(seed)
    axes = turned(rng, n) if framed else None
    ids = 10 * np.arange(1, n + 1)
    return Assembly(ids, rng.normal(size=(n, 3)), (), rigid=tuple(rigid), axes=axes, **more)


def rigid_motion(points, u, theta):
    """u + θ × r and θ at every point (n, 6)."""
    moves = u + np.cross(theta, points)
    return np.hstack([moves, np.broadcast_to(theta, moves.shape)])


def in_frames(assembly, motion):
    """The same motion in the displacement frames, one long vector."""
    if assembly.axes is None:
        return motion.ravel()
    return np.einsum("nij,nkj->nki", assembly.axes, motion.reshape(-1, 2, 3)).ravel()


EVEN = tuple((k, MOVES, 1.0 + k) for k in range(1, 6))
MIXED = ((1, MOVES, 2.0), (2, (1, 4, 6), 0.5), (3, ALL, 1.0), (4, (2,), 3.0))
UM = ((0, 1), (0, 2), (0, 6), (1, 1), (2, 3), (4, 2))
ELEMENTS = {
    "body": [RigidBody(1, 0, (1, 2), (ALL, (2, 5)))],
    "mean": [Average(1, 0, ALL, EVEN)],
    "mixed mean": [Average(1, 0, (1, 3, 5), MIXED)],
    "solved for others": [Average(1, 0, ALL, EVEN, moved=UM)],
    "chain": [
        RigidBody(1, 0, (1,), (ALL,)),
        Average(2, 2, ALL, ((1, MOVES, 1.0), (3, MOVES, 1.0), (4, MOVES, 1.0))),
        RigidBody(3, 2, (5, 6), (MOVES, ALL)),
    ],
}


@pytest.mark.parametrize("name", ELEMENTS)
def test_rigid_motion_passes_through(name):
    """u = T q for every rigid motion, whatever the frames: no constraint holds one back."""
    assembly = structure(ELEMENTS[name])
    T, q = transformation(assembly)
    for motion in np.eye(6):
        u = rigid_motion(assembly.points, motion[:3], motion[3:])
        assert_allclose(T @ in_frames(assembly, u)[q], u.ravel(), atol=1e-12)


def test_without_constraints_only_frames_turn():
    assembly = structure([])
    T, q = transformation(assembly)
    assert len(q) == 48
    assert_allclose((T.T @ T).toarray(), np.eye(48), atol=1e-14)


def test_body_keeps_distances():
    """Six dofs of a dependent point are those of a rigid arm, u + θ × r, for any θ."""
    assembly = structure(ELEMENTS["body"], framed=False)
    T, q = transformation(assembly)
    x = np.zeros(48)
    x[3:6] = [0.1, -0.2, 0.3]
    u = (T @ x[q]).reshape(-1, 6)
    arm = assembly.points[1] - assembly.points[0]
    assert_allclose(u[1], [*np.cross(x[3:6], arm), *x[3:6]], atol=1e-15)
    assert u[2, 4] == pytest.approx(-0.2)
    assert_allclose(u[2, [0, 2, 3, 5]], 0)  # components that do not follow


@pytest.mark.parametrize("moved", [(), UM])
@pytest.mark.parametrize("components", [ALL, (1, 2, 6, 5, 3, 4)])
def test_mean_equals_pyyeti(components, moved):
    """The same matrix as pyYeti's formrbe3, itself checked against NX Nastran."""
    n2p = pytest.importorskip("pyyeti.nastran.n2p")
    terms = ((1, (1, 2, 3), 1.5), (2, (1, 2, 3), 2.0), (3, (1, 3, 4), 0.7), (4, (2, 4, 5, 6), 0.3))
    assembly = structure([Average(9, 0, components, terms, moved)])
    uset = None
    for k, (point, frame) in enumerate(zip(assembly.points, assembly.axes, strict=True)):
        card = np.array([[k + 1, 1, 0], point, point + frame[2], point + frame[0]])[[0, 1, 2, 3]]
        uset = n2p.addgrid(uset, k + 1, "b", 0, point, card)
    flat = [x for k, c, w in terms for x in ([int("".join(map(str, c))), w], k + 1)]
    um = [x for k, c in moved for x in (k + 1, c)] or None
    G = n2p.formrbe3(uset, 1, 123456, flat, um)
    T, q = transformation(assembly)
    dependent = np.setdiff1d(np.arange(48), q)
    turn = np.zeros((48, 48))  # rows of T back into the displacement frames
    for k, frame in enumerate(assembly.axes):
        turn[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = np.kron(np.eye(2), frame)
    ours = (turn @ T.toarray())[dependent]
    used = [j for j in range(len(q)) if q[j] in in_element(terms)]
    assert_allclose(ours[:, used], G, atol=1e-12)
    assert_allclose(np.delete(ours, used, axis=1), 0, atol=1e-15)


def in_element(terms):
    return [6 * k + c - 1 for k, comps, _ in ((0, ALL, 0), *terms) for c in comps]


def test_force_and_moment_are_spread_in_balance():
    """Tᵀ f: the shares of a load at the reference add up to its force and moment."""
    assembly = structure(ELEMENTS["mean"], framed=False)
    T, q = transformation(assembly)
    load = np.zeros(48)
    load[:6] = [1, -2, 3, 0.4, 0.5, -0.6]
    share = np.zeros(48)
    share[q] = T.T @ load
    share = share.reshape(-1, 6)
    arm = assembly.points - assembly.points[0]
    assert_allclose(share[:, :3].sum(axis=0), load[:3], atol=1e-12)
    moment = np.cross(arm, share[:, :3]).sum(axis=0) + share[:, 3:].sum(axis=0)
    assert_allclose(moment, load[3:6], atol=1e-12)


def test_chain_of_equations():
    """a = 2 b, b = c - d, d = 3 e resolve to a = 2 c - 6 e in whatever order they stand."""
    chain = [
        Equation(3, (3, 4), (1, 1), (1.0, -3.0)),
        Equation(1, (0, 1), (1, 1), (1.0, -2.0)),
        Equation(2, (1, 2, 3), (1, 1, 1), (-2.0, 2.0, -2.0)),
    ]
    T, q = transformation(structure(chain, framed=False))
    x = np.zeros(48)
    x[[12, 24]] = 5, 7  # c, e
    assert (T @ x[q])[0] == pytest.approx(2 * 5 - 6 * 7)


def test_equation_counts_in_displacement_frames():
    assembly = structure([Equation(1, (0, 1), (1, 2), (1.0, -4.0))])
    T, q = transformation(assembly)
    x = np.zeros(48)
    x[7] = 1
    u = (T @ x[q]).reshape(-1, 6)
    assert assembly.axes[0, 0] @ u[0, :3] == pytest.approx(4)


def test_scalar_points_have_one_dof():
    scalar = np.arange(8) == 7
    _, q = transformation(structure([], scalar_points=scalar))
    assert q[-1] == 42
    assert len(q) == 43


def test_point_on_the_line_of_others_may_translate():
    """Collinear points leave a rotation open that a reference on their line does not feel."""
    points = np.array([[0, 0, 0], [-1, 0, 0], [1.0, 0, 0]])
    mean = Average(5, 0, MOVES, ((1, MOVES, 1.0), (2, MOVES, 1.0)))
    T, q = transformation(Assembly(np.arange(3), points, (), rigid=(mean,)))
    x = np.zeros(18)
    x[[6, 12]] = 1, 3
    assert (T @ x[q])[0] == pytest.approx(2)


SIX = (ALL,)
REFUSED = {  # what is named: the elements, and what else the structure has
    "twice": ([RigidBody(7, 0, (2,), SIX), Average(8, 2, (3,), ((3, ALL, 1.0),))], {},
              ["30:+Z", "rigid element 7", "RBE3 8"]),
    "held": ([RigidBody(7, 0, (2,), SIX)], {"supports": np.array([(2, 3)])},
             ["30:+Z", "element 7", "support"]),
    "a ring": ([RigidBody(7 + k, k, ((k + 1) % 3,), SIX) for k in range(3)], {},
               ["element 7", "element 8", "element 9", "itself"]),
    "a zero factor": ([Equation(4, (0, 1), (1, 1), (0.0, 1.0))], {}, ["MPC 4"]),
    "UM of wrong size": ([Average(3, 0, (1, 2), ((1, ALL, 1.0), (2, ALL, 1.0)), ((1, 1),))], {},
                         ["RBE3 3", "UM"]),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_resolved_is_named(name):
    """Of a support on a dof that follows, one of the two would be ignored in silence."""
    rigid, more, words = REFUSED[name]
    sentence = says(words[0].replace("+", "."), transformation, structure(rigid, **more))
    assert all(word in sentence for word in words)


def test_open_rotation_is_refused():
    points = np.array([[0, 1.0, 0], [-1, 0, 0], [0, 0, 0], [1, 0, 0]])
    mean = Average(5, 0, ALL, tuple((k, MOVES, 1.0) for k in (1, 2, 3)))
    says("RBE3 5", transformation, Assembly(np.arange(4), points, (), rigid=(mean,)))


def _means(n):
    rng = np.random.default_rng(0)
    means = tuple(
        Average(k, 5 * k, ALL, tuple((5 * k + j, MOVES, 1.0) for j in range(1, 5)))
        for k in range(n)
    )
    return Assembly(np.arange(5 * n), rng.normal(size=(5 * n, 3)), (), rigid=means)


def test_means_are_taken_together(work):
    """A mean more is a step or two more, however many there are."""
    few, many = (work(partial(transformation, _means(n))) for n in (50, 300))
    assert many - few <= 2 * 250
