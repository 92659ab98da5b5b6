"""A plate on its shaker table: transmissibilities are identified, fitted and explained as FRFs."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.cases import case_text, changed_case
from tests.builders.commands import refused
from tests.builders.plate_recordings import at
from tests.builders.recordings import noisy
from tests.builders.structures import held_along_x0

import chladni
from chladni.errors import FileError
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.model.point_masses import with_masses
from chladni.report.diagnosis_folder import write_diagnosis
from chladni.search.preparation import prepare
from chladni.search.written_scores import seen, written_Q
from chladni.workflows.question_of_case import question_of
from chladni_specimens.plates import plate

SENSORS = [(0.09, 0.05), (0.12, 0.2), (0.15, 0.1), (0.18, 0.025), (0.21, 0.15), (0.24, 0.0),
           (0.3, 0.05), (0.3, 0.175)]  # fmt: skip
TRIED = ["point-mass", "mass-patch", "stiffness-patch", "compliant-support"]
PLACE = (0.24, 0.15)  # of 20 g that the deck does not have


def clamped(t=1.2e-3, finer=1):
    """A plate held along its edge x = 0."""
    return held_along_x0(plate(0.3, 0.2, 10 * finer, 8 * finer, t))


def a_case(folder, article, seed):
    """What the table's accelerometer and those on the article say, with 1 % noise."""
    folder.mkdir(exist_ok=True)
    write_assembly(clamped(), folder / "plate.bdf")
    write_assembly(article, folder / "article.bdf")
    model = chladni.load(folder / "article.bdf", "SI")
    ends = [f"{g}:+Z" for g in at(article, SENSORS)]
    T = chladni.frf(model, ends, ["base:+Z"], np.linspace(12, 480, 700)).frfs[0]
    labels = tuple(f"{g}:+Z" for g in at(clamped(), SENSORS))
    write_npz(folder / "table.npz", replace(T, values=noisy(T.values, 0.01, seed), outputs=labels))
    mass = round(chladni.modes(model, 3).mass, 5)
    tried = f"[search]\neffects = {TRIED}\n"
    (folder / "case.toml").write_text(case_text(15.0, 420.0, mass, "table.npz") + tried)
    return chladni.load_case(folder)


@pytest.fixture(scope="module")
def heavy(tmp_path_factory):
    """A plate by a mesh twice as fine, with 20 g on it."""
    plain = clamped(finer=2)
    article = with_masses(plain, at(plain, [PLACE]), 0.02)
    return a_case(tmp_path_factory.mktemp("table"), article, 1)


@pytest.fixture(scope="module")
def diagnosed(heavy):
    return chladni.diagnose(heavy)


def test_a_concealed_mass_is_named(heavy, diagnosed):
    """Where it is and how heavy; the deck with it is better on data no fit saw.

    By half with the error of its mesh in both models: as it is written even the deck with the exact
    mass leaves 0.47 of what calibration leaves, all of it the mesh's.
    """
    (found,) = diagnosed.effects
    assert (diagnosed.verdict, found.name) == ("missing physics", "point-mass")
    assert np.linalg.norm(np.subtract(found.where.point_m[:2], PLACE)) < 0.04
    (mass,) = [p for p in found.parameters if p.name == "M"]
    assert mass.low < 0.02 < mass.high
    held = diagnosed.agreement.held_out
    assert held.with_effect < 0.5 * held.calibrated
    assert diagnosed.adequate.passes
    assert any("motion of the base" in note for note in diagnosed.notes)


def test_a_normal_is_an_output_of_a_moving_base():
    grid, f = at(clamped(), [PLACE])[0], np.linspace(12, 100, 5)
    T = chladni.frf(clamped(), [f"{grid}:n", f"{grid}:+Z"], ["base:+Z"], f).frfs[0]
    assert_allclose(np.abs(T.values[:, 0]), np.abs(T.values[:, 1]))


