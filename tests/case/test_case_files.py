"""Files of a case lie in its folder, unless it says otherwise; which files a command reads."""

import json
import os
import re

import pytest
from tests.builders.commands import ran

from chladni.case import load_case
from chladni.case.files_of_source import files_of
from chladni.errors import ChladniError, FileError
from chladni.io.scanned_surface import read_scan

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


SECRET = "SECRET1 = hidden\n"


@pytest.fixture
def outer(folder, tmp_path):
    """A sound case, and a file of yours beside it."""
    case = moved(folder, tmp_path, "softer.bdf")
    (case / "case.toml").write_text(CASE)
    (tmp_path / "secret").write_text(SECRET)
    return case


LINKS = ("plate.bdf", "a.npz", "b.npz", "sensors.csv", "formed.k", "case.toml")


@pytest.mark.parametrize("by_folder", [False, True])
@pytest.mark.parametrize("name", LINKS)
def test_no_link_leads_out_of_a_case(outer, tmp_path, name, by_folder):
    """Neither of a file nor of a folder above it; nothing of the file is repeated."""
    text = (outer / "case.toml").read_text()
    (outer / name).unlink()
    if by_folder and name != "case.toml":
        (tmp_path / "yours").mkdir()
        (tmp_path / "secret").rename(tmp_path / "yours" / name)
        (outer / "sub").symlink_to(tmp_path / "yours")
        (outer / "case.toml").write_text(text.replace(f'"{name}"', f'"sub/{name}"'))
    else:
        (outer / name).symlink_to(tmp_path / "secret")
    for command in ("modes", "check"):
        said = ran(command, outer, "--out", tmp_path / "out", code=2).stderr
        assert "out of the folder of the case" in said
        assert "SECRET" not in said


def test_a_link_within_a_case_is_followed(outer):
    (outer / "data").mkdir()
    (outer / "plate.bdf").rename(outer / "data" / "plate.bdf")
    (outer / "plate.bdf").symlink_to("data/plate.bdf")
    assert load_case(outer).deck.path.name == "plate.bdf"


def test_the_folder_of_a_case_may_be_a_link(outer, tmp_path):
    (tmp_path / "mine").symlink_to(outer)
    assert len(load_case(tmp_path / "mine").recordings) == 2


INCLUDES = {
    "climbs": "../secret", "whole": "{secret}", "link": "linked", "folder": "sub/secret",
    "lost": "../nowhere",
}  # fmt: skip


@pytest.mark.parametrize("way", INCLUDES)
@pytest.mark.parametrize("place", ["bulk", "above", "deep", "keyword file"])
def test_what_a_file_includes_lies_within(outer, tmp_path, way, place):
    """Includes of a deck at any depth, of its case control, and of a thickness file."""
    (outer / "linked").symlink_to(tmp_path / "secret")
    (outer / "sub").symlink_to(tmp_path)
    name, sound = INCLUDES[way].format(secret=tmp_path / "secret"), deck()
    line = f"INCLUDE '{name}'"
    if place == "bulk":
        sound = sound.replace("BEGIN BULK", f"BEGIN BULK\n{line}")
    elif place == "above":
        sound = "SOL 103\nCEND\n" + sound.replace("BEGIN BULK", f"{line}\nBEGIN BULK")
    elif place == "deep":
        sound = sound.replace("BEGIN BULK", "BEGIN BULK\nINCLUDE 'inner.bdf'")
        (outer / "inner.bdf").write_text(line + "\n")
    else:
        (outer / "formed.k").write_text(f"*KEYWORD\n*INCLUDE\n{name}\n*END\n")
    (outer / "plate.bdf").write_text(sound)
    with pytest.raises(FileError, match=r"INCLUDE.* leads out of the folder of the case") as said:
        load_case(outer)
    assert "SECRET" not in str(said.value)
    assert tmp_path / "secret" not in [p.resolve() for p in files_of(outer)]


