"""The page says what was done: what was calibrated, what was compared, and nothing else."""

import json
import shutil
from dataclasses import replace

import pytest
from tests.builders.cases import changed_case
from tests.builders.commands import ran

import chladni
from chladni.report.diagnosis_folder import write_diagnosis
from chladni.report.diagnosis_json import read_diagnosis
from chladni.report.drawings import drawings_of


@pytest.fixture(scope="module")
def run_folder(case, diagnosed, tmp_path_factory):
    out = tmp_path_factory.mktemp("run")
    write_diagnosis(out, case, diagnosed, pictures=True)
    return out


def test_the_page_is_written_again_from_its_folder(run_folder, tmp_path):
    """Word for word the same, but for what only the second page has."""
    first = (run_folder / "report.html").read_text()
    ran("report", run_folder, "--out", tmp_path, "--title", "again")
    second = (tmp_path / "report.html").read_text()
    for section in ("Scores", "Calibrated parameters", "Frequencies", "Why not something else"):
        a, b = (t[t.index(f"<h2>{section}</h2>") :] for t in (first, second))
        assert a[: a.index("<figure")] == b[: b.index("<figure")] if "<figure" in a else True


def test_every_picture_of_a_run_stands_on_its_page(run_folder):
    """Each by its drawing, in the section of that drawing."""
    page = (run_folder / "report.html").read_text()
    assert page.count("data:image/png") == len([*run_folder.glob("*.png")])
    assert "<h2>More pictures</h2>" not in page


def test_a_page_that_cannot_be_read_leaves_its_pictures(run_folder, tmp_path):
    """They stand at the end of the next page."""
    shutil.copytree(run_folder, tmp_path / "run")
    (tmp_path / "run" / "report.html").write_text("damaged")
    ran("report", tmp_path / "run", "--out", tmp_path / "again")
    page = (tmp_path / "again" / "report.html").read_text()
    assert page.count("data:image/png") == len([*run_folder.glob("*.png")])
    assert "<h2>More pictures</h2>" in page


def test_without_a_wish_for_pictures_there_is_that_of_the_first_screen(case, diagnosed, tmp_path):
    """The page draws the others itself, and a second page from the folder does too."""
    write_diagnosis(tmp_path / "run", case, diagnosed)
    assert [p.name for p in (tmp_path / "run").glob("*.png")] == ["where.png"]
    page = (tmp_path / "run" / "report.html").read_text()
    assert page.count("data:image/png") == 1
    ran("report", tmp_path / "run", "--out", tmp_path / "again")
    again = (tmp_path / "again" / "report.html").read_text()
    assert [d.name for d in drawings_of(tmp_path / "again" / "report.html")[1]] == [
        d.name for d in drawings_of(tmp_path / "run" / "report.html")[1]
    ]
    assert again.count('class="live') == page.count('class="live')


def test_the_result_is_read_back(run_folder, diagnosed):
    found = read_diagnosis(run_folder)
    assert found.effects == diagnosed.effects
    assert found.agreement == diagnosed.agreement
    assert found.calibrated == diagnosed.calibrated
    assert found.frequencies == diagnosed.frequencies
    assert found.models is None


def test_calibrated_values_stand_beside_those_of_the_deck(case, calibrated, tmp_path):
    """Deck, interval, change; the density of steel is known before the test: it is frozen."""
    result = write_diagnosis(tmp_path, case, calibrated)
    assert {c.where: c.deck_value for c in result.calibrated}
    page = (tmp_path / "report.html").read_text()
    assert "Calibrated parameters" in page
    assert page.count("<td") > 0
    t = next(c for c in result.calibrated if c.estimate.name == "t")
    assert t.deck_value == pytest.approx(1e-3)
    assert "210 GPa" in page
    assert "frozen (7773 kg/m³ to 7927 kg/m³ by its prior)" in page
    for title in ("Identifiability", "Basins of the fit", "Uncertainty of the values"):
        assert f"<h2>{title}</h2>" in page
    assert t.estimate.low < t.estimate.value < t.estimate.high


