"""Deflections of the MacNeal-Harder set (Finite Elements in Analysis and Design 1, 1985, 3-20).

Targets are read from ../shared/anchors; meshes are MacNeal and Harder's or finer, and the
tolerances are what good commercial quadrilaterals reach on the same meshes.
"""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from tests.builders.published import benchmarks, held

from chladni.fem.assemble import structure
from chladni.model.properties import Isotropic
from chladni_specimens.plates import grid, sheet

ALL = (1, 2, 3, 4, 5, 6)


def deflection(assembly, forces, **options):
    """Displacements (n, 6) under forces (n, 6)."""
    s = structure(assembly, **options)
    q = spsolve(s.system.K.tocsc(), s.T.T @ forces.ravel())
    return (s.T @ q).reshape(-1, 6)


def nodal(assembly, *loads):
    """Forces (n, 6) from (mask, total vector) spread evenly over the points of each mask."""
    F = np.zeros((len(assembly.points), 6))
    for mask, total in loads:
        F[mask, :3] += np.asarray(total) / mask.sum()
    return F


def weight(assembly, areal):
    """Consistent forces (n, 6) of a load per area [N/m²] in -z."""
    F = np.zeros((len(assembly.points), 6))
    for nodes in assembly.shells.nodes:
        first, second = np.diff(assembly.points[nodes[[0, 2, 1, 3]]], axis=0)[::2]
        area = np.linalg.norm(np.cross(first, second)) / 2
        F[nodes, 2] -= areal * area / 4
    return F


def ends(line):
    """Masks of the least and the greatest value."""
    return np.isclose(line, line.min()), np.isclose(line, line.max())


@pytest.mark.parametrize(("n", "tolerance"), [(8, 0.03), (24, 0.012)])
def test_scordelis_lo_roof(n, tolerance):
    """Quarter of the roof; deep-shell theory converges to 0.3006 to 0.3019."""
    points, nodes = grid(np.linspace(0, 25, n + 1), np.linspace(0, 40, n + 1))
    x, phi = points[:, 0], np.deg2rad(points[:, 1])
    points = np.column_stack([x, 25 * np.sin(phi), 25 * np.cos(phi)])
    roof = sheet(points, nodes, 0.25, Isotropic(4.32e8, 0.0))
    free, crown, middle, wall = (*ends(phi)[::-1], *ends(x))
    roof = held(roof, (wall, (2, 3)), (middle, (1, 5, 6)), (crown, (2, 4, 6)))
    u = deflection(roof, weight(roof, 90.0))
    target = benchmarks()["MH_scordelis_lo"]["target"]
    assert -u[free & middle, 2][0] == pytest.approx(target, rel=tolerance)


@pytest.mark.parametrize(("n_x", "n_y"), [(12, 2), (36, 6)])
def test_twisted_beam(n_x, n_y):
    """All elements are warped; too little drilling stiffness softens it without bound."""
    points, nodes = grid(np.linspace(0, 12, n_x + 1), np.linspace(-0.55, 0.55, n_y + 1))
    x, s = points[:, 0], points[:, 1]
    turn = np.pi / 2 * x / 12
    points = np.column_stack([x, s * np.cos(turn), s * np.sin(turn)])
    root, tip = ends(x)
    beam = held(sheet(points, nodes, 0.32, Isotropic(29e6, 0.22)), (root, ALL))
    target = benchmarks()["MH_twisted_beam"]["target"]
    for k, name in ((1, "along root-wide direction"), (2, "along root-thin direction")):
        force = np.eye(3)[k]
        u = deflection(beam, nodal(beam, (tip, force)))
        assert u[tip, k].mean() == pytest.approx(target[name], rel=0.02)


def test_curved_beam():
    """Radii 4.12 and 4.32, quarter circle; 6 x 1 is MacNeal-Harder's mesh, 48 x 4 converged."""
    target = benchmarks()["MH_curved_beam"]["target"]
    for n, m, tolerance in ((6, 1, 0.13), (48, 4, 0.02)):
        points, nodes = grid(np.linspace(np.pi / 2, 0, n + 1), np.linspace(4.12, 4.32, m + 1))
        phi, r = points[:, 0], points[:, 1]
        points = np.column_stack([r * np.cos(phi), r * np.sin(phi), 0 * r])
        tip, root = ends(phi)
        beam = held(sheet(points, nodes[:, ::-1], 0.1, Isotropic(1e7, 0.25)), (root, ALL))
        for k, name in ((0, "in-plane"), (2, "out-of-plane")):
            u = deflection(beam, nodal(beam, (tip, np.eye(3)[k])))
            assert u[tip, k].mean() == pytest.approx(target[name], rel=tolerance)


