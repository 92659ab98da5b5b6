"""A membrane force as an effect: how far it may go, and what is written of it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.membrane_prestress import (
    MOST_OF_BUCKLING,
    axes_of,
    buckling,
    critical_force,
    prestress,
    prestressed,
    tensors,
)
from chladni.errors import ModelError
from chladni.fem.assemble import structure
from chladni.model.assembly import Scalars
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

TOP = 300.0


@pytest.fixture(scope="module")
def sheet():
    return plate(0.4, 0.3, 8, 6, 1e-3)


@pytest.fixture(scope="module")
def reduced(sheet):
    return reduced_problem(sheet, TOP)


def frequencies(assembly):
    return normal_modes(structure(assembly).system, 12).frequency


def test_along_is_the_longest_way(sheet):
    along, across = axes_of(sheet, 0)
    assert_allclose(np.abs(along), [1, 0, 0], atol=1e-12)
    assert_allclose(np.abs(across), [0, 1, 0], atol=1e-12)


def test_axes_lie_in_the_sheets_of_two_flanges_that_face_each_other():
    """0.4 x 0.03 m each, 0.3 m apart: along them, and up; not from one to the other."""
    flange = plate(0.4, 0.03, 8, 2, 1e-3)
    x, y, _ = flange.points.T
    one = np.column_stack([x, 0 * x, y])
    n = len(x)
    shells = {k: np.concatenate([v, v]) for k, v in vars(flange.shells).items() if k != "nodes"}
    nodes = np.concatenate([flange.shells.nodes, flange.shells.nodes + n])
    two = replace(
        flange, ids=np.arange(1, 2 * n + 1), points=np.vstack([one, one + np.array([0, 0.3, 0])]),
        shells=replace(flange.shells, **shells, nodes=nodes),
    )  # fmt: skip
    assert_allclose(np.abs(axes_of(two, 0)), [[1, 0, 0], [0, 0, 1]], atol=1e-9)


def test_buckling_of_two_springs():
    """λ + N κ = 0 of each; a rigid motion and a mode the force does not touch set no bound."""
    lam, kappa = np.array([0.0, 100.0, 300.0, 900.0]), np.diag([0.0, 1.0, -6.0, 0.0])
    assert buckling(lam, kappa) == pytest.approx(50.0)
    assert buckling(lam, 0 * kappa) == np.inf


def test_no_value_buckles_the_sheet_and_its_bound_is_that_near(reduced, sheet):
    """x → ±∞ alone: a λ at about 0.3 of what it was; both at once, whatever signs: none below 0."""
    bare = prestress(reduced.structure, 0)
    state = evaluate(reduced.model, [bare], np.zeros(2))
    phi = state.vectors
    critical = np.array([buckling(state.lam, K) for K in state.dK.between(phi, phi)])
    effect = replace(bare, critical=critical)
    for k, tensor in enumerate(tensors(sheet, 0)):
        assert critical[k] == pytest.approx(critical_force(sheet, 0, tensor), rel=0.02)
        assert effect.force(1e3 * np.eye(2)[k])[k] == pytest.approx(
            MOST_OF_BUCKLING * critical[k], rel=1e-5
        )
    model = reduced.model_for(effect, np.zeros(2))

    def lowest(x):
        return evaluate(model, [effect], np.array(x, float), False).lam[6]

    alone = [min(lowest([-99 * a, -99 * b]), lowest([99 * a, 99 * b])) for a, b in np.eye(2)]
    assert min(alone) / state.lam[6] < 1 - MOST_OF_BUCKLING + 0.15
    assert min(lowest([99 * a, 99 * b]) for a in (-1, 1) for b in (-1, 1)) > 0


def test_a_pull_stiffens_a_press_softens_and_both_leave_it_free(sheet):
    N = 0.5 * critical_force(sheet, 0, tensor := np.eye(3))
    pressed, plain, pulled = (frequencies(prestressed(sheet, 0, tensor, f)) for f in (-N, 0, N))
    assert np.all(pulled[6:] > plain[6:])
    assert np.all(pressed[6:] < plain[6:])
    assert max(pulled[:6].max(), pressed[:6].max()) < 0.01 * plain[6]


def test_one_spring_a_pair_of_motions_holds_the_forces_both_ways(sheet):
    """K is linear in springs: those between the same two motions are one of their sum."""
    effect, x = prestress(structure(sheet), 0), np.array([0.5, 0.2])
    both, one_by_one = effect.apply(sheet, x), sheet
    for tensor, N in zip(effect.tensors, effect.force(x), strict=True):
        one_by_one = prestressed(one_by_one, 0, tensor, float(N))
    K, due = (structure(made).system.K for made in (both, one_by_one))
    assert abs(K - due).max() < 1e-12 * abs(due).max()
    s = both.springs
    ends = {
        frozenset(zip(n, c, strict=True))
        for n, c in zip(s.nodes.tolist(), s.component.tolist(), strict=True)
    }
    assert len(ends) == len(s) < len(one_by_one.springs)


def test_springs_of_a_deck_are_not_summed_with_those_of_a_force(sheet):
    own = Scalars(np.array([900, 901]), np.array([[0, -1]] * 2), np.array([[3, 3]] * 2),
                  np.array([5.0, 7.0]), np.zeros(2))  # fmt: skip
    held = replace(sheet, springs=own)
    made = prestress(structure(held), 0).apply(held, np.array([0.5, 0.2])).springs
    assert made.ids[:2].tolist() == [900, 901]
    assert made.value[:2].tolist() == [5.0, 7.0]


def test_only_its_part_is_pulled():
    two = plate(0.4, 0.3, 8, 6, 1e-3)
    part = (two.points[two.shells.nodes].mean(axis=1)[:, 0] > 0.2).astype(int)
    shells = replace(two.shells, part=part)
    two = replace(two, parts=(*two.parts, replace(two.parts[0], id=2, name="right")), shells=shells)
    made = prestressed(two, 1, np.eye(3), 500.0)
    touched = made.springs.nodes[made.springs.nodes[:, 1] >= 0].ravel()
    on_part = np.unique(shells.nodes[part == 1])
    assert set(touched) - set(range(len(two.points), len(made.points))) == set(on_part)


def test_grids_that_count_in_different_frames_are_refused(sheet):
    axes = np.tile(np.eye(3), (len(sheet.points), 1, 1))
    axes[3] = axes[3][[1, 2, 0]]
    with pytest.raises(ModelError, match="different displacement frames"):
        prestressed(replace(sheet, axes=axes), 0, np.eye(3), 100.0)
    turned = np.tile(np.eye(3)[[1, 2, 0]], (len(sheet.points), 1, 1))
    same = prestressed(replace(sheet, axes=turned), 0, np.eye(3), 1000.0)
    due = frequencies(prestressed(sheet, 0, np.eye(3), 1000.0))
    assert_allclose(frequencies(same)[6:], due[6:], rtol=1e-9)
