"""Starts of an effect where poles alone are known: as many points as its prior has pairings."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.orthotropy import material_axes
from chladni.search import pole_starts
from chladni_contract.effect_ground import GROUNDS


@pytest.fixture(scope="module")
def problem():
    return GROUNDS["plate"]().by_poles.problem


@pytest.fixture(scope="module")
def rolled(problem):
    """Orthotropy of the steel sheet."""
    return material_axes(problem.where)[0]


def wider(effect, times):
    unknown = tuple(replace(p, sd=times * p.sd) for p in effect.parameters)
    return replace(effect, parameters=unknown)


def test_a_prior_has_one_cell_until_it_moves_modes_by_more_than_their_spread(problem, rolled):
    """Beyond, cells grow with every direction of the prior that moves them."""

    def cells(effect):
        model = problem.reduced.model.split_for(
            effect, np.array([p.mean for p in rolled.parameters])
        )
        return pole_starts.cells(problem, model, [*problem.without(effect), effect])

    assert cells(wider(rolled, 0.2)) == 1.0
    once, twice = (cells(wider(rolled, times)) for times in (20.0, 40.0))
    assert twice == pytest.approx(once * 2 ** len(rolled.parameters), rel=0.6)


def test_a_narrow_prior_has_its_optimum_with_few_points(problem, rolled, monkeypatch):
    """As many as ever find no better one."""
    tried = []
    drawn = pole_starts.draws

    def counted(effect, count):
        tried.append(count)
        return drawn(effect, count)

    monkeypatch.setattr(pole_starts, "draws", counted)
    few = pole_starts.global_starts(problem, rolled)
    monkeypatch.setattr(pole_starts, "OF_A_CELL", 512)
    many = pole_starts.global_starts(problem, rolled)
    assert tried[0] < 0.25 * tried[1] <= pole_starts.DRAWS
    sd = np.array([p.sd for p in rolled.parameters])
    assert_allclose(few[0] / sd, many[0] / sd, atol=0.1)
