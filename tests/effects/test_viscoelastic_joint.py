"""A joint that rises with frequency and dissipates: each mode at its own frequency, its loss."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.adhesive import (
    LEVEL_SD,
    LOSS,
    LOSS_SD,
    NO_LOSS,
    SD,
    ViscoelasticJoint,
    beads_of,
    speaks_for,
    suspects,
)
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import Parameter
from chladni.effects.identified_damping import SCATTER, IdentifiedDamping, paired_with
from chladni.effects.joint_stiffness import joint_families
from chladni.effects.joints import fasteners, stiffness, with_factor_on
from chladni.fem.assemble import structure
from chladni.geometry.sampling import farthest_point_sample, nearest_points
from chladni.inference.damping_scatter import ModalDamping
from chladni.inference.likelihood import Responses
from chladni.inference.map_fit import constants, prior_residuals
from chladni.model.assembly import Bushes
from chladni.reduced.accuracy import products
from chladni.reduced.frequency_dependent_stiffness import Dissipated
from chladni.reduced.reduced_model import evaluate

FLEXIBLE = slice(6, 12)
USUAL = 0.01


@pytest.fixture(scope="module")
def mastic(reduced):
    """The bead between the two plates as one that may dissipate, and a model that carries it."""
    bead = beads_of(reduced.structure)[0]
    flexible = reduced.frequency[FLEXIBLE]
    damping = IdentifiedDamping(flexible, np.full(6, USUAL), np.full(6, 0.02))
    unknown = (
        Parameter("E", "Pa", 0.0, SD, 6e6, step=1.0),
        Parameter("loss factor", "-", 0.0, LOSS_SD, LOSS, nominal=NO_LOSS),
        Parameter("other damping", "-", 0.0, LEVEL_SD, USUAL),
    )
    effect = ViscoelasticJoint(
        unknown, "the bead", joint=bead.joint, operator=bead.operator,
        band=(float(reduced.frequency[6]), reduced.f_max),
        damping=damping,
    )  # fmt: skip
    return effect, reduced.model_for(effect, np.zeros(3))


X = np.array([0.4, 0.6, 0.1])


def hertz(lam):
    return np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)


def at_its_own_frequency(deck, effect, x, mode):
    """A mode of the full structure, its bead as stiff as it is at that mode's own frequency."""
    _, a, _ = effect.exponent(x)
    f = effect.reference
    for _ in range(6):
        made = with_factor_on(deck, effect.joint, float(np.exp(x[0])) * (f / effect.reference) ** a)
        f = normal_modes(structure(made).system, 14).frequency[mode]
    return f


def test_every_mode_meets_the_stiffness_of_its_own_frequency(deck, mastic):
    """K(ω_j) φ_j = ω_j² M φ_j by iteration on the full structure: a tenth of what the rise does."""
    effect, model = mastic
    got = hertz(evaluate(model, [effect], X, False).lam[FLEXIBLE])
    level = hertz(evaluate(model, [effect], np.array([X[0], NO_LOSS, 0]), False).lam[FLEXIBLE])
    due = np.array([at_its_own_frequency(deck, effect, X, k) for k in range(6, 12)])
    assert np.abs(level / due - 1).max() > 0.01
    assert_allclose(got, due, rtol=0.1 * np.abs(level / due - 1).max())


def test_damping_is_half_the_loss_factor_times_the_slope_of_the_eigenvalue(mastic):
    """ζ_j = η/2 ∂ln λ_j/∂ln E (Ungar and Kerwin), which Hellmann and Feynman give by themselves."""
    effect, model = mastic
    effect = replace(effect, band=(effect.reference,) * 2)  # of one stiffness at all frequencies
    state = evaluate(model, [effect], X)
    eta = effect.exponent(X)[0]
    share = state.dK.along(state.vectors)[0, FLEXIBLE] / state.lam[FLEXIBLE]
    assert_allclose(state.dissipated.ratio[FLEXIBLE], eta / 2 * share, rtol=1e-10)
    assert share.max() > 0.05
    assert_allclose(state.dissipated.ratio[:6], 0, atol=1e-12)


def test_what_is_lost_has_exact_slopes(mastic, reduced):
    """Of E of the sheets, and of all three numbers, by differences of fourth order."""
    effect, model = mastic
    both = [calibration_parameter(reduced.groups, "E", [0]), effect]
    x = np.array([0.05, *X])

    def ratio(x):
        return evaluate(model, both, x, False).dissipated.ratio[FLEXIBLE]

    slopes = evaluate(model, both, x).dissipated.slopes[:, FLEXIBLE]
    for k, e in enumerate(1e-3 * np.eye(4)):
        due = (8 * (ratio(x + e) - ratio(x - e)) - (ratio(x + 2 * e) - ratio(x - 2 * e))) / 12e-3
        assert_allclose(slopes[k], due, atol=1e-3 * np.abs(slopes).max())


