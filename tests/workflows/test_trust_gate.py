"""What a new user does wrong, one thing at a time: the cause in a sentence, before any fit."""

import shutil
from dataclasses import replace

import pytest

import chladni
from chladni.io.package_files import mesh_path
from chladni.io.tables.read_tables import read_recordings
from chladni.io.tables.write_tables import write_npz


@pytest.fixture(scope="module")
def frf():
    return read_recordings(mesh_path("demo/recording.uff"))[0].frf


def exchanged(frf):
    names = list(frf.outputs)
    names[2], names[11] = names[11], names[2]
    return replace(frf, outputs=tuple(names))


def table(frf):
    rows = (f"{label},{label.partition(':')[0]},+X,output" for label in frf.outputs)
    return "\n".join(["label,grid,direction,role", *rows, ""])


WRONG = {  # the recording, words of the case that are exchanged, what must be said
    "two labels exchanged": (exchanged, {}, "303:+Z and 3:+Z are exchanged"),
    "ten times too large": (lambda H: replace(H, values=10 * H.values), {}, "times the model"),
    "all signs": (lambda H: replace(H, values=-H.values), {}, "reversed"),
    "X for Z": (None, {"recordings": 'sensors = "x.csv"\nrecordings'}, "declared along X"),
    "displacement": (lambda H: replace(H, quantity="receptance"), {}, "is accelerance"),
    "grams": (None, {"mass = 1.92641": "mass = 1926.41"}, "is in kg"),
    "millimetres": (None, {"mm-t-s": "SI"}, 'set units = "mm-t-s"'),
}


@pytest.mark.parametrize("wrong", [None, *WRONG])
def test_the_likely_cause_is_said(frf, tmp_path, wrong):
    spoil, words, said = WRONG[wrong] if wrong else (None, {}, "")
    text = mesh_path("demo/case.toml").read_text().replace("recording.uff", "a.npz")
    for old, new in words.items():
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "case.toml").write_text(text)
    (tmp_path / "x.csv").write_text(table(frf))
    shutil.copy(mesh_path("demo/deck.bdf"), tmp_path)
    write_npz(tmp_path / "a.npz", spoil(frf) if spoil else frf)
    faults = chladni.check(chladni.load_case(tmp_path)).faults
    assert bool(faults) == bool(wrong), faults
    assert said in " ".join(f"{f.text}; {f.remedy}" for f in faults[:1])  # what the command says
