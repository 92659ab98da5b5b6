"""A hypothesis that holds the null within it never loses to it for want of a start."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.search_context import Candidate
from chladni.errors import ModelError
from chladni.inference.hypothesis_fit import HypothesisFit
from chladni.inference.likelihood import Responses
from chladni.inference.map_fit import Status
from chladni.search import search_round
from chladni.search.search_round import (
    BEHIND,
    _closer,
    _finished,
    _jointly,
    _leaders,
    _own_optima,
    _tried,
    by_family,
)

NULL = SimpleNamespace(neg2_log_evidence=100.0, fit=SimpleNamespace(x=np.ones(2)))


class UpdatingProblem:
    """A fit from zeros stops at ``first``, one from the null's parameters at ``again``."""

    def __init__(self, first, again):
        self.ends, self.starts = {0.0: first, 1.0: again}, []

    def fitted_with(self, effect, start, base, steps, model):
        self.starts.append(float(base[0]))
        if self.ends[float(base[0])] is None:
            raise ModelError("an effect left negative stiffness")
        return SimpleNamespace(neg2_log_evidence=self.ends[float(base[0])])


@pytest.mark.parametrize(
    ("first", "again", "starts", "end"),
    [
        (90.0, 0.0, [0.0], 90.0),  # better than the null: no second start
        (100.0 + BEHIND - 1, 0.0, [0.0], 100.0 + BEHIND - 1),  # behind by its price only
        (5000.0, 80.0, [0.0, 1.0], 80.0),  # stopped on the way
        (5000.0, 9000.0, [0.0, 1.0], 5000.0),  # the better of both
        (None, 80.0, [0.0, 1.0], 80.0),  # the first start is no structure
        (5000.0, None, [0.0, 1.0], 5000.0),
    ],
)
def test_what_stays_behind_the_null_begins_there(first, again, starts, end):
    problem = UpdatingProblem(first, again)
    found = _tried(problem, NULL, None, np.zeros(1), np.zeros(2))
    assert min(t.neg2_log_evidence for t in found) == end
    assert problem.starts == starts


@pytest.mark.parametrize(
    ("expected", "joint", "worst", "fitted"),
    [
        ([50.0, 80.0, 40.0], [50.0, 80.0, 40.0], np.inf, [2]),  # linear: the others stay behind
        ([44.0, 80.0, 40.0], [30.0, 60.0, 20.0], np.inf, [2]),  # all are 20 better than linear
        ([50.0, 80.0, 40.0], [30.0, 60.0, 60.0], np.inf, [2, 0]),  # the next may be the best
        ([50.0, 80.0, 40.0], [30.0, 60.0, 60.0], 31.0, [2, 0]),
        ([50.0, 80.0, 40.0], [30.0, 60.0, 60.0], 29.0, [2]),  # another family is far ahead
        ([50.0, 80.0, None], [30.0, 60.0, None], np.inf, [0]),  # no structure
    ],
)
def test_what_may_be_the_best_of_its_family_is_fitted_jointly(expected, joint, worst, fitted):
    """The linear base may be as wrong about one place as about another; all places are known."""
    problem, done = problem_of({k: joint[k] for k in range(3)}, expected)
    tried = [Candidate(e, np.zeros(1), np.zeros(1)) for e in effects_at("mass", 3)]
    optima = _own_optima(problem, NULL, [*tried, tried[0]])
    (lead,), others = _jointly(problem, NULL, optima)
    found = by_family(others.tried(problem, NULL, lead, worst))
    assert done == fitted
    assert found[0].fit.neg2_log_evidence == min(joint[k] for k in fitted)
    known = {found[0].effect.k, *(v.effect.k for v in found[0].optima)}
    left_out = {0, 1} if worst == 29.0 else set()  # a linear 50 is no rival of a joint 60
    assert known == {k for k in range(3) if expected[k] is not None} - left_out


@pytest.mark.parametrize(
    ("hidden", "least", "fitted"),
    [
        (0.0, None, 5),  # those with the best own optima alone: the sixth is 31.6 behind
        (2.0, None, 6),  # the base hid 2 of the fourth
        (0.0, 22.0, 2),  # a later round: the third gains 21
        (2.0, 22.0, 3),
    ],
)
def test_families_whose_own_optimum_is_far_behind_are_not_fitted(hidden, least, fitted):
    """They stay hypotheses at that optimum; what joint fits gain over it is room for others."""
    expected = [50.0, 70.0, 81.6, 79.0, 80.0, 81.5, 90.0]
    joint = {k: S for k, S in enumerate(expected)} | {1: 70.0 - hidden, 3: 79.0 - hidden}
    problem, done = problem_of(joint, expected)
    effects = [effects_at(f"family-{k}", 7)[k] for k in range(7)]
    families = ([hypothesis_of(e, expected[e.k])] for e in effects)
    left = []
    found = [t for fits, _ in _leaders(problem, NULL, families, least, left) for t in fits]
    assert sorted(t.effect.k for t in (*found, *left)) == list(range(7))
    assert len(done) == fitted


