"""Patch tests, convergence rates and limits of the shell elements."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from chladni.dynamics.eigen import normal_modes
from chladni.fem import shell
from chladni.fem.assemble import structure
from chladni.model.properties import Isotropic, Orthotropic
from chladni_specimens.plates import grid, plate, sheet

E, NU, T = 1e6, 0.25, 0.001
INNER = np.array([[0.04, 0.02], [0.18, 0.03], [0.16, 0.08], [0.08, 0.08]])
OUTER = np.array([[0, 0], [0.24, 0], [0.24, 0.12], [0, 0.12]])
QUADS = np.array([[4, 5, 1, 0], [5, 6, 2, 1], [6, 7, 3, 2], [7, 4, 0, 3], [4, 7, 6, 5]])[:, ::-1]
TILT = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
TILT *= np.sign(np.linalg.det(TILT))


def triangles(nodes):
    return np.concatenate([nodes[:, [0, 1, 2]], nodes[:, [0, 2, 3]]])


def patch(cells, offset=0.0):
    """MacNeal and Harder's patch of five quadrilaterals (or ten triangles), tilted in space."""
    flat = np.vstack([OUTER, INNER])
    shape = sheet(np.column_stack([flat, 0 * flat[:, 0]]) @ TILT.T, cells, T, Isotropic(E, NU))
    shells = replace(shape.shells, offset=np.full(len(cells), offset))
    return flat, replace(shape, shells=shells)


def solved(shape, u):
    """Displacements (8, 6) when the four outer grids move as u says."""
    K = structure(shape).system.K.tocsr()
    outer, inner = np.arange(24), np.arange(24, 48)
    q = u.ravel().copy()
    q[inner] = spsolve(K[inner][:, inner].tocsc(), -K[inner][:, outer] @ q[outer])
    return q.reshape(-1, 6), q @ (K @ q) / 2


def tilted(u):
    """Displacements and rotations of the flat patch in the frame of space."""
    return np.hstack([u[:, :3] @ TILT.T, u[:, 3:] @ TILT.T])


CELLS = pytest.mark.parametrize("cells", [QUADS, triangles(QUADS)], ids=["quads", "triangles"])


def strained(flat, kind):
    """Motion of constant strain 1e-3 (1, 1, 1): u, v of a membrane; w, rx = w,y, ry = -w,x."""
    (x, y), u = flat.T, np.zeros((8, 6))
    if kind == "membrane":
        u[:, 0], u[:, 1] = 1e-3 * (x + y / 2), 1e-3 * (y + x / 2)
    else:
        u[:, 2] = 1e-3 * (x**2 + x * y + y**2) / 2
        u[:, 3], u[:, 4] = 1e-3 * (x / 2 + y), -1e-3 * (x + y / 2)
    return tilted(u)


def energy_of(stiffness):
    """½ A s εᵀQε of the patch, s = t of a membrane and t³/12 of a plate."""
    strain = 1e-3 * np.ones(3)
    return stiffness * 0.24 * 0.12 / 2 * strain @ Isotropic(E, NU).plane_stress() @ strain


@CELLS
@pytest.mark.parametrize(("kind", "stiffness"), [("membrane", T), ("plate", T**3 / 12)])
def test_patch(cells, kind, stiffness):
    """The interior follows, and the energy is that of the strain."""
    flat, shape = patch(cells)
    u = strained(flat, kind)
    found, energy = solved(shape, u)
    np.testing.assert_allclose(found, u, atol=1e-12)
    assert energy == pytest.approx(energy_of(stiffness), rel=1e-10)


def test_offset_patch_couples_stretch_and_bending():
    """A mid-surface at d above the grids: energy of curvature about the grids is D + t d² Q."""
    d = 0.004
    flat, shape = patch(QUADS, offset=d)
    normal = shell.geometry(shape.points, shape.shells).frames[0, 2]
    side = normal @ TILT[:, 2]  # the cells may face down
    q, K = strained(flat, "plate").ravel(), structure(shape).system.K
    due = energy_of(T**3 / 12 + T * (side * d) ** 2)
    assert q @ (K @ q) / 2 == pytest.approx(due, rel=1e-10)


def test_coupling_material_is_an_offset():
    """MID4 = -d/t Q_m with Q_b + 12 d²/t² Q_m has an offset's energies of constant strains."""
    Q, d, t = Isotropic(E, NU).plane_stress(), 0.03, np.full((1, 4), 0.01)
    points, nodes = grid(np.array([0, 0.3]), np.array([0, 0.2]))
    shape = sheet(points, nodes, 0.01, Isotropic(E, NU))
    geo = shell.geometry(points, shape.shells)
    moved = replace(geo, offset=np.array([d]))
    K = shell.stiffness(moved, t, Qm=Q, Qb=Q)[0]
    smeared = shell.stiffness(
        geo, t, Qm=Q, Qb=(1 + 12 * d**2 / 0.01**2) * Q, Qc=-d / 0.01 * Q, reference=Q
    )[0]
    x, y = points[nodes[0], :2].T
    q = np.zeros((4, 6))
    q[:, 0], q[:, 1] = 0.2 * x + 0.1 * y, 0.3 * y
    q[:, 3], q[:, 4] = 0.7 * y + 0.3 * x, -1.1 * x
    q = q.ravel()
    assert q @ smeared @ q == pytest.approx(q @ K @ q, rel=1e-10)


