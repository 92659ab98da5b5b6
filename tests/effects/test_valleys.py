"""A search begins at the bottom of every valley of the scores, however near the next one is."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chladni.effects.attachments import around
from chladni.effects.effect_context import ElementGrids
from chladni.effects.search_context import valleys
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

GRID = np.array([[x, y, 0.0] for x in range(12) for y in range(9)], dtype=float)


def pits(*centres, depth):
    """Scores over ``GRID`` with a cone of each depth round each centre."""
    far = [np.linalg.norm(GRID - np.array([*c, 0.0]), axis=1) for c in centres]
    return np.min([r - d for r, d in zip(far, depth, strict=True)], axis=0)


def at(positions):
    """The points of these positions."""
    return [tuple(GRID[k][:2].tolist()) for k in positions]


def test_a_valley_next_to_a_deeper_one_is_found():
    score = pits((3, 4), (6, 4), (10, 8), depth=(3.0, 2.5, 1.0))
    assert at(valleys(score, GRID, wanted=2)) == [(3, 4), (6, 4)]
    assert at(valleys(score, GRID, wanted=9)) == [(3, 4), (6, 4), (10, 8)]


def test_a_valley_that_is_taken_is_left_out_with_its_slopes():
    score = pits((3, 4), (9, 2), depth=(3.0, 2.0))
    (deepest,) = valleys(score, GRID)
    assert at(valleys(score, GRID, [deepest], wanted=5)) == [(9, 2)]


def test_a_place_without_a_score_is_none():
    score = pits((3, 4), depth=(3.0,))
    score[valleys(score, GRID)] = np.inf
    found = valleys(score, GRID, wanted=9)
    assert found
    assert np.isfinite(score[found]).all()
    assert valleys(np.full(len(GRID), np.inf), GRID, wanted=9) == []


@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_of_several_options_at_a_place_the_best_is_taken(seed, options):
    rng = np.random.default_rng(seed)
    score, point = rng.random(options * len(GRID)), np.tile(GRID, (options, 1))
    found = valleys(score, point, wanted=len(GRID))
    assert found[0] == int(np.argmin(score))
    assert len({tuple(p) for p in point[found]}) == len(found)
    assert (np.diff(score[found]) >= 0).all()
    for k in found:
        assert score[k] == score[(point == point[k]).all(axis=1)].min()


def test_every_grid_is_tried_round_its_nearest_place_alone():
    reduced = reduced_problem(plate(0.4, 0.3, 16, 12, 1.5e-3), 250.0)
    grids, places = reduced.grids, reduced.candidates
    assert isinstance(places, ElementGrids)
    tried = [around(grids, places, k) for k in range(len(places))]
    for k, near in enumerate(tried):
        d = np.linalg.norm(near.point[:, None] - places.point, axis=2)
        assert (d[:, k] <= d.min(axis=1) * (1 + 1e-9)).all()
    assert set(np.concatenate([near.grids for near in tried])) == set(grids.grids)
