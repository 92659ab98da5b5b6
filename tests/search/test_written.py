"""A deck holds no scatter: what is written is the best without it, the effect as it was found."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from chladni.decision.hypothesis_table import NULL, HypothesisTable
from chladni.effects.calibration_parameters import calibration_parameter, random_field
from chladni.effects.effect import Effect, Parameter
from chladni.effects.joint_stiffness import ADHESIVE, ModelFamily
from chladni.effects.model_errors import mesh_errors
from chladni.effects.orthotropy import orthotropic
from chladni.effects.sheets import StiffnessPatch, ThicknessDistribution
from chladni.errors import ModelError
from chladni.fem.modelled import modelled
from chladni.inference.hypothesis_fit import HypothesisFit
from chladni.inference.implausible_values import implausible_values
from chladni.inference.likelihood import Responses
from chladni.inference.map_fit import fit
from chladni.inference.result import Agreement, Scores
from chladni.inference.rows_of_fits import row_of_null
from chladni.inference.written_hypothesis import as_foretold, as_found, as_written
from chladni.reduced.reduced_model import evaluate
from chladni.search import deciding, verdict_models
from chladni.search.deciding import decided
from chladni.search.decision_in_words import concluded
from chladni.search.diagnosis import Diagnosis, threshold
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
    """E is all that moves."""
    deck = as_written(hypothesis, None)
    assert [e.name for e in deck.fit.effects] == ["part-scale", "thickness-distribution"]
    assert deck.fit.of(deck.effect) == pytest.approx(hypothesis.fit.of(hypothesis.effect), abs=5e-3)


def test_is_the_best_without_scatter(hypothesis):
    """Never worse than leaving the scatter out of what was found."""
    deck = as_written(hypothesis, None)
    own = hypothesis.fit
    x = np.concatenate([own.of(own.effects[0]), own.of(hypothesis.effect)])
    left = evaluate(hypothesis.model, deck.fit.effects, x, False)
    r, _ = hypothesis.data.residual(left, False)
    assert deck.fit.misfit <= r @ r + 1e-6


@pytest.fixture(scope="module")
def unseen(hypothesis):
    """A fifth of the lines, which the fit is then made without."""
    use = np.zeros_like(hypothesis.data.use)
    use[-len(use) // 5 :] = True
    return use


@pytest.fixture(scope="module")
def learned(hypothesis, unseen):
    """The hypothesis with a scatter that is felt, found on the lines that were not held out.

    Its numbers are as uncertain as before the test.
    """
    own, x = hypothesis.fit, hypothesis.fit.x.copy()
    (scatter,) = [e for e in own.effects if not e.traits.writable]
    x[own.slice(scatter)] = 3 * np.eye(len(scatter.parameters))[2]
    data = hypothesis.data.using(hypothesis.data.use & ~unseen)
    prior = np.diag([p.sd**2 for e in own.effects for p in e.parameters])
    return replace(hypothesis, fit=replace(own, x=x, data=data, covariance=prior))


def off(deck, whole, use):
    """Mean square of the log deviation between a deck and the hypothesis it was made of."""
    state = evaluate(whole.model, whole.fit.effects, whole.fit.x, False)
    foretold = replace(whole.data, values=whole.data.model(state), use=use)
    delta = foretold.deviation(deck.fit.state)[use]
    return float((np.abs(delta) ** 2).mean())


def test_a_deck_that_can_hold_all_that_was_found_keeps_its_numbers(learned, unseen):
    """Without scatter the hypothesis is the deck: no number moves, wherever the prior would."""
    kept = [e for e in learned.fit.effects if e.traits.writable]
    bare = fit(learned.model, kept, learned.data, None, np.concatenate(
        [learned.fit.of(e) for e in kept]))  # fmt: skip
    deck = as_foretold(replace(learned, fit=bare), None, unseen)
    assert deck.fit.x == pytest.approx(bare.x, abs=2e-3)


def test_a_deck_responds_as_what_was_found_does_on_lines_that_were_held_out_too(learned, unseen):
    """Nearer to it than a deck fitted to what was recorded, or what was found less scatter."""
    whole, deck = learned.data.use | unseen, as_foretold(learned, None, unseen)
    assert [e.name for e in deck.fit.effects] == ["part-scale", "thickness-distribution"]
    for other in (as_written(learned, None), as_found(learned)):
        assert off(deck, learned, whole) < 0.9 * off(other, learned, whole)
    assert deck.fit.of(deck.effect) == pytest.approx(learned.fit.of(learned.effect), abs=5e-3)


@pytest.mark.parametrize("share", [0.5, 0.0])
def test_numbers_of_a_deck_stay_within_the_intervals_of_what_was_found(learned, unseen, share):
    """As far as the narrowest lets them, all along the same line."""
    kept = [e for e in learned.fit.effects if e.traits.writable]
    found = np.concatenate([learned.fit.of(e) for e in kept])
    free = as_foretold(learned, None, unseen).fit.x - found
    at = learned.fit.slice(kept[0])
    covariance = learned.fit.covariance.copy()
    covariance[at, at] = np.diag((share * free[:1] / 1.96) ** 2)
    narrow = replace(learned, fit=replace(learned.fit, covariance=covariance))
    np.testing.assert_allclose(
        as_foretold(narrow, None, unseen).fit.x - found, share * free, atol=1e-9
    )


def test_what_was_held_out_does_not_enter_the_deck(learned, unseen):
    """Its recorded values may be anything."""
    values = np.where(unseen[:, :, None], 7.0 + 3.0j, learned.data.values)
    spoilt = replace(learned, fit=replace(learned.fit, data=replace(learned.data, values=values)))
    one, other = (as_foretold(h, None, unseen) for h in (learned, spoilt))
    np.testing.assert_allclose(one.fit.x, other.fit.x, atol=1e-5)


def test_what_the_mesh_hides_is_made_up_for_and_still_known(learned, unseen, reduced):
    """E takes up the error a deck cannot hold; the error itself stays as it was found."""
    plain = modelled(reduced.structure.assembly, 2.5 * 200.0)
    over = mesh_errors(plain, 200.0)[0]
    E, effect = learned.fit.effects[0], learned.effect
    effects, x = (E, over, effect), np.concatenate([[0.0], [4.0], learned.fit.of(effect)])
    model = reduced.model_for(over, np.array([4.0]))
    state = evaluate(model, effects, x, False)
    own = replace(
        learned.fit, effects=effects, x=x, state=state, data=learned.data.rebased(model),
        covariance=np.eye(len(x)),
    )  # fmt: skip
    found = HypothesisFit(effect, own, model)
    deck = as_foretold(found, None, unseen)
    assert deck.fit.of(over) == pytest.approx([4.0])
    assert abs(deck.fit.of(E)[0]) > 1e-3
    whole, bare = found.data.use | unseen, np.array([1.0, 0.0, *np.ones(len(x) - 2)])

    def written(values):
        at = evaluate(model, effects, values * bare, False)
        return off(replace(deck, fit=replace(deck.fit, state=at)), found, whole)

    assert written(deck.fit.x) < 0.5 * written(x)


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


DUE = threshold(object.__new__(Responses), 1)  # of one family
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


def test_numbers_as_they_were_found_are_those_of_the_null(scattered):
    """The scatter beside them is gone; values and what is known of them stay."""
    found, fitted = as_found(scattered), scattered.fit
    E = fitted.effects[0]
    assert found.fit.effects == (E,)
    assert found.fit.of(E) == fitted.of(E)
    assert found.fit.sd(E) == fitted.sd(E)
    due = evaluate(scattered.model, [E], fitted.of(E), False)
    assert found.fit.state.lam[6:] == pytest.approx(due.lam[6:])


def glued(reduced):
    """A hundredth of the plate's stiffness as if it were that of adhesive."""
    K, prior = reduced.structure.system.K, (Parameter("k", "-", 0.0, ADHESIVE),)
    return ModelFamily(prior, "adhesive", operator=sp.csr_array(0.01 * K))