def supported(n, t, cells=None, material=None, width=1.0):
    """First frequency of a simply supported unit plate, hard supports."""
    shape = plate(1.0, width, n, n, t, material or Isotropic(210e9, 0.3, 7850.0))
    if cells == "triangles":
        shape = sheet(
            shape.points, triangles(shape.shells.nodes), t, shape.parts[0].section.bending
        )
    x, y, _ = shape.points.T
    on_x, on_y = np.isclose(x % 1.0, 0), np.isclose(y % width, 0)
    held = {(k, c) for k in range(len(x)) for c in (1, 2, 6)}
    held |= {(k, c) for k in np.flatnonzero(on_x) for c in (3, 4)}
    held |= {(k, c) for k in np.flatnonzero(on_y) for c in (3, 5)}
    return replace(shape, supports=np.array(sorted(held)))


def first(shape, count=1, **options):
    return normal_modes(structure(shape, **options).system, count).frequency


def kirchhoff(t):
    """f₁₁ = π/a² √(D/ρt)."""
    return np.pi * np.sqrt(210e9 * t**2 / (12 * (1 - 0.3**2) * 7850.0))


@pytest.mark.parametrize(
    ("cells", "residual"), [("quads", True), ("quads", False), ("triangles", True)]
)
def test_thin_plate_converges_quadratically(cells, residual):
    """h² at t/a = 1e-3: no locking, with and without residual bending flexibility."""
    t = 1e-3
    f = [first(supported(n, t, cells), residual_bending=residual)[0] for n in (8, 16, 32)]
    error = np.abs(np.array(f) / kirchhoff(t) - 1)
    assert np.log2(error[-2] / error[-1]) == pytest.approx(2.0, abs=0.3)
    assert error[-1] < 3e-3


def test_no_locking_however_thin():
    """The error at one mesh is the same from t/a = 1e-2 to 1e-5."""
    error = [first(supported(12, t))[0] / kirchhoff(t) - 1 for t in (1e-3, 1e-4, 1e-5)]
    np.testing.assert_allclose(error, error[0], atol=2e-5)


@pytest.mark.parametrize("turned", [False, True])
def test_orthotropic_plate(turned):
    """ω = π² √((D11 m⁴/a⁴ + 2(D12 + 2D66) m²n²/a²b² + D22 n⁴/b⁴) / ρt), Jones 5.2."""
    t, b, rho = 2e-3, 0.7, 1600.0
    first_along, second = (140e9, 9e9) if not turned else (9e9, 140e9)
    nu = 0.3 if not turned else 0.3 * 9 / 140
    sheet_ = Orthotropic(first_along, second, nu, 5e9, 5e9, 5e9, rho)
    shape = supported(32, t, material=sheet_, width=b)
    if turned:
        axis = np.tile([0.0, 1.0, 0.0], (len(shape.shells), 1))
        shape = replace(shape, shells=replace(shape.shells, axis=axis))
    nu21 = 0.3 * 9 / 140
    D = t**3 / 12 * np.array([140e9, 9e9, 0.3 * 9e9]) / (1 - 0.3 * nu21)
    D66 = 5e9 * t**3 / 12
    m, n = np.meshgrid(np.arange(1, 5), np.arange(1, 5))
    stiff = D[0] * m**4 + 2 * (D[2] + 2 * D66) * (m * n / b) ** 2 + D[1] * (n / b) ** 4
    exact = np.sort(np.pi / 2 * np.sqrt(stiff / (rho * t)).ravel())[:3]
    np.testing.assert_allclose(first(shape, 3), exact, rtol=0.01)


def test_tapered_strip():
    """Wedge cantilever, h = h0 (1 - x/2L): tip w = F ∫ (L-x)²/EI dx with 8, 16, 32 elements."""
    L, b, h_0, E_, F = 1.0, 0.1, 0.02, 70e9, 3.0
    s = np.linspace(0, L, 20001)
    exact = F * np.trapezoid((L - s) ** 2 / (E_ * b * (h_0 * (1 - s / 2 / L)) ** 3 / 12), s)
    error = []
    for n in (4, 8, 16):
        shape = plate(L, b, n, 1, h_0, Isotropic(E_, 0.0))
        x = shape.points[:, 0]
        t = h_0 * (1 - x[shape.shells.nodes] / 2 / L)
        root = [[k, c] for k in np.flatnonzero(x == 0) for c in range(1, 7)]
        shape = replace(shape, shells=replace(shape.shells, thickness=t), supports=np.array(root))
        s_ = structure(shape)
        tip = s_.along(shape.ids[x == L], np.tile([0, 0, 1.0], (2, 1)))
        w = tip @ spsolve(s_.system.K.tocsc(), tip.T @ np.full(2, F / 2))
        error.append(abs(w.mean() / exact - 1))
    assert np.log2(error[-2] / error[-1]) > 1.6
    assert error[-1] < 2e-3
