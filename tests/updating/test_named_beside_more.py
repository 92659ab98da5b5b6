"""A leader that leaves more than it explains is asked with what may be missing beside it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from chladni.updating import several_judged
from chladni.updating.diagnosis import Diagnosis
from chladni.updating.outcome import LEAVES_MORE
from chladni.updating.question import Prepared
from chladni.updating.several import Search, Several, _better
from chladni.updating.several_judged import named_beside_more, perhaps_beside

LEFT = f"it {LEAVES_MORE}"
NULL = SimpleNamespace(data=None, neg2_log_evidence=0.0)
LEAD = SimpleNamespace(verdict="missing physics", name="sensor-mass")
NONE = SimpleNamespace(effects=(), name="")
SETS = tuple(
    SimpleNamespace(hypothesis=h, pay=h == "paid", own=NONE, gains=(), due=0.0)
    for h in ("paid", "pair", "three")
)
ALONE = cast(Diagnosis, Diagnosis(NULL, NULL, NULL, (LEAD,), "missing physics", sets=SETS))
REFUSED = replace(ALONE, verdict="not in catalogue", refused=LEFT, notes=("it leaves more",))


def answer(monkeypatch, refused, named=""):
    """What is answered, and the sets that are asked, the last of which is named if it is any."""
    asked = []

    def named_together(prepared, alone, more, whole):
        asked.append(whole)
        found = replace(ALONE, notes=("together",)) if whole == named else None
        return found, "" if found else f"{whole} is not borne"

    monkeypatch.setattr(several_judged, "named_together", named_together)
    renew = lambda h: SimpleNamespace(hypothesis=h, note="renewed", distrust=("far",))  # noqa: E731
    return *named_beside_more(cast(Prepared, None), ALONE, refused, renew), asked


def test_the_largest_set_that_all_data_bear_is_named(monkeypatch):
    found, doubts, asked = answer(monkeypatch, REFUSED, "pair")
    assert asked == ["three", "pair"]  # what pays by itself was asked before
    assert found.verdict == "missing physics"
    assert found.notes == ("together", "renewed")
    assert doubts == ("far",)


def test_sets_that_they_do_not_bear_leave_the_refusal_and_are_said(monkeypatch):
    found, doubts, _ = answer(monkeypatch, REFUSED)
    assert (found.verdict, found.refused, doubts) == ("not in catalogue", LEFT, ())
    assert found.notes == ("it leaves more", "three is not borne", "pair is not borne")


@pytest.mark.parametrize("refused", [ALONE, replace(REFUSED, refused="its damping is odd")])
def test_none_is_asked_where_the_leader_stands_or_other_data_refuse_it(monkeypatch, refused):
    assert answer(monkeypatch, refused, "pair") == (refused, (), [])


def test_what_pays_in_part_beside_those_that_are_named_is_said():
    def of(*effects, due=31.0):
        own = SimpleNamespace(effects=[SimpleNamespace(name=name) for name, _ in effects])
        own.name = " and ".join(name for name, _ in effects)
        return cast(Several, SimpleNamespace(own=own, gains=[g for _, g in effects], due=due))

    pair = of(("sensor-mass", 130.0), ("thickness-distribution", 111.0))
    three = of(("sensor-mass", 145.0), ("thickness-distribution", 118.0), ("hem-contact", 28.0))
    (said,) = perhaps_beside(pair, (pair, three))
    assert said.startswith("beside sensor-mass and thickness-distribution hem-contact gains 28 ")
    assert perhaps_beside(pair, (pair,)) == ()
    assert perhaps_beside(pair, (of(("sensor-mass", 20.0), ("crack", 40.0)),)) == ()


def test_of_two_searches_the_one_whose_set_pays_in_full_is_the_better():
    def search(*sets):
        each = (
            SimpleNamespace(pay=pay, hypothesis=SimpleNamespace(neg2_log_evidence=S))
            for pay, S in sets
        )
        return Search(cast(tuple[Several, ...], tuple(each)), "")

    none, part, paid, more = (
        search(),
        search((False, -90)),
        search((True, -50)),
        search((True, -60)),
    )
    assert _better(part, paid) is _better(paid, part) is paid
    assert _better(paid, more) is more
    assert _better(paid, search((True, -60), (False, -99))).sets[0].pay
    assert _better(none, part) is _better(part, none) is part
    assert _better(none, search()) is none