def calibration(base, data, found, changed=0.0):
    """What is answered where nothing is named, and calibration gained so much."""
    null = replace(row_of_null(found.null), p=0.5)
    table = HypothesisTable(
        {NULL: null}, nominal=null.neg2_log_evidence + changed,
        implausible=bool(implausible_values(found.plain.fit)), families=20,
    )  # fmt: skip
    n = sum(len(e.parameters) for e in base)
    problem = SimpleNamespace(base=base, mass_measurement=None, mean=lambda: np.zeros(n))
    prepared = SimpleNamespace(problem=problem, score=data, too_little="", numbers=9)
    found = replace(found, table=table)
    return concluded(prepared, found, *decided(prepared, found, lambda hypothesis: 1 / 0))[0]


@pytest.mark.parametrize(("x", "verdict"), [(1.6, "calibration only"), (1.4, "nothing missing")])
def test_a_deck_whose_joints_are_strained_is_calibrated(reduced, responses, x, verdict):
    """The joints explain what E, rho and t would add nothing to: they are what is written."""
    data, base = (
        responses.rebased(reduced.model),
        (calibration_parameter(reduced.groups, "E", [0]), glued(reduced)),
    )

    def at(x):
        found = fit(reduced.model, base, data, None, np.array([0.0, x]), max_steps=0)
        return HypothesisFit(Effect(), found, reduced.model)

    data = replace(data, values=data.model(at(x).fit.state))
    quiet = Diagnosis(at(0.0), at(x), at(0.0), ())
    found = calibration(base, data, quiet)
    assert found.verdict == verdict
    written = [e.text for e in found.plain.fit.effects]
    assert written == [base[0].text, "adhesive"][: 2 if x > 1.5 else 1]


