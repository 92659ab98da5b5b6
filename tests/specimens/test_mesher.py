"""The plane mesher: areas add up, borders and folds are kept, matchings are largest."""

import itertools
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.errors import ModelError
from chladni.geometry.cells import corner_quality, edges_of
from chladni_specimens.forms.mesh_pieces import stops
from chladni_specimens.mesher.flat_regions import fill, grid, strip
from chladni_specimens.mesher.graded import graded, loops
from chladni_specimens.mesher.matching import augment
from chladni_specimens.mesher.plane_curves import (
    Loop,
    counterclockwise,
    inside,
    rectangle,
    resampled,
    rounded,
    stadium,
)
from chladni_specimens.mesher.quads_from_triangles import split_folded


def area(points, quads):
    x = points[quads]
    d1, d2 = x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]
    return (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]) / 2


def polygon_area(loop):
    x, y = counterclockwise(loop).T
    return np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2


def region(size):
    outer = resampled(
        rounded(
            [(-0.4, 0, 0.09), (0.4, 0, 0.09), (0.5, 0.5, 0.1), (0, 0.4, 0.2), (-0.5, 0.5, 0.1)]
        ),
        size,
    )
    hole = resampled(rectangle(-0.1, 0.2, 0.1, 0.35, 0.03), size)
    line = resampled(stadium((-0.2, 0.12), (0.2, 0.12), 0.02), size)
    return outer, hole, line


@pytest.mark.parametrize("size", [0.03, 0.02, 0.012])
def test_fill_covers_the_region(size):
    """Σ A_e = area of the polygon less its hole: no gap, no overlap, no fold."""
    outer, hole, line = region(size)
    points, quads = fill(outer, size, [hole], [line])
    assert area(points, quads).sum() == pytest.approx(
        polygon_area(outer) - polygon_area(hole), rel=1e-12
    )
    assert area(points, quads).min() > 0
    assert corner_quality(points, quads).min() > 0.1
    assert np.mean(quads[:, 2] == quads[:, 3]) < 0.08


def test_fill_keeps_borders_and_folds():
    """Every border point stays where it was, every border segment is a free edge."""
    outer, hole, line = region(0.02)
    points, quads = fill(outer, 0.02, [hole], [line])
    np.testing.assert_array_equal(points[: len(outer)], counterclockwise(outer))
    _, count = np.unique(edges_of(quads), axis=0, return_counts=True)
    assert np.sum(count == 1) == len(outer) + len(hole)
    assert count.max() == 2
    away = np.linalg.norm(points[:, None] - line[None], axis=2).min(axis=0)
    assert np.sort(away)[: int(0.8 * len(line))].max() < 1e-12


def test_fill_names_a_border_too_close_to_itself():
    outer = resampled(np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float), 0.1)
    hole = np.array([(0.4, 0.2), (0.6, 0.2), (0.6, 0.4), (0.4, 0.4)])
    beside = np.array([(0.5, 0.404), (0.6, 0.6), (0.5, 0.8), (0.4, 0.6)])
    with pytest.raises(ModelError, match="too close to itself"):
        fill(outer, 0.1, [hole, beside])


def test_strip_and_grid():
    points, quads = grid(stops([0, 1, 1.4], 0.2), stops([0, 0.5], 0.25))
    assert area(points, quads).sum() == pytest.approx(0.7)
    assert area(points, quads).min() > 0
    with pytest.raises(ModelError, match="give as many"):
        strip([np.zeros((3, 2)), np.zeros((4, 2))], closed=False)


@settings(max_examples=60, deadline=None)
@given(st.integers(2, 9), st.integers(0, 10**6))
def test_matching_is_largest(n, seed):
    """Edmonds' search from every unmatched vertex leaves no larger matching."""
    rng = random.Random(seed)
    edges = [e for e in itertools.combinations(range(n), 2) if rng.random() < 0.35]
    near = [[] for _ in range(n)]
    for a, b in edges:
        near[a].append(b)
        near[b].append(a)
    mate = {}
    for v in range(n):
        if v not in mate:
            augment(v, near, mate)
    assert all(mate[b] == a and b in near[a] for a, b in mate.items())
    assert len(mate) // 2 == largest(edges, 0, frozenset())


