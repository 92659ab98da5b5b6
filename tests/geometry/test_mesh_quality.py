"""Mesh checks: known shapes, a mesh with one fault of every kind."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.geometry.mesh_quality import check_mesh, edge_faults, element_quality, free_edges
from chladni_specimens.joints.builders import spot_welds
from chladni_specimens.plates import plate


def distorted(points, nodes):
    base = plate(1.0, 1.0, 1, 1, 1e-3)
    shells = replace(base.shells, nodes=np.array([nodes]))
    return replace(base, points=np.array(points, float), shells=shells)


def test_known_shapes():
    """Square 1, 1, 0; a 1 x 4 strip has aspect 4; one corner lifted by d warps by d/4."""
    square = element_quality(plate(1.0, 1.0, 2, 2, 1e-3))
    np.testing.assert_allclose(square.sine, 1)
    np.testing.assert_allclose(square.aspect, 1)
    np.testing.assert_allclose(square.warp, 0, atol=1e-15)
    assert element_quality(plate(4.0, 1.0, 1, 1, 1e-3)).aspect[0] == pytest.approx(4)
    d = 0.04
    lifted = distorted([(0, 0, 0), (1, 0, 0), (1, 1, d), (0, 1, 0)], [0, 1, 2, 3])
    assert element_quality(lifted).warp[0] == pytest.approx(d / 4, rel=1e-2)
    rhombus = distorted([(0, 0, 0), (1, 0, 0), (1.5, 0.9, 0), (0.5, 0.9, 0)], [0, 1, 2, 3])
    angle = np.arctan2(0.9, 0.5)
    assert element_quality(rhombus).sine[0] == pytest.approx(np.sin(angle))


def test_triangles_are_measured_as_such():
    t = np.sqrt(0.75)
    tri = distorted([(0, 0, 0), (1, 0, 0), (0.5, t, 0), (9, 9, 9)], [0, 1, 2, 2])
    found = element_quality(tri)
    assert found.sine[0] == pytest.approx(1)
    assert found.aspect[0] == pytest.approx(1)
    assert found.warp[0] == 0


def test_size_and_place_do_not_matter():
    a = plate(0.3, 0.2, 5, 4, 1e-3, hole=0.04)
    rng = np.random.default_rng(0)
    a = replace(a, points=a.points + 0.004 * rng.normal(size=a.points.shape))
    Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    b = replace(a, points=1e3 * a.points @ Q.T * np.sign(np.linalg.det(Q)) + 5)
    for name in ("sine", "aspect", "warp"):
        both = (getattr(element_quality(x), name) for x in (a, b))
        np.testing.assert_allclose(*both, atol=1e-9)


def test_free_edges_of_a_plate_with_a_hole():
    """Outer border and hole; n_free = 2 (nx + ny) + the hole's sides."""
    whole = plate(1.0, 1.0, 10, 10, 1e-3)
    assert len(free_edges(whole.shells.nodes)) == 40
    check = check_mesh(whole)
    assert check.parts[0].free_edge == pytest.approx(4.0)
    assert check.parts[0].pieces == 1
    holed = plate(1.0, 1.0, 10, 10, 1e-3, hole=0.2)
    assert check_mesh(holed).parts[0].free_edge > 4.0


def test_turned_and_branched():
    """One shell turned over disagrees across its four inner edges."""
    whole = plate(1.0, 1.0, 4, 4, 1e-3)
    nodes = whole.shells.nodes.copy()
    nodes[5] = nodes[5][::-1]
    assert edge_faults(nodes) == (4, 0)
    assert edge_faults(whole.shells.nodes) == (0, 0)
    check = check_mesh(replace(whole, shells=replace(whole.shells, nodes=nodes)))
    assert check.parts[0].turned == 4
    assert not check.fit
    doubled = np.vstack([whole.shells.nodes, whole.shells.nodes[:1]])
    assert edge_faults(doubled)[1] == 2


def test_a_folded_shell_is_named():
    bad = distorted([(0, 0, 0), (1, 0, 0), (0.2, 0.2, 0), (0, 1, 0)], [0, 1, 2, 3])
    check = check_mesh(bad)
    assert check.bad.tolist() == bad.shells.ids.tolist()
    assert not check.fit


def test_a_loose_part_is_named_until_it_is_welded():
    from tests.specimens.test_connections import WELDS, pair

    assembly = pair()
    assert len(check_mesh(assembly).loose) == 1
    assert not check_mesh(assembly).parts[0].joined
    joined, _ = spot_welds(assembly, WELDS)
    assert check_mesh(joined).loose == ()
    assert check_mesh(joined).parts[0].joined
