"""A deck holds no scatter and no mesh error: it is a fit of its own."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from chladni.effects.calibration_parameters import calibration_parameter, random_field
from chladni.effects.effect import Effect, Parameter
from chladni.effects.joint_stiffness import ADHESIVE, ModelFamily
from chladni.effects.model_errors import MeshError, mesh_errors
from chladni.effects.orthotropy import orthotropic
from chladni.effects.sheets import StiffnessPatch, ThicknessDistribution
from chladni.effects.user_parameters import freed_effect
from chladni.errors import ModelError
from chladni.fem.modelled import modelled
from chladni.inference import written_hypothesis
from chladni.inference.hypothesis_fit import HypothesisFit, UpdatingProblem
from chladni.inference.map_fit import fit, prior_residuals
from chladni.inference.result import Agreement, Scores
from chladni.inference.written_hypothesis import as_written
from chladni.reduced.reduced_model import evaluate
from chladni.search.diagnosis import Diagnosis, applied
from chladni.search.hypotheses import Explanation
from chladni.search.result_parts import calibrated, foretells_worse


@pytest.fixture(scope="module")
def hypothesis(reduced, responses):
    effect = ThicknessDistribution.on(reduced.groups, 0, 1)
    effects = [
        calibration_parameter(reduced.groups, "E", [0]),
        random_field(reduced.groups, "t", 0.05),
        effect,
    ]
    start = np.concatenate([[p.mean for p in e.parameters] for e in effects])
    data = responses.rebased(reduced.model)
    return HypothesisFit(effect, fit(reduced.model, effects, data, None, start), reduced.model)


def test_scatter_is_gone_and_the_effect_stays(hypothesis):
    """It moves by less than it is uncertain."""
    deck, effect = as_written(hypothesis, None), hypothesis.effect
    assert [e.name for e in deck.fit.effects] == ["part-scale", "thickness-distribution"]
    moved = np.abs(deck.fit.of(effect) - hypothesis.fit.of(effect))
    assert (moved < hypothesis.fit.sd(effect)).all()


def test_is_the_best_without_scatter(hypothesis):
    """Never worse than leaving the scatter out of what was found."""
    deck = as_written(hypothesis, None)
    own = hypothesis.fit
    x = np.concatenate([own.of(own.effects[0]), own.of(hypothesis.effect)])
    left = evaluate(hypothesis.model, deck.fit.effects, x, False)
    r, _ = hypothesis.data.residual(left, False)
    assert deck.fit.misfit <= r @ r + 1e-6


def cost(deck):
    """-2 ln posterior of a deck up to a constant: data and priors."""
    r0, _ = prior_residuals(deck.fit.effects, None, deck.fit.x, deck.fit.state)
    return deck.fit.misfit + r0 @ r0


def test_decks_are_nested(hypothesis, scattered):
    """A deck without its last freedom fits worse: calibration, or the effect where it is idle."""
    updated, effect = as_written(hypothesis, None), hypothesis.effect
    idle = np.array([p.nominal for p in effect.parameters])
    for deck, x in (
        (as_written(scattered, None), np.zeros(1)),
        (updated, np.concatenate([updated.fit.x[:1], idle])),
    ):
        before = fit(deck.model, deck.fit.effects, deck.data, None, x, max_steps=0)
        assert cost(deck) < cost(replace(deck, fit=before))


def test_the_mesh_error_is_no_number_of_a_deck(hypothesis, reduced):
    """E compensates for it as far as the recording and its prior say."""
    over = mesh_errors(modelled(reduced.structure.assembly, 2.5 * 200.0), 200.0)[0]
    E, _, effect = hypothesis.fit.effects
    model = reduced.model_for(over, np.array([1.0]))
    x = np.concatenate([[0.0], [1.0], hypothesis.fit.of(effect)])
    data = hypothesis.data.rebased(model)
    own = fit(model, (E, over, effect), data, None, x, max_steps=0)
    assert as_written(HypothesisFit(effect, own, model), None).fit.effects == (E, effect)


def test_values_of_no_structure_give_way_to_those_of_the_deck(scattered, monkeypatch):
    """A fit begins at the found values or at the deck's own, and is refused where it cannot."""
    due, limit = as_written(scattered, None).fit.x, 1e-3

    def begun(model, effects, data, mass, x):
        if abs(x[0]) > limit:
            raise ModelError("an effect left negative stiffness")
        return fit(model, effects, data, mass, x)

    monkeypatch.setattr(written_hypothesis, "fit", begun)
    assert as_written(scattered, None).fit.x == pytest.approx(due, abs=1e-3)
    limit = -1.0
    with pytest.raises(ModelError, match="belong to a structure"):
        as_written(scattered, None)


