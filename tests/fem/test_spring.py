import numpy as np
from numpy.testing import assert_allclose
from tests.builders.elements import bush, scalar

from chladni.fem import spring
from chladni.model.assembly import Assembly, Masses


def frames(n, seed=0):
    Q = np.linalg.qr(np.random.default_rng(seed).normal(size=(n, 3, 3)))[0]
    return Q * np.linalg.det(Q)[:, None, None]


def assembly(**families):
    points = np.array([[0.0, 0, 0], [1, 2, 0.5], [3, 1, 1]])
    return Assembly(np.array([1, 2, 3]), points, (), **families)


def test_spring_between_components_of_two_frames():
    """k (q_a - q_b)²: energy of motions counted along the points' own axes."""
    axes = frames(3)
    made = assembly(springs=scalar((0, 2), (2, 3), 5.0, 0.1), axes=axes)
    K, V, M, loss = spring.matrices(made)
    u = np.random.default_rng(1).normal(size=18)
    stretch = axes[0, 1] @ u[:3] - axes[2, 2] @ u[12:15]
    assert_allclose(u @ K @ u, 5 * stretch**2)
    assert_allclose(loss.toarray(), 0.1 * K.toarray())
    assert V.nnz == M.nnz == 0


def test_grounded_rotational_damper_and_mass():
    """A grounded end (-1) takes no part; components 4-6 turn about the point's axes."""
    axes = frames(3)
    made = assembly(
        dampers=scalar((1, -1), (5, 1), 2.0),
        scalar_masses=scalar((1, -1), (1, 1), 3.0),
        axes=axes,
    )
    _, V, M, _ = spring.matrices(made)
    assert_allclose(V.toarray()[9:12, 9:12], 2 * np.outer(axes[1, 1], axes[1, 1]))
    assert_allclose(M.toarray()[6:9, 6:9], 3 * np.outer(axes[1, 0], axes[1, 0]))
    assert V.nnz == M.nnz == 9


def test_scalars_without_frames():
    K, *_ = spring.matrices(assembly(springs=scalar((0, 1), (1, 1), 7.0)))
    assert_allclose(K.toarray()[[0, 0, 6], [0, 6, 6]], [7, -7, 7])


def test_bush_is_blind_to_rigid_motion():
    """Rigid arms lead to the spring wherever it sits: no held rotation over a gap."""
    made = assembly(bushes=bush((0, 1), (5, -3, 2), [1, 2, 3, 4, 5, 6], frames(1)[0]))
    K, *_ = spring.matrices(made)
    for motion in np.eye(6):
        u = np.hstack([motion[:3] + np.cross(motion[3:], made.points), np.tile(motion[3:], (3, 1))])
        assert_allclose(K @ u.ravel(), 0, atol=1e-12)


def test_bush_in_its_own_frame_with_losses():
    """½ Σ k_i δ_i², δ along the frame's axes at the place of the spring; V and loss likewise."""
    k = np.array([1.0, 2, 3, 4, 5, 6])
    made = assembly(bushes=bush((0, 1), (0.5, 0, 0), k, frames(1)[0], 0.3, 0.2))
    K, V, _, loss = spring.matrices(made)
    u = np.random.default_rng(3).normal(size=18)
    R, arms = frames(1)[0], np.array([0.5, 0, 0]) - made.points
    there = [u[6 * n : 6 * n + 3] + np.cross(u[6 * n + 3 : 6 * n + 6], arms[n]) for n in (0, 1)]
    delta = np.concatenate([R @ (there[1] - there[0]), R @ (u[9:12] - u[3:6])])
    assert_allclose(u @ K @ u, k @ delta**2)
    assert_allclose(u @ V @ u, 0.3 * delta @ delta)
    assert_allclose(loss.toarray(), 0.2 * K.toarray())


def test_grounded_bush():
    made = assembly(bushes=bush((1, -1), (1, 2, 0.5), [1, 1, 1, 0, 0, 0], frames(1)[0]))
    K, *_ = spring.matrices(made)
    expected = np.zeros(K.shape)
    expected[6:9, 6:9] = np.eye(3)
    assert_allclose(K.toarray(), expected, atol=1e-12)


def test_point_mass_adds_up():
    six = np.arange(36.0).reshape(6, 6)
    six = six + six.T
    made = assembly(masses=Masses(np.array([1, 2]), np.array([1, 1]), np.stack([six, six])))
    assert_allclose(spring.matrices(made)[2].toarray()[6:12, 6:12], 2 * six)