def test_a_table_of_channels_lies_within(outer, tmp_path):
    (tmp_path / "secret").write_text("channel,label,unit\nSECRET,1:+Z,N\n")
    (outer / "run.csv").write_text(
        "time_s,a,b\n" + "".join(f"{k},{k % 7},{k % 5}\n" for k in range(64))
    )
    (outer / "run.channels.csv").symlink_to(tmp_path / "secret")
    (outer / "case.toml").write_text(CASE.replace('"a.npz"', '"run.csv"'))
    with pytest.raises(FileError, match="leads out of") as said:
        load_case(outer)
    assert "SECRET" not in str(said.value)


def test_a_scan_opens_no_second_file(outer, tmp_path, monkeypatch):
    """An OBJ may name a file of materials, which a scan has no use for."""
    scan = "mtllib ../secret.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl x\nf 1 2 3\n"
    (outer / "scan.obj").write_text(scan)
    (tmp_path / "secret.mtl").write_text("newmtl x\n")
    opened, really = [], open
    monkeypatch.setattr("builtins.open", lambda n, *a, **k: opened.append(n) or really(n, *a, **k))
    assert len(read_scan(outer / "scan.obj").cells) == 1
    assert not [name for name in opened if "secret" in str(name)]


@pytest.mark.parametrize("form", ["HDF", "Binary"])
def test_the_numbers_of_an_xdmf_lie_within(outer, form):
    text = f'<Xdmf><Domain><DataItem Format="{form}">../secret:/t</DataItem></Domain></Xdmf>'
    (outer / "formed.xdmf").write_text(text)
    (outer / "case.toml").write_text(CASE.replace("formed.k", "formed.xdmf"))
    with pytest.raises(FileError, match="leads out of"):
        load_case(outer)


def test_a_long_value_is_shortened(outer):
    for found, other in (("plate.bdf", "x" * 2_000_000), ("a.npz", "y z " * 500_000)):
        (outer / "case.toml").write_text(CASE.replace(found, other))
        with pytest.raises(ChladniError) as said:
            load_case(outer)
        assert len(str(said.value)) < 1000


def test_a_way_that_comes_back_is_within(folder, tmp_path):
    case = moved(folder, tmp_path, "softer.bdf")
    (case / "sub").mkdir()
    text = CASE.replace('"plate.bdf"', '"sub/../plate.bdf"')
    (case / "case.toml").write_text(text)
    assert load_case(case).deck.path.name == "plate.bdf"


def test_what_a_case_allows_of_its_deck_is_noted(folder, tmp_path):
    case = moved(folder, tmp_path, "softer.bdf")
    text = deck().replace("ENDDATA", "CELAS2,99,0.1,17,3\nCSEAM,900,1\nENDDATA")
    (case / "plate.bdf").write_text(text)
    (case / "case.toml").write_text(CASE.replace('allow = ["CSEAM"]\n', ""))
    with pytest.raises(FileError, match=r"CSEAM .*\[model\] allow = \[\"CSEAM\"\]"):
        load_case(case)
    (case / "case.toml").write_text(CASE)
    assert any("ignored" in n and "CSEAM" in n for n in load_case(case).notes)


def test_init_allows_what_it_points_to(tmp_path):
    (tmp_path / "plate.bdf").write_text(deck())
    for out, climbs in ((tmp_path / "case", True), (tmp_path, False)):
        words = ["init", str(tmp_path / "plate.bdf"), "--out", str(out), "--units", "mm-t-s"]
        ran(*words)
        assert ("outside = true" in (out / "case.toml").read_text()) is climbs
        assert load_case(out).deck.path.samefile(tmp_path / "plate.bdf")


def test_init_allows_what_the_deck_includes_from_elsewhere(tmp_path):
    (tmp_path / "more.inc").write_text("$\n")
    (tmp_path / "case").mkdir()
    text = deck().replace("BEGIN BULK", "BEGIN BULK\nINCLUDE '../more.inc'")
    (tmp_path / "case" / "plate.bdf").write_text(text)
    ran("init", tmp_path / "case/plate.bdf", "--out", tmp_path / "case", "--units", "mm-t-s")
    assert "outside = true" in (tmp_path / "case" / "case.toml").read_text()
    assert load_case(tmp_path / "case").deck.path.samefile(tmp_path / "case/plate.bdf")


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
