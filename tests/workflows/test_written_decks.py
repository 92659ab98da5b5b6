"""Every Q of a result is that of a deck as it is written: anybody who runs the deck finds it."""

import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from tests.builders.cases import SENSORS, write_case

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.effects.effect import Traits, Weight
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.model.point_masses import with_masses
from chladni.reduced.accuracy import LIMIT
from chladni.report.diagnosis_folder import write_diagnosis
from chladni.search.preparation import ZETA_Q, prepare
from chladni.search.written_scores import noise_Q, seen, written_Q
from chladni.workflows import decks_of_diagnosis
from chladni.workflows.decks_of_diagnosis import article_mass
from chladni.workflows.question_of_case import question_of
from chladni_specimens.plates import plate

LN10 = np.log(10.0)


@pytest.mark.parametrize(
    ("deck", "score"), [("updated.bdf", "with_effect"), ("calibrated.bdf", "calibrated")]
)
def test_a_deck_put_back_has_the_Q_that_was_promised(
    case, folder, diagnosed, tmp_path, deck, score
):
    """No mesh error, no scatter, no gain hides beside the deck: its own Q is the one reported."""
    write_diagnosis(tmp_path / "run", case, diagnosed)
    again = tmp_path / "again"
    shutil.copytree(folder, again)
    shutil.copy(tmp_path / "run" / deck, again / "plate.bdf")
    asked = question_of(chladni.load_case(again))
    prepared = prepare(asked)
    sets = prepared.score.use, prepared.held.reporting
    now = written_Q(prepared, prepared.nominal, sets)
    due = diagnosed.agreement
    then = [getattr(q, score) for q in (due.fitted, due.held_out)]
    np.testing.assert_allclose(now, then, rtol=1e-6)


def test_the_effect_explains_the_recording(diagnosed):
    """The case holds a mass of 20 g on the same mesh; its deck is as good as the recording."""
    q = diagnosed.agreement.fitted
    assert diagnosed.effects[0].name == "point-mass"
    assert q.with_effect < 0.05 * q.nominal


def test_a_mesh_too_coarse_for_the_change_is_halved(tmp_path, monkeypatch):
    """An article on a mesh four times as fine: the decks with halved shells are much nearer to it.

    The deck on the given mesh is taken to be no better than the one before it.
    """
    (tmp_path / "case").mkdir()
    write_case(tmp_path / "case", 6, SENSORS, np.linspace(15, 330, 450), 300.0, 0.003, halved=2)
    case = replace(chladni.load_case(tmp_path / "case"), effects=("point-mass",))
    own = chladni.diagnose(case).agreement.held_out
    said, calls = decks_of_diagnosis.last_step_in_words, []

    def once(agreement, named):
        calls.append(agreement)
        return "it is worse" if len(calls) == 1 else said(agreement, named)

    monkeypatch.setattr(decks_of_diagnosis, "last_step_in_words", once)
    result = chladni.diagnose(case)
    held, mesh = result.agreement.held_out, result.models.final.model.assembly
    assert len(mesh.shells) == 4 * len(case.assembly.shells)
    assert held.with_effect < 0.3 * own.with_effect
    assert held.with_effect < held.calibrated
    assert not result.distrust
    assert result.halved == "on the given mesh it is worse"
    files = write_diagnosis(tmp_path / "run", case, result).files
    assert {"updated.bdf", "calibrated.bdf"} <= set(files.values())
    read = chladni.load(tmp_path / "run" / "updated.bdf", "SI").assembly
    f = [normal_modes(structure(a).system, 12).frequency[6:] for a in (read, mesh)]
    np.testing.assert_allclose(*f, rtol=1e-6)
    for what, score in (("deck", "with_effect"), ("calibrated", "calibrated")):
        shutil.copy(tmp_path / "run" / files[what], tmp_path / "case" / "plate.bdf")
        asked = question_of(chladni.load_case(tmp_path / "case"))
        prepared = prepare(asked)
        sets = prepared.score.use, prepared.held.reporting
        then = [getattr(q, score) for q in (result.agreement.fitted, held)]
        np.testing.assert_allclose(written_Q(prepared, prepared.nominal, sets), then, rtol=1e-6)