@pytest.mark.parametrize(("n", "tolerance"), [(8, 0.03), (16, 0.015)])
def test_hemisphere_with_a_hole(n, tolerance):
    """Quarter with 18 degrees hole, unit loads at the equator; converges to 0.0934."""
    points, nodes = grid(np.linspace(0, 90, n + 1), np.linspace(0, 72, n + 1))
    lon, lat = np.deg2rad(points[:, :2]).T
    round_ = [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
    points = 10 * np.column_stack(round_)
    at_x, at_y = ends(lon)
    equator = ends(lat)[0]
    dome = sheet(points, nodes, 0.04, Isotropic(6.825e7, 0.3))
    one = equator & at_x
    dome = held(dome, (at_x, (2, 4, 6)), (at_y, (1, 5, 6)), (one, (3,)))
    F = nodal(dome, (one, (1, 0, 0)), (equator & at_y, (0, -1, 0)))
    u = deflection(dome, F)
    assert u[one, 0][0] == pytest.approx(benchmarks()["MH_hemisphere18"]["target"], rel=tolerance)


@pytest.mark.parametrize("shape", ["rectangle", "parallelogram"])
def test_straight_cantilever(shape):
    """6 x 0.2 x 0.1, six elements; targets are beam theory with shear.

    QM6 leaning by 45 degrees is known to lose 37 % of the in-plane deflection (0.63).
    """
    L, b, t, E, nu = 6.0, 0.2, 0.1, 1e7, 0.3
    points, nodes = grid(np.linspace(0, L, 7), np.array([-b / 2, b / 2]))
    if shape == "parallelogram":
        inner = (points[:, 0] > 0) & (points[:, 0] < L)
        points[inner, 0] += points[inner, 1]  # 45 degrees
    root, tip = ends(points[:, 0])
    beam = held(sheet(points, nodes, t, Isotropic(E, nu)), (root, ALL))
    G, A = E / 2 / (1 + nu), b * t
    due = {
        0: L / (E * A),
        1: 4 * L**3 / (E * t * b**3) + 1.2 * L / (G * A),
        2: 4 * L**3 / (E * b * t**3) + 1.2 * L / (G * A),
    }
    for k, exact in due.items():
        u = deflection(beam, nodal(beam, (tip, np.eye(3)[k])))
        leaning = k == 1 and shape == "parallelogram"
        assert u[tip, k].mean() == pytest.approx(0.63 * exact if leaning else exact, rel=0.03)


def test_residual_bending_makes_a_strip_exact():
    """w = FL³/3EI + 6FL/5GA with n = 2 elements; without it 1/4n² of the bending is missing."""
    L, b, t, E = 1.0, 0.1, 0.01, 70e9
    points, nodes = grid(np.linspace(0, L, 3), np.array([0, b]))
    root, tip = ends(points[:, 0])
    strip = held(sheet(points, nodes, t, Isotropic(E, 0.0)), (root, ALL))
    bending, shear = 4 * L**3 / (E * b * t**3), 1.2 * L / (E / 2 * b * t)
    for on, due in ((True, bending + shear), (False, bending * (1 - 1 / 16) + shear)):
        u = deflection(strip, nodal(strip, (tip, (0, 0, 1))), residual_bending=on)
        assert u[tip, 2].mean() == pytest.approx(due, rel=1e-8)


def test_strip_in_torsion():
    """One element across: MacNeal-Harder's twist, 0.03208; their element has 0.94 of it.

    Residual bending flexibility of all the shear would make it seven times too soft.
    """
    points, nodes = grid(np.linspace(0, 6, 7), np.array([-0.1, 0.1]))
    root, tip = ends(points[:, 0])
    strip = held(sheet(points, nodes, 0.1, Isotropic(1e7, 0.3)), (root, ALL))
    top = points[:, 1] > 0
    u = deflection(strip, nodal(strip, (tip & top, (0, 0, 5)), (tip & ~top, (0, 0, -5))))
    twist = (u[tip & top, 2][0] - u[tip & ~top, 2][0]) / 0.2
    assert 0.9 < twist / 0.03208 < 1.25


def test_raasch_hook():
    """Knight, AIAA J. 35 (1997): 4.9352 to 5.02; drilling must carry twist round the bend."""
    first, second = np.linspace(0, np.pi / 3, 13), np.linspace(0, 5 * np.pi / 6, 31)
    a = np.column_stack([14 * np.sin(first), 14 - 14 * np.cos(first)])
    centre = np.array([60 * np.sin(np.pi / 3), 14 - 60 * np.cos(np.pi / 3)])
    turn = -np.pi / 3 + second  # the outer bend curls the other way round its own centre
    b = centre + 46 * np.column_stack([np.sin(turn), np.cos(turn)])
    line = np.vstack([a, b[1:]])
    points, nodes = grid(np.arange(len(line)), np.linspace(0, 20, 17))
    k = points[:, 0].astype(int)
    points = np.column_stack([line[k], points[:, 1]])
    hook = held(sheet(points, nodes, 2.0, Isotropic(3300.0, 0.35)), (k == 0, ALL))
    tip = k == len(line) - 1
    u = deflection(hook, nodal(hook, (tip, (0, 0, 1))))
    assert 4.9 < u[tip, 2].mean() < 5.15
