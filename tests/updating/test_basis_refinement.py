"""A basis that lacks what an effect needs is widened before the answer is given."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import Effect
from chladni.errors import ModelError
from chladni.updating import basis_refinement
from chladni.updating.accuracy import Accuracy
from chladni.updating.hypothesis_fit import HypothesisFit
from chladni.updating.map_fit import fit


class Remade(Effect):
    """So strong that the structure is another one."""

    remakes_structure = True


@pytest.mark.parametrize(("effect", "structure"), [(Effect(), "deck"), (Remade(), "remade")])
def test_a_strong_change_is_fitted_on_a_structure_that_has_it(monkeypatch, effect, structure):
    """Not by name or class: the effect says so itself."""
    found = Accuracy(np.array([10.0]), np.array([0.0]), np.zeros((3, 1)))
    remade = SimpleNamespace(structure="remade")
    monkeypatch.setattr(basis_refinement, "_accuracy", lambda problem, hypothesis: found)
    monkeypatch.setattr(basis_refinement, "_on_new_structure", lambda *given: (None, remade))
    prepared = SimpleNamespace(problem=SimpleNamespace())
    begun = SimpleNamespace(effects=(Effect(), effect), structure="deck")
    assert basis_refinement.refined(None, prepared, begun).hypothesis.structure == structure


def a_hypothesis():
    data = SimpleNamespace(rebased=lambda model: model)
    fit = SimpleNamespace(effects=(), x=np.zeros(0), data=data)
    return HypothesisFit(Effect(), fit, "narrow")


@pytest.mark.parametrize(("error", "model"), [(4e-4, "narrow"), (2e-3, "wide")])
def test_is_fitted_again_only_beyond_the_limit(monkeypatch, error, model):
    """0.05 % is the limit: under it the hypothesis stays, above it a wider basis carries it."""
    found = Accuracy(np.array([10.0]), np.array([error]), np.zeros((3, 1)))
    monkeypatch.setattr(basis_refinement, "_accuracy", lambda problem, hypothesis: found)
    monkeypatch.setattr(Accuracy, "refined", lambda self, narrow: "wide")
    monkeypatch.setattr(basis_refinement, "fitted", lambda *given: a_hypothesis().fit)
    prepared = SimpleNamespace(problem=SimpleNamespace(mass_measurement=None))
    done = basis_refinement.refined(None, prepared, a_hypothesis())
    assert done.hypothesis.model == model
    assert f"{error:.2%}" in done.note
    assert bool(done.distrust) == (model == "wide")


def test_numbers_that_are_held_are_seen_over_the_wider_basis_and_stay(monkeypatch, reduced):
    """They are not fitted again; their state is that of the wider model."""
    errors = iter([2e-3, 2e-4])
    monkeypatch.setattr(
        basis_refinement, "_accuracy",
        lambda *given: Accuracy(np.ones(1), np.array([next(errors)]), np.zeros((3, 1))),
    )  # fmt: skip
    monkeypatch.setattr(basis_refinement, "fitted", lambda *given: pytest.fail("fitted again"))
    E = calibration_parameter(reduced.groups, "E", [0])
    fits = fit(reduced.model, [E], Still(), None, np.array([0.1]), max_steps=0)
    wide = reduced.model.with_components()
    monkeypatch.setattr(Accuracy, "refined", lambda self, narrow: wide)
    prepared = SimpleNamespace(problem=SimpleNamespace(mass_measurement=None))
    begun = HypothesisFit(Effect(), fits, reduced.model)
    done = basis_refinement.refined(None, prepared, begun, held=True).hypothesis
    assert done.model is wide
    assert done.fit.x == pytest.approx([0.1])
    assert done.fit.state is not fits.state
    assert done.fit.state.lam[6:] == pytest.approx(fits.state.lam[6:])


class Still:
    """Data that say nothing."""

    def rebased(self, model):
        return self

    def residual(self, state, gradient):
        return np.zeros(1), np.zeros((1, 1))


def test_is_widened_until_it_serves(monkeypatch):
    """Two times too narrow, then wide enough: fitted twice, and trusted."""
    errors = iter([2e-2, 2e-3, 2e-4])
    fits = []
    monkeypatch.setattr(
        basis_refinement, "_accuracy",
        lambda *given: Accuracy(np.ones(1), np.array([next(errors)]), np.zeros((3, 1))),
    )  # fmt: skip
    monkeypatch.setattr(Accuracy, "refined", lambda self, narrow: "wide")
    kept = a_hypothesis().fit
    monkeypatch.setattr(basis_refinement, "fitted", lambda *given: fits.append(given) or kept)
    prepared = SimpleNamespace(problem=SimpleNamespace(mass_measurement=None))
    done = basis_refinement.refined(None, prepared, a_hypothesis())
    assert len(fits) == 2
    assert done.worst == 2e-4
    assert done.distrust == ()


def test_a_basis_that_bears_the_fit_no_longer_is_said_and_not_trusted(monkeypatch):
    """What the narrow basis could not feel may be negative stiffness: no crash, no trust."""
    found = Accuracy(np.array([10.0]), np.array([2e-2]), np.zeros((3, 1)))
    monkeypatch.setattr(basis_refinement, "_accuracy", lambda *given: found)
    monkeypatch.setattr(Accuracy, "refined", lambda self, narrow: "wide")

    def refuse(*given):
        raise ModelError("an effect left negative stiffness")

    monkeypatch.setattr(basis_refinement, "fitted", refuse)
    prepared = SimpleNamespace(problem=SimpleNamespace(mass_measurement=None))
    done = basis_refinement.refined(None, prepared, a_hypothesis())
    assert done.hypothesis.model == "narrow"
    assert "negative stiffness" in done.note
    assert done.distrust