def test_Q_is_that_of_the_full_matrices(case):
    """Q of Ritz vectors against (K + s²M)⁻¹ on full matrices, line by line.

    Frequencies may be ``LIMIT`` off and a slope of log10 H is 1/(ζ ln 10) at most, so the two
    differ by less than LIMIT/(ζ ln 10) decades on a line.
    """
    asked = question_of(case)
    prepared = prepare(asked)
    data, state = seen(asked, prepared.score, prepared.nominal, prepared.problem.setup.f_max)
    system = prepared.nominal.structure.system
    made = prepared.nominal.structure
    load = asked.inputs.rows(made).T.toarray()[:, 0].astype(complex)
    out, some = asked.outputs.rows(made), np.arange(0, len(data.s), 7)
    u = [spl.spsolve(sp.csc_array(system.K + s**2 * system.M), load) for s in data.s[some]]
    exact = np.array([s**2 * (out @ x) for s, x in zip(data.s[some], u, strict=True)])[..., None]
    apart = np.abs(np.log(data.model(state)[some] / exact)) / LN10
    assert apart.max() < LIMIT / (ZETA_Q * LN10)
    (Q,) = written_Q(prepared, prepared.nominal, (prepared.score.use,))
    assert Q == pytest.approx(data.Q(state, data.use))


def test_every_structure_is_solved_once(diagnosis):
    """Three eigenproblems: the given, the calibrated and the updated deck."""
    result, solved = diagnosis
    models = result.models
    assert len(solved) == len({id(system) for system in solved}) == 3
    for made in (models.nominal, models.calibrated.model, models.final.model):
        assert sum(made.structure.system is system for system in solved) == 1


def test_an_unknown_gain_is_no_hidden_parameter(case):
    """Twice the recording: with the gain unknown, Q of the deck is what it was."""
    asked = replace(question_of(case), gain_known=False)
    twice = replace(asked, frf=replace(asked.frf, values=2 * asked.frf.values))
    found = []
    for q in (asked, twice):
        prepared = prepare(q)
        found.append(written_Q(prepared, prepared.nominal, (prepared.score.use,))[0])
    assert found[1] == pytest.approx(found[0], rel=1e-3)


@pytest.mark.parametrize(("variance", "told"), [(0.01, 0.01), (0.1, 0.1), (0.3, None), (1e5, None)])
def test_noise_as_large_as_the_response_leaves_no_floor_that_is_told(variance, told):
    """To first order E|Δ log10 H|² = E|Δ H / H|² / ln² 10: of no use beyond."""
    prepared = SimpleNamespace(score=None, noise=np.full((4, 2, 1), variance))
    Q = noise_Q(prepared, np.ones((4, 2, 1), bool))
    assert Q == (None if told is None else pytest.approx(told))


def test_an_updated_deck_is_weighed_without_the_sensors_that_were_found():
    """As the article was: what hangs on it in the test alone is in the deck, not on the scales."""
    deck = plate(0.3, 0.2, 6, 4, 1e-3)
    heavier = with_masses(deck, (1, 7), 0.05)
    effects = (
        SimpleNamespace(traits=Traits(), weight=lambda x: Weight(0.0, x, 0.1 * float(x[0]))),
        SimpleNamespace(traits=Traits(writable=False), weight=lambda x: 1 / 0),
    )
    given, made = (SimpleNamespace(assembly=a) for a in (deck, heavier))
    found = SimpleNamespace(fit=SimpleNamespace(effects=effects, of=lambda e: np.ones(1)))
    asked, kg = SimpleNamespace(sensor_masses=()), mass_properties(deck)[0]
    for final in (given, made):
        stages = SimpleNamespace(nominal=given, final=SimpleNamespace(model=final))
        assert article_mass(asked, stages, found) == pytest.approx(kg)
