"""A basis that lacks what an effect needs is widened before the answer is given."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.effect import Effect
from chladni.updating import renewal
from chladni.updating.accuracy import Accuracy


def a_trial():
    fit = SimpleNamespace(effects=(), x=np.zeros(0))
    data = SimpleNamespace(over=lambda model: model)
    return SimpleNamespace(effect=Effect(), fit=fit, model="narrow", data=data)


@pytest.mark.parametrize(("error", "model"), [(4e-4, "narrow"), (2e-3, "wide")])
def test_is_fitted_again_only_beyond_the_limit(monkeypatch, error, model):
    """0.05 % is the limit: under it the trial stays, above it a wider basis carries it."""
    found = Accuracy(np.array([10.0]), np.array([error]), np.zeros((3, 1)))
    monkeypatch.setattr(renewal, "_accuracy", lambda search, trial: found)
    monkeypatch.setattr(Accuracy, "renewed", lambda self, narrow: "wide")
    monkeypatch.setattr(renewal, "fitted", lambda *given: "fit")
    prepared = SimpleNamespace(search=SimpleNamespace(weighing=None))
    trial, said = renewal.renewed(None, prepared, a_trial())
    assert trial.model == model
    assert f"{error:.2%}" in said
