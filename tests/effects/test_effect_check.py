"""The check of an effect: an effect that is right keeps every rule, a broken one breaks its own."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.sparse as sp
from tests.builders.commands import ran, refused

import chladni
from chladni.effects import Weight, registry, strength
from chladni.errors import AccuracyError, LabelError
from chladni.io.nastran import write_assembly
from chladni.model.point_masses import with_masses
from chladni.model.properties import BeamSection
from chladni_contract.effect_check import PROPOSES, RULES, checked_rules
from chladni_specimens import STEEL, folded_panel

from .conftest import example

GRIDS = (28, 29)  # of the middle of the plate


@pytest.fixture(scope="module")
def stringer(tmp_path_factory):
    """The effect of the page on extensions, as a package that is installed."""
    with example("stringer", tmp_path_factory.mktemp("site")) as family:
        yield family


@pytest.fixture(scope="module")
def on_plate(grounds):
    return grounds("plate")


def broken(family, **methods):
    """The family with a class in which some methods and attributes are others."""
    made = dataclass(frozen=True, eq=False)(type("Broken", (family.effect,), methods))

    def placed(where):
        return [made(**vars(effect)) for effect in family.placed(where)]

    return replace(family, effect=made, placed=placed)


def half_slope(self, x):
    return tuple(replace(t, gradient=0.5 * t.gradient) for t in super(type(self), self).terms(x))


def one_sided(self, x):
    first, *rest = super(type(self), self).terms(x)
    operator = first.operator + 1e-3 * sp.triu(first.operator, 1)
    return (replace(first, operator=sp.csr_array(operator)), *rest)


def negative(self, x):
    return tuple(
        replace(t, coefficient=-t.coefficient, gradient=-t.gradient)
        for t in super(type(self), self).terms(x)
    )


def weak(self, x):
    return tuple(
        replace(t, coefficient=1e-6 * t.coefficient, gradient=1e-6 * t.gradient)
        for t in super(type(self), self).terms(x)
    )


def twice(self, x):
    return tuple(
        replace(t, coefficient=2 * t.coefficient, gradient=2 * t.gradient)
        for t in super(type(self), self).terms(x)
    )


def never_idle(self, x):
    return tuple(
        replace(t, coefficient=t.coefficient + 0.5) for t in super(type(self), self).terms(x)
    )


def weightless(self, x):
    return Weight(0.0, np.zeros(len(x)))


def applies_nothing(self, assembly, x):
    return assembly


def elsewhere(self, x, sd=None):
    return replace(self.where(), point_m=(30.0, 0.0, 0.0))


def by_rows(self, x, sd=None):
    return replace(self.where(), grids=(0,))


def infinite(self, x, sd):
    row = super(type(self), self).reported(x, sd)[0]
    return (replace(row, high=float("inf")),)


def still_there(self, x):
    """Terms that ignore the structure that contains the effect."""
    return super(type(self), self).terms(x)


def in_millimetres(article, rng):
    made = registry.family("stringer").conceal(article, rng)
    return replace(made, truth={**made.truth, "parameters": {"a": 4.0}})


def by_another_name(article, rng):
    made = registry.family("stringer").conceal(article, rng)
    return replace(made, truth={**made.truth, "parameters": {"side": 4e-3}})


def without_seed(article, rng):
    return registry.family("stringer").conceal(article, np.random.default_rng())


def along_rows(where):
    """Rows of points in place of the ids of grids."""
    a = strength("a", "m", 3e-3, 0.5, (0.0,))
    kind = registry.family("stringer").effect
    return [kind.along(where, [0, 1, 2], BeamSection(STEEL, 1e-5), a, "along an edge")]


def nothing_concealed(article, rng):
    return article.with_hidden(article.assembly, {"a": 4e-3})


@pytest.fixture(scope="module")
def breakages(stringer):
    """Rule: effects that break it, and words of the sentence."""
    remade = replace(stringer.effect.traits, remakes_structure=True)
    no_name = replace(stringer, settled_by=" ")
    return {
        "proposes candidates": [
            (replace(stringer, placed=lambda where: []), "proposes no candidate"),
            (replace(stringer, placed=lambda where: 1 / 0), "ZeroDivisionError in <lambda>"),
            (replace(stringer, effect=registry.family("crack").effect), "the family is of Crack"),
            (replace(stringer, placed=along_rows), "LabelError in along_rows"),
            (broken(stringer, starts=lambda self: [np.zeros(2)]), "begins at 2 numbers"),
        ],
        "describes itself": [
            (broken(stringer, claim="The sheet carries a stringer."), "without a full stop"),
            (no_name, "settled_by is empty"),
        ],
        "lies in the structure": [
            (broken(stringer, location=elsewhere), "29.6 m outside"),
            (broken(stringer, location=by_rows), "grid 0, which the deck lacks"),
        ],
        "does nothing at its nominal values": [
            (broken(stringer, terms=never_idle), "its terms must vanish there"),
        ],
        "acts at other values": [(broken(stringer, terms=weak), "raise Parameter.scale")],
        "has symmetric operators": [(broken(stringer, terms=one_sided), "not symmetric")],
        "keeps K and M positive": [(broken(stringer, terms=negative), "within the prior")],
        "has exact slopes": [(broken(stringer, terms=half_slope), "derivatives of the coeff")],
        "does nothing where it is in the structure": [
            (broken(stringer, traits=remade, terms=still_there), "relative to in_structure"),
        ],
        "applies what its terms say": [(broken(stringer, terms=twice), "the same physics")],
        "weighs what it writes": [(broken(stringer, weight=weightless), "from weight(x)")],
        "writes its cards": [
            (replace(stringer, cards=("CBAR",)), "has MAT1, PBAR, which"),
            (broken(stringer, apply=applies_nothing), "leaves the frequencies"),
        ],
        "reports plain numbers": [(broken(stringer, reported=infinite), "what JSON does not")],
        "survives pickling": [(broken(stringer), "cannot be pickled")],
        "is concealed on the bench": [
            (replace(stringer, conceal=in_millimetres), "use one unit (SI)"),
            (replace(stringer, conceal=by_another_name), "the names that it reports"),
            (replace(stringer, conceal=without_seed), "draw every number from rng"),
            (replace(stringer, conceal=nothing_concealed), "with the changed assembly"),
        ],
    }


@pytest.mark.parametrize("rule", RULES)
def test_a_broken_effect_breaks_its_rule(breakages, on_plate, rule):
    assert breakages[rule]
    for family, words in breakages[rule]:
        (found,) = checked_rules(family, on_plate, [rule])
        assert (found.rule, found.passed) == (rule, False)
        assert words in found.text


def test_what_needs_a_candidate_is_not_tried_without_one(stringer, on_plate):
    first, *rest = checked_rules(replace(stringer, placed=lambda where: []), on_plate)
    assert (first.rule, first.passed) == (PROPOSES, False)
    assert {one.passed for one in rest} == {None}
    assert [one.rule for one in rest] == [name for name in RULES if name != PROPOSES]


def test_an_effect_of_a_package_keeps_every_rule(example_family):
    """It is visible as well: each example conceals more than the scatter of articles."""
    found = chladni.check_effect(example_family.name)
    assert not found.broken, found.summary()
    assert found.visibility.seen
    assert found.trusted() is found


def test_it_is_checked_on_a_given_deck(stringer, tmp_path):
    deck = write_assembly(
        folded_panel(0.6, 0.3, 0.04, 0.01, 0.05, 1e-3), tmp_path / "p.bdf", "mm-t-s"
    )
    found = chladni.check_effect("stringer", deck, "mm-t-s")
    assert not found.broken, found.summary()
    assert found.structure == "p.bdf"


def test_an_invisible_effect_is_said_to_be_so(on_plate, stringer):
    """A stringer of a tenth of the side moves the responses less than scatter does."""

    def thin(article, rng):
        made = with_masses(article.assembly, (article.assembly.ids[0],), 1e-6)
        return article.with_hidden(made, {"a": 3e-3})

    from chladni_contract.effect_visibility import visibility

    loud, faint = (visibility(f, on_plate) for f in (stringer, replace(stringer, conceal=thin)))
    assert loud.scatter == faint.scatter > 0
    assert faint.seen == 0 < loud.seen
    assert max(faint.moved) < 0.01 * loud.scatter
    found = replace(chladni.check_effect(stringer), visibility=faint)
    assert "note: no draw is visible" in found.summary()


def test_the_command_says_every_rule_and_ends_by_them(stringer, tmp_path, monkeypatch):
    done = ran("check-effect", "stringer", "--out", tmp_path / "good")
    for rule in RULES:
        assert rule in done.output
    held = json.loads((tmp_path / "good" / "effect.json").read_text())
    assert {row["outcome"] for row in held["rules"]} == {"passes"}
    assert held["visibility"]["seen"] > 0
    assert (tmp_path / "good" / "report.html").exists()

    spoilt = replace(stringer, cards=("CBAR",))
    monkeypatch.setattr(registry, "family", lambda name: spoilt)
    done = ran("check-effect", "stringer", "--out", tmp_path / "bad", code=3)
    assert "stringer breaks 1 of 15 rules; the first, writes its cards" in done.stderr
    assert (tmp_path / "bad" / "effect.json").exists()


def test_an_unknown_name_is_refused_with_the_nearest(stringer, tmp_path):
    said = refused("check-effect", "stringr", "--out", tmp_path / "x")
    assert "did you mean 'stringer'?" in said
    with pytest.raises(LabelError, match="did you mean 'stringer'"):
        chladni.check_effect("stringr")


def test_a_deck_needs_its_units(stringer, tmp_path):
    deck = write_assembly(folded_panel(), tmp_path / "p.bdf", "mm-t-s")
    words = ("check-effect", "stringer", "--deck", deck, "--out", tmp_path / "x")
    assert "--units" in refused(*words)


def test_a_result_that_breaks_a_rule_is_not_trusted(stringer):
    found = chladni.check_effect(replace(stringer, settled_by=" "))
    with pytest.raises(AccuracyError, match="describes itself: settled_by is empty"):
        found.trusted()
    assert "rules are broken" in found.summary()
