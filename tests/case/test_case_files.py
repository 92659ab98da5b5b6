"""Files of a case lie in its folder, unless it says otherwise; which files a command reads."""

import json
import os
import re

import pytest
from tests.builders.commands import ran

from chladni.case import load_case
from chladni.case.files_of_source import files_of
from chladni.errors import ChladniError, FileError

from .test_case import deck
from .test_schema import CASE, SENSORS, folder

__all__ = ["folder"]  # a case with every word


def moved(folder, tmp_path, name):
    """The case with one of its files in the folder above."""
    case = tmp_path / "case"
    case.mkdir()
    (folder / "sensors.csv").write_text(SENSORS)
    for path in folder.iterdir():
        if path.suffix in (".bdf", ".npz", ".csv", ".k"):
            (case / path.name).write_bytes(path.read_bytes())
    (case / name).rename(tmp_path / name)
    (case / "case.toml").write_text(CASE.replace(f'"{name}"', f'"../{name}"'))
    return case


@pytest.mark.parametrize(
    ("name", "word"),
    [("plate.bdf", r"\[model\] deck"), ("a.npz", r"\[test\] recordings"),
     ("b.npz", r"\[test\] recordings"), ("sensors.csv", r"\[test\] sensors")],
)  # fmt: skip
def test_paths_do_not_climb_unless_allowed(folder, tmp_path, name, word):
    case = moved(folder, tmp_path, name)
    with pytest.raises(FileError, match=rf"line \d+: {word} = '\.\./{name}' leads out of"):
        load_case(case)
    whole = (case / "case.toml").read_text().replace(f"../{name}", str(tmp_path / name))
    whole = re.sub("use = .*", 'use = "a.npz"', whole)
    (case / "case.toml").write_text(whole)
    with pytest.raises(FileError, match="leads out of"):
        load_case(case)
    (case / "case.toml").write_text(whole.replace("outside = false", "outside = true"))
    assert any("outside of its folder" in note for note in load_case(case).notes)


def test_a_way_that_comes_back_is_within(folder, tmp_path):
    case = moved(folder, tmp_path, "softer.bdf")
    (case / "sub").mkdir()
    text = CASE.replace('"plate.bdf"', '"sub/../plate.bdf"')
    (case / "case.toml").write_text(text)
    assert load_case(case).deck.path.name == "plate.bdf"


def test_what_a_case_allows_of_its_deck_is_noted(folder, tmp_path):
    case = moved(folder, tmp_path, "softer.bdf")
    text = deck().replace("ENDDATA", "CELAS2,99,0.1,17,3\nCWELD,900,1\nENDDATA")
    (case / "plate.bdf").write_text(text)
    (case / "case.toml").write_text(CASE.replace('allow = ["CWELD"]\n', ""))
    with pytest.raises(FileError, match=r"CWELD .*\[model\] allow = \[\"CWELD\"\]"):
        load_case(case)
    (case / "case.toml").write_text(CASE)
    assert any("ignored" in n and "CWELD" in n for n in load_case(case).notes)


def test_init_allows_what_it_points_to(tmp_path):
    (tmp_path / "plate.bdf").write_text(deck())
    for out, climbs in ((tmp_path / "case", True), (tmp_path, False)):
        words = ["init", str(tmp_path / "plate.bdf"), "--out", str(out), "--units", "mm-t-s"]
        ran(*words)
        assert ("outside = true" in (out / "case.toml").read_text()) is climbs
        assert load_case(out).deck.path.samefile(tmp_path / "plate.bdf")


def test_all_files_a_case_reads_are_told(folder, tmp_path):
    """Those the reader opens, and the case file itself."""
    case = moved(folder, tmp_path, "softer.bdf")
    (case / "plate.bdf").write_text(deck().replace("BEGIN BULK", "BEGIN BULK\nINCLUDE 'more.inc'"))
    (case / "more.inc").write_text("CELAS2,99,0.1,17,3\n")
    (case / "case.toml").write_text(CASE)
    due = {"case.toml", "plate.bdf", "more.inc", "formed.k", "a.npz", "b.npz", "sensors.csv"}
    assert {p.name for p in files_of(case)} == due
    (case / "case.toml").write_text("[model\n")
    assert [p.name for p in files_of(case)] == ["case.toml"]


@pytest.mark.parametrize("command", ["modes", "frf"])
def test_a_case_is_never_written_over(folder, tmp_path, command):
    """Results into the folder of the case itself leave every file of it as it was."""
    case = moved(folder, tmp_path, "softer.bdf")
    (case / "case.toml").write_text(CASE)
    (case / "frf.npz").write_bytes((case / "a.npz").read_bytes())
    (case / "report.html").write_text("mine")
    before = {p.name: p.read_bytes() for p in case.iterdir()}
    said = ran(command, case, "--out", case, code=2).stderr
    assert re.search(r"report\.html|frf\.npz", said), said
    assert {p.name: p.read_bytes() for p in case.iterdir() if p.is_file()} == before
    (kept,) = (p for p in case.iterdir() if p.is_dir())
    assert json.loads((kept / "run.json").read_text())["command"] == command


def test_names_no_file_can_have(folder, tmp_path):
    case = moved(folder, tmp_path, "softer.bdf")
    for name in ("a\\u0000b.npz", "x" * 300):
        (case / "case.toml").write_text(CASE.replace("a.npz", name))
        with pytest.raises((ChladniError, OSError)):
            load_case(case)
    assert os.listdir(case)
