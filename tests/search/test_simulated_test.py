"""First tests of articles with a concealed effect, before anything is measured."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.commands import ran, refused

from chladni.fem.measured_dofs import MeasuredDofs
from chladni.io.nastran import write_assembly
from chladni.reduced.reduced_model import evaluate
from chladni.search import measurement_forecasts
from chladni.search.measurement_forecasts import Rival, measurements
from chladni.search.question import Question
from chladni.search.simulated_test import first_tests
from chladni.workflows.before_any_test import PlannedTests, before_any_test
from chladni_planning import plan
from chladni_specimens import plate

EFFECTS = ("point-mass", "extra-support")


@pytest.fixture(scope="module", autouse=True)
def few():
    """A sample of places and lines."""
    with pytest.MonkeyPatch.context() as patch:
        for name, n in (("PLACES", 6), ("MASSES", 2), ("LINES", 8)):
            patch.setattr(measurement_forecasts, name, n)
        yield


def places(assembly, grids):
    at, n = assembly.rows(grids), len(grids)
    labels, zero = tuple(f"{g}:+Z" for g in grids), np.zeros(n)
    way = np.tile([0.0, 0.0, 1.0], (n, 1))
    return MeasuredDofs(labels, np.array(grids), assembly.points[at], way, zero, zero)


@pytest.fixture(scope="module")
def question():
    made = plate(0.4, 0.3, 6, 5, 2e-3)
    return Question(made, places(made, [1, 24, 38]), places(made, [12]), band=(50.0, 330.0))


@pytest.fixture(scope="module")
def tests(question):
    return list(first_tests(question, EFFECTS, seed=3))


def test_every_effect_is_concealed_once_and_found(tests):
    """Three good sensors on a plate see a lump or a spring well enough to name it."""
    assert [t.name for t in tests] == list(EFFECTS)
    assert all(t.right for t in tests)
    assert_allclose([t.probability.sum() for t in tests], 1)


def test_the_recording_is_that_of_the_article(tests):
    """To 1 % of noise: the true model, which is no fit of the deck's reduced model."""
    for t in tests:
        data, itself = t.problem.data, t.itself
        exact = itself.data.model(evaluate(itself.model, (), np.zeros(0)))
        off = np.log(data.values / exact)
        assert 0.005 < np.sqrt((off.real**2).mean()) < 0.02


def test_a_forecast_is_compared_with_the_article_itself(tests):
    """Under the true explanation what the article shows lies within what was forecast."""
    t = tests[0]
    rivals = [Rival(t.problem, h) for h in (t.hypotheses[t.names.index(t.name)], t.itself)]
    z = []
    for _, ((mean, F), (true, none)) in measurements(t.problem, rivals):
        assert not none.any()
        z += list((true - mean) / np.sqrt(1 + (F**2).sum(axis=1)))
    assert np.sqrt(np.mean(np.square(z))) < 2


@pytest.fixture(scope="module")
def deck(tmp_path_factory):
    path = tmp_path_factory.mktemp("deck") / "plate.bdf"
    write_assembly(plate(0.4, 0.3, 6, 5, 2e-3), path)
    return path


def test_the_command_advises_before_any_test(deck, tmp_path):
    words = ("--effects", ",".join(EFFECTS), "--sensors", "1", "--units", "SI", "--top", "200")
    said = ran("next", deck, *words, "--odds", "1e9", "--out", tmp_path / "out").stdout
    assert "planned: 1 sensors" in said
    assert "settles 0 of 2 articles" in said
    plan = json.loads((tmp_path / "out" / "plan.json").read_text())
    assert set(plan) == {"sensors", "masses", "drives", "band_hz"}


def test_a_plan_says_what_it_separates(deck, tmp_path):
    words = ("--units", "SI", "--sensors", "2", "--modes", "1", "--drawn", "0", "--top", "200")
    said = ran("plan", deck, *words, "--separate", ",".join(EFFECTS), "--out", tmp_path / "out")
    assert "Explanations this layout separates" in said.stdout
    assert "1 sensor for modes alone settles" in said.stdout
    found = json.loads((tmp_path / "out" / "separate.json").read_text())
    assert found["explanations"] == list(EFFECTS)
    assert [a["effect"] for a in found["articles"]] == list(EFFECTS)
    assert all(abs(sum(a["probability"].values()) - 1) < 1e-6 for a in found["articles"])


def test_a_wrong_answer_is_not_settled(tests):
    """Its explanations count as even: what a wrong fit says for its name is no reason to stop."""
    p = np.array([0.001, 0.999])
    wrong = replace(tests[0], probability=p if tests[0].names[0] == tests[0].name else p[::-1])
    made = PlannedTests(tests[0].question, (wrong, tests[1]))
    assert made.open == ()
    assert wrong in made.unsettled
    assert_allclose(made.outlooks(("weighing",))[0].rivals.probability, 0.5)


def test_settled_articles_need_no_advice(deck):
    layout = plan(deck, sensors=6, units="SI", draws=0)
    made = before_any_test(deck, EFFECTS, layout, units="SI", odds=1.0)
    assert made.open == ()
    assert made.advised() == ()


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ((), "is no folder of a diagnosis; before any test give --effects"),
        (("--effects", "point-mass"), "--effects needs two and more effects"),
        (("--effects", "point-mass,crush"), "crush"),
        (("--effects", "point-mass,crack"), "there are no sensors; give --sensors"),
        (("--effects", "point-mass,weld-missing", "--sensors", "3"), "nothing that it acts on"),
        (("--effects", "point-mass,crack", "--sensors", "3", "--top", "1"), "the first elastic"),
        (("--effects", "point-mass,crack", "--sensors", "none.csv"), "no file none.csv"),
    ],
)
def test_what_cannot_be_planned_is_one_sentence(deck, tmp_path, words, why):
    assert why in refused("next", deck, "--units", "SI", *words, "--out", tmp_path / "out")
