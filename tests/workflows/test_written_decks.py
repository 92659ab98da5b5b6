"""Every Q of a result is that of a deck as it is written: anybody who runs the deck finds it."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spl

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.fem import modelled as fem_modelled
from chladni.io.nastran import write_deck
from chladni.updating.accuracy import LIMIT
from chladni.updating.preparation import ZETA_Q, prepare
from chladni.updating.written_scores import seen, written_Q
from chladni.workflows.question_of_case import question

LN10 = np.log(10.0)


@pytest.fixture(scope="module")
def again(case, folder, diagnosed, tmp_path_factory):
    """The same test with the updated deck as the deck."""
    place = tmp_path_factory.mktemp("again")
    shutil.copy(folder / "frf.npz", place)
    shutil.copy(folder / "case.toml", place)
    write_deck(case.deck, place / "plate.bdf", diagnosed.models.changes)
    return chladni.load_case(place)


def test_updated_deck_put_back_has_the_Q_that_was_promised(diagnosed, again):
    """No mesh error, no scatter, no gain hides beside the deck: Q_nominal now is Q_with_effect."""
    assert diagnosed.effects[0].name == "point-mass"
    found, due = chladni.calibrate(again).agreement, diagnosed.agreement
    for now, then in ((found.fitted, due.fitted), (found.held_out, due.held_out)):
        assert now.nominal == pytest.approx(then.with_effect, rel=1e-6)
    assert due.fitted.with_effect < 0.05 * due.fitted.nominal


def test_Q_is_that_of_the_full_matrices(case):
    """Q of Ritz vectors against (K + s²M)⁻¹ on full matrices, line by line.

    Frequencies may be ``LIMIT`` off and a slope of log10 H is 1/(ζ ln 10) at most, so the two
    differ by less than LIMIT/(ζ ln 10) decades on a line.
    """
    asked = question(case)
    prepared = prepare(asked)
    data, state = seen(asked, prepared.score, prepared.nominal, prepared.search.setup.top)
    system = prepared.nominal.structure.system
    made = prepared.nominal.structure
    load = asked.inputs.rows(made).T.toarray()[:, 0].astype(complex)
    out, some = asked.outputs.rows(made), np.arange(0, len(data.s), 7)
    u = [spl.spsolve(sp.csc_array(system.K + s**2 * system.M), load) for s in data.s[some]]
    exact = np.array([s**2 * (out @ x) for s, x in zip(data.s[some], u, strict=True)])[..., None]
    apart = np.abs(np.log(data.model(state)[some] / exact)) / LN10
    assert apart.max() < LIMIT / (ZETA_Q * LN10)
    (Q,) = written_Q(asked, prepared, prepared.nominal, (prepared.score.use,))
    assert Q == pytest.approx(data.Q(state, data.use))


def test_every_structure_is_solved_once(case, monkeypatch):
    """The deck, its refined mesh, the calibrated and the updated deck: four eigenproblems."""
    solved = []

    def counted(system, *given, **named):
        solved.append(system)
        return normal_modes(system, *given, **named)

    monkeypatch.setattr(fem_modelled, "normal_modes", counted)
    result = chladni.diagnose(case)
    models = result.models
    assert len(solved) == len({id(system) for system in solved}) == 4
    for made in (models.nominal, models.calibrated, models.final):
        assert sum(made.structure.system is system for system in solved) == 1


def test_an_unknown_gain_is_no_hidden_parameter(case):
    """Twice the recording: with the gain unknown, Q of the deck is what it was."""
    asked = replace(question(case), gain_known=False)
    twice = replace(asked, frf=replace(asked.frf, values=2 * asked.frf.values))
    found = []
    for q in (asked, twice):
        prepared = prepare(q)
        found.append(written_Q(q, prepared, prepared.nominal, (prepared.score.use,))[0])
    assert found[1] == pytest.approx(found[0], rel=1e-3)
