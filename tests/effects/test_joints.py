"""Joints one by one: what they have in K, their loss in full, and the scan that needs no fit."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.sparse.linalg import spsolve

from chladni.dynamics.eigen import normal_modes
from chladni.effects.adhesive import SEALANT, beads_of
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.contacts import close_places
from chladni.effects.joint_stiffness import joint_families
from chladni.effects.joints import alone, beads, fasteners, with_factor_on, without_joint
from chladni.effects.welds import (
    GONE,
    MOST_LN_LEFT,
    NONE_LEFT,
    SOUND,
    WeldCompliance,
    WeldMissing,
    of_one,
)
from chladni.fem.assemble import structure
from chladni.inference.likelihood import Responses
from chladni.inference.scan import baseline
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.search.fastener_scan import (
    fastener_scores,
    loosened_receptance,
    loosened_rows,
    singles,
)
from chladni_specimens.forms import FORMS

TOP = 300.0
FLEXIBLE = slice(6, 12)


@pytest.fixture(scope="module")
def found(reduced):
    return singles(loosened_rows(reduced))


@pytest.fixture(scope="module")
def families(reduced):
    return joint_families(reduced.structure)


def full(assembly):
    return normal_modes(structure(assembly).system, 14).frequency[FLEXIBLE]


def hertz(model, effect, x):
    lam = evaluate(model, [effect], np.asarray(x, float), False).lam[FLEXIBLE]
    return np.sqrt(lam) / (2 * np.pi)


def test_three_welds_and_a_screw_hold_both_sheets_and_one_bead_runs_between(deck):
    built = structure(deck)
    held = fasteners(built)
    assert [joint.kind for joint in held] == ["solids"] * 3 + ["beams"]
    assert all(set(joint.parts) == {"lower", "upper"} for joint in held)
    assert_allclose(held[3].point[:2], [0.2, 0.05], atol=1e-9)
    (bead,) = beads(built)
    assert len(bead.elements) == 10


def test_what_joints_have_in_K_adds_up(deck, reduced, found, families):
    """All rows together are all of the welds' stiffness; without them none of it is left."""
    welds = [one.joint for one in found if one.joint.kind == "solids"]
    K = sum(j.rows.T @ j.rows for j in welds)
    assert abs(K - families["welds"].operator).max() < 1e-8 * abs(K).max()
    bare = deck
    for one in found:
        K = reduced.structure.system.K - one.joint.rows.T @ one.joint.rows
        bare = without_joint(deck, one.joint)
        left = structure(replace(bare, auto_spc=False)).system.K
        if left.shape == K.shape:
            assert abs(K - left).max() < 1e-9 * abs(K).max()
    assert not len(alone(deck, welds[0]).shells)


def test_a_sound_weld_is_the_deck_and_a_missing_one_the_deck_without_it(
    deck, reduced, found, families
):
    for one in found:
        effect = of_one(WeldMissing, one.joint, one.share, families, len(found))
        x = np.array([GONE, 0.0][: len(effect.parameters)])
        model = reduced.model_for(effect, x)
        gone = full(without_joint(deck, one.joint))
        assert_allclose(hertz(model, effect, x), gone, rtol=2e-3)
        assert np.abs(gone / full(deck) - 1).max() > 2e-3
        x[0] = SOUND
        assert_allclose(hertz(model, effect, x), full(deck), rtol=1e-6)
        x[0] = GONE
        assert_allclose(full(effect.apply(deck, x)), gone, rtol=1e-9)


def test_modes_alone_do_not_see_a_stiff_weld_go(deck, reduced, found, families):
    """Why the scan takes static responses: the basis of modes keeps it closed."""
    one = found[0]
    effect = of_one(WeldMissing, one.joint, one.share, families, 4)
    x = np.array([-12.0, 0.0])
    gone, deck_as_is = full(without_joint(deck, one.joint)), full(deck)
    blind = hertz(reduced.model, effect, x)
    assert np.abs(blind / gone - 1).max() > 0.5 * np.abs(gone / deck_as_is - 1).max()


def test_no_weld_has_more_taken_from_it_than_it_has(reduced, found, families):
    """Whatever the others' factor: K stays positive, as it would not if the deck's were taken."""
    effect = of_one(WeldCompliance, found[0].joint, found[0].share, families, 4)
    model = reduced.model_for(effect, np.zeros(2))
    for g in (-6.0, 6.0):
        lam = evaluate(model, [effect], np.array([-8.0, g]), False).lam
        assert lam[0] > -1e-6 * lam[6]


def test_the_deck_has_the_stiffness_of_the_terms(deck, reduced, found, families):
    """K + (g - 1) Σ K_i + (f/g - 1) g K_j: the joint in the deck times f, not times f g."""
    effect = of_one(WeldCompliance, found[0].joint, found[0].share, families, 4)
    x = np.array([8.0, np.log(1.5)])
    terms = effect.terms(x)
    own, family = terms
    assert own.within.pieces < family.within.pieces
    due = reduced.structure.system.K + family.coefficient * family.operator
    due = due + (1 + family.coefficient) * own.coefficient * own.operator
    made = structure(effect.apply(deck, x)).system.K
    assert abs(made - due).max() < 1e-7 * abs(effect.operator).max()


