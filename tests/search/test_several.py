"""Several effects at once: each must pay, in whatever order they are found; one alone stays one."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from chladni import parallel
from chladni.effects import masses
from chladni.effects.calibration_parameters import calibration_parameter, random_field
from chladni.effects.effect import Effect
from chladni.effects.effect_context import Setup
from chladni.effects.masses import LocalResonator, PointMass
from chladni.effects.masses import sensor_mass as masses_of_sensors
from chladni.effects.registry import catalogue, families
from chladni.effects.search_context import Candidate
from chladni.effects.sheets import MassPatch
from chladni.effects.springs import ExtraSupport
from chladni.fem.energy import mass_properties
from chladni.inference.held_out_evidence import held_out_evidence
from chladni.inference.hypothesis_fit import HypothesisFit, UpdatingProblem, fitted
from chladni.inference.likelihood import Responses
from chladni.inference.map_fit import MassMeasurement
from chladni.inference.written_hypothesis import as_written
from chladni.reduced.reduced_model import evaluate
from chladni.search import diagnosis as diagnosing
from chladni.search.candidates import UpdatingContext, candidates, proposals, repeats
from chladni.search.decision_rules import required_gain
from chladni.search.diagnosis import Diagnosis, FitChances, could_not_be_evaluated
from chladni.search.hypotheses import Hypotheses
from chladni.search.search_round import _of_the_same_lump, on_common_basis, search_round
from chladni.search.several import _begun_with, _More, _paying, _revised, _same, several

SENSORS = [1, 7, 57, 63, 25, 39]
TOP, LINES = 200.0, 30
HELD = slice(-4, None)  # lines
FEW = (masses.POINT, masses.SENSORS)  # two are enough to go wrong with


def at(reduced, *xy):
    """Position of the grid next to a place of the plate [m]."""
    return int(np.argmin(np.linalg.norm(reduced.grids.point[:, :2] - xy, axis=1)))


def problem_of(reduced, hidden, mass=0.0):
    """The plate, seen at six sensors, with effects hidden in it: [(effect, x)]."""
    rows = reduced.grids.rows[[reduced.grids.position(g) for g in SENSORS]]
    s = 2 * np.pi * np.linspace(25, TOP, LINES) * (0.08 + 1j)
    base = (
        calibration_parameter(reduced.groups, "E", [0]),
        random_field(reduced.groups, "t", 0.01),
    )
    shares = tuple(((g, 1.0),) for g in SENSORS)
    setup = Setup(
        shares, (SENSORS[1], SENSORS[3]), mass_properties(reduced.structure.assembly)[0], TOP
    )
    ones = np.ones((LINES, len(SENSORS), 1), complex)
    use = np.ones(ones.shape[:2], bool)
    use[HELD] = False
    empty = Responses(ones, s, rows, rows[[4]], use)
    weighed = MassMeasurement(setup.weight + mass, 1e-3 * setup.weight)
    labels = tuple(f"{g}:+Z" for g in SENSORS)
    problem = UpdatingProblem(
        reduced, empty.rebased(reduced.model), weighed, base, (), setup, labels, families=FEW
    )
    hidden = [(of(problem.where), x) for of, x in hidden]
    article = problem.holding(hidden)
    state = evaluate(article.reduced.model, article.base, article.mean(), False)
    noise = np.exp(0.003 * np.random.default_rng(1).normal(size=(2, *ones.shape)).T @ [1, 1j]).T
    values = article.data.model(state) * noise
    data = replace(problem.data, values=values)
    nominal = evaluate(reduced.model, base, problem.mean(), False)
    return replace(problem, data=data.allowing_errors(nominal))


def lump(reduced, where, m):
    """A mass of m times the median of its prior at a place, as :func:`problem_of` takes it."""
    k = at(reduced, *where)
    return (lambda there: PointMass.near(there, k)), np.array([np.log(m), 0.0, 0.0])


def null_of(problem):
    model = problem.reduced.model
    fit = fitted(model, problem.base, problem.data, problem.mass_measurement, problem.mean())
    return HypothesisFit(Effect(), fit, model)


def singles_of(problem):
    null = null_of(problem)
    return search_round(problem, null, candidates(problem, null), lambda text, share: None)


def places(hypothesis):
    """Names and places [cm] of a set, in an order of their own."""
    where = [e.location(hypothesis.fit.of(e)).point_m for e in hypothesis.effects]
    return sorted(
        (e.name, *np.round(p or (0, 0, 0), 2))
        for e, p in zip(hypothesis.effects, where, strict=True)
    )


HERE, THERE = (0.1, 0.05), (0.3, 0.25)
DUE = required_gain(False, len(families()))


@pytest.fixture(scope="module")
def two(reduced):
    """Two lumps, one twice the other."""
    one, other = lump(reduced, HERE, 1.0), lump(reduced, THERE, 2.0)
    weight = 0.03 * mass_properties(reduced.structure.assembly)[0]
    return problem_of(reduced, [one, other], 3 * weight)


@pytest.fixture(scope="module")
def found(two):
    singles = singles_of(two)
    return singles, several(two, singles, DUE, False)


def test_candidates_side_by_side_end_where_they_end_one_after_the_other(two, found, monkeypatch):
    monkeypatch.setattr(parallel, "threads", lambda: 3)
    for one, other in zip(singles_of(two), found[0], strict=True):
        assert one.effects[0].text == other.effects[0].text
        np.testing.assert_allclose(one.fit.x, other.fit.x, rtol=1e-9, atol=1e-12)


def test_two_lumps_are_two_each_at_its_place(found):
    singles, search = found
    assert len(singles[0].effects) == 1
    (both,) = search.sets
    assert [e.name for e in both.own.effects] == ["point-mass", "point-mass"]
    known = [e.location(both.own.fit.of(e)).point_m[:2] for e in both.own.effects]
    for where in (HERE, THERE):
        assert min(np.linalg.norm(np.subtract(p, where)) for p in known) < 0.02
    assert both.hypothesis.neg2_log_evidence < singles[0].neg2_log_evidence - both.due


@pytest.mark.parametrize("only", ["local-resonator", "mass-patch"])
def test_a_mass_that_no_candidate_was_is_found_where_another_lump_is(reduced, only):
    """A scan proposes a lump on a spring alone, or a spread one: the mass leads all the same."""
    weight = 0.06 * mass_properties(reduced.structure.assembly)[0]
    problem = problem_of(reduced, [lump(reduced, HERE, 2.0)], weight)
    problem = replace(problem, families=catalogue())
    where, k = problem.where, at(reduced, *HERE)
    spread = MassPatch.of_lump(where, where.grids.point[k], 0.5 * weight)
    swings = LocalResonator.near(where, k), np.array([0.5, 0.0, 0.0, 0.5])
    begun = {"local-resonator": swings, "mass-patch": spread}[only]
    tried, null = [Candidate(*begun, problem.mean())], null_of(problem)
    best = search_round(problem, null, tried, lambda text, share: None)
    assert {t.name for t in best} == {only, "point-mass", "mass-patch"}
    mass, x = best[0].effect, best[0].fit.of(best[0].effect)
    assert best[0].name == "point-mass"
    assert np.linalg.norm(np.array(mass.location(x).point_m[:2]) - HERE) < 0.01
    assert mass.weight(x).mass == pytest.approx(weight, rel=0.05)


@pytest.mark.parametrize(("place", "begun"), [(HERE, 0), (THERE, 1)])
def test_no_other_lump_is_begun_where_one_was_found(two, place, begun):
    mass, x = PointMass.near(two.where, at(two.reduced, *HERE)), np.zeros(3)
    held = replace(two, families=catalogue()).holding([(mass, x)])
    effect, start = PointMass.of_lump(held.where, np.append(place, 0.0), 0.05)
    fit = SimpleNamespace(of=lambda e: start, effects=())
    lead = SimpleNamespace(effect=effect, effects=(effect,), fit=fit, neg2_log_evidence=0.0)
    assert len(_of_the_same_lump(held, [lead])) == begun


def test_each_gains_what_the_others_lose_without_it(two, found):
    both = found[1].sets[-1]
    assert min(both.gains) > both.due > DUE
    assert both.gains[0] >= both.gains[1]
    for gain, without in zip(both.gains, both.without, strict=True):
        assert gain == pytest.approx(without.neg2_log_evidence - both.own.neg2_log_evidence)
        assert len(without.effects) == 1


def test_each_is_borne_by_lines_that_no_fit_saw(two, found):
    """With the other in place."""
    both = found[1].sets[-1]
    for without in both.without:
        assert held_out_evidence(two, ~two.data.use, without, both.own, both.about) > 0


def test_the_order_in_which_they_are_found_does_not_matter(reduced, two, found):
    """Begun with the weaker of the two, at its own place, the search ends with both."""
    of, x = lump(reduced, HERE, 1.5)
    alone = two.fitted_with(of(two.where), x, null_of(two).fit.x)
    (*_, both) = _begun_with(two, alone, DUE, lambda text, share: None).sets
    assert places(both.own) == places(found[1].sets[-1].own)


def test_a_set_that_is_known_is_not_searched_again(monkeypatch, reduced, two, found):
    """What begins elsewhere and comes upon the same two ends there; two at other places go on."""
    of, x = lump(reduced, THERE, 1.5)
    alone = two.fitted_with(of(two.where), x, null_of(two).fit.x)
    begun = partial(_begun_with, two, alone, DUE, lambda text, share: None)
    assert begun(known=found[1].sets).sets == ()
    (both,) = found[1].sets
    away = replace(both.own, effect=PointMass.near(two.where, at(two.reduced, 0.2, 0.05)))
    monkeypatch.setattr(type(both.own.fit), "of", lambda fit, e: np.zeros(3))
    assert _same(two, both.own, both.own)
    assert not _same(two, both.own, away)
    assert not _same(two, both.own, replace(both.own, found_before=()))


def test_a_rival_has_a_basis_of_its_own_again(two, found):
    """A diagnosis keeps what was found of it, not the vectors that its place added to the basis."""
    lead = found[0][0]
    alternative = on_common_basis(two, lead)
    with pytest.raises(ValueError, match="mismatch"):
        alternative.data.scaled(alternative.fit.state, False)
    null = null_of(two)
    diagnosis = Diagnosis(null, null, null, (lead, alternative))
    rival = Hypotheses(SimpleNamespace(problem=two), diagnosis).singles[1]
    again = rival.whole
    assert rival.chances.test is not None
    assert again.data.scaled(again.fit.state, False)[0].size
    gains = [null.neg2_log_evidence - t.neg2_log_evidence for t in (again, lead)]
    assert gains[0] == pytest.approx(gains[1], rel=0.02)


def test_one_effect_stays_one(reduced):
    """Beside the only one that is there nothing pays, and the note says by how much."""
    weight = 0.03 * mass_properties(reduced.structure.assembly)[0]
    problem = problem_of(reduced, [lump(reduced, HERE, 1.5)], 1.5 * weight)
    search = several(problem, singles_of(problem), DUE, False)
    assert not search.sets
    assert "are required" in search.note


def test_a_mass_of_sensors_beside_a_lump(reduced):
    """Two families, the weaker of which stands at known places and is not on the scales."""
    weight = 0.03 * mass_properties(reduced.structure.assembly)[0]
    lumped = lump(reduced, THERE, 1.5)
    hidden = [lumped, (lambda there: masses_of_sensors(there)[0], np.array([0.3]))]
    problem = problem_of(reduced, hidden, 1.5 * weight)
    (both,) = several(problem, singles_of(problem), DUE, False).sets
    assert sorted(e.name for e in both.own.effects) == ["point-mass", "sensor-mass"]


def test_part_of_the_price_may_do_where_other_data_are_asked_of_the_rest(two, found):
    (paid,) = found[1].sets
    (both,) = several(two, found[0][:1], 1.5 * min(paid.gains), False).sets
    assert (paid.pay, both.pay, places(both.own)) == (True, False, places(paid.own))
    whole, of_it = _revised(two, _More(both.own, {}, {}, both.about), (), both.due)
    assert (len(whole.gains), len(of_it.gains)) == (2, 1)  # the stronger pays in full alone
    assert not several(two, found[0][:1], 2.5 * min(paid.gains), False).sets


def test_what_does_not_pay_goes(two, found):
    """A third that stands beside the two and does nothing is dropped."""
    both = found[1].sets[-1]
    held = two.holding([(e, both.own.fit.of(e)) for e in both.own.effects])
    held = replace(held, data=both.own.data.rebased(held.reduced.model))
    idle = masses_of_sensors(two.where)[0]
    three = held.fitted_with(idle, np.array([-6.0]), held.mean())
    left = _paying(two, _More(three, {}, {}, both.about), both.due, 1.0)
    assert idle not in left.own.effects
    assert places(left.own) == places(both.own)


def test_what_has_a_place_stands_at_one_of_its_own(two, found):
    """The same lump again, one beside it, or a spring in its place is none; one elsewhere is."""
    both = found[1].sets[-1]
    e = both.own.effect
    x = both.own.fit.of(e)
    held = two.holding([(e, x)])
    assert repeats(held, e, x)
    k = two.where.grids.position(e.nearest(x))
    assert repeats(held, PointMass.near(two.where, k), np.zeros(3))
    assert repeats(held, ExtraSupport.near(two.where, k), np.zeros(5))
    away = PointMass.near(two.where, at(two.reduced, *HERE))
    there = PointMass.near(two.where, at(two.reduced, *THERE))
    held = two.holding([(there, np.zeros(3))])
    assert not repeats(held, away, np.zeros(3))
    assert not repeats(held, masses_of_sensors(two.where)[0], np.zeros(1))


def test_there_are_no_two_resonators(two):
    """Resonators in parallel are the partial fractions of whatever is attached: two are no find."""
    here, there = (
        LocalResonator.near(two.where, at(two.reduced, *where)) for where in (HERE, THERE)
    )
    start = np.array([p.mean for p in here.parameters])
    held = two.holding([(here, start)])
    assert repeats(held, there, start)
    assert not repeats(held, PointMass.near(two.where, at(two.reduced, *THERE)), np.zeros(3))


def test_what_is_written_holds_all_that_was_found(found):
    """Both stand in the deck as they were found; scatter is gone."""
    both = found[1].sets[-1]
    deck = as_written(both.hypothesis, None)
    assert len(deck.effects) == 2
    assert [e.name for e in deck.fit.effects] == ["part-scale", "point-mass", "point-mass"]
    for e, was in zip(deck.effects, both.hypothesis.effects, strict=True):
        assert deck.fit.of(e) == pytest.approx(both.hypothesis.fit.of(was), abs=5e-3)


def test_where_nothing_is_named_and_calibration_fits_nothing_more_is_sought(monkeypatch):
    """A null costs nothing and stays one."""
    null = SimpleNamespace(data=SimpleNamespace(error=1), neg2_log_evidence=0.0)
    effect = SimpleNamespace(name="point-mass", expected=False)
    lead = SimpleNamespace(effect=effect, neg2_log_evidence=-1.0)
    monkeypatch.setattr(diagnosing, "several", lambda *given: 1 / 0)
    quiet = Diagnosis(null, null, null, (lead,), test=FitChances(None, 0.5, 1.0))
    assert diagnosing._with_sets_of_effects(None, quiet, None) is quiet


@pytest.mark.parametrize("shift", [-0.6, 0.6])
def test_a_deck_far_off_in_frequency_is_calibrated(reduced, shift):
    """From the deck's own E a fit stops between two resonances."""
    problem = problem_of(reduced, [])
    data = replace(problem.data, s=problem.data.s.imag * (0.02 + 1j))
    state = evaluate(reduced.model, problem.base, np.append(shift, problem.mean()[1:]), False)
    problem = replace(problem, data=replace(data, values=data.model(state)))
    _, null = diagnosing.without_effects(problem)
    assert null.fit.x[0] == pytest.approx(shift, abs=0.03)


