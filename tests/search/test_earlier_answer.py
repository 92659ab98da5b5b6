"""An earlier answer as the prior of a new recording: odds, places, parameters, data used once."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.search.test_several import HERE, THERE, lump, null_of, problem_of

from chladni.dynamics.frf import FRF
from chladni.effects.effect import Parameter
from chladni.effects.masses import PointMass
from chladni.errors import FileError
from chladni.fem.energy import mass_properties
from chladni.inference.joint_fit import informed, of_the_object
from chladni.output import write_json
from chladni.search.candidates import candidates
from chladni.search.earlier_answer import (
    FILE,
    KnownParameter,
    _moments,
    digests,
    earlier_answer,
    posterior_json,
    read_earlier,
)


@pytest.fixture(scope="module")
def problem(reduced):
    """A plate with a lump."""
    weight = 0.03 * mass_properties(reduced.structure.assembly)[0]
    return problem_of(reduced, [lump(reduced, HERE, 1.0)], weight)


@pytest.fixture(scope="module")
def fits(reduced, problem):
    """Calibration alone, and the lump at its place."""
    null = null_of(problem)
    of, x = lump(reduced, HERE, 1.0)
    return null, problem.fitted_with(of(problem.where), x, null.fit.x)


@pytest.fixture(scope="module")
def known(fits):
    null, here = fits
    gain = null.neg2_log_evidence - here.neg2_log_evidence
    found = SimpleNamespace(null=null, hypotheses=(here,), two_log_bayes_factor=lambda h: gain)
    return earlier_answer(found, "point-mass", 2.0, {"a": "1:+Z over 2:+Z"})


@pytest.mark.parametrize("kind", ["log", "linear"])
def test_a_prior_keeps_its_physical_value_where_the_scale_differs(kind):
    p = Parameter("M", "kg", 0.0, 9.0, scale=0.5, kind=kind)
    now = KnownParameter("M", 0.7, 0.2, 2.0).of(p)
    then = replace(p, scale=2.0)
    assert_allclose(now.value(now.mean), then.value(0.7))
    assert_allclose(now.value(now.mean + now.sd), then.value(0.9))
    assert KnownParameter("M", 0.7, 20.0, 0.5).of(p).sd == p.sd


def test_the_mixture_has_its_moments():
    """Compared with draws of it."""
    rng, rows = np.random.default_rng(1), [(0.2, 1.0, 0.3), (0.8, -1.0, 0.1)]
    drawn = np.concatenate([rng.normal(m, s, int(w * 400_000)) for w, m, s in rows])
    assert_allclose(_moments(rows), (drawn.mean(), drawn.std()), atol=3e-3)


def test_evidence_of_both_recordings_is_that_of_one_after_the_other(problem, fits, known):
    """p(y_2 | H, y_1) p(H | y_1): an effect that y_2 does not see keeps the odds that y_1 gave.

    Data of no weight leave evidence and parameters where they were.
    """
    null, here = fits
    loud = np.full(problem.data.values.shape, 1e4)
    data = replace(problem.data, noise=loud, error=None)
    silent = replace(problem, data=data, mass_measurement=None)
    silent = known.informed(silent)
    silent = replace(silent, base=tuple(informed(silent.base, known.shared)))
    (family,) = [f for f in silent.families if f.name == "point-mass"]
    effect = family.of_lump(silent.where, np.array(here.effect.point), 0.01)[0]
    again = silent.fitted_with(effect, here.fit.of(here.effect), null.fit.x)
    without = null_of(silent)
    gain = without.neg2_log_evidence - again.neg2_log_evidence
    assert_allclose(gain, known.effects[0].two_log_odds, atol=1.0)
    assert_allclose(again.fit.of(effect)[0], here.fit.of(here.effect)[0], atol=0.01)


def test_only_the_place_that_was_found_has_the_odds(reduced, problem, known):
    """A lump elsewhere has none, and keeps the price of its place."""
    (e,) = known.effects
    here, there = (lump(reduced, w, 1.0)[0](problem.where) for w in (HERE, THERE))
    assert e.informed(here).two_log_odds == e.two_log_odds > 10
    assert e.informed(here).trials_factor == 1
    assert e.informed(here).parameters[0].sd < here.parameters[0].sd
    assert e.informed(there).two_log_odds == 0
    assert e.informed(there).trials_factor == there.trials_factor > 1
    assert e.informed(there).parameters == there.parameters


def test_the_search_finds_the_place_again_and_a_second_search_has_no_odds(problem, fits, known):
    told = known.informed(problem)
    found = [c.effect for c in candidates(told, fits[0]) if isinstance(c.effect, PointMass)]
    assert max(e.two_log_odds for e in found) == known.effects[0].two_log_odds
    held = told.holding([(found[0], np.zeros(3))])
    assert [f.name for f in held.families] == [f.name for f in problem.families]
    assert all(f.before is None for f in held.families)


def test_parameters_of_the_object_have_the_posterior(problem, known):
    base = informed(problem.base, known.shared)
    for before, after in zip(problem.base, base, strict=True):
        if of_the_object(before):
            sds = [(p.sd, q.sd) for p, q in zip(before.parameters, after.parameters, strict=True)]
            assert all(q <= p for p, q in sds)
    assert base[0].parameters[0].sd < 0.5 * problem.base[0].parameters[0].sd


def test_a_posterior_is_read_as_it_was_written(known, tmp_path):
    write_json(tmp_path / FILE, posterior_json(known))
    assert read_earlier(tmp_path) == replace(known, folder=str(tmp_path))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (None, "there is no posterior.json, so this is no answer to build on"),
        ("[]", "does not have the form of a posterior"),
        ("{", "does not have the form of a posterior"),
        (
            json.dumps({"said": "", "mass": None, "data": {}, "shared": [[1]], "effects": []}),
            "form",
        ),
    ],
)
def test_another_file_is_refused(tmp_path, text, why):
    if text is not None:
        (tmp_path / FILE).write_text(text)
    with pytest.raises(FileError, match=why):
        read_earlier(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('"mass": 2.0', '"mass": NaN', "nan is no number"),
        ('"mass": 2.0', '"mass": -2', "-2 is not above 0"),
        ('"two_log_odds": ', '"two_log_odds": -Infinity, "was": ', "-inf is no number"),
        ('"two_log_odds": ', '"two_log_odds": "1e999", "was": ', "1e999 is no number"),
        ('"sd": ', '"sd": 0, "was": ', "0 is not above 0"),
        ('"mean": ', '"mean": 1e400, "was": ', "inf is no number"),
        ('"point_m": [', '"point_m": [0, ', "too many values"),
    ],
)
def test_a_posterior_edited_by_hand_is_refused(known, tmp_path, old, new, why):
    """Numbers that no fit leaves would end the search far from the file that holds them."""
    text = json.dumps(json.loads(write_json(tmp_path / FILE, posterior_json(known)).read_text()))
    assert old in text
    (tmp_path / FILE).write_text(text.replace(old, new, 1))
    with pytest.raises(FileError, match=rf"posterior.json does not .* a posterior: .*{why}"):
        read_earlier(tmp_path)


def test_data_that_were_used_are_refused_in_any_order_and_scale_of_rounding(known):
    """A column is known again next to others and with six digits; a repeat of the test is new."""
    rng = np.random.default_rng(0)
    H = rng.normal(size=(8, 2, 1)) + 1j * rng.normal(size=(8, 2, 1))
    f = np.arange(1.0, 9.0)
    first = FRF(H, f, ("1:+Z", "2:+Z"), ("3:+Z",))
    used = replace(known, data=digests([first]), folder="runs/first")
    written = FRF(np.round(H[:, [1]], 6), f, ("2:+Z",), ("3:+Z",))
    with pytest.raises(FileError, match=r"runs/first used the responses 2:\+Z over 3:\+Z already"):
        used.refuse_again(digests([written]), Path("case.toml"))
    used.refuse_again(digests([FRF(1.01 * H + 0.01, f, first.outputs, first.inputs)]), Path())
    assert len(digests([first])) == 2
