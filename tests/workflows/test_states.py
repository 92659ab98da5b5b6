"""Several recordings and several states of one object in one case."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from tests.builders.cases import changed_case
from tests.builders.commands import ran, refused
from tests.builders.plate_recordings import MASS, PLACE, SENSORS, SHAKERS, T, a_case, record

import chladni
from chladni.ema.setup import PoleTable
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_poles
from chladni.report.diagnosis_folder import write_diagnosis
from chladni.report.diagnosis_json import diagnosis_json, from_json, read_diagnosis
from chladni.search.diagnosis import Diagnosis
from chladni.workflows.diagnosis_pipeline import Explained
from chladni.workflows.states import _with
from chladni_specimens.plates import plate

TRIED = ("point-mass", "mass-patch", "stiffness-patch", "extra-support")


@pytest.fixture(scope="module")
def changed(tmp_path_factory):
    """A plate 1.5 % thicker than its deck, bare and with 20 g on it."""
    folder = tmp_path_factory.mktemp("states")
    mass = record(folder / "bare.npz")
    record(folder / "loaded.npz", mass=MASS, seed=1)
    return a_case(
        folder, mass, {"file": "bare.npz", "state": "bare"},
        {"file": "loaded.npz", "state": "with 20 g"}, tried=TRIED,
    )  # fmt: skip


@pytest.fixture(scope="module")
def diagnosed(changed):
    return chladni.diagnose(changed)


def test_the_effect_is_found_in_the_state_that_has_it(diagnosed):
    bare, loaded = diagnosed.states
    assert (bare.name, loaded.name) == ("bare", "with 20 g")
    assert not bare.result.effects
    (found,) = loaded.result.effects
    assert found.name == "point-mass"
    assert np.linalg.norm(np.subtract(found.where.point_m[:2], PLACE)) < 0.03
    M = next(p for p in found.parameters if p.name == "M")
    assert M.low < MASS < M.high


def test_what_is_common_is_one_number(diagnosed):
    """E, rho, t are the same in every deck, and the thickness is the plate's."""
    values = [
        {(c.where, c.estimate.name): c.estimate.value for c in s.result.calibrated}
        for s in diagnosed.states
    ]
    assert values[0] == pytest.approx(values[1])
    shared = {p.estimate.name: p.estimate for p in diagnosed.shared}
    assert set(shared) == {"E", "rho", "t"}
    assert shared["t"].low < T < shared["t"].high
    assert all("was fitted together with" in s.result.notes[0] for s in diagnosed.states)
    assert "point-mass is in 'with 20 g' only" in diagnosed.notes


def test_a_later_recording_builds_on_an_answer(changed, diagnosed, tmp_path):
    """A repeat of the loaded plate has the odds of both, and a narrower interval of the mass.

    The same recordings are refused, that of another state too.
    """
    write_diagnosis(tmp_path / "run", changed, diagnosed)
    earlier = tmp_path / "run" / "state-2-with-20-g"
    mass = record(tmp_path / "later.npz", mass=MASS, seed=2)
    later = a_case(tmp_path, mass, {"file": "later.npz"}, tried=TRIED)
    found = chladni.diagnose(later, earlier=earlier)
    (effect,) = found.effects
    assert effect.name == "point-mass"
    assert any(n.startswith(f"this answer builds on that of {earlier}") for n in found.notes)
    before = diagnosed.states[1].result
    assert found.agreement.two_log_bayes_factor > before.agreement.two_log_bayes_factor
    wide, narrow = (_mass(r) for r in (before, found))
    assert narrow.high - narrow.low < wide.high - wide.low
    assert len(found.posterior.data) == len(before.posterior.data) + len(SENSORS)
    used = tmp_path / "used"
    used.mkdir()
    for name in ("bare", "loaded"):
        (used / "frf.npz").write_bytes((changed.path.parent / f"{name}.npz").read_bytes())
        a_case(used, mass, {"file": "frf.npz"}, tried=TRIED)
        words = ("diagnose", used, "--earlier", earlier, "--out", tmp_path / "out")
        assert "so they would count twice" in refused(*words)
    words = ("diagnose", changed.path, "--earlier", earlier, "--out", tmp_path / "out")
    assert "choose one by [test] use" in refused(*words)


def _mass(result):
    """The estimate of the mass of the named effect."""
    return next(p for p in result.effects[0].parameters if p.name == "M")


