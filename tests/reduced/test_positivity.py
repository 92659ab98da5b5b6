"""No parameter of any effect or nuisance takes stiffness below zero, whatever all others are."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
from tests.builders.structures import held_along_x0

from chladni.effects.calibration_parameters import defaults
from chladni.effects.effect import Effect, Parameter
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.family import Family
from chladni.effects.joint_stiffness import joint_families, joint_nuisances
from chladni.effects.joints import fasteners
from chladni.effects.registry import BUILT_IN
from chladni.effects.rigid_ties import on_firm_springs
from chladni.effects.search_context import Candidate
from chladni.effects.welds import WeldCompliance, of_one
from chladni.fem.modelled import modelled
from chladni.model.assembly import Assembly
from chladni.reduced.real_modes import flexible
from chladni.reduced.reduced_model import Reduced, evaluate
from chladni.reduced.reduced_problem import ReducedProblem, reduced_problem
from chladni.search.base_effects import mesh_hidden, nuisances
from chladni.search.fastener_scan import loosened_rows, singles
from chladni.search.preparation import carrying
from chladni_specimens import (
    TailgateDesign,
    folded_panel,
    jointed_plates,
    plate,
    tailgate,
    tied_plates,
)

REACH = 3.0  # standard deviations of every parameter at once
DRAWS = 6  # of random signs for each effect, besides both corners


@dataclass(frozen=True, eq=False)
class Catalogue:
    """The services that families ask a search for, without a recording: every score is nought."""

    reduced: ReducedProblem
    f_max: float

    scan = None
    tells_places = False
    labels: tuple[str, ...] = ("1:+Z",)
    weighs_more = 0.0

    @cached_property
    def where(self) -> EffectContext:
        r = self.reduced
        grids = tuple(r.grids.grids[[0, len(r.grids) // 2, -1]].tolist())
        weight = float(r.groups.weight.sum())
        setup = Setup(tuple(((g, 1.0),) for g in grids), grids[:2], weight, self.f_max,
                      ((((grids[0], 1.0),), (0.0, 0.0, 1.0)),))  # fmt: skip
        shapes = r.shapes
        return EffectContext(
            r.groups, r.grids, r.candidates, setup, r.frequency[: shapes.shape[1]], shapes
        )

    @property
    def bases(self) -> tuple[np.ndarray, ...]:
        return (np.zeros(0),)

    @property
    def idle(self) -> float:
        return np.inf

    @cached_property
    def fasteners(self):
        return tuple((one.joint, one.share) for one in singles(loosened_rows(self.reduced)))

    def scores(self, effect: Effect, starts, extended: bool = False, about: int = -1):
        return np.zeros((1, len(starts)))

    def own(self, effect: Effect, start: np.ndarray):
        return 0.0, start

    def modal_operators(self, effect: Effect, x: np.ndarray):
        lam = evaluate(self.reduced.model, [], np.zeros(0), False)
        terms = [t for t in effect.terms(x) if hasattr(t, "operator")]
        project = self.reduced.model.operator
        return lam.lam, np.array([lam.phi.T @ project(t.operator) @ lam.phi for t in terms])

    def optima(self, effect: Effect) -> list[np.ndarray]:
        return effect.starts()[:1]

    def of(self, family: Family) -> list[Effect]:
        """An effect of a family, at one of its places."""
        found: list[Candidate] = family.proposed(self)
        return [c.effect for c in found[:1]]


@dataclass(frozen=True, eq=False)
class Ground:
    """A structure with everything that is free in every fit."""

    reduced: ReducedProblem
    base: tuple[Effect, ...]
    catalogue: Catalogue


def ground(assembly: Assembly, f_max: float) -> Ground:
    model = modelled(assembly, 3 * f_max)
    mesh = mesh_hidden(model, f_max)
    reduced = reduced_problem(model, f_max)
    free = defaults(reduced.groups)
    reduced = carrying(reduced, [*free, *joint_nuisances(model.structure)])
    every = (*free, *nuisances(reduced, model, mesh))
    return Ground(reduced, every, Catalogue(reduced, f_max))


STRUCTURES = {
    "panel": lambda: ground(folded_panel(0.05), 200.0),
    "jointed plates": lambda: ground(on_firm_springs(tied_plates()), 300.0),
    "clamped plate": lambda: ground(held_along_x0(plate(0.3, 0.2, 6, 4, 1.5e-3)), 300.0),
    "tailgate": lambda: ground(tailgate(TailgateDesign(size=0.030)), 100.0),
}


@pytest.fixture(
    scope="module",
    params=[pytest.param(n, marks=[pytest.mark.slow] * (n == "tailgate")) for n in STRUCTURES],
)
def structure(request) -> Ground:
    return STRUCTURES[request.param]()


def extremes(unknown: list[Parameter], own: int) -> Iterator[np.ndarray]:
    """Corners of the prior of all parameters: the last ``own`` of them at either end, and random.

    An effect whose nominal is beyond its prior is tried at each of its starts as well.
    """
    rng = np.random.default_rng(5)
    mean, sd = (np.array([getattr(p, q) for p in unknown]) for q in ("mean", "sd"))
    signs = [np.full(len(sd), s) for s in (-1.0, 1.0)]
    signs += [rng.choice([-1.0, 1.0], len(sd)) for _ in range(DRAWS)]
    for sign in signs:
        for end in (-1.0, 1.0):
            sign = sign.copy()
            if own:
                sign[-own:] *= end
            yield mean + REACH * sd * sign


def softest(model: Reduced, effects: tuple[Effect, ...], x: np.ndarray) -> float:
    """The lowest ω² over the median one; :class:`ModelError` where it is clearly negative."""
    lam = evaluate(model, effects, x, False).lam
    return float(lam[0] / np.median(lam[flexible(lam)]))


def test_nuisances_and_calibration_parameters_take_none_away(structure):
    unknown = [p for e in structure.base for p in e.parameters]
    for x in extremes(unknown, 0):
        assert softest(structure.reduced.model, structure.base, x) > -1e-6


@pytest.mark.parametrize("family", BUILT_IN, ids=lambda family: family.name)
def test_no_effect_takes_stiffness_away_that_the_others_left(structure, family):
    for effect in structure.catalogue.of(family):
        model = structure.reduced.model_for(effect, effect.starts()[0])
        kept = tuple(e for e in structure.base if e.text not in effect.replaces)
        every = (*kept, effect)
        unknown = [p for e in every for p in e.parameters]
        for x in extremes(unknown, len(effect.parameters)):
            assert softest(model, every, x) > -1e-6, effect.text


def test_two_joints_of_one_family_multiply():
    """Each replaces the factor of its family; both factors act on what neither of them is."""
    reduced = reduced_problem(jointed_plates(), 300.0)
    families = joint_families(reduced.structure)
    joints = [j for j in fasteners(reduced.structure) if j.kind == "solids"][:2]
    pair = [of_one(WeldCompliance, j, np.array([0.1]), families, 3) for j in joints]
    x = np.array([-8.0, -1.5, -8.0, -1.5])
    assert softest(reduced.model, tuple(pair), x) > -1e-6
    alone = evaluate(reduced.model, pair[:1], np.array([-8.0, -3.0]), False).lam
    both = evaluate(reduced.model, pair, np.array([-8.0, -1.5, 80.0, -1.5]), False).lam
    assert both[6:12] == pytest.approx(alone[6:12], rel=1e-2)


def slopes(model, effects, x):
    state = evaluate(model, effects, x)
    phi = state.vectors
    return state.lam, state.dK.along(phi) - state.lam * state.dM.along(phi)


def test_slopes_are_exact_where_everything_is_multiplied():
    """A crack in a soft sheet, near the buckling force of a prestress, on a coarse mesh."""
    case = STRUCTURES["panel"]()
    families = {f.name: f for f in BUILT_IN}
    (line,) = case.catalogue.of(families["crack"])
    (pulled,) = case.catalogue.of(families["membrane-prestress"])
    model = case.reduced.model_for(line, np.zeros(1))
    every = (*case.base, line, pulled)
    unknown = [p for e in every for p in e.parameters]
    rng = np.random.default_rng(1)
    x = np.array(
        [
            p.mean + 0.7 * p.sd * z
            for p, z in zip(unknown, rng.normal(size=len(unknown)), strict=True)
        ]
    )
    x[-3:] = 1.0, -9.0, -9.0
    lam, dlam = slopes(model, every, x)
    some = np.flatnonzero(flexible(lam))[:8]
    h = 1e-4
    for k in (0, 1, 2, *range(len(x) - 6, len(x)), *rng.choice(len(x), 12)):
        e = h * np.eye(len(x))[k]
        up, down = (evaluate(model, every, x + s * e, False).lam for s in (1, -1))
        due = (up - down)[some] / (2 * h)
        np.testing.assert_allclose(
            dlam[k][some], due, atol=1e-4 * np.abs(lam[some]).max() * max(unknown[k].sd, 0.1)
        )
