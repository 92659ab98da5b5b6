"""What every effect promises: exact slopes, harmless when it vanishes, the same physics in full."""

import pickle
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects import discretisation as mesh
from chladni.effects import registry
from chladni.effects import sensor_fault as sensors
from chladni.effects.calibration_parameters import calibration_parameter, random_field
from chladni.effects.crack import LineFinder, crack
from chladni.effects.effect import Effect, Parameter
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.element_groups import element_groups
from chladni.effects.extra_support import ExtraSupport
from chladni.effects.fold_bending import FoldBending
from chladni.effects.local_resonator import LocalResonator
from chladni.effects.mass_patch import MassPatch
from chladni.effects.membrane_prestress import prestress
from chladni.effects.model_families import model_families
from chladni.effects.orthotropic_material import material_axes
from chladni.effects.point_mass import PointMass
from chladni.effects.sensor_mass import sensor_mass
from chladni.effects.stiffness_patch import StiffnessPatch
from chladni.effects.suspension import suspension
from chladni.effects.thickness_distribution import ThicknessDistribution
from chladni.effects.user_parameters import user_parameter
from chladni.effects.weld_patch import RigidPatch, WeldPatch
from chladni.fem.assemble import structure
from chladni.fem.modelled import solved
from chladni.geometry.refine import refined
from chladni.model.assembly import Assembly
from chladni.model.free_parameter import FreeParameter
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_contract.effect_rules import (
    ActingEffect,
    acts,
    exact_slopes,
    idle_at_nominal,
    reports_in_json,
    survives_pickling,
    symmetric_operators,
)
from chladni_contract.family_rules import weighed, written
from chladni_specimens.plates import plate

TOP = 300.0  # Hz; six flexible modes of the plate lie below
FLEXIBLE = slice(6, 12)
CHANNELS = 4
NAMES = ("family", 
    "E", "rho", "t", "scatter", "gain", "orthotropic-material", "point-mass", "extra-support",
    "sensor-mass", "suspension", "thickness-distribution", "sensor-fault", "mesh-error", "jitter",
    "joint-footprint",
    "user_parameter", "local-resonator", "stiffness-patch", "mass-patch", "crack",
    "membrane-prestress", "fold-bending",
)  # fmt: skip


@pytest.fixture(scope="module")
def reduced():
    return reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), TOP)


@pytest.fixture(scope="module")
def cases(reduced):
    groups = reduced.groups
    corners = (1, 7, 57, 63)
    setup = Setup(tuple(((g, 1.0),) for g in corners), (7, 63), float(groups.weight.sum()), TOP)
    where = EffectContext(groups, reduced.grids, reduced.candidates, setup)
    k = reduced.grids.position(25)
    line = LineFinder.of(reduced.structure.assembly).drawn(np.array([20]), (1.7,))[0]
    local = np.array([-1.0, np.log(0.3), 0.1, 0.05, 0.3])
    ortho = material_axes(where)[0]
    pulled = replace(prestress(reduced.structure, 0), critical=np.array([2000.0, 1500.0]))
    over = mesh.mesh_errors(solved(reduced.structure, 2 * TOP), TOP)[0]
    own = mesh.modal_discrepancy(solved(reduced.structure, 2 * TOP), TOP, over)
    waves = random_field(groups, "t", 0.03)
    n = len(waves.parameters)
    means = np.array([p.mean for p in ortho.parameters])
    found = {
        "E": (calibration_parameter(groups, "E", [0]), [0.07], [0]),
        "rho": (calibration_parameter(groups, "rho", [0]), [-0.05], [0]),
        "t": (calibration_parameter(groups, "t", [0]), [0.04], [0]),
        "scatter": (waves, np.cos(1 + np.arange(n)), np.zeros(n)),
        "gain": (sensors.channel_gain(CHANNELS, 0.5), [0.3], [0]),
        "orthotropic-material": (ortho, [0.18, -0.22, 0.1, means[3] + 0.1], means),
        "point-mass": (PointMass.near(where, k), [0.2, 0.1, -0.1], [-20, 0, 0]),
        "extra-support": (
            ExtraSupport.near(where, k), [-1, 0.1, 0, 0.3, -0.2], [-20, 0, 0, 0, 0],
        ),
        "sensor-mass": (sensor_mass(where)[0], [-0.5], [-20]),
        "suspension": (suspension(where)[1], [-0.7], [-20]),
        "thickness-distribution": (
            ThicknessDistribution.on(groups, 0, 9), local, [-40, *local[1:]],
        ),
        "sensor-fault": (sensors.sensor_fault("7+Z", 1, CHANNELS, 1, 0.4), [0.4], [0]),
        "local-resonator": (
            LocalResonator.near(where, k), [0.2, 0.1, -0.1, 0.9], [-20, 0, 0, 5],
        ),
        "stiffness-patch": (StiffnessPatch.on(groups, 0, 9), [-0.6, *local[1:]], [-40, *local[1:]]),
        "mass-patch": (MassPatch.on(groups, 0, 9), [0.4, *local[1:]], [-30, *local[1:]]),
        "crack": (crack(groups, line, 9), [0.5], [-40]),
        "membrane-prestress": (pulled, [0.4, -0.2], [0, 0]),
        "mesh-error": (over, [1.0], [0]),
        "joint-footprint": (
            mesh.JointFootprint(
                over.parameters, over.text, rows=over.rows, omega=over.omega, log=over.log
            ),
            [1.0], [0],
        ),
        "jitter": (own, 0.01 * np.sin(np.arange(len(own.omega)) + 1), np.zeros(len(own.omega))),
    }  # fmt: skip
    ones = (Parameter("k", "-", 0.0, 0.4),)
    found["fold-bending"] = (
        FoldBending(ones, "folds", quantity="bending", functions=np.full((len(groups), 1), 0.5)),
        [0.3],
        [0],
    )
    found["family"] = (model_families(reduced.structure)[0], [0.3], [0])
    number = FreeParameter("E", "E", ("sheet",), 0.1, 0.8, 1.3, positions=(0,))
    found["user_parameter"] = (user_parameter(groups, number), [0.2], [0])
    return {
        name: ActingEffect(
            e,
            np.array(x, float),
            np.array(idle, float),
            reduced.model_for(e, np.array(x, float)),
            FLEXIBLE,
        )
        for name, (e, x, idle) in found.items()
    }


