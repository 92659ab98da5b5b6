"""What a new user does wrong, one thing at a time: the cause in a sentence, before any fit."""

import shutil
from dataclasses import replace

import pytest

import chladni
from chladni.inference.result import Agreement, Scores
from chladni.io.package_files import mesh_path
from chladni.io.tables.read_tables import read_recordings
from chladni.io.tables.write_tables import write_npz
from chladni.report.next_steps import next_steps
from chladni.workflows.diagnosis_pipeline import far_off
from chladni.workflows.diagnosis_result import DiagnosisResult


@pytest.fixture(scope="module")
def frf():
    """Every third line of the recording of the demo."""
    whole = read_recordings(mesh_path("demo/recording.uff"))[0].frf
    thin = {k: v[::3] for k in ("frequency", "values", "coherence", "variance")
            if (v := getattr(whole, k)) is not None}  # fmt: skip
    return replace(whole, **thin)


def exchanged(frf):
    names = list(frf.outputs)
    names[2], names[11] = names[11], names[2]
    return replace(frf, outputs=tuple(names))


def all_along_x(frf):
    """A table that gives every channel the same direction, whatever its label says."""
    rows = (f"{label},{label.partition(':')[0]},+X,output" for label in frf.outputs)
    return "\n".join(["label,grid,direction,role", *rows, ""])


WRONG = {  # the recording, words of the case that are exchanged, what must be said
    "two labels exchanged": (exchanged, {}, "312:n and 240:+Y are exchanged"),
    "ten times too large": (lambda H: replace(H, values=10 * H.values), {}, "times the model"),
    "all signs": (lambda H: replace(H, values=-H.values), {}, "reversed"),
    "all along X": (None, {"sensors.csv": "all.csv"}, "the model's shapes across the surface"),
    "displacement": (lambda H: replace(H, quantity="receptance"), {}, "is accelerance"),
}


@pytest.mark.parametrize("wrong", [None, *WRONG])
def test_the_likely_cause_is_said(frf, tmp_path, wrong):
    spoil, words, said = WRONG[wrong] if wrong else (None, {}, "")
    text = mesh_path("demo/case.toml").read_text().replace("recording.uff", "a.npz")
    for old, new in words.items():
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "case.toml").write_text(text)
    (tmp_path / "all.csv").write_text(all_along_x(frf))
    for name in ("deck.bdf", "sensors.csv"):
        shutil.copy(mesh_path(f"demo/{name}"), tmp_path)
    write_npz(tmp_path / "a.npz", spoil(frf) if spoil else frf)
    faults = chladni.check(chladni.load_case(tmp_path)).faults
    assert bool(faults) == bool(wrong), faults
    assert said in " ".join(f"{f.text}; {f.remedy}" for f in faults[:1])  # what the command says


def test_a_table_that_contradicts_its_labels_is_told(frf, tmp_path):
    """The columns count, as docs/case.md says; nobody has to find out by a bad fit."""
    for name in ("deck.bdf", "recording.uff", "sensors.csv"):
        shutil.copy(mesh_path(f"demo/{name}"), tmp_path)
    text = mesh_path("demo/case.toml").read_text()
    (tmp_path / "case.toml").write_text(text)
    said = "another direction than the table of sensors"
    assert said not in " ".join(chladni.load_case(tmp_path).notes)
    (tmp_path / "sensors.csv").write_text(all_along_x(frf))
    (note,) = [n for n in chladni.load_case(tmp_path).notes if said in n]
    assert note.startswith("1:-Y, 620:+Y, 240:+Y, 382:-Y, 14:n, 207:n and 14 more say ")


@pytest.mark.parametrize(("Q", "doubts"), [(None, 0), (0.9, 0), (1.1, 1), (274.0, 1)])
def test_no_deck_a_factor_of_ten_off_is_recommended(Q, doubts):
    """Q = 1 is one decade squared: such a deck is in doubt whatever the verdict."""
    scores = Agreement(fitted=Scores(nominal=Q, calibrated=Q, with_effect=Q))
    result = DiagnosisResult(
        verdict="calibration only", agreement=scores, files={"deck": "updated.bdf"}
    )
    assert len(tuple(far_off(result))) == doubts
    said = replace(result, distrust=tuple(far_off(result)))
    steps = " ".join(next_steps(said))
    assert ("Use updated.bdf" in steps) == (not doubts)
    assert tuple(far_off(replace(result, compared="frequencies"))) == ()