def test_what_was_found_is_told_beside_what_the_written_deck_has(hypothesis):
    """E is estimated beside the scatter; the deck without it has the E that serves it."""
    deck = as_written(hypothesis, None)
    null = replace(hypothesis, effect=Effect())
    named = Diagnosis(null, null, null, (hypothesis,), NAMED, written=deck)
    (E,) = calibrated(named)
    whole, own = hypothesis.fit, hypothesis.fit.effects[0]
    nominal, (x,), (other,) = own.parameters[0].value(0.0), whole.of(own), deck.fit.of(own)
    assert E.estimate.value == pytest.approx(nominal * np.exp(x))
    assert E.written_value == pytest.approx(nominal * np.exp(other))
    assert abs(E.estimate.value / E.written_value - 1) > 1e-6
    assert E.estimate.low < E.estimate.value < E.estimate.high
    (of_states,) = calibrated(replace(named, shared=True))
    assert of_states.estimate.value == of_states.written_value == E.written_value
    (untouched,) = calibrated(replace(named, verdict=LITTLE))
    assert untouched.written_value == untouched.deck_value == nominal


def test_each_of_several_values_of_one_parameter_has_its_name(reduced):
    """The four values of a freed orthotropic sheet are told apart."""
    sheet = freed_effect(orthotropic(reduced.groups, (0,), np.array([1.0, 0, 0])), "material")
    x = np.zeros(len(sheet.parameters))
    fit = SimpleNamespace(effects=(sheet,), of=lambda e: x, sd=lambda e: x + 0.1)
    one = SimpleNamespace(fit=fit)
    found = SimpleNamespace(
        as_deck=None, plain=one, found=None, null=one, verdict=NAMED, shared=False
    )
    names = [c.where.split(" of ")[0] for c in calibrated(found)]
    assert names == ["material: E1", "material: E2", "material: G12", "material: nu mean"]


NAMED, REST, LITTLE = "missing physics", "not in catalogue", "nothing missing"


@pytest.fixture(scope="module")
def scattered(reduced, responses):
    """A null of E and a scatter of t."""
    E, t = calibration_parameter(reduced.groups, "E", [0]), random_field(reduced.groups, "t", 0.05)
    start = np.array([p.mean for e in (E, t) for p in e.parameters])
    found = fit(reduced.model, [E, t], responses.rebased(reduced.model), None, start)
    return HypothesisFit(Effect(), found, reduced.model)


def test_calibration_alone_is_written_without_scatter(scattered):
    """What the null has beside E stays out of the deck, and E is fitted anew."""
    deck = as_written(scattered, None)
    assert [e.name for e in deck.fit.effects] == ["part-scale"]
    assert deck.fit.x[0] == pytest.approx(0.04, abs=2e-3)


def glued(reduced):
    """A hundredth of the plate's stiffness as if it were that of adhesive."""
    K, prior = reduced.structure.system.K, (Parameter("k", "-", 0.0, ADHESIVE),)
    return ModelFamily(prior, "adhesive", operator=sp.csr_array(0.01 * K))


def test_joints_that_took_more_than_they_scatter_are_numbers_of_the_deck(responses, reduced):
    """Beyond 3 sd: calibrated beside E; within, a nuisance that no deck holds."""
    E, adhesive = calibration_parameter(reduced.groups, "E", [0]), glued(reduced)
    for x, kept in ((1.6, ["E", "k"]), (1.4, ["E"])):
        at = np.array([0.02, x])
        data = responses.rebased(reduced.model)
        begun = fit(reduced.model, [E, adhesive], data, None, at, max_steps=0)
        found = as_written(HypothesisFit(Effect(), begun, reduced.model), None).fit
        assert [p.name for e in found.effects for p in e.parameters] == kept


