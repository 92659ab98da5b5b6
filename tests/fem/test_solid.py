import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from tests.builders.elements import CUBE
from tests.builders.refusals import says

from chladni.fem import solid
from chladni.fem.assemble import structure
from chladni.geometry.solid_shapes import CORNERS as N_CORNERS
from chladni.geometry.solid_shapes import EDGES
from chladni.model.assembly import Assembly, Solids
from chladni.model.properties import Isotropic, Orthotropic, Part, SolidSection

STEEL = Isotropic(210e9, 0.3, 7850.0)
PYRAMID = np.vstack([CUBE[:4], [[0.5, 0.5, 1]]])
CORNERS = {8: CUBE, 6: CUBE[[0, 1, 2, 4, 5, 6]], 5: PYRAMID, 4: CUBE[[0, 1, 3, 4]]}
MIRRORED = {8: [4, 5, 6, 7, 0, 1, 2, 3], 6: [3, 4, 5, 0, 1, 2], 5: [0, 3, 2, 1, 4], 4: [0, 2, 1, 3]}
PIECES = {  # a brick in solids of each kind; 8 is a point at its centre
    8: [range(8)],
    6: [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]],
    5: [[0, 3, 2, 1, 8], [4, 5, 6, 7, 8], [0, 1, 5, 4, 8], [1, 2, 6, 5, 8], [2, 3, 7, 6, 8],
        [3, 0, 4, 7, 8]],
    4: [[0, a, b, 6] for a, b in ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))],
}  # fmt: skip


def with_edges(corners):
    """Corners (..., k, 3), then the middles of their edges."""
    first, second = np.array(EDGES[corners.shape[-2]]).T
    return np.concatenate([corners, (corners[..., first, :] + corners[..., second, :]) / 2], -2)


SHAPES = {len(X): X for k, corners in CORNERS.items() for X in (corners, with_edges(corners))}


def distorted(k, amount=0.12, seed=1):
    return SHAPES[k] + amount * np.random.default_rng(seed).uniform(-1, 1, (k, 3))


def straight(k):
    """Moved corners, the nodes on the edges between them."""
    X = distorted(k)
    return X if k in CORNERS else with_edges(X[: N_CORNERS[k]])


def stiffness(X, material=STEEL, modes=21):
    C = np.broadcast_to(solid.elasticity(material), (len(X), 6, 6))
    return solid.stiffness(X, C, modes)


def brick_mesh(n, size, shift=0.0, seed=0):
    """Points, bricks and the boundary of a box of n cells, inner points moved."""
    grid = [np.linspace(0, s, m + 1) for s, m in zip(size, n, strict=True)]
    points = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.all((points > 1e-9) & (points < np.array(size) - 1e-9), axis=1)
    noise = np.random.default_rng(seed).uniform(-shift, shift, points.shape)
    points = points + inside[:, None] * noise * np.array(size) / np.array(n)
    number = np.arange(len(points)).reshape([m + 1 for m in n])
    corners = [number[a : a + n[0], b : b + n[1], c : c + n[2]] for a, b, c in CUBE.astype(int)]
    return points, np.stack([c.ravel() for c in corners], axis=1), ~inside