class Sinking(PointMass):
    """A spring to ground of negative stiffness, wherever it begins."""

    name = "sinking"

    def terms(self, x):
        return tuple(
            replace(t, matrix="K", coefficient=-1e12 * np.ones(1)) for t in super().terms(x)
        )


def test_what_fails_numerically_is_one_hypothesis_lost(reduced):
    """In the scan or in every fit of it; all other families are found as without it."""

    def raises(context):
        raise np.linalg.LinAlgError("singular matrix")

    def sinks(context):
        k = at(reduced, *HERE)
        effect = Sinking(**vars(PointMass.near(context.where, k)))
        return [Candidate(effect, np.zeros(3), context.bases[0])]

    own = {f.name: f for f in FEW}["point-mass"]
    broken = replace(
        own, effect=type("Broken", (PointMass,), {"name": "broken"}), candidates=raises
    )
    sinking = replace(own, effect=Sinking, candidates=sinks, closer=None)
    weight = 0.03 * mass_properties(reduced.structure.assembly)[0]
    problem = problem_of(reduced, [lump(reduced, HERE, 1.0)], weight)
    problem = replace(problem, families=(broken, sinking, own))
    null = null_of(problem)
    tried, lost = proposals(UpdatingContext(problem, null))
    singles = search_round(problem, null, tried, lambda text, share: None)
    assert [t.effect.name for t in singles] == ["point-mass"]
    assert sorted(could_not_be_evaluated(tried, lost, singles)) == [
        "the hypothesis broken could not be evaluated: singular matrix",
        "the hypothesis sinking could not be evaluated: no start of its fit is a structure",
    ]