def test_figures_of_the_page_are_named_for_what_they_are(run_folder):
    d = json.loads((run_folder / "diagnosis.json").read_text())
    for q in (d["fit"], d["fit"]["held_out"]):
        assert q["Q_floor"] < 1e-3 * q["Q_with_effect"] or q["Q_floor"] < 1e-6
        assert q["Q_with_nuisances"] is not None
    page = (run_folder / "report.html").read_text()
    assert "floor: the recording&#39;s noise alone" in page
    assert "which no deck contains" in page
    assert "noise, repeats" not in page


def test_a_page_of_frequencies_claims_no_fitted_response(case, folder, tmp_path):
    """Places known to 2 cm only: frequencies are compared, responses are shown and said to be."""
    words = ("[test]", '[test]\nsensors = "sensors.csv"')
    source = changed_case(folder, tmp_path / "case", words)
    rows = [f"{o},{o.split(':')[0]},+Z,{role},0.02" for o, role in
            [(o, "output") for o in case.frfs[0].outputs] + [("2:+Z", "input")]]  # fmt: skip
    (source / "sensors.csv").write_text(
        "\n".join(["label,grid,direction,role,position_sd", *rows, ""])
    )
    made = chladni.load_case(source)
    result = write_diagnosis(tmp_path / "out", made, chladni.calibrate(made), pictures=True)
    assert result.compared == "frequencies"
    page = (tmp_path / "out" / "report.html").read_text()
    assert "frequencies were compared" in page
    assert "A fitted channel" not in page
    assert "held-out channel" not in page.split("</header>")[1]
    assert not (tmp_path / "out" / "frf_fitted.png").exists()
    assert (tmp_path / "out" / "frf.png").exists()


def test_no_curve_no_picture(case, diagnosed, tmp_path):
    """A result without responses still has its page."""
    bare = replace(diagnosed, models=replace(diagnosed.models, curves={}))
    write_diagnosis(tmp_path, case, bare, pictures=True)
    assert not list(tmp_path.glob("frf*"))


def test_a_correlation_explains_itself(folder, case, tmp_path):
    """Pairs with the model's own mode numbers, CoMAC, shapes side by side, Q in words."""
    out = tmp_path / "out"
    ran("correlate", folder, "--pictures", "--out", out)
    page = (out / "report.html").read_text()
    found = json.loads((out / "correlation.json").read_text())
    f = chladni.modes(case, 20).modal.frequency
    for pair in found["modes"]:
        assert f[pair["model_mode"] - 1] == pytest.approx(pair["model_hz"], rel=1e-6)
        assert f"<td>{pair['test_hz']:.2f}</td>" in page.replace(' class="word"', "")
    assert (out / "shapes.png").is_file()
    q = found["Q"]
    assert q["magnitude"] + q["phase"] == pytest.approx(q["mean"])
    assert f"a factor of {10 ** q['magnitude'] ** 0.5:.3g}" in page
    worst = min(found["comac"], key=found["comac"].get)
    sensors = page[page.index("<h2>Sensors</h2>") :]
    assert sensors.index(worst) == min(sensors.index(s) for s in found["comac"] if s in sensors)
    assert "e^" not in page


def test_pairs_of_shapes_agree_where_model_and_test_are_one(case):
    """Scaled onto the model at the sensors: of a pair with MAC 1 both are the same numbers."""
    pairs = chladni.correlate(case).shapes
    assert len(pairs.pairs) > 2
    for (i, j), mac in zip(pairs.pairs, pairs.mac, strict=True):
        test, model = pairs.test[:, i], pairs.model[:, j]
        assert abs(model).max() == pytest.approx(1)
        alike = (test @ model) ** 2 / ((test @ test) * (model @ model))
        assert alike == pytest.approx(mac, abs=0.01)
        assert ((test - model) ** 2).sum() <= (1.001 - mac) * (model @ model)
