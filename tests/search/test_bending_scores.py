"""Families that try the same lines of shells share their scores."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.inference.scan import baseline, bending_slopes, direction_scores
from chladni.search import candidates
from chladni.search.candidates import UpdatingContext


@pytest.fixture
def context(reduced, responses):
    effects = [calibration_parameter(reduced.groups, "E", [0])]
    made = UpdatingContext(SimpleNamespace(reduced=reduced, data=responses), SimpleNamespace())
    made.__dict__["baselines"] = tuple(
        baseline(reduced.model, effects, responses, None, np.array([x])) for x in (0.0, 0.05)
    )
    return made


def test_each_set_is_scored_once_about_each_base(context, reduced, responses, monkeypatch):
    asked = []

    def counted(base, model, data, sets):
        asked.extend(sets)
        return bending_slopes(base, model, data, sets)

    monkeypatch.setattr(candidates.scans, "bending_slopes", counted)
    sets = [np.array([3, 4, 5]), np.array([10, 11]), np.array([20, 21])]
    for about, base in enumerate(context.baselines):
        due = direction_scores(base, bending_slopes(base, reduced.model, responses, sets))
        context.bending_scores(about, sets[:2])
        for order in ([2, 0, 1], [1, 1], []):
            found = context.bending_scores(about, [sets[k] for k in order])
            assert_allclose(found, np.array(due)[:, order], rtol=1e-6)
    assert len(asked) == 2 * len(sets)
