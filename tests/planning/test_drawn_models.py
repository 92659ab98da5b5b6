"""Models with drawn thickness: the reduced ones are those solved in full."""

import numpy as np
import pytest

from chladni.ema.correlation import mac
from chladni.fem.assemble import structure
from chladni_planning import PlanSettings
from chladni_planning.drawn_models import drawn, ensemble, random, with_thickness
from chladni_planning.whole_plan import target_modes
from chladni_specimens.plates import folded_panel

SPREAD = 0.1


@pytest.fixture(scope="module")
def built():
    return structure(folded_panel())


@pytest.fixture(scope="module")
def models(built):
    return ensemble(built, 250.0, SPREAD)


def test_draws_are_the_models_solved_in_full(built, models):
    """Frequencies within 0.2 %, shapes within 1 % of MAC, for draws the basis never saw."""
    modal, _, _ = target_modes(built, PlanSettings(modes=8))
    assert modal.frequency[-1] < 250.0
    frequency, shapes = drawn(models, models.basis, 8, 3, SPREAD, seed=5)
    rng = np.random.default_rng(5)
    for f, phi in zip(frequency, shapes, strict=True):
        x = random(rng, len(models.effects), SPREAD)
        full, _, _ = target_modes(with_thickness(built, models.effects, x), PlanSettings(modes=8))
        np.testing.assert_allclose(f, full.frequency, rtol=2e-3)
        assert np.diag(mac(phi, full.shapes)).min() > 0.99


def test_no_spread_is_the_deck(built, models):
    modal, _, _ = target_modes(built, PlanSettings(modes=8))
    frequency, shapes = drawn(models, models.basis, 8, 2, 0.0, seed=1)
    np.testing.assert_allclose(frequency, np.tile(modal.frequency, (2, 1)), rtol=1e-6)
    assert np.diag(mac(shapes[0], modal.shapes)).min() > 1 - 1e-9


def test_draws_are_seeded_and_clipped(models):
    a, b = (drawn(models, models.basis[:5], 4, 3, SPREAD, seed=3)[0] for _ in range(2))
    np.testing.assert_array_equal(a, b)
    x = random(np.random.default_rng(0), 10_000, SPREAD)
    assert np.abs(x).max() == pytest.approx(2 * SPREAD)
