import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.fem import shell
from chladni.fem.shell_geometry import to_element
from chladni.model.assembly import Shells

Q = np.array([[2.3, 0.7, 0.1], [0.7, 1.1, 0.05], [0.1, 0.05, 0.6]]) * 1e11  # fully anisotropic
WARPED = np.array([[0, 0, 0], [1.1, 0.1, 0.05], [0.9, 1.2, 0], [-0.1, 0.8, 0.07]])
FLAT = WARPED * [1, 1, 0]
FULL = dict(Qm=Q, Qb=1.1 * Q, S=1e9 * np.array([[[1.0, 0.2], [0.2, 0.8]]]), drill=np.array([1e8]))


def rotation(seed=3):
    r, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return r * np.sign(np.linalg.det(r))


def one(points, t=0.1, offset=0.0, triangle=False, axis=(1.0, 0.3, 0.2)):
    """Geometry and thickness of one shell over the first points."""
    nodes = np.array([[0, 1, 2, 2 if triangle else 3]])
    shells = Shells(
        ids=np.array([7]),
        nodes=nodes,
        part=np.zeros(1, int),
        thickness=np.broadcast_to(np.asarray(t, float), (1, 4)).copy(),
        axis=np.array([axis]),
        offset=np.array([offset]),
    )
    return shell.geometry(points, shells), shells.thickness


def rigid(points, nodes):
    """(24, 6) motion of four nodes in the three translations and rotations of space."""
    x, y, z = points[nodes].T
    R = np.zeros((4, 6, 6))
    R[:] = np.eye(6)
    R[:, 0, 4], R[:, 0, 5], R[:, 1, 3] = z, -y, -z
    R[:, 1, 5], R[:, 2, 3], R[:, 2, 4] = x, y, -x
    return R.reshape(24, 6)


SHAPES = pytest.mark.parametrize(
    ("points", "triangle"), [(FLAT, False), (WARPED, False), (WARPED, True)]
)


@SHAPES
@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_only_the_six_rigid_motions_are_free(points, triangle, offset):
    """Warp, offset, anisotropy and any orientation in space: rank is 6 k - 6."""
    points = points @ rotation().T
    geo, t = one(points, [0.1, 0.12, 0.08, 0.08], offset, triangle)
    used = slice(0, 18 if triangle else 24)
    K = shell.stiffness(geo, t, **FULL)[0][used, used]
    lam = np.linalg.eigvalsh(K)
    assert np.abs(lam[:6]).max() < 1e-12 * lam[-1]
    assert lam[6] > 1e-7 * lam[-1]
    assert np.abs(K @ rigid(points, geo.nodes[0])[used]).max() < 1e-12 * np.abs(K).max()


def test_a_force_hangs_on_its_corner_and_the_two_beside_it():
    """Rule of NASTRAN-95's QDMM1D: normal forces there balance its couple, none opposite.

    Loads at the nodes are Bᵀ of those at the flattened corners: for each, forces and moments of
    the six normal forces about the mean plane are those of the force in the plane.
    """
    geo, _ = one(WARPED @ rotation().T)
    B = to_element(geo)[0].reshape(4, 6, 4, 6)[:, :2, :, :3] @ geo.frames[0].T  # element frame
    n, z = B[..., 2], geo.warp[0]
    assert np.abs(z).min() > 0.01
    for i in range(4):
        assert n[i, :, (i + 2) % 4] == pytest.approx(0, abs=1e-14)
    assert n.sum(axis=2) == pytest.approx(0, abs=1e-14)
    couple = np.einsum("iak,kb->iab", n, geo.corners[0])
    np.testing.assert_allclose(couple, z[:, None, None] * np.eye(2), atol=1e-14)


@SHAPES
def test_matrices_turn_with_the_element(points, triangle):
    """K of a turned element (axis with it) is the turned K."""
    R = rotation()
    big = np.kron(np.eye(8), R)
    geo, t = one(points, 0.1, 0.05, triangle)
    turned, _ = one(points @ R.T, 0.1, 0.05, triangle, axis=R @ (1.0, 0.3, 0.2))
    K, K_r = (shell.stiffness(g, t, **FULL)[0] for g in (geo, turned))
    np.testing.assert_allclose(K_r, big @ K @ big.T, atol=1e-12 * np.abs(K).max())


def test_a_triangle_has_no_first_corner():
    """The same corners numbered from another one give the same matrix."""
    geo, t = one(WARPED, [0.1, 0.12, 0.08, 0.08], triangle=True)
    again, t_again = one(WARPED[[1, 2, 0]], [0.12, 0.08, 0.1, 0.1], triangle=True)
    S = np.array([[[1.0, 0], [0, 1]]]) * 1e9  # isotropic: each frame is its own
    plain = dict(FULL, S=S)
    K, K_again = (
        shell.stiffness(g, thick, **plain)[0] for g, thick in ((geo, t), (again, t_again))
    )
    order = (6 * np.array([1, 2, 0])[:, None] + np.arange(6)).ravel()
    np.testing.assert_allclose(
        K_again[:18, :18], K[np.ix_(order, order)], atol=1e-12 * np.abs(K).max()
    )


def test_a_shell_without_area_is_refused():
    says("shells 7 ", one, FLAT[[0, 2, 1, 3]])
