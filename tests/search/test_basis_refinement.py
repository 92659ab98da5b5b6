"""A basis that lacks what an effect needs is widened before the answer is given."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.effect import Effect, Traits
from chladni.errors import ModelError
from chladni.inference.hypothesis_fit import HypothesisFit
from chladni.reduced.accuracy import Accuracy
from chladni.search import basis_refinement


class Remade(Effect):
    """So strong that the structure is another one."""

    traits = Traits(remakes_structure=True)


@pytest.mark.parametrize(("effect", "structure"), [(Effect(), "deck"), (Remade(), "remade")])
def test_a_strong_change_is_fitted_on_a_structure_that_has_it(monkeypatch, effect, structure):
    """Not by name or class: the effect says so itself."""
    found = Accuracy(np.array([10.0]), np.array([0.0]), np.zeros((3, 1)))
    remade = SimpleNamespace(structure="remade")
    monkeypatch.setattr(basis_refinement, "_accuracy", lambda problem, hypothesis: found)
    monkeypatch.setattr(basis_refinement, "_on_new_structure", lambda *given: (None, remade))
    prepared = SimpleNamespace(question=None, problem=SimpleNamespace())
    begun = SimpleNamespace(effects=(Effect(), effect), structure="deck")
    assert basis_refinement.refined(prepared, begun)[0].structure == structure


PREPARED = SimpleNamespace(problem=SimpleNamespace(mass_measurement=None))
FIT = SimpleNamespace(effects=(), x=np.zeros(0), data=SimpleNamespace(rebased=lambda model: model))
FIT.kept = lambda: FIT
NARROW = HypothesisFit(Effect(), FIT, "narrow")


@pytest.fixture
def errors(monkeypatch):
    """Set the errors that are measured one after the other; the fits made in between."""
    fits = []
    monkeypatch.setattr(Accuracy, "refined", lambda self, narrow: "wide")
    monkeypatch.setattr(basis_refinement, "fitted", lambda *given: fits.append(given) or FIT)

    def measured(*values):
        left = iter(values)
        monkeypatch.setattr(
            basis_refinement, "_accuracy",
            lambda *given: Accuracy(np.ones(1), np.array([next(left)]), np.zeros((3, 1))),
        )  # fmt: skip
        return fits

    return measured


@pytest.mark.parametrize(("error", "model"), [(4e-4, "narrow"), (2e-3, "wide")])
def test_is_fitted_again_only_beyond_the_limit(errors, error, model):
    """0.05 % is the limit: under it the hypothesis stays, above it a wider basis carries it."""
    errors(error, error, error, error)
    done, note, distrust = basis_refinement.refined(PREPARED, NARROW)
    assert done.model == model
    assert f"{100 * error:.2f} %" in note
    assert bool(distrust) == (model == "wide")


@pytest.mark.parametrize("written", [True, False])
def test_the_form_of_a_deck_keeps_the_learned_error(errors, monkeypatch, written):
    """It is fitted as it was written; any other form learns the error of the model again."""
    fits, kept = errors(2e-3, 2e-4), []
    monkeypatch.setattr(basis_refinement, "fit", lambda *given: kept.append(given) or FIT)
    basis_refinement.refined(PREPARED, NARROW, written)
    assert (len(kept), len(fits)) == ((1, 0) if written else (0, 1))


def test_is_widened_until_it_serves(errors):
    """Two times too narrow, then wide enough: fitted twice, and trusted."""
    fits = errors(2e-2, 2e-3, 2e-4)
    _, note, distrust = basis_refinement.refined(PREPARED, NARROW)
    assert len(fits) == 2
    assert "at most 0.02 %" in note
    assert distrust == ()


def test_a_basis_that_bears_the_fit_no_longer_is_said_and_not_trusted(errors, monkeypatch):
    """What the narrow basis could not feel may be negative stiffness: no crash, no trust."""
    errors(2e-2)

    def refuse(*given):
        raise ModelError("an effect left negative stiffness")

    monkeypatch.setattr(basis_refinement, "fitted", refuse)
    done, note, distrust = basis_refinement.refined(PREPARED, NARROW)
    assert done.model == "narrow"
    assert "negative stiffness" in note
    assert distrust
