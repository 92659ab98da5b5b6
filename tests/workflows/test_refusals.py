"""What cannot be right is said in one sentence; what is not to be trusted is written and exit 3."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from tests.builders.cases import changed_case
from tests.builders.commands import ran

import chladni
from chladni.cli import app
from chladni.errors import AccuracyError, FileError
from chladni.io.nastran import write_assembly
from chladni.reduced.accuracy import Accuracy
from chladni.search import basis_refinement
from chladni.units import UNITS, units
from chladni.workflows.unit_check import refuse_other_units
from chladni_specimens.plates import plate


@pytest.mark.parametrize("true", UNITS)
@pytest.mark.parametrize("said", UNITS)
def test_the_unit_system_that_fits_is_named(case, tmp_path, true, said):
    """A deck written in one system and declared another: its mass betrays it, or its steel does."""
    text = (case.path).read_text().replace('"SI"', f'"{said}"')
    (tmp_path / "case.toml").write_text(text)
    shutil.copy(case.path.with_name("frf.npz"), tmp_path)
    write_assembly(plate(0.3, 0.22, 6, 6, 1e-3), tmp_path / "plate.bdf", units(true))
    made = chladni.load_case(tmp_path)
    if true == said:
        refuse_other_units(made)
        return
    by_mass = units(true).mass != units(said).mass
    told = rf'weighs .* kg.*set units = "{true}"' if by_mass else rf'set units = "{true}".*steel'
    with pytest.raises(FileError, match=told):
        refuse_other_units(made)


def test_a_deck_that_fits_in_no_system_says_so(case):
    heavy = replace(case, setup=replace(case.setup, mass=60 * case.setup.mass))
    with pytest.raises(FileError, match="in no unit system"):
        refuse_other_units(heavy)


def test_grams_are_refused_in_words_of_case_and_command(case):
    """The mass may be an option, and where no case is written its name is that of the deck."""
    grams = replace(case, setup=replace(case.setup, mass=1e3 * case.setup.mass))
    said = r"^\S+: the deck read in SI weighs .*: the mass is in kg: write"
    with pytest.raises(FileError, match=said):
        refuse_other_units(grams)


@pytest.mark.parametrize("times", [0.21, 1.0, 4.9])
def test_what_an_effect_may_weigh_is_not_refused(case, times):
    deck = chladni.modes(case, 7).mass
    refuse_other_units(replace(case, setup=replace(case.setup, mass=times * deck)))


def test_nothing_weighed_nothing_refused(without_mass):
    refuse_other_units(without_mass)


def test_a_reduced_model_beyond_its_limit_is_written_and_exit_3(case, tmp_path, monkeypatch):
    """Whatever is added to the basis, it stays 1 % off: all is on disk, and the exit says so."""
    off = Accuracy(np.ones(1), np.array([0.01]), np.zeros((1, 0)))
    monkeypatch.setattr(Accuracy, "refined", lambda self, model: model)
    monkeypatch.setattr(basis_refinement, "_accuracy", lambda problem, hypothesis: off)
    done = ran("calibrate", case.path.parent, "--out", tmp_path / "out", code=3)
    assert "by 1.00 %" in done.stderr
    d = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert "do not trust the result" in d["distrust"][0]
    assert "Reasons for doubt" in (tmp_path / "out" / "report.html").read_text()
    assert (tmp_path / "out" / "calibrated.bdf").exists()


def test_a_result_that_is_trusted_hands_itself_out(diagnosed):
    assert diagnosed.trusted() is diagnosed
    with pytest.raises(AccuracyError, match="too narrow"):
        replace(diagnosed, distrust=("the basis is too narrow",)).trusted()


def test_each_reason_for_doubt_is_a_line(diagnosed, capsys):
    doubted = replace(diagnosed, distrust=("the basis is too narrow", "t ended\nfar off"))
    assert app._run(lambda: doubted.trusted() and 0) == 3
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["chladni: the basis is too narrow", "chladni: t ended far off"]


def test_frfs_beside_the_poles_that_are_compared_are_screened_alone(case, tmp_path):
    """Where poles are compared the case knows places of its table alone, not those of the FRFs."""
    named = '["frf.npz", "poles.csv"]\nuse = "poles.csv"\nsensors = "sensors.csv"'
    source = changed_case(case.path.parent, tmp_path / "case", ('["frf.npz"]', named))
    (source / "poles.csv").write_text("mode,frequency_hz\n1,40.0\n2,80.0\n")
    rows = ["label,grid,direction,role", *(f"{g}:+Z,{g},+Z,input" for g in (30, 43))]
    (source / "sensors.csv").write_text("\n".join(rows) + "\n")
    (found,) = chladni.evaluate_recordings(chladni.load_case(source)).recordings
    assert found.screening.name == "frf.npz"
    assert "channels against the model" not in [check.name for check in found.screening.checks]
