"""Pictures of a calibration are drawn of few and of many parameters."""

import numpy as np
import pytest

from chladni.view.calibration_plots import corner, likelihood_profiles, response_bands, unit_places


@pytest.mark.parametrize("count", [1, 2, 11])
def test_profiles_and_pairs_of_any_number_of_parameters(tmp_path, count):
    names = [f"E of part {k}" for k in range(count)]
    rows = [(n, (4.0, 1.0, 1.1, np.inf), (4.0, 1.0, 1.0, 4.0)) for n in names]
    assert likelihood_profiles(tmp_path / "profiles.png", rows).stat().st_size > 1000
    C = 1e-4 * np.ones((count, count))  # all of them trade off: no ellipse has a width
    assert corner(tmp_path / "corner.png", names, C).stat().st_size > 1000


def test_draws_are_drawn_over_the_ellipses(tmp_path):
    draws = np.random.default_rng(1).normal(size=(50, 2)) / 100
    plain, drawn = (corner(tmp_path / "corner.png", ["E", "t"], 1e-4 * np.eye(2), x).read_bytes()
                    for x in (None, draws))  # fmt: skip
    assert plain != drawn


def test_bands_of_several_channels(tmp_path):
    f = np.linspace(10, 100, 40)
    rows = [("1:+Z, held out", f, 1 + f, f, 2 + f), ("2:+Z, fitted", f, f, f, f)]
    assert response_bands(tmp_path / "bands.png", rows, "kg⁻¹").stat().st_size > 1000


def test_places_of_two_articles(tmp_path):
    rows = [("E", 0.01, [0.01, -0.01], [0.002, 0.002]), ("t", 0.0, [0.0, 0.0], [0.1, 0.1])]
    assert unit_places(tmp_path / "articles.png", rows, ("A", "B")).stat().st_size > 1000
