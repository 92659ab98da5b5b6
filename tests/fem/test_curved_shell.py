"""Shells with nodes on their edges: rigid motions, patches, thin plates and cylinders, masses."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.fem import shell
from chladni.fem.assemble import structure
from chladni.fem.energy import shell_energies
from chladni.fem.shell_section import section_arrays
from chladni.model.assembly import Assembly, Shells
from chladni.model.properties import Isotropic, Part, ShellSection

STEEL = Isotropic(210e9, 0.3, 7850.0)
KINDS = pytest.mark.parametrize("corners", [4, 3])


def sheet(nx, ny, corners=4, t=1e-3, size=(1.0, 1.0), shape=None, shift=0.0, lacks=None, **fields):
    """A rectangle of cells with nodes on their edges, moved by ``shape`` as (x, y) -> (x, y, z).

    Inner corners move by ``shift`` of a cell; edges whose middle ``lacks`` takes have no node.
    """
    x, y = np.meshgrid(np.linspace(0, size[0], nx + 1), np.linspace(0, size[1], ny + 1))
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    inside = np.all((points > 1e-9) & (points < np.array(size) - 1e-9), axis=1)
    noise = np.random.default_rng(1).uniform(-shift, shift, points.shape)
    points += inside[:, None] * noise * np.array(size) / (nx, ny)
    n = np.arange(len(points)).reshape(ny + 1, nx + 1)
    quads = np.stack([n[:-1, :-1], n[:-1, 1:], n[1:, 1:], n[1:, :-1]], axis=-1).reshape(-1, 4)
    cells = quads if corners == 4 else np.vstack([quads[:, [0, 1, 2, 2]], quads[:, [0, 2, 3, 3]]])
    edges = np.stack([cells[:, :corners], np.roll(cells[:, :corners], -1, axis=1)], axis=2)
    unique, at = np.unique(np.sort(edges, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    middle = points[unique].mean(axis=1)
    own = (len(points) + at).reshape(edges.shape[:2])
    if lacks is not None:
        own = np.where(np.array([lacks(p) for p in middle])[at].reshape(own.shape), -1, own)
    rows = np.full((len(cells), 4), -1)
    rows[:, :corners] = own
    flat = np.vstack([points, middle])
    X = np.array([shape(*p) for p in flat]) if shape else np.column_stack([flat, 0 * flat[:, 0]])
    m = len(cells)
    shells = Shells(
        np.arange(1, m + 1), cells, np.zeros(m, int), np.full((m, 4), t),
        np.tile([1.0, 0, 0], (m, 1)), np.full(m, fields.pop("offset", 0.0)), rows,
    )  # fmt: skip
    section = ShellSection(t, STEEL, STEEL, STEEL)
    return Assembly(np.arange(1, len(X) + 1), X, (Part(1, "sheet", section),), shells, **fields)


def bowl(x, y):
    return x, y + 0.05 * x * x, 0.3 * x * x - 0.2 * x * y + 0.1 * y * y


def matrices(made, coupled=True):
    geo, t = shell.geometry(made.points, made.shells), made.shells.thickness
    s = section_arrays(made, geo)
    return geo, shell.stiffness(geo, t, **s.stiffness), shell.mass(geo, t, s.rho, s.nsm, coupled)


def rigid(X):
    """The six rigid motions of points (n, 6, 6)."""
    R = np.zeros((len(X), 6, 6))
    for k, e in enumerate(np.eye(3)):
        R[:, :3, k], R[:, 3:, 3 + k] = e, e
        R[:, :3, 3 + k] = np.cross(e, X)
    return R


@KINDS
@pytest.mark.parametrize("lacks", [None, lambda p: p[0] > 0.6])
@pytest.mark.parametrize("k6rot", [None, 100.0])
def test_a_curved_shell_with_offset_has_six_rigid_motions_and_no_more(corners, lacks, k6rot):
    made = sheet(1, 1, corners, 0.05, shape=bowl, lacks=lacks, offset=0.03, k6rot=k6rot)
    geo, K, _ = matrices(made)
    free = np.isin(np.arange(8), np.unique(geo.nodes[0], return_index=True)[1])
    dofs = np.repeat(free, 6)
    value = np.linalg.eigvalsh(K[0][np.ix_(dofs, dofs)])
    R = rigid(made.points[geo.nodes[0]]).reshape(48, 6)
    assert np.abs((R.T @ K[0] @ R)[free[0] * np.arange(6)]).max() < 1e-9 * value[-1]
    assert np.abs(value[:6]).max() < 1e-9 * value[-1] < 1e3 * value[6] * 1e3


def moved(made, u):
    """Largest error of the inner nodes' motions where the rim has the motion u (n, 6)."""
    built = structure(replace(made, k6rot=None, auto_spc=False))
    X, used = made.points, np.isin(np.arange(len(made.points)), made.shells.nodes)
    used |= np.isin(np.arange(len(X)), made.shells.middle)
    rim = ((X[:, :2] < 1e-9) | (X[:, :2] > 1 - 1e-9)).any(axis=1)
    held, inner = (np.repeat(mask & used, 6) for mask in (rim, ~rim))
    K = np.zeros((6 * len(X), 6 * len(X)))
    at = 6 * built.assembly.rows(built.system.dofs[:, 0]) + built.system.dofs[:, 1] - 1
    K[np.ix_(at, at)] = built.system.K.toarray()
    found = np.linalg.solve(K[inner][:, inner], -K[inner][:, held] @ u.ravel()[held])
    return np.abs(found - u.ravel()[inner]).max() / np.abs(u).max()


