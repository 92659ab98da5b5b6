"""Holes cut into sheets: topology and area say that nothing else changed."""

import numpy as np
import pytest

from chladni.errors import ModelError
from chladni.geometry.cells import edges_of
from chladni.geometry.nearest import ShellSurface
from chladni_specimens.joints.bolts import free_edges, rim
from chladni_specimens.mesher.flat_regions import fill, grid
from chladni_specimens.mesher.pressed_sheets import MAIN, PressedSheet
from chladni_specimens.mesher.round_holes import bored
from chladni_specimens.tailgate.design import TailgateDesign
from chladni_specimens.tailgate.tailgate import tailgate_specimen

R = 0.0035


def flat(plan):
    return 0 * plan[:, 0]


def space(plan):
    return np.column_stack([plan[:, :2], plan[:, 2]])


def sheet(points, quads):
    plan = np.column_stack([points, 0 * points[:, 0]])
    return PressedSheet("sheet", plan, space(plan), quads, np.full(len(quads), MAIN))


def lattice(h):
    return sheet(*grid(np.arange(0, 0.1201, h), np.arange(0, 0.0901, h)))


def euler(made):
    """V - E + F, one less for every hole."""
    used = len(np.unique(made.quads))
    assert used == len(made.plan)
    return used - len(np.unique(edges_of(made.quads), axis=0)) + len(made.quads)


@pytest.mark.parametrize(("h", "area"), [(0.03, np.pi * R**2), (0.01, 2 * np.sqrt(2) * R**2)])
def test_a_hole_takes_its_area_and_nothing_else(h, area):
    """In a cell a square of the circle's area, at a node an octagon; near the place wanted."""
    whole, place = lattice(h), np.array([0.0462, 0.0435])
    made, centre = bored(whole, place, R, flat, space)
    assert euler(made) == euler(whole) - 1
    assert whole.area.sum() - made.area.sum() == pytest.approx(area, rel=1e-12)
    assert np.linalg.norm(centre - place) < min(1.8 * R, h / np.sqrt(2))
    ring = rim(ShellSurface.over("sheet", made.points, made.quads), np.r_[place, 0], 0.006)
    assert len(ring) == (4 if h > 0.02 else 8)
    np.testing.assert_allclose(made.points[ring].mean(axis=0)[:2], centre, atol=1e-12)
    x = made.points[made.quads]
    up = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])[:, 2]
    assert (up > 0).all()


@pytest.mark.parametrize(("h", "rows"), [(0.012, 1), (0.0042, 9)])
def test_a_narrow_strip_or_small_cells_take_a_hole(h, rows):
    """One cell of 12 mm across, no inner node; neighbours of a node 1.2 radii away."""
    whole = sheet(*grid(np.arange(0, 0.1001, h), h * np.arange(rows + 1)))
    made, centre = bored(whole, np.array([0.05, h * rows / 2]), R, flat, space)
    assert euler(made) == euler(whole) - 1
    assert np.linalg.norm(centre - [0.05, h * rows / 2]) < h
    with pytest.raises(ModelError, match="no room"):
        bored(whole, np.array([0.05, 0.2]), R, flat, space)


def test_a_hole_in_a_mesh_with_triangles():
    """Any node of a free mesh can be opened; what is left has the area less the polygon's."""
    border = np.array([(0, 0), (0.1, 0), (0.13, 0.05), (0.1, 0.1), (0, 0.1)], dtype=float)
    dense = np.vstack(
        [
            a + np.linspace(0, 1, 10, endpoint=False)[:, None] * (b - a)
            for a, b in zip(border, np.roll(border, -1, axis=0), strict=True)
        ]
    )
    whole = sheet(*fill(dense, 0.011))
    for place in (np.array([0.05, 0.05]), np.array([0.031, 0.072])):
        made, centre = bored(whole, place, R, flat, space)
        assert euler(made) == euler(whole) - 1
        near = np.linalg.norm(made.plan[free_edges(made.quads)][:, 0, :2] - centre, axis=1)
        assert near.min() == pytest.approx(R, rel=0.3)
        assert np.linalg.norm(centre - place) < 0.011


def test_a_hole_wider_than_the_cells_is_refused():
    with pytest.raises(ModelError, match=r"no room for a hole of 7 mm near y 0.050 m"):
        bored(lattice(0.0036), np.array([0.05, 0.05]), R, flat, space)


def loops(quads):
    """Number of closed free edges: each has as many nodes as sides."""
    sides = free_edges(quads)
    group = {int(n): int(n) for n in np.unique(sides)}

    def root(n):
        while group[n] != n:
            n = group[n]
        return n

    for a, b in sides.tolist():
        group[root(a)] = root(b)
    return len({root(n) for n in group})


@pytest.mark.parametrize("size", [0.030, 0.016])
def test_bolt_holes_of_the_tailgate(size):
    """Twelve through the inner panel beside its window and openings, each through one more."""
    made = tailgate_specimen(TailgateDesign(size=size, tied_holes=True))
    holed = {name: loops(s.quads) for name, s in made.sheets.items()}
    assert holed["inner"] == 1 + 1 + 2 + 12
    for name in ("upper reinforcements", "lower reinforcements"):
        assert holed[f"{name} left"] == holed[f"{name} right"] == 1 + 2
    assert holed["latch reinforcement"] == holed["wiper motor bracket"] == 1 + 2
    tied = [j for j in made.joints if j.kind == "tied hole"]
    bodies = {b.id: b for b in made.assembly.rigid}
    edges = set(np.unique(free_edges(made.assembly.shells.nodes)).tolist())
    for joint in tied:
        assert set(bodies[joint.elements[0]].dependent) <= edges
    assert len(tied) == 12
