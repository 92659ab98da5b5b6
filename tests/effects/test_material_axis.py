"""An orthotropic sheet responds in the reduced model as its deck does, whatever its axis."""

import numpy as np
import pytest
from tests.builders.decks import flat_sheet

from chladni.effects.orthotropy import _extents, orthotropic
from chladni.fem.modelled import modelled
from chladni.io.nastran import assembly, read_deck
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.units import UNITS


@pytest.mark.parametrize("angle", [0.0, 55.0, 90.0])
def test_the_reduced_model_has_the_axis_of_the_deck(tmp_path, angle):
    """Isotropic in the deck, E1 twice E2 along a turned axis: both give the same frequencies."""
    cards = ["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,25.+9,,.3,2900.", "PSHELL,1,1,.0013,1,,1"]
    cards += [*flat_sheet(10, 8, 0.25, 0.2), "ENDDATA"]
    (tmp_path / "deck.bdf").write_text("\n".join(cards) + "\n")
    made = assembly(read_deck(tmp_path / "deck.bdf"), UNITS["SI"])
    problem = reduced_problem(modelled(made, 3000.0), 400.0, groups=20)
    axis = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    effect = orthotropic(problem.groups, (0,), axis)
    x = np.array([0.35, -0.35, -0.3, effect.parameters[3].mean])
    state = evaluate(problem.model_for(effect, x), [effect], x, False)
    f = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
    due = modelled(effect.apply(made, x), 400.0).modes.frequency
    np.testing.assert_allclose(f[f > 1][:6], due[due > 1][:6], rtol=0.01)


def test_a_square_has_the_axes_of_the_frame(tmp_path):
    """Its extents are equal: their principal directions are those of rounding errors."""
    cards = ["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,25.+9,,.3,2900.", "PSHELL,1,1,.0013,1,,1"]
    cards += [*flat_sheet(8, 8, 0.25, 0.25), "ENDDATA"]
    (tmp_path / "deck.bdf").write_text("\n".join(cards) + "\n")
    made = assembly(read_deck(tmp_path / "deck.bdf"), UNITS["SI"])
    groups = reduced_problem(modelled(made, 1000.0), 200.0, groups=20).groups
    assert np.array_equal(_extents(groups, groups.sheet)[0], [1.0, 0.0, 0.0])
