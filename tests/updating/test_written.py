"""A deck holds no scatter: what is written is the best without it, the effect as it was found."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.effect import Effect
from chladni.effects.ordinary import ordinary, scatter
from chladni.effects.thickness_distribution import thickness_distribution
from chladni.updating import outcome
from chladni.updating.diagnosis import Diagnosis
from chladni.updating.hypothesis_fit import Trial, as_written
from chladni.updating.map_fit import fit
from chladni.updating.outcome import FittedScores
from chladni.updating.reduced_model import evaluate


@pytest.fixture(scope="module")
def trial(bench, responses):
    effect = thickness_distribution(bench.groups, 0, 1)
    effects = [ordinary(bench.groups, "E", [0]), scatter(bench.groups, "t", 0.05), effect]
    start = np.concatenate([[p.mean for p in e.parameters] for e in effects])
    data = responses.over(bench.model)
    return Trial(effect, fit(bench.model, effects, data, None, start), bench.model)


def test_scatter_is_gone_and_the_effect_stays(trial):
    """E is all that moves."""
    deck = as_written(trial, None)
    assert [e.name for e in deck.fit.effects] == ["part-scale", "thickness-distribution"]
    assert deck.fit.of(deck.effect) == pytest.approx(trial.fit.of(trial.effect), abs=5e-3)


def test_is_the_best_without_scatter(trial):
    """Never worse than leaving the scatter out of what was found."""
    deck = as_written(trial, None)
    left = evaluate(
        trial.model, deck.fit.effects,
        np.concatenate([trial.fit.of(trial.fit.effects[0]), trial.fit.of(trial.effect)]), False,
    )  # fmt: skip
    r, _ = trial.data.residual(left, False)
    assert deck.fit.misfit <= r @ r + 1e-6


def test_what_the_held_out_data_refuse_is_not_written(monkeypatch, trial):
    """No name, and nothing of it in the deck that is reported."""
    refused = FittedScores(1.0, 2.0, 1.0)
    monkeypatch.setattr(outcome, "fitted_scores", lambda prepared, diagnosis: (refused, refused))
    null = Trial(Effect(), replace(trial.fit, S=trial.S + 1e6), trial.model)
    found = Diagnosis(null, null, null, (trial,), "missing physics")
    prepared = SimpleNamespace(search=SimpleNamespace(weighing=None, labels=()))
    judged = outcome.judged(prepared, found)
    assert judged.found is None
    assert judged.written is None
    assert "so it is not named" in judged.notes[-1]