@pytest.fixture(params=NAMES)
def case(request, cases) -> ActingEffect:
    return cases[request.param]


def families(kind: type[Effect] = Effect) -> set[type[Effect]]:
    """All subclasses in chladni.effects that carry a name of their own."""
    below = {c for sub in kind.__subclasses__() for c in {sub, *families(sub)}}
    return {c for c in below if c.__module__.startswith("chladni.effects") and "name" in vars(c)}


def test_every_family_is_held_to_the_contract(cases):
    """Families that need more than a bare plate, and patches about joints, have own files."""
    elsewhere = {family.effect for family in registry.BUILT_IN if family.needs}
    elsewhere |= {WeldPatch, RigidPatch}
    assert families() == {type(case.effect) for case in cases.values()} | elsewhere


RULES = (
    idle_at_nominal, partial(acts, least=1e-3), symmetric_operators, exact_slopes,
    reports_in_json, survives_pickling,
)  # fmt: skip


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: getattr(rule, "__name__", "acts"))
def test_keeps_the_contract(case, rule):
    """A broken rule raises its sentence."""
    rule(case)


def hertz(lam):
    return np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)


def full(assembly: Assembly) -> np.ndarray:
    return normal_modes(structure(assembly).system, band=2 * TOP).frequency[FLEXIBLE]


# no deck holds them
IDLE = {
    "scatter", "gain", "mesh-error", "joint-footprint", "jitter", "family", "sensor-fault",
    "fold-bending",
}  # fmt: skip
WRITTEN = [n for n in NAMES if n not in IDLE]


@pytest.mark.parametrize("name", WRITTEN)
def test_reduced_agrees_with_the_full_structure(name, cases, reduced):
    within = 0.005 if name == "orthotropic-material" else 0.003
    written(cases[name], reduced.structure.assembly, within)


def test_scatter_agrees_with_the_same_thickness_in_every_shell(cases, reduced):
    case, shells = cases["scatter"], reduced.structure.assembly.shells
    factor = np.exp(case.effect.functions @ case.x)[reduced.groups.group]
    thick = replace(shells, thickness=shells.thickness * factor[:, None])
    got = hertz(evaluate(case.model, [case.effect], case.x, False).lam[FLEXIBLE])
    assert_allclose(got, full(replace(reduced.structure.assembly, shells=thick)), rtol=0.003)


def test_whole_mesh_error_leads_to_the_refined_frequencies(cases, reduced):
    case = cases["mesh-error"]
    got = hertz(evaluate(case.model, [case.effect], np.ones(1), False).lam[FLEXIBLE])
    assert_allclose(got, full(refined(reduced.structure.assembly)), rtol=0.003)


def test_modal_discrepancy_moves_every_mode_by_itself(cases):
    case = cases["jitter"]
    state = evaluate(case.model, [case.effect], case.x, False)
    n = len(case.x)
    due = np.sort(case.effect.omega**2 * np.exp(case.x))
    assert_allclose(due, state.lam[6 : 6 + n], rtol=1e-8)


HEAVIER = (
    "rho", "t", "point-mass", "extra-support", "orthotropic-material", "local-resonator",
    "stiffness-patch", "mass-patch", "sensor-mass",
)  # fmt: skip


@pytest.mark.parametrize("name", HEAVIER)
def test_weight_is_what_the_written_structure_weighs(name, cases, reduced):
    weighed(cases[name], reduced.structure.assembly, 1e-9)


def test_pickles(case):
    """Processes hand effects to one another."""
    again = pickle.loads(pickle.dumps(case.effect))
    one = evaluate(case.model, [case.effect], case.x)
    two = evaluate(case.model, [again], case.x)
    assert_allclose(two.lam[FLEXIBLE], one.lam[FLEXIBLE], rtol=1e-12)
    assert again.where() == case.effect.where()


def test_reversed_channel_is_reported_with_its_sign(cases):
    fault = sensors.sensor_fault("7+Z", 1, CHANNELS, -1, 0.0)
    row = fault.reported(np.array([np.log(2.0)]), np.array([0.1]))[0]
    assert_allclose(row.value, -2.0)
    assert row.low <= row.value <= row.high
    assert_allclose(fault.terms(np.zeros(1))[0].value[1], 1j * np.pi / np.log(10))


def test_groups_hold_all_of_the_shells(reduced):
    groups = element_groups(reduced.structure, 16)
    assert len(groups) == 16
    assert_allclose(groups.area.sum(), 0.12)
    assert_allclose(groups.weight.sum(), 7850 * 0.12 * 1.5e-3)
