"""What every command refuses: one sentence, exit code 2 and no file, whichever command it is."""

import re
import shutil

import numpy as np
import pytest
from tests.builders.cases import write_case
from tests.builders.commands import ran, refused

import chladni
from chladni.cli.app import commands
from chladni.io.nastran import write_assembly
from chladni.units import UNITS
from chladni_specimens.plates import plate

from .test_cli import deck_text

WITH_FILE = [c for c in commands() if c not in ("demo", "blind")]  # these two take no file
CASELESS = (  # they take no case
    "report",
    "index",
    "compare",
    "next",
    "specimen",
    "init",
    "map",
    "check-effect",
    "convert",
)
COMPARING = ("diagnose", "calibrate", "correlate")  # a recording with the model
NEEDED = {  # extra arguments a command cannot do without
    "frf": ["--input", "1:+Z", "--output", "9:+Z"],
    "map": ["formed.k"],
    "compare": ["other"],
}
READERS = {  # commands that read a bare deck, and what makes them quick
    "modes": ("--count", "8"),
    "render": ("--modes", "7"),
    "frf": ("--input", "1:+Z", "--output", "9:+Z", "--lines", "4"),
    "plan": ("--sensors", "4", "--drawn", "0", "--modes", "2"),
    "bench": ("--exact",),
    "study": ("--vary", "E=90%:110%", "--samples", "2"),
    "check": (),
}
BAD = {
    "missing": None,
    "binary": bytes(range(256)) * 20,
    "no grids": b"BEGIN BULK\nMAT1,1,2.1+11,,0.3,7850.\nENDDATA\n",
}
BAD_DECKS = {
    "empty": "",
    "text": "one fine day\n" * 30,
    "no elements": "BEGIN BULK\nGRID,1,,0.,0.,0.\nENDDATA\n",
    "unknown property": deck_text().replace("PSHELL,1,", "PSHELL,7,"),
    "unknown grid": deck_text().replace("CQUAD4,1,1,1,", "CQUAD4,1,1,999,"),
    "no thickness": deck_text().replace("PSHELL,1,1,0.001,", "PSHELL,1,1,,"),
}


@pytest.mark.parametrize("command", WITH_FILE)
def test_a_bad_file_is_refused(tmp_path, monkeypatch, command):
    """No folder is left, neither the one that was named nor one of the command's own choice."""
    monkeypatch.chdir(tmp_path)
    for name, content in BAD.items():
        if content is not None:
            (tmp_path / name).write_bytes(content)
        words = (command, name, *NEEDED.get(command, []))
        sentence = refused(*words, "--out", tmp_path / "runs" / "x")
        assert " runs" not in sentence  # a folder that went again is not recommended
        ran(*words, code=2)
    assert {p.name for p in tmp_path.iterdir()} == {n for n, c in BAD.items() if c is not None}


