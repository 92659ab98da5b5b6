"""A mesh twice as fine is the same structure."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.elements import bars
from tests.fem.test_curved_shell import sheet as curved_sheet

from chladni.dynamics.eigen import normal_modes
from chladni.fem import shell
from chladni.fem.assemble import structure
from chladni.fem.curved_shell import strains
from chladni.geometry.facets import cell_areas, vector_areas
from chladni.geometry.refine import refined
from chladni.model.properties import BeamSection, Part
from chladni_evidence.bench_of_structure import SPECIMENS
from chladni_specimens.forms import FORMS
from chladni_specimens.plates import STEEL, box, grid, plate, sheet


def area(assembly):
    return cell_areas(assembly.points, assembly.shells.nodes)


def triangles():
    points, quads = grid(np.linspace(0, 0.4, 5), np.linspace(0, 0.3, 4))
    return sheet(points, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]), 1e-3)


@pytest.mark.parametrize("make", [lambda: plate(0.4, 0.3, 4, 3, 1e-3), triangles, box])
def test_flat_faces_keep_their_area_in_four_equal_pieces(make):
    coarse = make()
    fine = refined(coarse)
    assert len(fine.shells) == 4 * len(coarse.shells)
    assert_allclose(area(fine).sum(), area(coarse).sum(), rtol=1e-12)
    assert_allclose(np.sort(area(fine)), np.sort(np.repeat(area(coarse) / 4, 4)), rtol=1e-9)
    assert fine.shells.triangle.sum() == 4 * coarse.shells.triangle.sum()


def test_old_points_keep_rows_and_ids_and_new_ids_are_new():
    coarse = plate(0.4, 0.3, 4, 3, 1e-3)
    coarse = replace(coarse, ids=10 * coarse.ids)
    fine = refined(coarse)
    n = len(coarse.ids)
    assert np.array_equal(fine.ids[:n], coarse.ids)
    assert np.array_equal(fine.points[:n], coarse.points)
    assert np.all(np.diff(fine.ids) > 0)


def test_normals_and_parts_stay():
    coarse = box()
    fine = refined(coarse)
    for k in range(3):
        of_part = (area(a)[a.shells.part == k].sum() for a in (fine, coarse))
        assert_allclose(*of_part)
    # the divergence theorem: Σ x·n A = 3 V, negative were any shell turned over
    for a in (coarse, fine):
        out = vector_areas(a.points, a.shells.nodes)
        middle = a.points[a.shells.nodes].mean(axis=1)
        assert_allclose(np.einsum("ij,ij->", middle, out), 3 * 0.3 * 0.2 * 0.1, rtol=1e-9)


@pytest.mark.parametrize("make", [lambda: plate(0.4, 0.3, 4, 3, 1e-3), triangles])
def test_thickness_linear_over_the_plate_stays_that_function(make):
    coarse = make()

    def law(assembly):
        x, y, _ = assembly.points[assembly.shells.nodes].transpose(2, 0, 1)
        return 1e-3 * (1 + 2 * x - y)

    shells = replace(coarse.shells, thickness=law(coarse))
    fine = refined(replace(coarse, shells=shells))
    assert_allclose(fine.shells.thickness, law(fine), rtol=1e-12)


def test_a_panel_with_creases_becomes_the_one_meshed_twice_as_fine():
    """The flat strips of its rim stay flat: rounded, they change a frequency by 0.16 %."""
    halved, due = (
        normal_modes(structure(a).system, 22).frequency[6:]
        for a in (refined(SPECIMENS["panel"].build(1)), SPECIMENS["panel"].build(2))
    )
    assert_allclose(halved, due, rtol=1e-3)


def on_arc(angles, width=0.2, radius=0.1):
    """A sheet along an arc of these angles [rad], two shells wide."""
    points, quads = grid(np.asarray(angles), np.linspace(0, width, 3))
    phi, y, _ = points.T
    return sheet(np.column_stack([radius * np.cos(phi), y, radius * np.sin(phi)]), quads, 1e-3)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("angles", [np.linspace(0, np.pi, 9), np.pi * np.array([0, 3, 5, 8, 11, 13])
                                    / 16])  # fmt: skip
def test_new_points_of_a_cylinder_lie_on_it(angles, turned):
    """They leave its radius by less than a tenth of the arc's rise, whatever the numbering."""
    coarse = on_arc(angles)
    nodes = coarse.shells.nodes.copy()
    nodes[::2] = nodes[::2, ::-1] if turned else nodes[::2]
    fine = refined(replace(coarse, shells=replace(coarse.shells, nodes=nodes)))
    rise = 0.1 * (1 - np.cos(np.diff(angles).max() / 2))
    assert np.abs(np.hypot(fine.points[:, 0], fine.points[:, 2]) - 0.1).max() < 0.1 * rise


def test_a_cylinder_becomes_the_one_meshed_twice_as_fine():
    """On the facets of a half cylinder of eight shells two frequencies are 9 % lower."""
    halved, due = (
        normal_modes(structure(a).system, 16).frequency[6:]
        for a in (refined(half_cylinder(8, 6)), half_cylinder(16, 12))
    )
    assert_allclose(halved, due, rtol=2e-3)


