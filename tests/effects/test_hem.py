"""A hem's line, and what the stop of sliding along it may and may not hold."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.contacts import close_places, contacts
from chladni.effects.hems import along_stretch, everywhere, hem_lines
from chladni.fem.assemble import structure
from chladni.fem.energy import rigid_motions
from chladni.reduced.reduced_model import evaluate
from chladni_specimens.forms import FORMS
from chladni_specimens.tailgate.design import TailgateDesign
from chladni_specimens.tailgate.tailgate import tailgate

FLEXIBLE = slice(6, 12)


@pytest.fixture(scope="module")
def line(deck):
    return hem_lines(deck)[0]


def as_rigid(built):
    """Rigid motions at the free dofs (n, 6)."""
    dofs = built.system.dofs
    return rigid_motions(built.assembly)[6 * built.assembly.rows(dofs[:, 0]) + dofs[:, 1] - 1]


def test_the_line_of_a_tailgate_goes_once_round_it():
    """Two strings, on the upper and on the lower outer panel, are one closed line."""
    made = tailgate(TailgateDesign(size=0.030))
    hem = next(one for one in hem_lines(made) if one.name == "hem adhesive")
    assert hem.closed
    assert hem.sheets == ("inner", "outer upper", "outer lower")
    step = np.linalg.norm(np.diff(hem.middle, axis=0), axis=1)
    assert step.max() < 3 * np.median(step)  # it jumps nowhere
    assert_allclose(hem.share.sum(), hem.length, rtol=0.05)
    d = hem.from_place(0.98 * hem.length)
    assert np.abs(d).max() <= hem.length / 2 * (1 + 1e-9)  # the shorter way round
    middle = next(one for one in hem_lines(made) if one.name == "middle adhesive")
    assert not middle.closed


def test_a_layer_is_no_string():
    assert hem_lines(FORMS["bonded plates"].made(1)) == []


def test_rigid_motion_slides_nowhere(deck, reduced, line):
    """Neither in the rows nor in the deck that holds the springs."""
    rows = line.relative_rows(reduced.structure)
    assert np.abs(rows @ as_rigid(reduced.structure)).max() < 1e-12
    f = normal_modes(structure(line.gripped(deck, np.full(len(line), 1e9))).system, 8).frequency
    assert f[5] < 1e-4 * f[6]
    for effect in contacts(reduced.structure)[::40]:
        assert np.abs(effect.rows @ as_rigid(reduced.structure)).max() < 1e-12


def test_sliding_is_the_shear_of_the_sheets(deck, reduced, line):
    """Each sheet moved by itself along x slides by the line's share of x."""
    built = reduced.structure
    upper = np.isin(np.arange(len(deck.points)), deck.shells.nodes[deck.shells.part == 1])
    at = deck.rows(built.system.dofs[:, 0])
    q = ((built.system.dofs[:, 1] == 1) & upper[at]).astype(float)
    assert_allclose(line.relative_rows(built) @ q, line.along[:, 0], atol=1e-9)


@pytest.mark.parametrize("x", [[0.0], [3.0], [1.0, 0.6, 0.2], [3.0, 1.4, -0.3]])
def test_the_reduced_hem_is_that_of_the_deck(deck, reduced, line, x):
    rows, x = line.relative_rows(reduced.structure), np.array(x)
    effect = (everywhere if len(x) == 1 else along_stretch)(line, rows, 1)
    model = reduced.model_for(effect, x)
    got = np.sqrt(evaluate(model, [effect], x, False).lam[FLEXIBLE]) / (2 * np.pi)
    written = normal_modes(structure(effect.apply(deck, x)).system, 14).frequency[FLEXIBLE]
    assert_allclose(got, written, rtol=3e-3)
    assert written[0] > normal_modes(reduced.structure.system, 14).frequency[6]


def test_a_line_costs_its_stiffness_per_length(deck, reduced, line):
    """Sliding u of all of it stores ½ k L u², by the terms and by the bushes that are written."""
    effect, x = everywhere(line, line.relative_rows(reduced.structure), 1), np.array([0.7])
    n = len(line)  # each solid has its own pitch, the length is from first middle to last
    due = effect.reported(x, np.zeros(1))[0].value * line.length * n / (n - 1)
    assert effect.terms(x)[0].coefficient.sum() == pytest.approx(due, rel=0.05)
    bushes = effect.apply(deck, x).bushes.stiffness[len(deck.bushes) :]
    assert bushes.sum() == pytest.approx(due, rel=0.05)


def test_a_stretch_as_long_as_the_line_is_all_of_it(reduced, line):
    rows = line.relative_rows(reduced.structure)
    whole, some = everywhere(line, rows, 1), along_stretch(line, rows, 1)
    far = np.array([1.0, 1.0, 6.0])
    assert_allclose(some.terms(far)[0].coefficient, whole.terms(far[:1])[0].coefficient)


def test_a_stretch_is_told_from_end_to_end(reduced, line):
    effect = along_stretch(line, line.relative_rows(reduced.structure), 1)
    x = np.array([0.0, 1.0, np.log(0.08 / (0.15 * line.length))])
    said = effect.location(x)
    assert said.radius_m == pytest.approx(0.08)
    k = int(np.abs(line.s - line.length / 2).argmin())
    assert_allclose(said.point_m, line.middle[k])
    length = effect.reported(x, np.zeros(3))[1]
    assert (length.name, length.unit) == ("L", "m")
    assert length.value == pytest.approx(0.16)


def test_sheets_are_close_away_from_joints_only(deck):
    """1.2 mm between mid-planes of 1.5 and 1 mm: they touch, wherever nothing holds them."""
    found = close_places(deck)
    assert len(found) > 10
    assert_allclose(np.abs(found.along[:, 2]), 1)
    held = deck.points[[mean.reference for mean in deck.rigid if hasattr(mean, "reference")]]
    away = np.linalg.norm(found.middle[:, None] - held[None], axis=2).min(axis=1)
    assert away.min() > 0.018 - 1e-3