def effects_at(name, count):
    nowhere = SimpleNamespace(point_m=None, radius_m=None)
    return [
        SimpleNamespace(k=k, name=name, text=f"at grid {k}", location=lambda x, sd: nowhere)
        for k in range(count)
    ]


def problem_of(joint, expected):
    """A problem with these own optima and joint fits, and the list of the latter."""
    done = []

    def own(effect, start, bases):
        if expected[effect.k] is None:
            raise ModelError("an effect left negative stiffness")
        return hypothesis_of(effect, expected[effect.k])

    def fit(effect, start, base, steps, model):
        done.append(effect.k)
        return hypothesis_of(effect, joint[effect.k])

    common = SimpleNamespace(model=None)
    return SimpleNamespace(
        own_optimum=own, fitted_with=fit, mean=lambda: NULL.fit.x, base=(), reduced=common
    ), done


@dataclass(frozen=True)
class OneParameter:
    neg2_log_evidence: float
    data: object
    effects: tuple = ()

    def of(self, effect):
        return np.zeros(1)

    def sd(self, effect):
        return np.ones(1)


def hypothesis_of(effect, evidence):
    """A fit of one effect with this evidence."""
    data = SimpleNamespace(rebased=lambda model: None)
    return HypothesisFit(effect, OneParameter(evidence, data), None)


@pytest.mark.parametrize("status", list(Status))
@pytest.mark.parametrize("running", [True, False])
def test_what_ran_out_of_steps_is_fitted_to_the_end(monkeypatch, status, running):
    """In the running or not: a hypothesis is judged where it comes to rest."""
    end = SimpleNamespace(neg2_log_evidence=1.0)
    monkeypatch.setattr(search_round, "fitted", lambda *given: end)
    left = SimpleNamespace(
        neg2_log_evidence=9.0, effects=(), x=np.zeros(1), status=status, data=None
    )
    problem = SimpleNamespace(data=object.__new__(Responses), mass_measurement=None)
    got = _finished(problem, HypothesisFit(None, left, None), running)
    assert got.neg2_log_evidence == (1.0 if running or status is Status.OUT_OF_STEPS else 9.0)


@pytest.mark.parametrize(("gains", "followed"), [([5.0, 3.0], 3), ([0.5, 9.0], 1), ([5.0], 2)])
def test_a_leader_goes_on_to_where_its_family_finds_it_closer(gains, followed):
    """Until it gains no more, or nothing next to it does; from the base of its own fit."""
    bases, lead = [], hypothesis_at("weld", 50.0)

    def closer(context, effect, x):
        bases.append(context.bases[-1])
        return Candidate(effect, x, context.bases[-1]) if len(bases) <= len(gains) + 1 else None

    left = iter(50.0 - np.cumsum([*gains, 0.0]))
    families = (SimpleNamespace(name="weld", closer=closer),)
    problem = SimpleNamespace(
        base=(), where=None, mean=lambda: np.zeros(0), families=families,
        fitted_with=lambda effect, start, base: hypothesis_at("weld", next(left)),
    )  # fmt: skip
    assert len(_closer(problem, NULL, lead)) == followed
    assert len(bases) == followed
    assert _closer(problem, NULL, hypothesis_at("of another family", 50.0)) == []


def hypothesis_at(name, evidence):
    effect = SimpleNamespace(name=name)
    fit = SimpleNamespace(effects=(), of=lambda effect: np.zeros(1), neg2_log_evidence=evidence)
    return SimpleNamespace(
        effect=effect, effects=(effect,), fit=fit, neg2_log_evidence=evidence, data=None
    )


def test_what_is_one_answer_with_the_best_is_in_the_running():
    """A lump that gained 7 beside a weld's 11 was fifth, and was never closed in on."""
    fits = [SimpleNamespace(neg2_log_evidence=v) for v in (88.6, 91.0, 92.8, 93.2, 93.0, 98.7)]
    assert search_round._in_the_running(fits) == 5
    assert search_round._in_the_running([]) == 0