def test_what_makes_another_material_is_written_before_what_divides_a_part(reduced):
    """Otherwise a patch would keep the material that the rest has lost."""
    sheet = orthotropic(reduced.groups, (0,), np.array([1.0, 0, 0]))
    patch = StiffnessPatch.on(reduced.groups, 0, 1)
    x = {
        id(sheet): np.array([0.2, -0.2, 0.0, 0.0]),
        id(patch): np.array([1.0, -1.5, 0.0, 0.0, 0.5]),
    }

    def written(*order):
        fit = SimpleNamespace(effects=order, of=lambda e: x[id(e)])
        named = HypothesisFit(order[0], fit, None, tuple(order[1:]))
        return applied(reduced.structure.assembly, named)

    one, other = written(sheet, patch), written(patch, sheet)
    assert len(one.parts) == len(other.parts) > 1
    for mine, its in zip(one.parts, other.parts, strict=True):
        assert (mine.section.bending.E1, mine.name) == (its.section.bending.E1, its.name)


def held(nominal, calibrated, updated=None, floor=None):
    return Agreement(
        held_out=Scores(nominal=nominal, calibrated=calibrated, with_effect=updated, floor=floor)
    )


@pytest.mark.parametrize(
    ("scores", "named", "worse"),
    [
        (held(0.108, 0.150), False, "calibrated deck .* given deck .Q 0.15, 0.108 before"),
        (held(0.108, 0.115, floor=0.01), False, ""),  # as noise allows
        (held(0.108, 0.108), False, ""),
        (held(0.108, 0.150, 0.140), True, ""),  # it is compared with the deck before it
        (held(0.208, 0.150, 0.160), True, "updated deck .* calibrated deck .Q 0.16, 0.15 before"),
        (held(None, None), True, ""),
        (None, False, ""),
    ],
)
def test_a_deck_beats_the_one_before_it_on_data_that_report(scores, named, worse):
    """Calibrated after given, updated after calibrated."""
    said = foretells_worse(scores, named)
    assert len(said) == bool(worse)
    assert all(re.search(worse, why) for why in said)


def test_values_are_told_with_errors_about_the_state_of_the_effect(hypothesis):
    """Errors are largest at its own antiresonances; evidence stays comparable with the null's."""
    null = evaluate(hypothesis.model, hypothesis.fit.effects[:1], np.zeros(1), False)
    about = hypothesis.data.allowing_errors(null, 0.003)
    common = replace(hypothesis, fit=replace(hypothesis.fit, data=about))
    problem = UpdatingProblem(None, about, None, (), (), None)
    one = Explanation(SimpleNamespace(prepared=SimpleNamespace(problem=problem)), common)
    assert one.own.data.about is common.fit.state
    assert one.own.data.about is not about.about
    assert one.own.neg2_log_evidence == common.neg2_log_evidence
    assert one.written.data is one.own.data


@pytest.mark.parametrize(("finer", "halved"), [(-30.0, True), (30.0, False)])
def test_the_mesh_of_the_decks_is_chosen_with_the_effect_in_place(
    monkeypatch, hypothesis, finer, halved
):
    """Without a strong effect no mesh fits; the calibrated deck has the mesh of the other."""
    measured = object()
    case = SimpleNamespace(
        plain_halved="calibrated", found=SimpleNamespace(plain="given", halved=()),
        prepared=SimpleNamespace(problem=SimpleNamespace(mass_measurement=measured)),
    )  # fmt: skip
    one = Explanation(case, hypothesis)
    mesh = MeshError(omega=np.ones(1), log=np.zeros((1, 1)))
    fit = replace(hypothesis.fit, effects=(*hypothesis.fit.effects, mesh))
    vars(one)["own"] = own = replace(hypothesis, fit=fit)
    vars(one)["written"] = written = replace(hypothesis)

    def as_deck(what, mass, halved):
        assert (what, mass, halved) == (own, measured, True)
        return replace(written, fit=replace(fit, neg2_log_evidence=fit.neg2_log_evidence + finer))

    monkeypatch.setattr(written_hypothesis, "as_written", as_deck)
    assert [type(deck) for deck in one.halved] == [str, HypothesisFit] * halved
    case.plain_halved = None  # no such deck is a structure
    del vars(one)["halved"]
    assert one.halved == ()
