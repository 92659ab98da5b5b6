"""Frequencies of response that follow the modes."""

import numpy as np

from chladni.model.following_frequencies import SAME, Between, Times, merged

MODES = np.array([0.0, 12.0, 12.0, 75.0, 900.0])


def test_between_has_count_in_every_range():
    """FREQ3 from 2 to 500 with 10: steps of (12 - 2)/9 up to the first mode, and so on."""
    f = merged([Between(2.0, 500.0)(MODES)])
    np.testing.assert_allclose(f[:3], [2, 2 + 10 / 9, 2 + 20 / 9])
    assert len(f) == 3 * 9 + 1
    assert {2.0, 12.0, 75.0, 500.0} <= set(f.tolist())


def test_cluster_gathers_at_the_modes():
    """|x|^(1/c) with c > 1 draws the frequencies to the ends, c = 1 spaces them evenly."""
    even, drawn = (np.unique(Between(0.0, 24.0, 9, c)(np.zeros(0))) for c in (1.0, 2.0))
    np.testing.assert_allclose(np.diff(even), 3.0)
    assert np.diff(drawn)[0] < 3.0 < np.diff(drawn).max()


def test_logarithmic_ranges_have_equal_ratios():
    f = np.unique(np.round(Between(1.0, 16.0, 5, logarithmic=True)(np.zeros(0)), 9))
    np.testing.assert_allclose(f, [1, 2, 4, 8, 16])


def test_times_keeps_to_its_band_whatever_the_mode():
    """A mode outside may give a frequency inside, and one inside a frequency outside."""
    f = np.unique(Times(10.0, 100.0, (0.1, 1.0, 2.0))(MODES))
    assert f.tolist() == [12.0, 24.0, 75.0, 90.0]


def test_neighbours_within_the_threshold_are_one():
    f = merged([np.array([1.0, 2.0, 101.0]), np.array([2.0 + 50 * SAME])])
    assert len(f) == 3
    assert len(merged([np.array([1.0, 2.0, 101.0]), np.array([2.0 + 200 * SAME])])) == 4
    assert len(merged([])) == 0
