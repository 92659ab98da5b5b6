"""The reduced model is the structure itself, seen through a basis."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from tests.builders.recorded_plate import with_attachments

from chladni.model.ground_springs import with_springs
from chladni.model.point_masses import with_masses
from chladni.reduced.reduced_model import evaluate, reduce
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import folded_panel

TOP = 120.0


@pytest.fixture(scope="module")
def reduced():
    return reduced_problem(folded_panel(h=0.06), TOP, groups=12)


def each(stack):
    """Every matrix of a stack (g, r, r)."""
    return np.array([stack.weighted(w) for w in np.eye(stack.shape[0])])


def alike(got, expected):
    assert_allclose(got, expected, atol=1e-9 * np.abs(expected).max())


def test_nominal_frequencies_are_those_of_the_structure(reduced):
    lam = evaluate(reduced.model, [], np.zeros(0)).lam
    got = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
    assert_allclose(got[6 : len(reduced.frequency)], reduced.frequency[6:], rtol=1e-7)


def test_shells_are_all_there_is_where_there_is_nothing_else(reduced):
    model = reduced.model
    total = each(model.linear[""]).sum(axis=0) + each(model.cubic[""]).sum(axis=0)
    assert np.abs(model.K0).max() < 1e-9 * np.abs(total).max()
    assert np.abs(model.M0).max() < 1e-9 * np.abs(each(model.mass).sum(axis=0)).max()
    assert model.weight0 < 1e-9


def test_groups_and_rest_sum_to_the_structure():
    built = with_masses(folded_panel(h=0.06), (3, 9), 0.05)
    reduced = reduced_problem(with_springs(built, (5,), np.eye(3)[2:], 2e3), TOP, groups=12)
    model, system = reduced.model, reduced.structure.system
    K = each(model.linear[""]).sum(axis=0) + each(model.cubic[""]).sum(axis=0) + model.K0
    alike(K, model.basis.T @ (system.K.real @ model.basis))
    alike(each(model.mass).sum(axis=0) + model.M0, model.basis.T @ (system.M @ model.basis))
    assert_allclose(model.weight0, 0.1)


def test_basis_is_orthonormal_before_and_after_it_grows(reduced):
    rows = reduced.grids.rows[[2, 11]]
    for model in (reduced.model, with_attachments(reduced, rows)):
        one = model.basis.T @ (reduced.structure.system.M @ model.basis)
        assert_allclose(one, np.eye(len(one)), atol=1e-8)


@pytest.mark.parametrize("split", [False, True])
def test_grown_model_is_the_model_of_the_grown_basis(reduced, split):
    model = reduced.model.with_components() if split else reduced.model
    vectors = np.random.default_rng(3).normal(size=(len(model.basis), 4))
    grown = model.extended(vectors)
    direct = reduce(reduced.groups, grown.basis)
    direct = direct.with_components() if split else direct
    assert grown.basis.shape[1] == model.basis.shape[1] + 4
    assert grown.linear.keys() == direct.linear.keys()
    for name in direct.linear:
        alike(each(grown.linear[name]), each(direct.linear[name]))
        alike(each(grown.cubic[name]), each(direct.cubic[name]))
    alike(each(grown.mass), each(direct.mass))
    scale = np.abs(sum(map(each, direct.linear.values())).sum(axis=0)).max()
    assert_allclose(grown.K0, direct.K0, atol=1e-9 * scale)
    assert_allclose(grown.M0, direct.M0, atol=1e-9 * np.abs(each(direct.mass).sum(axis=0)).max())


def test_vectors_it_has_already_leave_it_alone(reduced):
    assert reduced.model.extended(reduced.model.basis[:, 6:9] * 3.0) is reduced.model


def test_components_sum_to_the_whole(reduced):
    split = reduced.model.with_components()
    assert set(split.linear) == {"Q11", "Q22", "Q12", "Q66"}
    alike(sum(map(each, split.linear.values())), each(reduced.model.linear[""]))
    alike(sum(map(each, split.cubic.values())), each(reduced.model.cubic[""]))


def test_an_operator_over_a_longer_basis_is_projected_as_a_whole(reduced):
    """What the shorter basis knows of it and what the new vectors add, twice over."""
    A = sp.csr_array(reduced.structure.system.K.real)
    rng = np.random.default_rng(3)
    once = reduced.model.extended(rng.normal(size=(A.shape[0], 3)))
    twice = once.extended(rng.normal(size=(A.shape[0], 2)))
    for model in (once, twice):
        whole = model.basis.T @ (A @ model.basis)
        assert_allclose(model.operator(A), whole, atol=1e-9 * np.abs(whole).max())