FOREIGN = {  # first lines of files of other programs
    "a.inp": ("*HEADING\n*NODE\n1, 0., 0.\n", "an Abaqus input file"),
    "a.cdb": ("/COM,ANSYS\n/PREP7\n", "an Ansys archive"),
    "a.k": ("$ made by hand\n*KEYWORD\n*NODE\n", "an LS-DYNA keyword file"),
    "a.msh": ("$MeshFormat\n4.1 0 8\n", "a Gmsh mesh"),
    "a.vtk": ("# vtk DataFile Version 3.0\n", "a VTK file"),
    "a.vtu": ('<?xml version="1.0"?>\n<VTKFile type="x">\n', "a VTK file"),
    "a.stl": ("solid a\nfacet normal 0 0 1\n", "an STL file"),
    "b.stl": ("\0" * 90, "an STL file"),
    "a.unv": ("    -1\n  2411\n", "a universal file"),
    "a.med": ("\x89HDF\n", "a MED mesh"),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_model_of_another_program_names_the_command(tmp_path, name):
    """Each command says the same sentence; a deck with any of these names is still a deck."""
    text, what = FOREIGN[name]
    path = tmp_path / name
    path.write_text(text)
    made = f"`chladni convert {path} --out {path.stem}.bdf` makes a deck of it"
    due = f"{path} is {what}, not a Nastran deck; {made}"
    for command in (*READERS, "map", "init", "diagnose", "correlate"):
        words = (command, path, *NEEDED.get(command, []), "--out", tmp_path / "out")
        assert due in " ".join(refused(*words).split())
        if name != "a.inp":
            break
    if path.suffix in (".inp", ".k"):
        path.write_text(deck_text())
        assert ran("modes", path, "--count", "8", "--out", tmp_path / "out")


@pytest.mark.parametrize("fault", BAD_DECKS)
def test_a_bad_deck_is_refused(tmp_path, fault):
    (tmp_path / "bad.bdf").write_text(BAD_DECKS[fault])
    refused("modes", tmp_path / "bad.bdf", "--out", tmp_path / "out")


@pytest.mark.parametrize("command", [c for c in WITH_FILE if c not in CASELESS])
def test_a_folder_without_a_case_is_refused(tmp_path, command):
    words = (command, tmp_path, *NEEDED.get(command, []))
    assert "no case.toml in the folder" in refused(*words, "--out", tmp_path / "x")


@pytest.mark.parametrize("command", READERS)
def test_a_deck_in_other_units_is_refused(tmp_path, command):
    deck = write_assembly(plate(0.3, 0.3, 4, 4, 1e-3), tmp_path / "plate.bdf", UNITS["SI"])
    words = (command, deck, *READERS[command], "--units", "mm-t-s")
    assert "give --units SI, not mm-t-s" in refused(*words, "--out", tmp_path / "out")


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """Nine sensors along Z on a plate."""
    folder = tmp_path_factory.mktemp("case")
    sensors = (2, 4, 7, 18, 24, 30, 36, 43, 47)
    write_case(folder, 6, sensors, np.linspace(15, 250, 900), 240.0)
    for way in "XZ":
        rows = ["label,grid,direction,role", *(f"{g}:+Z,{g},+{way},output" for g in sensors)]
        (folder / f"along_{way}.csv").write_text("\n".join([*rows, ""]))
    return folder


@pytest.mark.parametrize(("command", "said"), [("check", "9 outputs"), ("correlate", "partner")])
def test_a_deck_with_its_recording_is_a_case(case, tmp_path, command, said):
    """As it is to ``diagnose`` and ``calibrate``."""
    deck, recording = case / "plate.bdf", case / "frf.npz"
    done = ran(command, deck, recording, "--units", "SI", "--out", tmp_path / "out")
    assert said in done.output
    out = "--out", tmp_path / "not"
    assert "leave out units" in refused(command, case, "--units", "SI", *out)


def spoilt(case, place, changes):
    """A copy of the case in which lines of case.toml that begin so are replaced."""
    shutil.copytree(case, place)
    text = (place / "case.toml").read_text()
    for start, new in changes.items():
        text = re.sub(rf"^{re.escape(start)}.*$", new, text, flags=re.MULTILINE)
    (place / "case.toml").write_text(text)
    return place


SPOILT = {  # what is replaced in case.toml; what is said
    "no recording": (
        {"recordings = ": ""},
        "has no recording to compare with the model; give it as recordings = [",
    ),
    "wrong units": ({"units = ": 'units = "mm-t-s"'}, 'set units = "SI"'),
    "wrong units, nothing weighed": (
        {"units = ": 'units = "mm-t-s"', "mass = ": ""},
        'set units = "SI" in [model], not mm-t-s',
    ),
    "another axis": ({"[test]": '[test]\nsensors = "along_X.csv"'}, "declared along X"),
}


@pytest.mark.parametrize("fault", SPOILT)
def test_a_case_that_cannot_be_right_is_refused_before_the_work(case, tmp_path, fault):
    """``check`` says the same."""
    changes, said = SPOILT[fault]
    place = spoilt(case, tmp_path / "case", changes)
    for command in COMPARING:
        assert said in refused(command, place, "--out", tmp_path / command)
    faults = chladni.check(chladni.load_case(place)).faults
    assert fault == "no recording" or any(said in f"{f.text}; {f.remedy}" for f in faults)


def test_sensors_declared_as_they_are_pass(case, tmp_path):
    place = spoilt(case, tmp_path / "case", {"[test]": '[test]\nsensors = "along_Z.csv"'})
    assert not chladni.check(chladni.load_case(place)).faults
    assert len(chladni.correlate(chladni.load_case(place)).pairs) > 3
