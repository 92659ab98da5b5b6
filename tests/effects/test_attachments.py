"""What is attached is sought at the best places, and at the best for what the scales ask for."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from chladni.effects import masses
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.masses import SHARE, TRIED
from chladni.effects.search_context import SearchContext
from chladni.effects.springs import ExtraSupport
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import folded_panel, plate


@pytest.fixture(scope="module")
def where():
    reduced = reduced_problem(plate(0.4, 0.3, 16, 12, 1.5e-3), 250.0)
    setup = Setup((), (), float(reduced.groups.weight.sum()), 200.0)
    return EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)


def proposed(where, more):
    """Masses that are followed where a light one explains most at the left, a heavy one right."""
    heavy = 1.5 * SHARE * where.setup.weight

    def point_scores(about, matrix, strengths, places=None):
        assert matrix == "M"
        x = (where.places if places is None else places).point[:, 0]
        return np.where(np.asarray(strengths) < heavy, x[:, None], 1.0 - x[:, None])

    context = SimpleNamespace(
        where=where,
        bases=(np.zeros(1), np.ones(1)),
        weighs_more=more,
        scan=SimpleNamespace(point_scores=point_scores),
    )
    return masses.masses(cast(SearchContext, context))


def test_the_mass_that_the_scales_ask_for_is_sought_by_itself(where):
    more = 2.0 * SHARE * where.setup.weight
    found = proposed(where, more)
    asked = [c for c in found if c.effect.parameters[0].value(c.start[0]) == pytest.approx(more)]
    assert [c.base[0] for c in asked] == [0.0, 1.0]  # about the nominal model and the calibrated
    assert all(c.effect.at(c.start)[0] > 0.35 for c in asked)
    others = [c for c in found if c not in asked]
    assert len(others) == 4
    assert min(c.effect.at(c.start)[0] for c in others) < 0.05


@pytest.mark.parametrize("share", [0.0, -2.0, 0.5 * TRIED.min()])
def test_none_is_asked_for_that_is_less_than_the_least_tried(where, share):
    assert len(proposed(where, share * SHARE * where.setup.weight)) == 4


@pytest.mark.parametrize("z", [-0.01, -0.001])
def test_a_place_between_a_fold_and_the_next_grids_can_be_reached(z):
    """Both faces end at the fold: next to it a place moves as a rigid body does there."""
    panel = folded_panel(0.4, 0.3, 0.04, 0.0, 0.02, 1e-3)
    reduced = reduced_problem(panel, 250.0)
    setup = Setup((), (), float(reduced.groups.weight.sum()), 200.0)
    where = EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)
    k = int(np.argmin(np.linalg.norm(where.grids.point - [0.2, 0.0, -0.02], axis=1)))
    support = ExtraSupport.near(where, k)
    patch = support.patch
    at = patch.plane @ (np.array([0.21, 0.0, z]) - patch.origin)
    x = np.array([0.0, *(at / patch.size), 0.0, 0.0])
    np.testing.assert_allclose(support.at(x), [0.21, 0.0, z], atol=1e-9)
    weights = patch.weights(at)  # they reproduce motions that are linear in the plane
    np.testing.assert_allclose([weights.sum(), *(weights @ patch.flat)], [1.0, *at], atol=1e-6)
    heights = panel.points[panel.rows(patch.grids), 2]
    assert heights.max() == pytest.approx(0.0)  # the fold itself, and no grid of the other face
    assert np.ptp(panel.points[panel.rows(patch.grids), 1]) == pytest.approx(0.0)