def test_residuals_of_damping_have_exact_slopes(mastic):
    effect, model = mastic

    def residual(x):
        return prior_residuals([effect], None, x, evaluate(model, [effect], x, False))[0]

    _, J = prior_residuals([effect], None, X, evaluate(model, [effect], X))
    assert J.shape == (3 + 6, 3)
    for k, e in enumerate(1e-4 * np.eye(3)):
        due = (residual(X + e) - residual(X - e)) / 2e-4
        assert_allclose(J[:, k], due, atol=2e-3 * np.abs(J).max())


def test_complex_modes_are_those_of_a_complex_stiffness(mastic):
    """ΔH against eigenvectors ψ of Λ + iN: residues a + ib as (a + b s/ω) / (s² + λ)."""
    effect, model = mastic
    state = evaluate(model, [effect], np.array([0.4, -1.0, 0.0]), False)
    flexible = slice(6, 18)
    lam, N = state.lam[flexible], 0.02 * state.dissipated.coupling[flexible, flexible]
    omega = np.sqrt(lam)
    none = np.zeros((0, *N.shape))
    lost = Dissipated(0 * lam, none[:, 0], N, none, omega, (lam, np.eye(len(lam))))
    rng = np.random.default_rng(1)
    phi_o, phi_i = rng.normal(size=(3, len(lam))), rng.normal(size=(1, len(lam)))
    s = 2 * np.pi * np.linspace(30, 250, 40) * (0.05 + 1j)
    d = 1 / (lam + s[:, None] ** 2)
    got = lost.seen(s, d, phi_o, phi_i)[:, :, 0]
    value, psi = np.linalg.eig(np.diag(lam) + 1j * N)
    psi = psi[:, np.argsort(value.real)]
    psi = psi / np.sqrt((psi**2).sum(axis=0))
    residue = (phi_o @ psi) * (phi_i @ psi)
    due = np.einsum("or,fr->fo", residue.imag, s[:, None] / omega * d)
    plain = np.einsum("or,fr->fo", phi_o * phi_i, d)
    assert np.abs(due).max() > 1e-4 * np.abs(plain).max()
    assert_allclose(got, due, atol=0.01 * np.abs(due).max())


def test_full_operators_are_those_of_the_reduced_model(mastic):
    effect, model = mastic
    K, _ = products(model, [effect], X, model.basis)
    state = evaluate(model, [effect], X, False)
    in_basis = model.basis.T @ K
    assert_allclose(
        state.phi.T @ in_basis @ state.phi, np.diag(state.lam), atol=1e-7 * state.lam[-1]
    )


def test_idle_it_is_the_deck_and_dissipates_nothing(mastic):
    effect, model = mastic
    idle = evaluate(model, [effect], np.array([0.0, NO_LOSS, 0.0]), False)
    assert_allclose(idle.lam[FLEXIBLE], evaluate(model, [], np.zeros(0), False).lam[FLEXIBLE])
    assert_allclose(idle.dissipated.ratio, 0, atol=1e-15)


def test_even_damping_speaks_against_it_and_damping_that_follows_for_it(mastic):
    """Beside the same responses: what damping adds to -2 ln evidence, both ways."""
    effect, model = mastic
    state = evaluate(model, [effect], X, False)
    f, lost = hertz(state.lam[FLEXIBLE]), state.dissipated.ratio[FLEXIBLE]

    def gain(ratio):
        held_out_votes = IdentifiedDamping(f, ratio, np.full(6, 0.02))
        told, x = (
            replace(effect, damping=held_out_votes),
            np.array([*X[:2], np.log(USUAL / held_out_votes.usual)]),
        )
        r0, J0 = prior_residuals([told], None, x, evaluate(model, [told], x))
        A = J0.T @ J0
        return -(float(r0[3:] @ r0[3:]) + constants([told]) + float(np.linalg.slogdet(A)[1]))

    assert lost.max() > 3 * USUAL
    follows = gain(USUAL + lost)
    assert gain(np.full(6, USUAL)) < follows - 10
    assert gain((USUAL + lost)[::-1]) < follows


def test_it_is_asked_for_where_damping_follows_its_share():
    f, share = np.linspace(50, 300, 12), np.linspace(0, 0.3, 12) ** 2
    rng = np.random.default_rng(3)
    scatter = np.exp(SCATTER * rng.normal(size=(200, 12)))

    def told(ratio):
        return speaks_for(IdentifiedDamping(f, ratio, np.full(12, 0.02)), f, share)

    follows = [told(USUAL * e + 0.5 * share) for e in scatter[:20]]
    by_chance = np.array([told(USUAL * e) for e in scatter])
    assert np.min(follows) > 10
    assert (by_chance > 10).mean() < 0.01


