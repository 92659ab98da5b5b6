"""What is said of explanations that are not the answer, and of what calibration leaves."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.effect import Parameter, Traits
from chladni.effects.estimate import Remarks
from chladni.effects.joint_stiffness import ModelFamily
from chladni.effects.masses import LocalResonator
from chladni.effects.registry import families
from chladni.inference.adequacy import FitTest
from chladni.search.decision_rules import RULES
from chladni.search.diagnosis import Diagnosis
from chladni.search.result_parts import laid_on_sheets, remainder, why_not

TIED = RULES.tied
ADHESIVE = ModelFamily((Parameter("k", "-", 0.0, 0.5),), "adhesive")


def tried(name, S, becomes="", implausible="", ln_k=0.0, nearly=""):
    said = Remarks(becomes, nearly, implausible)
    effect = SimpleNamespace(
        name=name, remarks=lambda x, sd=None: said, expected=False, traits=Traits()
    )
    at = np.array([ln_k])
    fit = SimpleNamespace(effects=(ADHESIVE,), of=lambda e: at, sd=lambda e: 0.1 + 0 * at)
    return SimpleNamespace(
        neg2_log_evidence=S,
        effect=effect,
        name=name,
        fit=fit,
        effects=(effect,),
        physics=True,
        channels=(),
        remarks=said,
    )


def test_every_family_says_what_would_settle_it():
    assert all(f.settled_by for f in families() if f.effect.__module__.startswith("chladni."))


@pytest.mark.parametrize(("sd", "name"), [(0.05, ""), (0.5, "point-mass")])
def test_a_lump_whose_spring_may_be_stiff_may_be_a_point_mass(sd, name):
    """Half of the highest line, known to a tenth or to no better than a factor of two."""
    f = Parameter("f", "Hz", 0.0, 0.6, 100.0)
    other = tuple(Parameter(q, "-", 0.0, 1.0) for q in "mab")
    resonator = LocalResonator((*other, f), patch=None, nowhere=None)
    x = np.array([0.0, 0.0, 0.0, np.log(1.5)])
    known = resonator.remarks(x, np.array([0.1, 0.1, 0.1, sd]))
    assert (known.becomes, known.nearly) == ("", name)


def test_what_has_become_the_named_effect_is_told_as_that():
    """It is left out of the ties, so the table of alternatives must say why."""
    mass, lump = tried("point-mass", 0.0), tried("local-resonator", 2.0, "point-mass")
    null = SimpleNamespace(neg2_log_evidence=500.0, data=None)
    diagnosis = Diagnosis(null, null, null, (mass, lump), "missing physics")
    assert "its fitted form from point-mass" in why_not(diagnosis, lump, mass)


def test_a_lump_tuned_above_the_highest_line_is_a_point_mass():
    high = SimpleNamespace(value=lambda x: x, scale=100.0)
    effect = SimpleNamespace(parameters=(None, None, None, high))
    assert LocalResonator.remarks(effect, [0, 0, 0, 301.0]).becomes == "point-mass"
    assert LocalResonator.remarks(effect, [0, 0, 0, 299.0]).becomes == ""


RUBS = "1 of 5 modes have a damping of 2.0 %"


@pytest.mark.parametrize(
    ("gain", "passes", "one_of", "said"),
    [
        (2.0, True, (), "no effect tried accounts for more of it than mesh error and scatter"),
        (TIED + 20, True, (), "point-mass accounts for more of it"),
        (2.0, False, (), "no effect tried accounts for it"),
        (TIED + 200, False, (), "no effect tried accounts for it"),
        (9.0, False, ("point-mass", "crack"), "one of these may: point-mass, crack"),
    ],
)
def test_mesh_error_is_not_made_the_reason_of_what_it_does_not_explain(gain, passes, one_of, said):
    """What calibration leaves, 40 times what the recording is known to, where nothing is named."""
    data = SimpleNamespace(Q=lambda state, use: 0.04)
    score = SimpleNamespace(use=None, rebased=lambda model: data)
    prepared = SimpleNamespace(score=score, identified=None)
    fit = SimpleNamespace(state=None)
    null = SimpleNamespace(neg2_log_evidence=0.0, data=None, model=None, fit=fit)
    test = FitTest(passes, 0.5 if passes else 1e-4, RUBS, "near 410 Hz")
    answer = Diagnosis(
        null, null, null, (tried("point-mass", -gain),), "calibration only", adequacy=test,
        one_of=one_of,
    )  # fmt: skip
    assert said in remainder(prepared, answer).sentence


def test_a_leader_that_is_refused_is_told_with_what_refused_it():
    """By what it leaves, not by held-out data that were never asked."""
    null = SimpleNamespace(neg2_log_evidence=0.0, data=None)
    lead, second = tried("local-resonator", -183.0), tried("point-mass", -180.0)
    answer = Diagnosis(
        null, null, null, (lead, second), "not in catalogue",
        refused=f"its residual is not explained: {RUBS}",
    )  # fmt: skip
    assert why_not(answer, lead, null).endswith(f"but its residual is not explained: {RUBS}")
    assert why_not(answer, second, null).endswith("but local-resonator, ahead of it, is not named")


def test_an_explanation_that_is_worse_than_calibration_loses():
    null = SimpleNamespace(neg2_log_evidence=0.0, data=None)
    crack, lump = tried("crack", 12.9), tried("point-mass", 0.04)
    answer = Diagnosis(null, null, null, (lump, crack), "calibration only")
    assert why_not(answer, crack, null).startswith("loses 12.9 in -2 ln evidence over plain")
    assert why_not(answer, lump, null).startswith("gains 0.0 in")


@pytest.mark.parametrize(
    ("verdict", "weighed", "said"),
    [
        ("calibration only", 6.0, "5.3 % more"),
        ("nothing missing", 5.4, "5.3 % less"),
        ("calibration only", 5.75, ""),
        ("calibration only", None, ""),
        ("missing physics", 6.0, ""),
    ],
)
def test_weight_that_calibration_lays_on_sheets_may_be_trim(verdict, weighed, said):
    answer = Diagnosis(None, None, None, (tried("point-mass", 0.0),), verdict)
    assert said in "".join(laid_on_sheets(answer, weighed, 5.7))
    assert bool(laid_on_sheets(answer, weighed, 5.7)) == bool(said)