def mesh_of(k, n, size, shift=0.0, curved=0.0, straight_edges=lambda middle: False):
    """Points, solids of k nodes and the boundary of a box of n bricks in pieces.

    Nodes within move by ``curved``; edges whose middle ``straight_edges`` takes lack theirs.
    """
    points, bricks, _ = brick_mesh(n, size, shift)
    corners = N_CORNERS[k]
    if corners == 5:
        points = np.vstack([points, points[bricks].mean(axis=1)])
        bricks = np.column_stack([bricks, len(points) - len(bricks) + np.arange(len(bricks))])
    nodes = np.vstack([bricks[:, list(piece)] for piece in PIECES[corners]])
    if k > corners:
        ends = nodes[:, np.array(EDGES[corners])]
        edges, at = np.unique(np.sort(ends, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
        middle = points[edges].mean(axis=1)
        own = (len(points) + at).reshape(ends.shape[:2])
        own = np.where(np.array([straight_edges(x) for x in middle])[at].reshape(own.shape),
                       ends[:, :, 0], own)  # fmt: skip
        points, nodes = np.vstack([points, middle]), np.hstack([nodes, own])
    inside = np.all((points > 1e-9) & (points < np.array(size) - 1e-9), axis=1)
    first = len(points) - len(middle) if k > corners else len(points)
    noise = np.random.default_rng(7).uniform(-curved, curved, points.shape)
    points = points + (inside & (np.arange(len(points)) >= first))[:, None] * noise
    return points, nodes, ~inside


def assembled(K, nodes, n):
    dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)
    full = np.zeros((3 * n, 3 * n))
    for block, at in zip(K, dofs, strict=True):
        np.add.at(full, np.ix_(at, at), block)
    return full


@pytest.mark.parametrize("modes", [0, 9, 21])
@pytest.mark.parametrize("k", SHAPES)
def test_six_rigid_motions_and_no_more(k, modes):
    """Distorted elements have six zero eigenvalues: neither held motions nor hourglasses."""
    X = distorted(k)
    K = stiffness(X[None], modes=modes)[0]
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() < 1e-9 * values[-1]
    assert values[6] > 1e-3 * values[-1]
    for u, theta in zip(np.eye(6)[:, :3], np.eye(6)[:, 3:], strict=True):
        assert_allclose(K @ (u + np.cross(theta, X)).ravel(), 0, atol=1e-9 * values[-1])


@pytest.mark.parametrize("modes", [0, 9, 21])
def test_patch_of_distorted_bricks(modes):
    """Constant strain on the boundary is constant strain inside, to round-off."""
    points, nodes, boundary = brick_mesh((3, 3, 3), (2.0, 1.0, 1.5), shift=0.25)
    K = assembled(stiffness(points[nodes], modes=modes), nodes, len(points))
    H = np.random.default_rng(2).normal(size=(3, 3))
    u = points @ H.T
    held = np.repeat(boundary, 3)
    inner = np.linalg.solve(K[~held][:, ~held], -K[~held][:, held] @ u.ravel()[held])
    assert_allclose(inner, u.ravel()[~held], rtol=0, atol=1e-12 * np.abs(u).max())


@pytest.mark.parametrize("modes", [0, 21])
@pytest.mark.parametrize("lacking", ["none", "some"])
@pytest.mark.parametrize("k", [5, 10, 13, 15, 20])
def test_patch_of_pyramids_and_solids_with_mid_side_nodes(k, lacking, modes):
    """A constant strain on the boundary is one inside, with curved edges but for reduced shear."""
    lacks = (lambda x: x[0] > 1 and x[2] > 0.7) if lacking == "some" else (lambda x: False)
    curved = 0.03 if modes == 0 or k in (10, 13) else 0.0  # reduced shear is exact where straight
    points, nodes, boundary = mesh_of(k, (2, 2, 2), (2.0, 1.0, 1.5), 0.2, curved, lacks)
    K = assembled(stiffness(points[nodes], modes=modes), nodes, len(points))
    used = np.isin(np.arange(len(points)), nodes)
    u = (points @ np.random.default_rng(2).normal(size=(3, 3)).T).ravel()
    held, free = (np.repeat(mask, 3) for mask in (boundary & used, ~boundary & used))
    inner = np.linalg.solve(K[free][:, free], -K[free][:, held] @ u[held])
    assert_allclose(inner, u[free], rtol=0, atol=1e-11 * np.abs(u).max())


@pytest.mark.parametrize("k", [8, 6, 5, 4])
def test_a_solid_that_lacks_all_mid_side_nodes_is_the_one_without(k):
    """Straight edges take the quadratic terms out: K (plain) and M are those of linear elements."""
    X = CORNERS[k]
    lacking = np.vstack([X, X[np.array(EDGES[k])[:, 0]]])
    K = stiffness(lacking[None], modes=0)[0]
    assert_allclose(K[3 * k :], 0, atol=1e-3)
    assert_allclose(
        K[: 3 * k, : 3 * k], stiffness(X[None], modes=0)[0], rtol=0, atol=1e-9 * K.max()
    )
    rho = np.array([7850.0])
    M = solid.mass(lacking[None], rho)[0]
    assert_allclose(M[: 3 * k, : 3 * k], solid.mass(X[None], rho)[0], atol=1e-9 * M.max())
    assert np.trace(solid.lumped_mass(lacking[None], rho)[0]) == pytest.approx(
        3 * 7850 * solid.volume(X[None])[0]
    )


@pytest.mark.parametrize("component", [0, 1])
@pytest.mark.parametrize(("k", "order"), [(4, 2), (5, 2), (10, 4), (13, 4), (15, 4), (20, 4)])
def test_standing_wave_converges(k, order, component):
    """ω² of a wave across a layer, (π/L)² M/ρ with M = λ + 2G or G, errs by h² or h⁴."""
    G = STEEL.shear_modulus
    modulus = {0: solid.elasticity(STEEL)[0, 0], 1: G}[component]
    exact, errors = np.pi**2 * modulus / 7850, []
    for n in (3, 6):
        points, nodes, _ = mesh_of(k, (n, 1, 1), (1.0, 1 / n, 1 / n))
        rho = np.full(len(nodes), 7850.0)
        K, M = (assembled(A, nodes, len(points))[component::3, component::3]
                for A in (stiffness(points[nodes]), solid.mass(points[nodes], rho)))  # fmt: skip
        free = (points[:, 0] > 1e-9) & (points[:, 0] < 1 - 1e-9)
        errors.append(eigh(K[free][:, free], M[free][:, free])[0][0] / exact - 1)
    assert 0 < errors[1] < errors[0]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.35)


