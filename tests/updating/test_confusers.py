"""Explanations of nearly the same evidence are one answer, with the measurement that separates."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.effect import Parameter
from chladni.effects.local_resonator import LocalResonator
from chladni.effects.model_families import ModelFamily
from chladni.effects.registry import families
from chladni.updating.adequacy import FitTest
from chladni.updating.confusers import with_confusers, with_doubt
from chladni.updating.diagnosis import Diagnosis
from chladni.updating.outcome import BEYOND, TOO_LITTLE
from chladni.updating.result_parts import laid_on_sheets, remainder, why_not
from chladni.updating.ties import TIED, simplest_first

ADHESIVE = ModelFamily((Parameter("k", "-", 0.0, 0.5),), "adhesive")


def tried(name, S, becomes="", implausible="", ln_k=0.0, nearly=""):
    effect = SimpleNamespace(
        name=name, becomes=lambda x: becomes, implausible=lambda x: implausible,
        nearly=lambda x, sd: nearly, expected=False,
    )  # fmt: skip
    at = np.array([ln_k])
    fit = SimpleNamespace(effects=(ADHESIVE,), of=lambda e: at, sd=lambda e: 0.1 + 0 * at)
    return SimpleNamespace(neg2_log_evidence=S, effect=effect, name=name, fit=fit)


def found(*evidence, verdict="missing physics"):
    names = ("point-mass", "sensor-mass", "suspension")
    hypotheses = tuple(tried(name, S) for name, S in zip(names, evidence, strict=True))
    return with_confusers(Diagnosis(None, None, None, hypotheses, verdict))


def test_near_ones_are_listed_with_what_would_settle_it():
    answer = found(0.0, TIED - 1, TIED + 1)
    assert answer.one_of[:2] == ("point-mass", "sensor-mass")
    assert "weigh the structure" in answer.one_of[2]
    assert "suspension" not in answer.one_of
    assert "sensor-mass" in answer.notes[-1]


@pytest.mark.parametrize("verdict", ["missing physics", "measurement fault"])
def test_a_clear_lead_is_a_name(verdict):
    assert found(0.0, TIED + 1, 2 * TIED, verdict=verdict).one_of == ()


def test_where_nothing_is_named_nothing_is_tied():
    assert found(0.0, 1.0, 2.0, verdict="calibration only").one_of == ()


@pytest.mark.parametrize(
    ("gains", "verdict", "heard", "tied"),
    [
        ((TIED + 2, TIED + 1, 1.0), "calibration only", None, ("point-mass", "sensor-mass")),
        ((TIED + 9, TIED - 1, 1.0), "nothing missing", None, ("point-mass",)),
        ((TIED - 1, 2.0, 1.0), "calibration only", None, ()),
        ((TIED + 2, 2.0, 1.0), "not in catalogue", None, ()),  # says so itself
        ((TIED + 2, 2.0, 1.0), "calibration only", {"lines": 9.0, "sensors": -1.0}, ()),
        ((TIED + 2, 2.0, 1.0), "calibration only", {"lines": 9.0, "sensors": 1.0}, ("point-mass",)),
    ],
)
def test_what_leads_without_being_named_leaves_calibration_in_doubt(gains, verdict, heard, tied):
    names = ("point-mass", "sensor-mass", "suspension")
    hypotheses = tuple(tried(name, -gain) for name, gain in zip(names, gains, strict=True))
    null = tried("", 0.0)
    null.data = None
    heard = heard and SimpleNamespace(votes=heard)
    answer = with_doubt(Diagnosis(None, null, None, hypotheses, verdict, heard=heard))
    assert answer.one_of == (("calibration alone", *tied) if tied else ())
    assert bool(answer.notes) == bool(tied)
    assert not tied or "weigh the structure" in answer.notes[0]


@pytest.mark.parametrize(
    ("refused", "vote", "open_"),
    [(f"it {TOO_LITTLE}", 1.0, True), (f"it {TOO_LITTLE}", -1.0, False), ("it is odd", 1.0, False)],
)
def test_where_calibration_does_not_fit_a_leader_that_gains_little_is_one_of(refused, vote, open_):
    """It, or what the catalogue does not hold; not where other data are against it."""
    null = tried("", 0.0)
    null.data = None
    heard = SimpleNamespace(votes={"the data held out": vote})
    hypotheses = (tried("point-mass", -TIED - 1),)
    answer = with_doubt(
        Diagnosis(None, null, None, hypotheses, "not in catalogue", heard=heard, refused=refused)
    )
    assert answer.one_of == (("point-mass", BEYOND) if open_ else ())


@pytest.mark.parametrize(("ln_k", "tied"), [(1.6, ("point-mass", "suspension")), (1.4, ())])
def test_what_relieves_a_strained_joint_is_one_of_both(ln_k, tied):
    """At 3.2 sd of its scatter adhesive holds what is missing; what leaves it so is no rival."""
    each = (("point-mass", TIED - 1, 0.2), ("sensor-mass", 5.0, ln_k), ("suspension", 2.0, 0.2))
    hypotheses = tuple(tried(name, -gain, ln_k=k) for name, gain, k in each)
    null = tried("", 0.0, ln_k=ln_k)
    null.data = None
    answer = with_doubt(Diagnosis(None, null, None, hypotheses, "calibration only"))
    assert answer.one_of == (("calibration alone", *tied) if tied else ())


def test_every_family_says_what_would_settle_it():
    assert all(f.settled_by for f in families() if f.effect.__module__.startswith("chladni."))


def test_what_has_become_the_named_effect_is_no_rival():
    hypotheses = tried("point-mass", 0.0), tried("local-resonator", 2.0, "point-mass")
    answer = with_confusers(Diagnosis(None, None, None, hypotheses, "missing physics"))
    assert answer.one_of == ()


@pytest.mark.parametrize(("nearly", "one_of"), [("point-mass", True), ("", False)])
def test_what_the_named_effect_may_be_is_told_whatever_the_odds(nearly, one_of):
    lump = tried("local-resonator", 0.0, nearly=nearly)
    hypotheses = (lump, tried("point-mass", 5 * TIED), tried("suspension", 4 * TIED))
    answer = with_confusers(Diagnosis(None, None, None, hypotheses, "missing physics"))
    assert answer.one_of[:2] == (("local-resonator", "point-mass") if one_of else ())


@pytest.mark.parametrize(
    ("behind", "lead"), [(TIED - 1, "point-mass"), (TIED + 1, "local-resonator")]
)
def test_what_may_be_simpler_lets_the_simpler_lead_where_that_is_as_probable(behind, lead):
    """A point or two made a resonator of a mass at the edge of a tailgate (tuning 561)."""
    lump = tried("local-resonator", 0.0, nearly="point-mass")
    ordered = simplest_first([lump, tried("point-mass", behind)], 200.0)
    assert ordered[0].name == lead
    answer = with_confusers(Diagnosis(None, None, None, tuple(ordered), "missing physics"))
    assert answer.one_of[:2] == (() if lead == "point-mass" else ("local-resonator", "point-mass"))


@pytest.mark.parametrize(("sd", "name"), [(0.05, ""), (0.5, "point-mass")])
def test_a_lump_whose_spring_may_be_stiff_may_be_a_point_mass(sd, name):
    """Half of the highest line, known to a tenth or to no better than a factor of two."""
    f = Parameter("f", "Hz", 0.0, 0.6, 100.0)
    other = tuple(Parameter(q, "-", 0.0, 1.0) for q in "mab")
    resonator = LocalResonator((*other, f))
    x = np.array([0.0, 0.0, 0.0, np.log(1.5)])
    assert resonator.becomes(x) == ""
    assert resonator.nearly(x, np.array([0.1, 0.1, 0.1, sd])) == name


def test_what_has_become_the_named_effect_is_told_as_that():
    """It is left out of the ties, so the table of alternatives must say why."""
    mass, lump = tried("point-mass", 0.0), tried("local-resonator", 2.0, "point-mass")
    null = SimpleNamespace(neg2_log_evidence=500.0, data=None)
    diagnosis = Diagnosis(null, null, null, (mass, lump), "missing physics")
    assert "it is point-mass" in why_not(diagnosis, lump, mass)


def test_a_leader_that_has_become_a_simpler_effect_lets_it_lead():
    lump, mass = tried("local-resonator", 0.0, "point-mass"), tried("point-mass", TIED - 1)
    assert simplest_first([lump, mass], 500.0) == [mass, lump]
    far = tried("point-mass", TIED + 1)
    assert simplest_first([lump, far], 500.0) == [lump, far]
    foot = 100 * (TIED + 1)  # a resonance beyond all lines has added a hundredth of the gain
    assert simplest_first([lump, far], foot + 1) == [far, lump]
    assert simplest_first([lump, far], foot - 1) == [lump, far]
    own = tried("local-resonator", 0.0)
    assert simplest_first([own, mass], 500.0) == [own, mass]
    assert simplest_first([], 500.0) == []


def test_a_lump_tuned_above_the_highest_line_is_a_point_mass():
    high = SimpleNamespace(value=lambda x: x, scale=100.0)
    effect = SimpleNamespace(parameters=(None, None, None, high))
    assert LocalResonator.becomes(effect, [0, 0, 0, 301.0]) == "point-mass"
    assert LocalResonator.becomes(effect, [0, 0, 0, 299.0]) == ""


def test_a_value_a_thing_cannot_have_yields_to_one_it_can():
    """A uniform hem and a stiff string are one to frequencies: told as one of the two."""
    string = tried("adhesive-stiffness", 0.0, implausible="E of 210000 MPa is that of no sealant")
    hem, far = tried("hem-contact", TIED - 1), tried("hem-contact", TIED + 1)
    assert simplest_first([string, hem], 500.0) == [hem, string]
    assert simplest_first([string, far], 500.0) == [string, far]
    plain = tried("adhesive-stiffness", 0.0)
    assert simplest_first([plain, hem], 500.0) == [plain, hem]
    answer = with_confusers(Diagnosis(None, None, None, (hem, string), "missing physics"))
    assert answer.one_of[:2] == ("hem-contact", "adhesive-stiffness")
    assert "cut through the hem" in answer.one_of[2]
    assert "no sealant" in answer.notes[-1]


RUBS = "1 of 5 modes are damped by 2.0%"


@pytest.mark.parametrize(
    ("gain", "passes", "said"),
    [
        (2.0, True, "mesh error and scatter within the parts account for it as well as any"),
        (TIED + 20, True, "point-mass accounts for more of it"),
        (2.0, False, "nothing that was tried accounts for it"),
        (TIED + 200, False, "nothing that was tried accounts for it"),
    ],
)
def test_mesh_error_is_not_made_the_reason_of_what_it_does_not_explain(gain, passes, said):
    """What calibration leaves, 40 times what the recording is known to, where nothing is named."""
    data = SimpleNamespace(Q=lambda state, use: 0.04)
    score = SimpleNamespace(use=None, over=lambda model: data)
    prepared = SimpleNamespace(score=score, identified=None)
    fit = SimpleNamespace(state=None)
    null = SimpleNamespace(neg2_log_evidence=0.0, data=None, model=None, fit=fit)
    test = FitTest(passes, 0.5 if passes else 1e-4, RUBS, "near 410 Hz")
    answer = Diagnosis(
        null, null, null, (tried("point-mass", -gain),), "calibration only", adequacy=test
    )
    assert said in remainder(prepared, answer).sentence


def test_a_leader_that_is_refused_is_told_with_what_refused_it():
    """By what it leaves, not by held-out data that were never asked."""
    null = SimpleNamespace(neg2_log_evidence=0.0, data=None)
    lead, second = tried("local-resonator", -183.0), tried("point-mass", -180.0)
    answer = Diagnosis(
        null, null, null, (lead, second), "not in catalogue",
        refused=f"what it leaves is not explained: {RUBS}",
    )  # fmt: skip
    assert why_not(answer, lead, null).endswith(f"but what it leaves is not explained: {RUBS}")
    assert why_not(answer, second, null).endswith("but local-resonator, ahead of it, is not named")


@pytest.mark.parametrize(
    ("verdict", "weighed", "said"),
    [
        ("calibration only", 6.0, "5.3% more"),
        ("nothing missing", 5.4, "5.3% less"),
        ("calibration only", 5.75, ""),
        ("calibration only", None, ""),
        ("missing physics", 6.0, ""),
    ],
)
def test_weight_that_calibration_lays_on_sheets_may_be_trim(verdict, weighed, said):
    answer = Diagnosis(None, None, None, (tried("point-mass", 0.0),), verdict)
    assert said in "".join(laid_on_sheets(answer, weighed, 5.7))
    assert bool(laid_on_sheets(answer, weighed, 5.7)) == bool(said)