def test_a_null_stays_quiet(tmp_path):
    """The same plate 3 % thicker: that is calibrated, and nothing is named.

    The mesh is coarse, and the thin deck is right on the held-out band by chance. The calibrated
    deck has every shell halved, and is better.
    """
    found = chladni.diagnose(a_case(tmp_path / "null", clamped(1.236e-3, 2), 3))
    assert found.verdict in ("nothing missing", "calibration only")
    assert not found.effects
    assert not found.distrust
    assert "the calibrated deck predicts the held-out data worse" in found.halved
    held = found.agreement.held_out
    assert held.calibrated < 0.1 * held.nominal
    assert len(found.models.final.model.assembly.shells) == 4 * len(clamped().shells)
    t = next(p.estimate for p in found.calibrated if p.estimate.name == "t")
    assert t.low < 1.236e-3 < t.high
    assert found.agreement.fitted.calibrated < found.agreement.fitted.nominal


def test_the_reference_of_a_table_has_a_node_of_its_own(heavy, tmp_path):
    """Node 901 is the accelerometer on the table: sensors.csv says that it is the base."""
    words = ("[band]", 'sensors = "s.csv"\n[band]')
    source = changed_case(heavy.path.parent, tmp_path / "case", words)
    write_npz(source / "table.npz", replace(heavy.frfs[0], inputs=("901:+Z",)))
    (source / "s.csv").write_text("label,grid,role\n901:+Z,base,input\n")
    case = chladni.load_case(source)
    assert case.inputs.base.tolist() == [True]
    named, plain = (prepare(question_of(c)) for c in (case, heavy))
    assert_allclose(named.problem.data.values, plain.problem.data.values)
    (source / "s.csv").write_text("label,grid,role\n901:+Z,bas,input\n")
    with pytest.raises(FileError, match=r"s.csv, line 2: .*bas"):
        chladni.load_case(source)


def test_what_is_compared_is_the_full_structures_transmissibility(heavy):
    """Q of the deck by Ritz vectors, and the responses drawn, are of one structure."""
    asked = question_of(heavy)
    ready = prepare(asked)
    data, state = seen(asked, ready.score, ready.nominal, ready.problem.setup.f_max)
    drawn = ready.problem.data.rebased(ready.problem.reduced.model)
    assert data.quantity == "transmissibility"
    still = replace(data, s=2j * np.pi * np.array([1e-3]), values=np.ones((1, len(SENSORS), 1)))
    assert_allclose(still.model(state), 1.0, atol=1e-6)  # the base carries everything along
    assert drawn.direct.shape == (len(SENSORS), 1)
    (Q,) = written_Q(ready, ready.nominal, (ready.score.use,))
    assert pytest.approx(data.Q(state, data.use)) == Q


def test_the_page_and_the_deck(heavy, diagnosed, tmp_path):
    """The page says what was moved; the deck that is written explains the recording."""
    out = tmp_path / "out"
    write_diagnosis(out, heavy, diagnosed)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "the input is the motion of the base (base:+Z)" in page
    told = json.loads((out / "diagnosis.json").read_text())
    (out / "plate.bdf").write_text((out / told["files"]["deck"]).read_text())
    (out / "table.npz").write_bytes((heavy.path.parent / "table.npz").read_bytes())
    (out / "case.toml").write_text(heavy.path.read_text())
    asked = question_of(chladni.load_case(out))
    ready = prepare(asked)
    (Q,) = written_Q(ready, ready.nominal, (ready.score.use,))
    assert pytest.approx(told["fit"]["Q_with_effect"], rel=1e-6) == Q


@pytest.mark.parametrize("command", ["calibrate", "diagnose", "correlate"])
def test_a_base_without_supports_is_refused(heavy, tmp_path, command):
    source = changed_case(heavy.path.parent, tmp_path / "case")
    write_assembly(replace(clamped(), supports=np.zeros((0, 2), int)), source / "plate.bdf")
    assert "the base moves, but the deck has no grid with SPC" in refused(
        command, source, "--out", tmp_path / "x"
    )