def test_every_state_has_its_deck_and_its_place_on_the_page(changed, diagnosed, tmp_path):
    written = write_diagnosis(tmp_path, changed, diagnosed)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "with 20 g" in page
    assert "Shared by all states" in page
    loaded = tmp_path / "state-2-with-20-g"
    assert (loaded / "report.html").exists()
    assert "CONM2" in (loaded / "updated.bdf").read_text()
    assert "CONM2" not in (tmp_path / "updated.bdf").read_text()
    again = read_diagnosis(tmp_path)
    assert diagnosis_json(from_json(diagnosis_json(written))) == diagnosis_json(written)
    assert [s.name for s in again.states] == ["bare", "with 20 g"]
    assert again.states[1].result.effects[0].name == "point-mass"


def test_one_state_alone_where_it_is_asked_for(changed, tmp_path):
    words = ("[test]", '[test]\nuse = "with 20 g"')
    one = changed_case(changed.path.parent, tmp_path / "one", words)
    found = chladni.calibrate(chladni.load_case(one))
    assert not found.states
    assert any("loaded.npz is compared with the model; not used: bare.npz" in n
               for n in found.notes)  # fmt: skip


def test_states_of_a_table_of_poles_share_their_parameters(tmp_path):
    """Natural frequencies of one plate, twice: E, rho and t are one."""
    found = chladni.modes(_article(tmp_path), 11)
    f = found.modal.frequency[6:]
    nothing = np.full(len(f), np.nan)
    both = PoleTable(
        np.concatenate([f, f * 1.002]), np.full(2 * len(f), 0.05), np.tile(nothing, 2),
        np.tile(np.arange(1, len(f) + 1), 2), ("cold",) * len(f) + ("warm",) * len(f),
    )  # fmt: skip
    write_poles(tmp_path / "poles.csv", both)
    case = a_case(tmp_path, round(found.mass, 5), {"file": "poles.csv"})
    found = chladni.calibrate(case)
    assert [s.name for s in found.states] == ["cold", "warm"]
    values = [[c.estimate.value for c in s.result.calibrated] for s in found.states]
    np.testing.assert_allclose(values[0], values[1])
    decks = [{edit.value for edit in s.result.models.final.changes} for s in found.states]
    assert decks[0] == decks[1] != set()
    t = next(p.estimate for p in found.shared if p.estimate.name == "t")
    assert t.low < T < t.high


def _article(folder):
    write_assembly(plate(0.3, 0.22, 12, 12, T), folder / "article.bdf")
    return chladni.load(folder / "article.bdf", "SI")


def test_two_shakers_an_article_and_a_level(tmp_path):
    """Stacked, spread, held out and scored, and the level that moves is named."""
    mass = record(tmp_path / "a.npz")
    record(tmp_path / "b.npz", shakers=SHAKERS[1:], seed=1)
    record(tmp_path / "other.npz", t=1.003 * T, shakers=SHAKERS, seed=2)
    record(tmp_path / "hard.npz", t=0.985 * T, shakers=SHAKERS, seed=3)
    a_case(
        tmp_path, mass, {"file": "a.npz", "level": 1.0}, {"file": "b.npz", "level": 1.0},
        {"file": "other.npz", "article": "B"}, {"file": "hard.npz", "level": 5.0},
    )  # fmt: skip
    out = tmp_path / "out"
    done = ran("calibrate", tmp_path, "--out", out, code=3)
    assert "predicts the held-out data worse" in done.stderr
    told = json.loads((out / "diagnosis.json").read_text())
    rows = {r["name"]: r for r in told["recordings"]}
    assert rows["other.npz"]["relation"] == "article"
    assert rows["hard.npz"]["relation"] == "level"
    assert rows["other.npz"]["apart"] < rows["hard.npz"]["apart"]
    notes = " ".join(told["notes"])
    assert "stacked with a.npz as one test with 2 inputs" in notes
    assert "other.npz and the recording that is fitted differ by" in notes
    assert "nonlinear: natural frequencies change with level: " in notes
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "no deck can be expected to come closer" in page


@pytest.mark.parametrize("verdict", ["missing physics", "calibration only", "nothing missing"])
def test_decks_of_several_states_have_the_shared_values_alone(verdict):
    """Halved decks were fitted to one state: none stays, whatever the verdict."""
    fit = SimpleNamespace(neg2_log_evidence=0.0)
    found = Diagnosis(fit, fit, fit, (fit,), verdict, halved=(fit, fit))
    joint = SimpleNamespace()
    one = _with(Explained(None, None, found), joint, changed=True).found
    assert one.shared
    assert one.halved == ()
    assert joint in (one.written, one.plain)
