"""Factors on joints and on the shear of shells: exact, harmless at nought, never negative."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.effect import Effect, FieldChange, Parameter
from chladni.effects.element_groups import element_groups
from chladni.effects.joint_stiffness import (
    ADHESIVE,
    FAR,
    calibrated_family,
    joint_nuisances,
    model_families,
)
from chladni.fem.assemble import structure
from chladni.model.assembly import Bushes
from chladni.reduced.accuracy import products
from chladni.reduced.reduced_model import evaluate, reduce
from chladni_specimens.plates import folded_panel


@pytest.fixture(scope="module")
def jointed():
    """A folded panel with a bush between two of its points."""
    panel = folded_panel(0.2, 0.1, 0.02, 0.004, 0.02, 1e-3)
    k = np.array([[1e5, 1e5, 1e5, 10.0, 10.0, 10.0]])
    bush = Bushes(
        np.array([900]), np.array([[0, 7]]), np.eye(3)[None], panel.points[[0]], k, 0 * k, 0 * k
    )  # fmt: skip
    return replace(panel, bushes=bush)


def test_every_family_is_found(jointed):
    names = [f.text for f in model_families(structure(jointed))]
    assert names == ["bushes"] + [f"shear of {p.name}" for p in jointed.parts]


def test_a_factor_on_bushes_is_that_of_the_deck(jointed):
    built = structure(jointed)
    twice = replace(jointed, bushes=replace(jointed.bushes, stiffness=2 * jointed.bushes.stiffness))
    found = model_families(built)[0].operator
    assert_allclose((structure(twice).system.K - built.system.K - found).toarray(), 0, atol=1e-3)


def test_shear_is_the_part_of_the_stiffness_that_residual_bending_softens(jointed):
    """Without it the stiffness is larger, and in no other strain."""
    built = structure(jointed)
    shear = sum(f.operator for f in model_families(built)[1:]).toarray()
    stiffer = (structure(jointed, residual_bending=False).system.K - built.system.K).toarray()
    w, V = np.linalg.eigh(stiffer)
    idle = V[:, np.abs(w) < 1e-9 * w.max()]
    assert_allclose(idle.T @ shear @ idle, 0, atol=1e-6 * np.abs(shear).max())


def test_idle_at_nought_and_positive_far_away(jointed):
    built = structure(jointed)
    basis = normal_modes(built.system, band=2000.0).shapes
    model, found = reduce(element_groups(built), basis), model_families(built)
    zero = evaluate(model, found, np.zeros(len(found)))
    assert_allclose(zero.lam, evaluate(model, [], np.zeros(0), False).lam, rtol=1e-9, atol=1e-3)
    for x in (-4.0, 4.0):
        assert evaluate(model, found, np.full(len(found), x), False).lam.min() > -1e-3 * zero.lam[9]


@dataclass(frozen=True, eq=False)
class Soft(Effect):
    """One group of shells whose E (or t) is e^x times the deck's."""

    quantity: Literal["E", "t"] = "E"
    own: np.ndarray = field(default_factory=lambda: np.zeros((0, 1)))

    def terms(self, x):
        """The field over the groups."""
        return (FieldChange(self.quantity, self.own[:, 0] * x[0], self.own),)


@pytest.fixture(scope="module")
def softened(jointed):
    """The panel over 200 modes, its shear factors, and a group of shells that softens."""
    built = structure(jointed)
    groups = element_groups(built)
    basis = normal_modes(built.system, 200).shapes  # up to where a single shell bends
    own, unknown = np.eye(len(groups))[:, :1], (Parameter("soft", "-", 0.0, 1.0),)
    soft = [Soft(unknown, quantity=q, own=own) for q in "Et"]
    return reduce(groups, basis), model_families(built)[1:], soft


@pytest.mark.parametrize("which", [0, 1])
def test_shear_takes_no_more_than_a_soft_patch_leaves(softened, which):
    """Taken from the deck's own stiffness, it would leave the patch with negative shear."""
    model, shear, soft = softened
    x = np.append(np.full(len(shear), -1.0), -2.5)
    K = products(model, [*shear, soft[which]], x, np.eye(model.vectors.shape[0]))[0]
    stiffness = np.linalg.eigvalsh((K + K.T) / 2)
    assert stiffness.min() > -1e-9 * stiffness.max()


@pytest.mark.parametrize("which", [0, 1])
def test_slopes_know_of_the_limit(softened, which):
    model, shear, soft = softened
    effects, x, h = [*shear, soft[which]], np.append(np.full(len(shear), -0.7), -1.5), 1e-6
    state = evaluate(model, effects, x)
    for p, e in enumerate(np.eye(len(x))):
        up, down = (evaluate(model, effects, x + s * h * e, False).lam for s in (1, -1))
        due = (state.dK.along(state.phi) - state.lam * state.dM.along(state.phi))[p]
        at = slice(6, 30)
        assert_allclose((up - down)[at] / (2 * h), due[at], rtol=1e-4, atol=1e-5 * state.lam[30])


@pytest.mark.parametrize("far", [1.0, 30.0])
def test_no_glue_is_stiffer_than_its_coupons(deck, jointed, far):
    """However far its number goes, adhesive ends at FAR; small changes are as they are."""
    (glue,) = (f for f in joint_nuisances(structure(deck)) if f.text == "adhesive")
    (p,) = glue.parameters
    most = np.exp(FAR * ADHESIVE)
    for sign in (-1, 1):
        assert abs(np.log(p.value(sign * far))) < min(far, np.log(most) * (1 + 1e-12))
        assert p.value(sign * 0.02) == pytest.approx(np.exp(sign * 0.02), rel=1e-5)
        h, x = 1e-5, 0.6 * sign
        assert p.slope(x) == pytest.approx((p.value(x + h) - p.value(x - h)) / (2 * h), rel=1e-8)
    assert p.value(100.0) == pytest.approx(most)
    (bushes,) = (f for f in joint_nuisances(structure(jointed)) if f.text == "bushes")
    assert bushes.parameters[0].value(3.0) == pytest.approx(np.exp(3.0))


@pytest.mark.parametrize("name", ["adhesive", "welds", "bushes"])
def test_a_family_in_the_deck_is_what_the_fit_had(deck, jointed, name):
    """The deck that is written has the factor on K_family, and no more mass."""
    assembly = jointed if name == "bushes" else deck
    built, x = structure(assembly), np.array([np.log(6.0)])
    family = next(f for f in joint_nuisances(built) if f.text == name)
    assert family.apply(assembly, x) is assembly  # a nuisance is no number of a deck
    made = structure(calibrated_family(family).apply(assembly, x)).system
    (term,) = family.terms(x)
    assert abs(term.operator).max() > 0
    error = made.K - built.system.K - term.coefficient * term.operator
    assert abs(error).max() < 1e-6 * abs(built.system.K).max()
    assert abs(made.M - built.system.M).max() == 0