def test_what_it_explains_of_the_damping_is_even_beside_it(mastic):
    """Else the name of what damps would be refused for what it says."""
    effect, model = mastic
    state = evaluate(model, [effect], X, False)
    f, lost = hertz(state.lam[FLEXIBLE]), state.dissipated.ratio[FLEXIBLE]
    held_out_votes = ModalDamping(f, USUAL + lost, np.full(6, 0.02))
    assert_allclose(np.ptp(np.log(held_out_votes.beyond(state).ratio)), 0, atol=0.05)
    plain = evaluate(model, [], np.zeros(0), False)
    assert held_out_votes.beyond(plain) is held_out_votes


def test_a_mode_is_paired_with_the_nearest_and_two_that_are_one_share_it():
    w, _ = paired_with(np.array([100.0, 200.0]), np.array([0.0, 99.0, 200.0, 200.0]))
    assert_allclose(w, [[0, 1, 0, 0], [0, 0, 0.5, 0.5]], atol=1e-12)


def test_responses_see_it_with_slopes_of_second_order(mastic, reduced):
    """The loss by itself, modes as they are: what is left falls as h²."""
    effect, model = mastic
    rows = reduced.grids.rows[[0, 9, 20]]
    s = 2 * np.pi * np.linspace(40, 280, 20) * (0.05 + 1j)
    data = Responses(np.ones((20, 3, 1), complex), s, rows, rows[[1]], np.ones((20, 3), bool))
    data = data.rebased(model)
    flat = replace(effect, band=(effect.reference,) * 2)  # the loss moves no mode
    state = evaluate(model, [flat], X)
    data = replace(data, values=data.model(state))
    slope = data.slopes(state)[1]
    left = []
    for h in (0.02, 0.01):
        there = evaluate(model, [flat], X + h * np.eye(3)[1], False)
        left.append(np.abs(data.deviation(there) - h * slope).max())
    assert np.abs(slope).max() > 1e-4
    assert left[0] / left[1] == pytest.approx(4, rel=0.1)


@pytest.fixture(scope="module")
def on_mounts(deck):
    """The two plates with rubber mounts of one make at three places."""
    a = deck
    lower, upper = (np.unique(a.shells.nodes[a.shells.part == k]) for k in (0, 1))
    on = upper[farthest_point_sample(a.points[upper], 3)]
    below = lower[nearest_points(a.points[lower], a.points[on])]
    n, k = len(on), np.array([1e5, 1e5, 2e5, 0, 0, 0])
    bushes = Bushes(
        9000 + np.arange(n), np.column_stack([on, below]), np.tile(np.eye(3), (n, 1, 1)),
        a.points[on], np.tile(k, (n, 1)), np.zeros((n, 6)), np.zeros((n, 6)),
    )  # fmt: skip
    return replace(a, bushes=bushes)


def test_bushes_are_tried_together_and_one_by_one(on_mounts):
    """Operators of the single ones add up to that of all, which is the family's."""
    built = structure(on_mounts)
    mounts = [j for j in fasteners(built) if j.kind == "bushes"]
    tried = [joint for joint in suspects(built, mounts) if joint.kind == "bushes"]
    assert [len(joint.elements) for joint in tried] == [3, 1, 1, 1]
    whole, *each = (stiffness(built, joint) for joint in tried)
    family = joint_families(built)["bushes"].operator
    assert abs(whole - family).max() < 1e-9 * abs(family).max()
    assert abs(whole - sum(each[1:], each[0])).max() < 1e-9 * abs(family).max()


def test_a_bush_that_dissipates_has_its_own_loss_in_the_deck(on_mounts):
    built = structure(on_mounts)
    mount = next(j for j in suspects(built, fasteners(built)[-3:]) if j.kind == "bushes")
    one = replace(mount, elements=np.array([1]))
    unknown = tuple(Parameter(n, "-", 0.0, 1.0, s) for n, s in (("K", 1.0), ("loss factor", LOSS)))
    x = np.array([np.log(0.5), 0.0])
    made = ViscoelasticJoint(unknown, joint=one).apply(on_mounts, x).bushes
    assert_allclose(made.stiffness[1], 0.5 * on_mounts.bushes.stiffness[1])
    assert_allclose(made.loss, np.array([[0.0], [LOSS], [0.0]]) * np.ones(6))
    assert_allclose(made.stiffness[[0, 2]], on_mounts.bushes.stiffness[[0, 2]])


def test_the_deck_is_told_what_no_card_holds(mastic):
    """|E| over frequency as a comment: one at f_0, and to the power a of the frequency."""
    effect, _ = mastic
    said = effect.remarks(X).comment.splitlines()
    _, a, _ = effect.exponent(X)
    rows = [line.split(" Hz: E times ") for line in said[1:-1]]
    f, factor = np.array(rows, float).T
    assert_allclose(factor, (f / effect.reference) ** a, rtol=1e-3)
    assert f"GE {effect.exponent(X)[0]:.4f}" in said[-1]