def test_names_follow_what_is_carried(found, families):
    one = found[0]
    effect = of_one(WeldCompliance, one.joint, one.share, families, 4)
    assert effect.remarks(np.array([NONE_LEFT - 0.1, 0.0])).becomes == "weld-missing"
    assert effect.remarks(np.array([NONE_LEFT + 0.1, 0.0])).becomes == ""
    left = [effect.left(x)[0] for x in (-2.0, 0.0, 30.0, SOUND)]
    assert_allclose(left, one.share.min() * np.exp([-2.0, 0.0, MOST_LN_LEFT, 0.0]) ** [1, 1, 1, 0]
                    * np.array([1, 1, 1, 1 / one.share.min()]), rtol=1e-6)  # fmt: skip


def test_softness_is_what_the_sheets_have_of_both(reduced, found):
    """A weld of s of its stiffness adds as much again to what the sheets have there: z = s w."""
    one = found[1]
    share = np.linalg.eigvalsh(one.R)
    K = reduced.structure.system.K + (2 * np.pi * reduced.hertz) ** 2 * reduced.structure.system.M
    B = one.joint.rows.toarray()
    without = K.toarray() - B.T @ B
    z = np.linalg.inv(B @ np.linalg.solve(without, B.T))  # in units of w
    assert_allclose(np.sort(share), np.sort(1 / (1 + 1 / np.linalg.eigvalsh(z))), rtol=1e-4)


@pytest.fixture(scope="module")
def scanned(deck, reduced, found):
    """A recording of the deck without its second weld, and its baseline."""
    rows = reduced.grids.rows[[0, 7, 20, 40, 55]]
    s = 2 * np.pi * np.linspace(25, TOP, 60) * (0.05 + 1j)
    use = np.ones((60, 5), bool)
    missing = structure(without_joint(deck, found[1].joint))
    modes = normal_modes(missing.system, 80)
    grids = reduced.grids.grids[[0, 7, 20, 40, 55]]
    phi = missing.along(grids, reduced.grids.normal[[0, 7, 20, 40, 55]]) @ modes.shapes
    d = 1 / ((2 * np.pi * modes.frequency) ** 2 + s[:, None] ** 2)
    H = s[:, None, None] ** 2 * np.einsum("or,fr,ir->foi", phi, d, phi[[0]])
    ground = reduced_problem(deck, TOP, rows)
    data = Responses(H, s, rows, rows[[0]], use).rebased(ground.model)
    base = baseline(
        ground.model, [calibration_parameter(ground.groups, "E", [0])], data, None, np.zeros(1)
    )
    return ground, data, base


def test_the_scan_becomes_the_full_solve(deck, found, scanned):
    """Receptances by Woodbury tend to those of the structure with the joint loosened.

    Of modes beyond the basis, from ω_c on, inertia is left out, (ω / ω_c)² of their static part,
    and the force they load a weld with grows as a plate's shear, ω_c^1.5: their sum falls as
    ω_c^-1.5, and a basis that reaches twice as far misses half at most.
    """
    _, data, _ = scanned
    left, rows, s = np.array([1e-9, 1e-2]), data.outputs.toarray(), data.s[:30:7]
    over = {}
    for reach in (2.5, 5.0):
        ground = reduced_problem(deck, TOP, data.outputs, reach=reach)
        lines = replace(data, s=s, use=data.use[: len(s)], values=data.values[: len(s)])
        over[reach] = ground, lines.rebased(ground.model), singles(loosened_rows(ground))

    def solved(system):
        return np.array(
            [rows @ spsolve(sp.csc_array(system.K + v**2 * system.M), rows[0]) for v in s]
        )

    sound = solved(over[5.0][0].structure.system)
    for j, one in enumerate(found):
        due = [solved(structure(with_factor_on(deck, one.joint, f)).system) for f in left]
        missed = []
        for ground, lines, joints in over.values():
            state = evaluate(ground.model, [], np.zeros(0), False)
            H = loosened_receptance(state, ground, lines, joints[j], left)[..., 0]
            missed.append([np.linalg.norm(h - d) for h, d in zip(H, due, strict=True)])
        moved = [np.linalg.norm(sound - d) for d in due]
        assert (np.array(missed[1]) < np.array(missed[0]) / 2).all()
        assert (np.array(missed[1]) < 0.01 * np.array(moved)).all()


def test_the_weld_that_is_gone_is_first(found, scanned):
    ground, data, base = scanned
    score = fastener_scores(base, ground, data, found, np.full((len(found), 1), 1e-9))[:, 0]
    assert int(score.argmin()) == 1
    nothing = fastener_scores(base, ground, data, found, np.ones((len(found), 1)))[:, 0]
    assert_allclose(nothing, base.score(base.residual[:, None])[0], rtol=1e-9)


def test_a_bead_of_any_stiffness_is_that_of_the_deck(deck, reduced):
    (effect,) = beads_of(reduced.structure)
    for x in (-4.0, -1.0, 2.0, 4.0):
        model = reduced.model_for(effect, np.array([x]))
        assert_allclose(hertz(model, effect, [x]), full(effect.apply(deck, [x])), rtol=2e-3)
    assert effect.remarks(np.array([np.log(SEALANT / 6e6) + 0.1])).implausible
    assert not effect.remarks(np.array([np.log(SEALANT / 6e6) - 0.1])).implausible


def test_no_contact_is_looked_for_beside_a_fold():
    """The plate's end lies under the bend of the angle, which two codes hold unlike."""
    bracket = FORMS["bolted bracket"].made(511)
    places = close_places(bracket)
    assert len(places)
    bend = bracket.points[:, 0].max()
    held = np.concatenate([bracket.points[side] for pair in places.sides for side in pair])
    assert held[:, 0].max() < bend - 1e-6
    assert places.middle[:, 0].max() > bend - 0.06  # the lap is looked at up to there