def test_joints_that_took_more_than_they_scatter_are_numbers_of_the_deck(responses, reduced):
    """Beyond 3 sd: calibrated beside E; within, a nuisance that no deck holds."""
    E, adhesive = calibration_parameter(reduced.groups, "E", [0]), glued(reduced)
    for x, kept in ((1.6, ["E", "k"]), (1.4, ["E"])):
        at = np.array([0.02, x])
        data = responses.rebased(reduced.model)
        begun = fit(reduced.model, [E, adhesive], data, None, at, max_steps=0)
        found = as_found(HypothesisFit(Effect(), begun, reduced.model)).fit
        assert [p.name for e in found.effects for p in e.parameters] == kept
        assert list(found.x) == [0.02, x][: len(kept)]
        due = evaluate(reduced.model, [E, adhesive][: len(kept)], found.x, False)
        assert found.state.lam[6:] == pytest.approx(due.lam[6:])


def prudent(monkeypatch, reduced, responses, E, plain):
    """Calibration as it is answered with, E of the null and of plain calibration given."""
    data, base = (
        responses.rebased(reduced.model),
        (calibration_parameter(reduced.groups, "E", [0]),),
    )

    def at(x):
        found = fit(reduced.model, base, data, None, np.array([x]), max_steps=0)
        return HypothesisFit(Effect(), found, reduced.model)

    for made in ("as_found", "as_written"):
        monkeypatch.setattr(deciding, made, lambda null, mass=None: at(E))
    begun = at(plain)
    return calibration(base, data, Diagnosis(begun, begun, begun, ()), 100.0), begun


@pytest.mark.parametrize(("E", "kept"), [(0.03, True), (0.2, False)])
def test_prudent_values_are_kept_where_they_do_not_fit_worse_than_the_deck(
    monkeypatch, reduced, responses, E, kept
):
    found, plain = prudent(monkeypatch, reduced, responses, E, 0.04)
    assert (found.plain is not plain) == kept


def test_where_no_number_serves_the_deck_stays_as_it_is(monkeypatch, reduced, responses):
    """Neither the prudent values nor those of plain calibration, 8 sd off, which nobody has."""
    found, _ = prudent(monkeypatch, reduced, responses, 0.2, 0.5)
    assert found.plain.fit.x == pytest.approx([0.0])
    assert found.verdict == "nothing missing"
    assert "the deck keeps its numbers" in found.notes[-1]


@pytest.mark.parametrize("begun", [True, False])
def test_values_that_make_no_structure_are_not_prudent(monkeypatch, reduced, responses, begun):
    """A stiffness that is no longer positive has no Q: the calibration stays, without a fault.

    Nor where no fit of them could even be begun.
    """
    data = responses.rebased(reduced.model)
    base = (calibration_parameter(reduced.groups, "E", [0]),)
    found = fit(reduced.model, base, data, None, np.array([0.04]), max_steps=0)
    plain = HypothesisFit(Effect(), found, reduced.model)
    none = HypothesisFit(Effect(), replace(found, x=np.array([np.inf])), reduced.model)
    real = deciding.evaluate

    def evaluated(model, effects, x, gradient):
        if not np.isfinite(x).all():
            raise ModelError("an effect left negative stiffness")
        return real(model, effects, x, gradient)

    def asked(null, mass=None):
        if begun:
            return none
        raise ModelError("an effect left negative stiffness")

    monkeypatch.setattr(deciding, "evaluate", evaluated)
    for made in ("as_found", "as_written"):
        monkeypatch.setattr(deciding, made, asked)
    assert calibration(base, data, Diagnosis(plain, plain, plain, ()), 100.0).plain is plain


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
        return verdict_models.applied(reduced.structure.assembly, named)

    one, other = written(sheet, patch), written(patch, sheet)
    assert len(one.parts) == len(other.parts) > 1
    for mine, its in zip(one.parts, other.parts, strict=True):
        assert (mine.section.bending.E1, mine.name) == (its.section.bending.E1, its.name)


def held(nominal, calibrated, floor=None):
    return Agreement(held_out=Scores(nominal=nominal, calibrated=calibrated, floor=floor))


def test_numbers_that_foretell_worse_than_the_deck_are_not_to_be_trusted():
    """What is fitted must serve what was not; only what noise leaves of Q may be chance."""
    (why,) = foretells_worse(held(0.315, 0.938, 0.01))
    assert "0.938, 0.315 before" in why
    assert 'gain = "unknown"' in why
    assert "position_sd" in why
    assert foretells_worse(held(0.108, 0.150))
    assert not foretells_worse(held(0.108, 0.115, 0.01))
    assert not foretells_worse(held(0.108, 0.108))
    assert not foretells_worse(held(None, None))
    assert not foretells_worse(None)