def half_cylinder(around, along):
    points, quads = grid(np.linspace(0, np.pi, around + 1), np.linspace(0, 0.4, along + 1))
    phi, y, _ = points.T
    return sheet(np.column_stack([0.15 * np.cos(phi), y, 0.15 * np.sin(phi)]), quads, 2e-3)


PROFILES = {  # z over x; folds stand out from the sides around them
    "bead of one flat shell": [0, 0, 0, 0.01, 0.01, 0, 0, 0],
    "bead of two flat shells": [0, 0, 0, 0.01, 0.01, 0.01, 0, 0],
    "channel of three flat strips": [0.01, 0, 0, 0.01],
    "step": [0, 0, 0, 0.005, 0.01, 0.01, 0.01],
    "ridge": [0, 0.002, 0.004, 0.006, 0.004, 0.002, 0],
    "corrugation": [0, 0.01, 0, 0.01, 0, 0.01, 0],
}


@pytest.mark.parametrize("name", PROFILES)
def test_flats_between_folds_stay_flat(name):
    z = np.array(PROFILES[name])
    points, quads = grid(np.arange(len(z)) * 0.01, np.linspace(0, 0.02, 3))
    points[:, 2] = np.interp(points[:, 0], np.arange(len(z)) * 0.01, z)
    fine = refined(sheet(points, quads, 1e-3))
    due = np.interp(fine.points[:, 0], np.arange(len(z)) * 0.01, z)
    assert_allclose(fine.points[:, 2], due, atol=1e-12)


def test_a_round_lid_stays_flat_and_its_rim_becomes_rounder():
    """Side and lid both place the points of the fold between them."""
    phi = np.linspace(0, 2 * np.pi, 13)[:-1]
    ring = np.column_stack([np.cos(phi), np.sin(phi), 0 * phi])
    points = 0.1 * np.concatenate(
        [
            ring - np.array([0, 0, 1.0]),
            ring - np.array([0, 0, 0.5]),
            ring,
            ring / 2,
            np.zeros((1, 3)),
        ]
    )
    here, there = np.arange(12), np.roll(np.arange(12), -1)
    quads = [np.stack([here, there, 12 + there, 12 + here], axis=1) + 12 * k for k in range(3)]
    tips = np.stack([36 + here, 36 + there, 48 + 0 * here, 48 + 0 * here], axis=1)
    coarse = sheet(points, np.concatenate([*quads, tips]), 1e-3)
    fine = refined(coarse)
    x = fine.points
    assert_allclose(x[x[:, 2] > -0.01][:, 2], 0, atol=1e-12)
    side = (x[:, 2] < -0.001) | (np.hypot(x[:, 0], x[:, 1]) > 0.09)
    rise = 0.1 * (1 - np.cos(np.pi / 12))
    assert np.abs(np.hypot(x[side, 0], x[side, 1]) - 0.1).max() < 0.1 * rise


def test_a_frame_of_beams_becomes_the_one_meshed_twice_as_fine():
    form = FORMS["tube frame"]
    deck, fine = form.made(1), form.made(1, 2.0)
    halved, due = (
        normal_modes(structure(a).system, 30).frequency[6:] for a in (refined(deck), fine)
    )
    assert_allclose(halved, due, rtol=1e-8)
    pinned = replace(deck.beams, pins=np.ones_like(deck.beams.pins))
    pins = refined(replace(deck, beams=pinned)).beams.pins
    assert pins.sum() == pinned.pins.sum()  # none where a beam was cut


def test_a_stiffener_along_shells_takes_the_points_their_sides_get():
    made = plate(0.4, 0.3, 4, 3, 1e-3)
    n = len(made.points)
    edge = np.array([[0, 1], [1, 2]])
    stiff = bars(edge, 1, (0, 0, 1), ids=np.array([900, 901]))
    bar = Part(9, "bar", BeamSection(STEEL, 1e-4, 1e-9, 1e-9, 0.0, 2e-9))
    both = replace(made, parts=(*made.parts, bar), beams=stiff)
    fine = refined(both)
    assert len(fine.points) == len(refined(made).points)
    assert len(fine.beams) == 4
    assert len(np.unique(fine.beams.nodes)) == 5
    middle = np.setdiff1d(fine.beams.nodes, edge)
    assert (middle >= n).all()
    assert np.isin(middle, fine.shells.nodes).all()


@pytest.mark.parametrize("components", [(1, 2, 3, 4, 5, 6), (3,), (3, 6)])
def test_an_edge_that_is_held_stays_held_between_its_points(components):
    """A supported plate becomes the one meshed twice as fine, none of whose edge is let go."""

    def held(nx, ny):
        made = plate(0.4, 0.3, nx, ny, 1e-3)
        edge = np.flatnonzero((made.points[:, 0] == 0) | (made.points[:, 1] == 0))
        turned = np.tile(np.eye(3)[[1, 0, 2]] * [[1], [1], [-1]], (len(made.points), 1, 1))
        supports = np.array([(row, c) for row in edge for c in components])
        return replace(made, supports=supports, axes=turned)

    halved, due = (
        normal_modes(structure(a).system, 12).frequency[6:]
        for a in (refined(held(4, 3)), held(8, 6))
    )
    assert_allclose(halved, due, rtol=1e-9)


