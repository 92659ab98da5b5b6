"""A patch about joints is what the deck then holds, smooth in its radius, and nothing at first."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.weld_patch import PATCHES, bell, spiders, weld_patch
from chladni.errors import ModelError
from chladni.fem.assemble import structure
from chladni.fem.modelled import modelled
from chladni.model.free_parameter import FreeParameter
from chladni.reduced.accuracy import accuracy, products
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.search.preparation import carrying
from chladni_specimens.plates import plate

FREE = {field: FreeParameter("patch", field) for field in PATCHES}


@pytest.fixture(scope="module", params=PATCHES)
def patch(reduced, request):
    return weld_patch(reduced.groups, FREE[request.param])


def test_shells_that_touch_a_weld_are_its_innermost_ring(reduced):
    """The three welds of the two plates lie at x = 0.05 m; the screw and the bead are none."""
    assembly, patch = reduced.structure.assembly, weld_patch(reduced.groups, FREE["weld-patch"])
    middle = assembly.points[assembly.shells.nodes].mean(axis=1)
    welds = np.array([(0.05, y) for y in (0.06, 0.15, 0.24)])
    away = np.linalg.norm(middle[:, None, :2] - welds, axis=2).min(axis=1)
    assert "3 welds" in patch.text
    assert set(patch.parts) == {"lower", "upper"}
    assert (patch.ring[away < 0.02] == 0).all()
    assert (patch.ring[away > 0.15] < 0).all()


def test_a_spider_holds_the_sheets_about_its_feet(reduced):
    """The screw at (0.2, 0.05) m spreads over both plates; welds and bead have no spiders."""
    assembly, patch = reduced.structure.assembly, weld_patch(reduced.groups, FREE["rigid-patch"])
    assert "2 spiders" in patch.text
    assert set(patch.parts) == {"lower", "upper"}
    feet = np.concatenate([rows for _, rows in spiders(assembly)])
    touching = np.isin(assembly.shells.nodes, feet).any(axis=1)
    assert ((patch.ring == 0) == touching).all()
    middle = assembly.points[assembly.shells.nodes].mean(axis=1)
    away = np.linalg.norm(middle[:, :2] - (0.2, 0.05), axis=1)
    assert (patch.ring[away > 0.2] < 0).all()


def test_it_does_nothing_at_the_deck_s_values(patch):
    assert all(term.coefficient == 0 for term in patch.terms(np.zeros(2)))
    assert all(term.coefficient == 0 for term in patch.terms(np.array([0.0, 0.5])))


@pytest.mark.parametrize("x", [(0.4, 0.0), (-0.5, 0.6), (0.3, -0.8)])
def test_reduced_operators_are_those_of_the_written_deck(reduced, patch, x):
    x = np.array(x)
    q = np.random.default_rng(0).normal(size=(reduced.model.vectors.shape[0], 2))
    full = structure(patch.apply(reduced.structure.assembly, x)).system.elastic
    Kq, _ = products(reduced.model, [patch], x, q)
    moved = np.abs((full - reduced.structure.system.elastic) @ q).max()
    assert_allclose(Kq, full @ q, atol=1e-7 * moved)


def test_slopes_are_exact(patch):
    """The remainder of Taylor's series falls with the square of the step."""
    x, along = np.array([0.3, -0.2]), np.array([0.7, -1.1])

    def coefficients(x):
        return np.array([t.coefficient for t in patch.terms(x)])

    slope = np.array([t.gradient for t in patch.terms(x)]) @ along
    left = [
        np.abs(coefficients(x + h * along) - coefficients(x) - h * slope).max()
        for h in (1e-2, 5e-3, 2.5e-3)
    ]
    assert_allclose(np.log2(np.array(left[:-1]) / left[1:]), 2, atol=0.1)


def test_the_bell_reaches_all_or_spreads_its_area_over_a_shell():
    """A wide bell is 1; one far smaller than the shell it is in has the share 2π R² of its area."""
    d, v = np.array([0.0, 0.02]), np.array([1e-4, 1e-4])
    assert_allclose(bell(50.0, d, v)[0], 1, rtol=1e-5)
    assert_allclose(bell(1e-6, d, v)[0], 1e-12 / v * np.exp(-(d**2) / (2 * v)), rtol=1e-6)


def test_frequencies_are_those_of_the_full_model_all_over_the_prior(reduced, patch):
    """0.1 % at random points, or the reduced model says itself that it is farther off."""
    ready = carrying(reduced, [patch])
    rng = np.random.default_rng(1)
    sd = np.array([p.sd for p in patch.parameters])
    for _ in range(3):
        x = 2 * sd * rng.uniform(-1, 1, 2)
        lam = evaluate(ready.model, [patch], x, False).lam
        full = modelled(patch.apply(reduced.structure.assembly, x), reduced.f_max).modes.frequency
        full = full[(full > 0.02 * reduced.f_max) & (full < reduced.f_max)]
        f = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
        f = f[f > 0.02 * reduced.f_max][: len(full)]
        said = accuracy(reduced, ready.model, [patch], x, reduced.f_max).worst
        assert np.abs(f / full - 1).max() < max(1e-3, 2 * said)


@pytest.mark.parametrize(("field", "what"), [(PATCHES[0], "welds of"), (PATCHES[1], "spiders of")])
def test_a_deck_without_such_joints_is_refused(field, what):
    made = reduced_problem(plate(0.4, 0.3, 4, 3, 1.5e-3), 100.0)
    with pytest.raises(ModelError, match=f"no shells that touch {what}"):
        weld_patch(made.groups, FREE[field])
