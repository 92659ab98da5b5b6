"""A leader that leaves more than it explains is asked with what may be missing beside it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from chladni.updating import several_judged
from chladni.updating.diagnosis import Diagnosis
from chladni.updating.likelihood import Responses
from chladni.updating.outcome import GOOD_PART, LEAVES_MORE
from chladni.updating.question import Prepared
from chladni.updating.several import Search
from chladni.updating.several_judged import named_beside_more

LEFT = f"it {LEAVES_MORE}"
DATA = object.__new__(Responses)
NULL = SimpleNamespace(data=DATA, neg2_log_evidence=0.0)
LEAD = SimpleNamespace(verdict="missing physics", name="sensor-mass")
ALONE = cast(Diagnosis, Diagnosis(NULL, NULL, NULL, (LEAD,), "missing physics"))
REFUSED = replace(ALONE, verdict="not in catalogue", refused=LEFT, notes=("it leaves more",))
PAIR = SimpleNamespace(hypothesis="both")
RENEWAL = SimpleNamespace(hypothesis="both, renewed", note="renewed", distrust=("far",))


@pytest.fixture
def asked(monkeypatch):
    """What was searched, with which part of the price; a pair is found."""
    calls = []

    def several(problem, singles, due, unfit, progress, part):
        calls.append((singles, part))
        return Search((PAIR,), "")

    monkeypatch.setattr(Responses, "over", lambda self, model: self)
    monkeypatch.setattr(several_judged, "replace", replace_)
    monkeypatch.setattr(several_judged, "several", several)
    return calls


def replace_(of, **changes):
    """Of what is no dataclass here as well."""
    if isinstance(of, SimpleNamespace):
        return SimpleNamespace(**{**vars(of), **changes})
    return replace(of, **changes)


def answer(refused):
    problem = SimpleNamespace(reduced=SimpleNamespace(model=None), data=None)
    prepared = cast(Prepared, SimpleNamespace(problem=problem))
    return named_beside_more(
        prepared, ALONE, refused, lambda hypothesis: RENEWAL, lambda text, share: None
    )


def test_a_pair_that_all_data_bear_is_named(monkeypatch, asked):
    together = replace(ALONE, notes=("together",))
    monkeypatch.setattr(several_judged, "named_together", lambda *given: (together, ""))
    found, doubts = answer(REFUSED)
    assert asked == [((LEAD,), GOOD_PART)]
    assert found.verdict == "missing physics"
    assert found.notes == ("together", "renewed")
    assert doubts == ("far",)


def test_a_pair_that_they_do_not_bear_leaves_the_refusal_and_is_said(monkeypatch, asked):
    monkeypatch.setattr(several_judged, "named_together", lambda *given: (None, "not borne"))
    found, doubts = answer(REFUSED)
    assert (found.verdict, found.refused, doubts) == ("not in catalogue", LEFT, ())
    assert found.notes == ("it leaves more", "not borne")


@pytest.mark.parametrize("refused", [ALONE, replace(REFUSED, refused="its damping is odd")])
def test_nothing_is_searched_where_the_leader_stands_or_other_data_refuse_it(asked, refused):
    assert answer(refused) == (refused, ())
    assert not asked