def test_two_bricks_with_mid_side_nodes_bend_a_cantilever():
    """They hold a linear moment to a tenth, a hundredth of their length thick (plain: a sixth)."""
    assert bent(STEEL, 21, n=(2, 1, 1), size=(10.0, 1.0, 0.1), k=20) == pytest.approx(1, abs=0.11)
    assert bent(STEEL, 21, n=(8, 1, 1), size=(8.0, 1.0, 0.5), k=20) == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize("modes", [0, 3])
def test_patch_of_irregular_wedges(modes):
    """Two unequal layers of irregular triangles hold a constant strain."""
    base, bricks, _ = brick_mesh((4, 4, 2), (4.0, 4.0, 1.0))
    rng = np.random.default_rng(5)
    column = {tuple(xy): rng.uniform(-0.25, 0.25, 2) for xy in np.unique(base[:, :2], axis=0)}
    rim = np.any((base[:, :2] == 0) | (base[:, :2] == 4), axis=1)
    points = base.copy()
    points[:, :2] += ~rim[:, None] * np.array([column[tuple(xy)] for xy in base[:, :2]])
    points[points[:, 2] == 0.5, 2] = 0.3
    nodes = np.vstack([bricks[:, [0, 1, 2, 4, 5, 6]], bricks[:, [0, 2, 3, 4, 6, 7]]])
    K = assembled(stiffness(points[nodes], modes=modes), nodes, len(points))
    u = (points @ rng.normal(size=(3, 3)).T).ravel()
    held = np.repeat(rim | (base[:, 2] != 0.5), 3)
    inner = np.linalg.solve(K[~held][:, ~held], -K[~held][:, held] @ u[held])
    assert_allclose(inner, u[~held], rtol=0, atol=1e-12 * np.abs(u).max())


@pytest.mark.parametrize("k", SHAPES)
def test_constant_strain_energy(k):
    """½ uᵀ K u = ½ εᵀ C ε V of constant strain; a wedge when it is an equilateral prism."""
    X = straight(k)
    if k == 6:
        angle = 2 * np.pi * np.arange(3) / 3
        ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        X = np.vstack([ring, ring + np.array([0.2, 0.1, 0.8])])
    H = np.random.default_rng(4).normal(size=(3, 3))
    u = (X @ H.T).ravel()
    S = H + H.T
    strain = np.array([H[0, 0], H[1, 1], H[2, 2], S[0, 1], S[1, 2], S[2, 0]])
    due = strain @ solid.elasticity(STEEL) @ strain * solid.volume(X[None])[0]
    assert u @ stiffness(X[None])[0] @ u == pytest.approx(due, rel=1e-10)


def mirrored(k):
    """Nodes of a solid in the order of the other hand."""
    corners = MIRRORED[N_CORNERS[k]]
    if k == len(corners):
        return corners
    edges = {frozenset(pair): e for e, pair in enumerate(EDGES[len(corners)])}
    pairs = [frozenset((corners[a], corners[b])) for a, b in EDGES[len(corners)]]
    return corners + [len(corners) + edges[pair] for pair in pairs]


@pytest.mark.parametrize("k", SHAPES)
def test_handedness_does_not_matter(k):
    """The mirrored node order gives the same energy and the same mass."""
    X = straight(k)
    order = mirrored(k)
    dofs = (3 * np.array(order)[:, None] + np.arange(3)).ravel()
    K, other = stiffness(X[None])[0], stiffness(X[order][None])[0]
    assert_allclose(other, K[np.ix_(dofs, dofs)], rtol=0, atol=1e-10 * K.max())
    rho = np.array([7850.0])
    one, two = solid.mass(X[None], rho)[0], solid.mass(X[order][None], rho)[0]
    assert_allclose(two, one[np.ix_(dofs, dofs)], atol=1e-12 * one.max())


@pytest.mark.parametrize("k", SHAPES)
def test_mass_of_a_translation(k):
    """Both masses move the whole ρ V, and no motion has a negative one."""
    X = distorted(k)[None]
    rho = np.array([1000.0])
    move = np.tile([1.0, 0, 0], k)
    for M in (solid.mass(X, rho)[0], solid.lumped_mass(X, rho)[0]):
        assert move @ M @ move == pytest.approx(1000 * solid.volume(X)[0])
        assert np.all(np.linalg.eigvalsh(M) > 0)