@KINDS
@pytest.mark.parametrize("lacks", [None, lambda p: p[0] > 0.6 and p[1] > 0.4])
def test_patches_of_distorted_shells(corners, lacks):
    """Constant membrane strain and, with all nodes, constant curvature on the rim hold inside."""
    made = sheet(3, 3, corners, 0.01, shift=0.2, lacks=lacks)
    x, y, _ = made.points.T
    zero = 0 * x
    a, b, c, d = 0.3, -0.2, 0.5, 0.4
    stretch = np.stack([a * x + b * y, c * x + d * y, zero, zero, zero, zero + (c - b) / 2], axis=1)
    assert moved(made, stretch) < 1e-9
    if lacks is None:
        w = (a * x * x + b * x * y + c * y * y) / 2
        bend = np.stack([zero, zero, w, (b * x / 2 + c * y), -(a * x + b * y / 2), zero], axis=1)
        assert moved(made, bend) < 1e-7


@KINDS
def test_clamped_thin_plate_converges(corners):
    """λ of the clamped square is 35.985 (Leissa 1969), t/a 1e-3: no locking, order four in f²."""
    exact = 35.985 / (2 * np.pi) * np.sqrt(STEEL.E * 1e-3**2 / (12 * 0.91 * STEEL.rho))
    error = []
    for n in (3, 6):
        made = sheet(n, n, corners)
        rim = np.flatnonzero(((made.points[:, :2] < 1e-9) | (made.points[:, :2] > 1 - 1e-9)).any(1))
        plane = np.setdiff1d(np.arange(len(made.points)), rim)
        held = [(r, c) for r in rim for c in range(1, 7)] + [
            (r, c) for r in plane for c in (1, 2, 6)
        ]
        f = normal_modes(structure(replace(made, supports=np.array(held))).system, 1).frequency[0]
        error.append(f / exact - 1)
    assert abs(error[1]) < 0.012
    assert abs(error[1]) < abs(error[0]) / 4


@KINDS
def test_mass_is_area_times_thickness(corners):
    """Rigid translations carry ρ t A and rotations their inertia; lumped masses are positive."""
    made = sheet(2, 2, corners, 0.05, offset=0.02)
    for coupled in (True, False):
        geo, _, M = matrices(made, coupled)
        R = rigid(made.points[geo.nodes].reshape(-1, 3)).reshape(len(geo), 8, 6, 6)
        absent = np.repeat(geo.nodes[:, 4:] == geo.nodes[:, :4], 1, axis=1)
        R[:, 4:][absent] = 0
        if corners == 3:
            R[:, 3] = 0
        R = R.reshape(len(geo), 48, 6)
        total = (R.swapaxes(1, 2) @ M @ R).sum(axis=0)
        m = STEEL.rho * 0.05
        assert_allclose(np.diag(total)[:3], m)
        assert total[1, 3] == pytest.approx(-m * 0.02)
        assert np.all(np.diagonal(M, axis1=1, axis2=2) >= 0)
        if coupled:
            assert total[3, 3] == pytest.approx(m * (1 / 3 + 0.02**2 + 0.05**2 / 12))


@KINDS
def test_slope_by_thickness_is_exact(corners):
    """The Taylor remainder of K over a change of corner thickness falls as its square."""
    made = sheet(2, 1, corners, 0.02, shape=bowl)
    geo, t = shell.geometry(made.points, made.shells), made.shells.thickness
    s = section_arrays(made, geo)
    change = np.random.default_rng(0).uniform(0.5, 1, t.shape) * 0.02
    if corners == 3:
        change[:, 3] = change[:, 2]
    dK = shell.thickness_derivative(
        geo, t, change, s.Qm, s.Qb, s.Qc, s.shear_by_thickness(geo, t, change),
        s.drill_by_thickness(geo, t, change), reference=s.Qm,
    )  # fmt: skip
    rest = []
    for h in (1e-2, 5e-3):
        thick = replace(made, shells=replace(made.shells, thickness=t + h * change))
        _, K, _ = matrices(thick)
        rest.append(np.abs(K - matrices(made)[1] - h * dK).max())
    assert rest[1] == pytest.approx(rest[0] / 4, rel=0.05)


def test_a_sheet_of_both_kinds_has_the_energy_of_its_modes():
    """Strain energies of shells with and without nodes on edges add up to ω²/2."""
    made = sheet(4, 4, lacks=lambda p: p[0] > 0.4)
    assert 0 < made.shells.curved.sum() < len(made.shells)
    built = structure(made)
    modes = normal_modes(built.system, 10)
    energy = shell_energies(built, modes.shapes).sum(axis=0)
    assert_allclose(energy[6:], (2 * np.pi * modes.frequency[6:]) ** 2 / 2, rtol=1e-6)
