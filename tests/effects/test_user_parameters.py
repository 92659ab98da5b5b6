"""What a user frees acts on the reduced model as it does on the structure that is written."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import OF_ALLOYS, SPREAD, prior_sd
from chladni.effects.user_parameters import defaults_of_solids, sd_of, user_parameter
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.model.assembly import Beams, Bushes, Solids
from chladni.model.free_parameter import FreeParameter
from chladni.model.ground_springs import with_springs
from chladni.model.point_masses import with_masses
from chladni.model.properties import (
    BeamSection,
    Isotropic,
    Orthotropic,
    Part,
    ShellSection,
    SolidSection,
)
from chladni.reduced.accuracy import products
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate, solid_plate

TOP = 200.0
GLUE = Isotropic(2e9, 0.4, 1200.0, id=2)
STEEL = Isotropic(210e9, 0.3, 7850.0, id=3)


def jointed():
    """A plate with a block of glue and a bar under it, a spring, a bush and a mass."""
    made = plate(0.4, 0.3, 4, 3, 1.5e-3)
    n = len(made.points)
    below = made.points[[0, 4, 5, 1]] - [0, 0, 0.01]
    ids = np.append(made.ids, int(made.ids[-1]) + np.arange(1, 5))
    parts = (
        *made.parts,
        Part(20, "glue", SolidSection(GLUE)),
        Part(30, "bar", BeamSection(STEEL, 1e-4, 1e-9, 1e-9, 0.0, 2e-9, nonstructural=0.3)),
    )
    hexa = Solids(np.array([900]), np.array([[n, n + 1, n + 2, n + 3, 0, 4, 5, 1]]), np.array([1]))
    bar = Beams(
        np.array([901]), np.array([[0, 19]]), np.array([2]), np.array([[0, 0, 1.0]]),
        np.zeros((1, 2, 3)), np.zeros((1, 2, 6), bool),
    )  # fmt: skip
    bush = Bushes(
        np.array([902]), np.array([[3, -1]]), np.eye(3)[None], made.points[[3]],
        np.array([[1e3, 2e3, 3e3, 0, 0, 5.0]]), np.zeros((1, 6)), np.zeros((1, 6)),
    )  # fmt: skip
    made = replace(
        made, ids=ids, points=np.vstack([made.points, below]), parts=parts, solids=(hexa,),
        beams=bar, bushes=bush,
    )  # fmt: skip
    return with_masses(with_springs(made, (7,), np.eye(3)[2:], 4e3), (9,), 0.15)


KINDS = {
    "E of the glue": dict(field="E", positions=(1,)),
    "rho of the glue": dict(field="rho", positions=(1,)),
    "E of glue, bar and sheet": dict(field="E", positions=(0, 1, 2)),
    "rho of bar and sheet": dict(field="rho", positions=(0, 2)),
    "K of the spring": dict(field="K", springs=(0,)),
    "K of spring and bush": dict(field="K", springs=(0,), bushes=(0,)),
    "M": dict(field="M", masses=(0,)),
}


@pytest.fixture(scope="module")
def reduced():
    return reduced_problem(jointed(), TOP, groups=4)


@pytest.mark.parametrize("name", KINDS)
def test_linear_numbers_are_exact(reduced, name):
    """K(x) q, M(x) q and the weight are those of the structure written with e^x."""
    effect = user_parameter(reduced.groups, FreeParameter(name, sd=0.3, **KINDS[name]))
    x = np.array([0.4])
    q = np.random.default_rng(0).normal(size=(len(reduced.model.basis), 2))
    made = effect.apply(jointed(), x)
    system = structure(made).system
    Kq, Mq = products(reduced.model, [effect], x, q)
    before = structure(jointed()).system
    moved = np.abs((system.K - before.K) @ q).max() + np.abs((system.M - before.M) @ q).max()
    assert moved > 0
    assert_allclose(Kq, system.K @ q, atol=1e-9 * np.abs(system.K @ q).max())
    assert_allclose(Mq, system.M @ q, atol=1e-9 * np.abs(system.M @ q).max())
    weight = evaluate(reduced.model, [effect], x, False).weight
    assert_allclose(weight, mass_properties(made)[0], rtol=1e-9)


@pytest.mark.parametrize("part", [0, 1])
def test_what_is_left_out_of_poissons_ratio_is_of_third_order(reduced, part):
    """Halving the change makes the error of K(nu) q eight times smaller."""
    effect = user_parameter(reduced.groups, FreeParameter("nu", "nu", positions=(part,)))
    q = np.random.default_rng(1).normal(size=(len(reduced.model.basis), 2))

    def error(x):
        due = structure(effect.apply(jointed(), x)).system.K @ q
        return np.abs(products(reduced.model, [effect], x, q)[0] - due).max()

    assert_allclose(error(np.array([0.01])) / error(np.array([0.005])), 8, rtol=0.1)
    change = np.abs((structure(effect.apply(jointed(), np.array([0.02]))).system.K
                     - structure(jointed()).system.K) @ q).max()  # fmt: skip
    assert error(np.array([0.02])) < 0.01 * change


def test_bounds_are_never_passed_and_do_not_bend_the_deck(reduced):
    """y' = 1 at the deck's value, y within (ln low, ln high) wherever x is."""
    effect = user_parameter(
        reduced.groups, FreeParameter("E", "E", low=0.8, high=1.1, positions=(0,))
    )
    assert effect.y(np.zeros(1)) == (np.zeros(1), 1.0)
    E = STEEL.E
    for x, bound in ((9.0, 1.1), (-9.0, 0.8)):
        row = effect.reported(np.array([x]), np.array([0.1]))[0]
        assert_allclose(row.value, bound * E, rtol=1e-6)
        assert effect.on_bound(np.array([x]))
    here = effect.reported(np.array([0.01]), np.array([0.001]))[0]
    assert not effect.on_bound(np.array([0.01]))
    assert_allclose(here.value, E * np.exp(0.01), rtol=1e-3)


def test_one_value_is_given_as_it_is_and_several_as_a_factor(reduced):
    one = user_parameter(reduced.groups, FreeParameter("E", "E", positions=(1,)))
    both = user_parameter(reduced.groups, FreeParameter("E", "E", positions=(0, 1)))
    assert (one.parameters[0].scale, one.parameters[0].unit) == (GLUE.E, "Pa")
    assert (both.parameters[0].scale, both.parameters[0].unit) == (1.0, "of the deck's")


def test_pickles(reduced):
    effect = user_parameter(reduced.groups, FreeParameter("K", "K", springs=(0,), bushes=(0,)))
    again = pickle.loads(pickle.dumps(effect))
    made = again.apply(jointed(), np.array([0.5]))
    assert_allclose(made.bushes.stiffness, np.exp(0.5) * jointed().bushes.stiffness)


def test_of_solids_their_materials_are_free():
    found = defaults_of_solids(jointed())
    assert [(p.field, p.positions) for p in found] == [("E", (1,)), ("rho", (1,))]
    assert {p.sd for p in found} == {None}


@pytest.mark.parametrize(("material", "sd"), [
    (STEEL, [0.03, 0.005]), (Isotropic(112e9, 0.34, 4430.0), [None, None]),
])  # fmt: skip
def test_a_deck_of_solids_has_all_dimensions_so_its_alloy_alone_scatters(material, sd):
    made = solid_plate(0.1, 0.1, 0.01, 2, 2, material)
    assert [p.sd for p in defaults_of_solids(made)] == sd


SHEET_OF = {
    "steel": Isotropic(210e9, 0.3, 7850.0),
    "aluminium": Isotropic(70e9, 0.33, 2700.0),
    "glass": Isotropic(70e9, 0.22, 2500.0),
    "titanium": Isotropic(112e9, 0.34, 4430.0),
    "steel in other units": Isotropic(210e3, 0.3, 7.85e-9),
    "laminate": Orthotropic(210e9, 210e9, 0.3, 80e9, rho=7850.0),
}


@pytest.mark.parametrize("name", SHEET_OF)
def test_a_class_of_alloys_is_known_by_its_modulus_and_density(name):
    part = Part(1, name, ShellSection(1e-3, SHEET_OF[name], SHEET_OF[name]))
    due = OF_ALLOYS if name in ("steel", "aluminium") else SPREAD
    for quantity in ("E", "rho", "t"):
        assert prior_sd([part], quantity, [0]) == due[quantity]
        free = FreeParameter(quantity, quantity, positions=(0,))
        assert sd_of(replace(plate(1.0, 1.0, 1, 1, 1e-3), parts=(part,)), free) == due[quantity]
        assert (
            sd_of(replace(plate(1.0, 1.0, 1, 1, 1e-3), parts=(part,)), replace(free, sd=0.02))
            == 0.02
        )


def test_numbers_of_a_solid_bar_also_stand_for_its_section():
    """A density that it shares with a sheet is that of the material."""
    sheet = Part(1, "skin", ShellSection(1e-3, STEEL, STEEL))
    bar = Part(2, "bar", BeamSection(STEEL, 4e-5, 1e-9, 1e-11, 0.0, 5e-11))
    assert prior_sd([sheet, bar], "rho", [1]) == SPREAD["rho"]
    assert prior_sd([sheet, bar], "rho", [0, 1]) == OF_ALLOYS["rho"]