def cylinder(x, y):
    """An arc of 2 rad on a radius of 0.5 m."""
    return 0.5 * np.sin(2 * x), y, 0.5 * np.cos(2 * x)


def true_area(made):
    """∫ dA of shells with nodes on their edges [m²]."""
    return strains(shell.geometry(made.points, made.shells))[1].sum()


KINDS = pytest.mark.parametrize("corners", [4, 3])


@KINDS
@pytest.mark.parametrize("lacks", [None, lambda p: p[0] < 1e-9], ids=["all", "some lack a node"])
def test_quarters_of_a_curved_shell_lie_on_its_own_surface(corners, lacks):
    """The area stays, quarter by quarter; neighbours share the nodes of their edges."""
    coarse = curved_sheet(3, 2, corners, shape=cylinder, lacks=lacks)
    fine = refined(coarse)
    assert len(fine.shells) == 4 * len(coarse.shells)
    assert_allclose(true_area(fine), true_area(coarse), rtol=5e-6)  # to the quadrature
    assert fine.shells.curved.all()
    own = fine.shells.middle[:, :corners]
    assert (own < 0).sum() == (0 if lacks is None else 2 * 2)
    used = np.unique(np.concatenate([fine.shells.nodes.ravel(), own[own >= 0]]))
    places = fine.points[used].round(9)
    assert len(np.unique(places, axis=0)) == len(places)


@KINDS
def test_the_area_of_a_cylinder_is_reached_as_h4(corners):
    """Its arc is a parabola a shell: of 1 m² it lacks h⁴; nodes on the edges lie near the arc."""
    meshes = [curved_sheet(n, 1, corners, shape=cylinder) for n in (2, 4)]
    off = [abs(true_area(a) - 1.0) for a in meshes]
    assert off[0] / off[1] > 12
    fine = refined(meshes[1])
    x, _, z = fine.points.T
    assert np.abs(np.hypot(x, z) - 0.5).max() < 1e-3 * 0.5


@KINDS
def test_modes_that_are_interpolated_are_the_same_motion(corners):
    """Quarters hold every motion of their shell: ΦᵀMΦ = I, and constant curvature has its energy.

    The places of new nodes are linear in the old ones, and so are motions.
    """
    coarse = curved_sheet(3, 2, corners, t=2e-3)
    built, fine = structure(coarse), structure(refined(coarse))
    x, y = coarse.points[:, :2].T
    bent = np.zeros((len(coarse.points), 6, 1))
    bent[:, 2, 0], bent[:, 3, 0], bent[:, 4, 0] = x * x - 2 * x * y, -2 * x, 2 * y - 2 * x
    modes = normal_modes(built.system, 12).sel(slice(6, 12)).shapes
    u = np.concatenate([(built.T @ modes).reshape(len(x), 6, -1), bent], axis=2)

    def between(values):
        moved = replace(coarse, points=coarse.points + values)
        return refined(moved).points - fine.assembly.points

    each = [np.hstack([between(u[:, :3, k]), between(u[:, 3:, k])]) for k in range(u.shape[2])]
    q = fine.T.T @ np.stack(each, axis=2).reshape(-1, u.shape[2])
    assert_allclose((q.T @ (fine.system.M @ q))[:6, :6], np.eye(6), atol=2e-3)
    p = built.T.T @ bent.reshape(-1, 1)
    energies = [float((v.T @ (s.system.K @ v)).item()) for v, s in ((q[:, 6:], fine), (p, built))]
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)


def test_a_clamped_quadratic_edge_stays_clamped():
    """Its new nodes are held, its neighbours inside are free."""
    coarse = curved_sheet(2, 2)
    edge = np.flatnonzero(coarse.points[:, 0] < 1e-9)
    held = np.array([(row, c) for row in edge for c in range(1, 7)])
    fine = refined(replace(coarse, supports=held))
    rows = np.unique(fine.supports[:, 0])
    assert_allclose(fine.points[rows, 0], 0, atol=1e-12)
    assert len(rows) == 2 * len(edge) - 1


def test_a_beam_on_a_quadratic_edge_uses_its_nodes():
    """From a corner to the node in the middle: the half takes the node of the finer shell."""
    coarse = curved_sheet(2, 2)
    corner, node = coarse.shells.nodes[0, 0], coarse.shells.middle[0, 0]
    beam = Part(2, "rib", BeamSection(STEEL, 1e-4, 1e-9, 1e-9, J=2e-9))
    made = replace(coarse, beams=bars([(corner, node)], 1), parts=(*coarse.parts, beam))
    fine = refined(made)
    used = set(fine.shells.nodes.ravel()) | set(fine.shells.middle.ravel())
    assert set(fine.beams.nodes.ravel()) <= used