def largest(edges, start, used):
    best = 0
    for k in range(start, len(edges)):
        a, b = edges[k]
        if a not in used and b not in used:
            best = max(best, 1 + largest(edges, k + 1, used | {a, b}))
    return best


def test_distance_and_inside_of_a_circle():
    """Exact to the chord of the polygon, h²/8R."""
    angle = 2 * np.pi * np.arange(720) / 720
    circle = Loop.through(0.3 * np.column_stack([np.cos(angle), np.sin(angle)]), 1e-3)
    p = np.array([(0.0, 0.19), (0.4, 0.0), (0.2, 0.2), (-0.29, 0.0)])
    np.testing.assert_allclose(
        circle.distance(p), np.abs(np.linalg.norm(p, axis=1) - 0.3), atol=1e-5
    )
    np.testing.assert_array_equal(circle.inside(p), [True, False, True, True])
    np.testing.assert_allclose(
        np.linalg.norm(circle.offset(circle.points, 0.05), axis=1), 0.25, atol=1e-4
    )


@given(st.floats(0.2, 3.0), st.floats(0.2, 3.0))
def test_rounded_rectangle_area(a, b):
    """A = a b - (4 - π) r²."""
    r = 0.05
    loop = rectangle(0, 0, a, b, r)
    assert polygon_area(loop) == pytest.approx(a * b - (4 - np.pi) * r**2, rel=1e-3)
    assert inside(loop, np.array([[a / 2, b / 2], [2 * a, b]])).tolist() == [True, False]


def test_quality_of_known_shapes():
    """Square 1, rhombus sin θ, equilateral triangle 1, folded quad negative."""
    t = np.deg2rad(40)
    points = np.array(
        [(0, 0), (1, 0), (1, 1), (0, 1), (1 + np.cos(t), np.sin(t)), (np.cos(t), np.sin(t))]
    )
    points = np.vstack([points, (0.5, np.sqrt(0.75)), (0.9, 0.1)])
    quads = np.array([(0, 1, 2, 3), (0, 1, 4, 5), (0, 1, 6, 6), (0, 1, 7, 3)])
    quality = corner_quality(points, quads)
    np.testing.assert_allclose(quality[:3], [1, np.sin(t), 1], atol=1e-12)
    assert corner_quality(points, np.array([(0, 2, 1, 3)]))[0] < 0
    flat = np.column_stack([points, np.zeros(len(points))])
    np.testing.assert_allclose(corner_quality(flat, quads), quality, atol=1e-12)


def test_a_folded_quad_becomes_two_triangles():
    """A dart cannot be a shell; its triangles have its area."""
    points = np.array([(0, 0, 0), (1, 0, 0), (0.3, 0.3, 0), (0, 1, 0)], dtype=float)
    cells, source = split_folded(points, np.array([(0, 1, 2, 3)]))
    assert len(cells) == 2
    assert source.tolist() == [0, 0]
    assert area(points[:, :2], cells).sum() == pytest.approx(
        area(points[:, :2], np.array([[0, 1, 2, 3]])).sum()
    )
    assert corner_quality(points, cells).min() > 0


def test_graded_mesh_follows_its_size_field():
    """Areas add up; triangles are near the wanted size where it is small and where it is large."""

    def size(plan):
        return np.where(plan[:, 0] < 0, 0.005, 0.02)

    border = rectangle(-0.2, 0, 0.2, 0.2, 0.02)
    points, T = graded([border], size, 0.02, 0.005)
    quads = T[:, [0, 1, 2, 2]]
    assert area(points, quads).sum() == pytest.approx(
        polygon_area(resampled(border, 0.0075)), rel=1e-9
    )
    middle = points[T].mean(axis=1)
    inner = np.abs(middle[:, 1] - 0.1) < 0.06
    fine, coarse = (
        np.median(np.sqrt(2 * area(points, quads)[inner & side]))
        for side in (middle[:, 0] < -0.04, middle[:, 0] > 0.04)
    )
    assert fine == pytest.approx(0.005, rel=0.3)
    assert coarse == pytest.approx(0.02, rel=0.3)


def test_loops_of_a_ring():
    outer, hole, _ = region(0.02)
    points, quads = fill(outer, 0.02, [hole])
    found = loops(quads, points)
    assert [len(line) for line in found] == [len(outer), len(hole)]
