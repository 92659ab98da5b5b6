"""A deck holds no scatter: what is written is the best without it, the effect as it was found."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.effect import Effect
from chladni.effects.ordinary import ordinary, random_field
from chladni.effects.thickness_distribution import thickness_distribution
from chladni.updating import outcome
from chladni.updating.diagnosis import Diagnosis
from chladni.updating.hypothesis_fit import HypothesisFit, as_written
from chladni.updating.map_fit import fit
from chladni.updating.outcome import FittedScores
from chladni.updating.reduced_model import evaluate


@pytest.fixture(scope="module")
def hypothesis(reduced, responses):
    effect = thickness_distribution(reduced.groups, 0, 1)
    effects = [ordinary(reduced.groups, "E", [0]), random_field(reduced.groups, "t", 0.05), effect]
    start = np.concatenate([[p.mean for p in e.parameters] for e in effects])
    data = responses.over(reduced.model)
    return HypothesisFit(effect, fit(reduced.model, effects, data, None, start), reduced.model)


def test_scatter_is_gone_and_the_effect_stays(hypothesis):
    """E is all that moves."""
    deck = as_written(hypothesis, None)
    assert [e.name for e in deck.fit.effects] == ["part-scale", "thickness-distribution"]
    assert deck.fit.of(deck.effect) == pytest.approx(hypothesis.fit.of(hypothesis.effect), abs=5e-3)


def test_is_the_best_without_scatter(hypothesis):
    """Never worse than leaving the scatter out of what was found."""
    deck = as_written(hypothesis, None)
    own = hypothesis.fit
    x = np.concatenate([own.of(own.effects[0]), own.of(hypothesis.effect)])
    left = evaluate(hypothesis.model, deck.fit.effects, x, False)
    r, _ = hypothesis.data.residual(left, False)
    assert deck.fit.misfit <= r @ r + 1e-6


def test_what_the_held_out_data_refuse_is_not_written(monkeypatch, hypothesis):
    """No name, and nothing of it in the deck that is reported."""
    refused = FittedScores(1.0, 2.0, 1.0)
    monkeypatch.setattr(outcome, "fitted_scores", lambda prepared, diagnosis: (refused, refused))
    far = replace(hypothesis.fit, neg2_log_evidence=hypothesis.neg2_log_evidence + 1e6)
    null = HypothesisFit(Effect(), far, hypothesis.model)
    found = Diagnosis(null, null, null, (hypothesis,), "missing physics")
    prepared = SimpleNamespace(problem=SimpleNamespace(mass_measurement=None, labels=()))
    judged = outcome.judged(prepared, found)
    assert judged.found is None
    assert judged.written is None
    assert "so it is not named" in judged.notes[-1]
