"""What a new user does wrong, one thing at a time: the cause in a sentence, before any fit."""

import shutil
from dataclasses import replace

import pytest
from tests.workflows.test_chain_faults import with_frf

import chladni
from chladni.ema.frf_maps import mapped
from chladni.inference.result import Agreement, Scores
from chladni.io.package_files import mesh_path
from chladni.report.next_steps import next_steps
from chladni.workflows.diagnosis_pipeline import far_off
from chladni.workflows.diagnosis_result import DiagnosisResult


def exchanged(case, one, other):
    return with_frf(case, values=mapped(case.frfs[0], ("exchanged", one, other)).values)


def scaled(case, factor):
    return with_frf(case, values=factor * case.frfs[0].values)


def all_along_x(labels):
    """A table that gives every channel the same direction, whatever its label says."""
    rows = (f"{label},{label.partition(':')[0]},+X,output" for label in labels)
    return "\n".join(["label,grid,direction,role", *rows, ""])


WRONG = {  # how the case is changed, what must be said
    "nothing": (lambda c: c, ""),
    "two labels": (lambda c: exchanged(c, "7:+Z", "43:+Z"), "7:+Z and 43:+Z are exchanged"),
    "ten times too large": (lambda c: scaled(c, 10), "times the model"),
    "all signs": (lambda c: scaled(c, -1), "reversed"),
    "displacement": (lambda c: with_frf(c, quantity="receptance"), "is accelerance"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_the_likely_cause_is_said(sound, wrong):
    change, said = WRONG[wrong]
    faults = chladni.check(change(sound)).faults
    assert bool(faults) == bool(said), faults
    assert said in " ".join(f"{f.text}; {f.remedy}" for f in faults[:1])  # what the command says


def test_a_table_that_contradicts_its_labels_is_told(tmp_path):
    """The columns count, as docs/case.md says: a note tells it, and check the likely cause."""
    for name in ("deck.bdf", "recording.uff", "sensors.csv"):
        shutil.copy(mesh_path(f"demo/{name}"), tmp_path)
    shutil.copy(mesh_path("demo/case.toml"), tmp_path)
    said = "another direction than the table of sensors"
    case = chladni.load_case(tmp_path)
    assert said not in " ".join(case.notes)
    labels = case.frfs[0].outputs
    (tmp_path / "sensors.csv").write_text(all_along_x(labels))
    case = chladni.load_case(tmp_path)
    (note,) = [n for n in case.notes if said in n]
    assert note.startswith("1:-Y, 620:+Y, 240:+Y, 382:-Y, 14:n, 207:n and 14 more say ")
    (first, *_) = chladni.check(case).faults
    assert "the model's shapes across the surface" in first.text + first.remedy


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