def test_volumes():
    assert solid.volume(CUBE[None])[0] == pytest.approx(1)
    assert solid.volume(SHAPES[6][None])[0] == pytest.approx(1 / 2)
    assert solid.volume(SHAPES[4][None])[0] == pytest.approx(1 / 6)
    assert solid.volume(SHAPES[5][None])[0] == pytest.approx(1 / 3)


def bent(material, modes, n=(8, 1, 1), size=(8.0, 1.0, 0.5), k=8):
    """Tip deflection of a cantilever of bricks, load 1 N, over beam theory's."""
    points, nodes, _ = mesh_of(k, n, size)
    K = assembled(stiffness(points[nodes], material, modes), nodes, len(points))
    held = np.repeat(points[:, 0] == 0, 3)
    tip = np.flatnonzero(points[:, 0] == size[0])
    f = np.zeros(len(K))
    f[3 * tip + 2] = 1 / len(tip)
    u = np.zeros(len(K))
    u[~held] = np.linalg.solve(K[~held][:, ~held], f[~held])
    L, b, h = size
    bending = L**3 / (3 * material.E * b * h**3 / 12)
    shear = L / (material.shear_modulus * b * h * 5 / 6)
    return u[3 * tip + 2].mean() / (bending + shear)


def test_one_brick_through_the_thickness_bends():
    """Internal strains bend at 2 to 3 % (the root may not narrow); plain bricks lock."""
    assert bent(STEEL, 21) == pytest.approx(1, abs=0.02)
    assert bent(STEEL, 9) == pytest.approx(1, abs=0.03)
    assert bent(STEEL, 0) < 0.5


def test_nearly_incompressible_does_not_lock():
    """From nu 0.3 to 0.4999 the ratio to beam theory stays; plain bricks lose it."""
    rubber = [Isotropic(1e6, nu) for nu in (0.3, 0.49, 0.4999)]
    rich = [bent(m, 21, n=(8, 2, 1)) for m in rubber]
    plain = [bent(m, 0, n=(8, 2, 1)) for m in rubber]
    assert min(rich) > 0.95
    assert plain[2] < 0.1 * rich[2]


def sheared_slab(modes, nu):
    """Force over G A / t of a thin soft brick, 16 x 10 x 0.15, its top moved along by 1."""
    X = CUBE * [16, 10, 0.15]
    K = stiffness(X[None], Isotropic(1e6, nu), modes)[0]
    u = np.zeros((8, 3))
    u[4:, 0] = 1
    force = (K @ u.ravel()).reshape(8, 3)[4:, 0].sum()
    return force * 0.15 / (160 * 1e6 / (2 * (1 + nu)))


@pytest.mark.parametrize("modes", [0, 9, 21])
def test_thin_bead_shears_by_its_modulus(modes):
    """An adhesive bead 0.15 high has k = G A / t whatever nu, when its faces stay plane."""
    assert sheared_slab(modes, 0.49) == pytest.approx(1, rel=0.02)


def box(k, section):
    part = Part(7, "block", section)
    nodes = np.arange(k)[None]
    solids = Solids(np.array([55]), nodes, np.array([0]))
    return Assembly(np.arange(1, k + 1), SHAPES[k], (part,), solids=(solids,))


def test_assembly_uses_the_section():
    (nodes, K, M), *_ = solid.stiffness_and_mass(box(8, SolidSection(STEEL, full=True)))
    assert nodes.shape == (1, 8)
    assert_allclose(K, stiffness(CUBE[None], modes=0))
    assert M[0, ::3, ::3].sum() == pytest.approx(7850)


def test_losses_of_the_material():
    """K_loss = η K of the block's material."""
    lossy = Isotropic(210e9, 0.3, 7850.0, damping=0.05)
    built = structure(box(8, SolidSection(lossy)))
    assert_allclose(built.loss.toarray(), 0.05 * built.system.K.toarray(), atol=1)


def test_faults_name_the_element():
    assembly = box(8, SolidSection(STEEL))
    flat = Assembly(assembly.ids, CUBE * [1, 1, 0], assembly.parts, solids=assembly.solids)
    says("55", solid.stiffness_and_mass, flat)
    for material, said in ((Orthotropic(1e9, 1e9, 0.3, 1e9), "isotropic"),
                           (Isotropic(1e6, 0.5, id=3), "Poisson")):  # fmt: skip
        says(said, solid.stiffness_and_mass, box(8, SolidSection(material)))
