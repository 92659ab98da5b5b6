"""A run: seeds kept apart, seals said first, nothing done twice, crashes are rows."""

import json
import shutil

import pytest

from chladni.errors import AccuracyError, LabelError
from chladni_evidence import evidence_run
from chladni_evidence.__main__ import main
from chladni_evidence.blind_diagnosis import Answer, diagnosed
from chladni_evidence.evidence_run import RunFolders, run
from chladni_evidence.evidence_sets import HOMES, OURS, SETS, Order, orders, purpose, seed_range
from chladni_evidence.hidden_kinds import CATALOGUED
from chladni_evidence.made_case import KINDS
from chladni_evidence.outside_kinds import OUTSIDE

NULL = Order("tube frame", "nothing", 500, "fine")
MASS = Order("tube frame", "point-mass", 500, "fine")


def test_seeds_that_tune_never_report():
    assert "tuning" in purpose([500, 599])
    assert "report" in purpose([600, 601])
    for mixed in ([599, 600], [7], [499, 500]):
        with pytest.raises(LabelError, match="tune"):
            purpose(mixed)


def test_sets_hold_what_they_promise():
    """Five seeds: 60 cases on forms, half of them nulls; 30 outside; all kinds on the tailgate."""
    five = range(600, 605)
    forms, outside = orders("forms", five), orders("outside", five)
    assert len(forms) == 60
    assert sum(o.kind == "nothing" for o in forms) == 30
    assert {o.kind for o in forms} == set(CATALOGUED)
    assert len(outside) == 30
    assert {o.kind for o in outside} == set(HOMES) > set(OUTSIDE)
    tailgate = orders("tailgate", five)
    assert {(o.kind, o.mesh == "calculix") for o in tailgate} == {
        (k, by) for k in CATALOGUED for by in (True, False) if not (by and k in OURS)
    }
    for name in SETS:
        names = [o.name for o in orders(name, five)]
        assert len(set(names)) == len(names)
        assert not any(kind in n for n in names for kind in KINDS)


def answering(calls):
    def diagnose(case, out, limit):
        calls.append(case.name)
        if case.name == MASS.name:
            return Answer(1, 1.0, 0.1, "ZeroDivisionError: division by zero")
        return Answer(0, 1.0, 0.1, "", {"verdict": "nothing missing", "effects": []})

    return diagnose


def test_a_finished_case_is_never_run_again(tmp_path, monkeypatch):
    """Seal before answer, a crash is a row, a second run takes the answers of the first."""
    calls, said = [], []
    monkeypatch.setattr(evidence_run, "diagnosed", answering(calls))
    rows = run([NULL, MASS], tmp_path, 1, said.append)
    assert [r["outcome"] for r in rows] == ["right", "crash"]
    first = next(k for k, text in enumerate(said) if text.startswith(f"{NULL.name} sealed with"))
    assert said[first + 1].startswith(f"{NULL.name}: tube frame")
    again = run([NULL, MASS], tmp_path, 1, said.append)
    assert len(calls) == 2
    assert again == rows
    assert json.loads((tmp_path / "rows.json").read_text()) == rows


def test_a_seal_that_changed_is_noticed(tmp_path, monkeypatch):
    places = RunFolders(tmp_path)

    def meddle(case, out, limit):
        sealed = places.of("sealed", NULL, ".json")
        sealed.write_text(sealed.read_text().replace('"seed": 500', '"seed": 501'))
        return Answer(0, 1.0, 0.1, "", {"verdict": "nothing missing", "effects": []})

    monkeypatch.setattr(evidence_run, "diagnosed", meddle)
    with pytest.raises(AccuracyError, match="changed since"):
        run([NULL], tmp_path, 1, str)
    said = []
    assert run([NULL], tmp_path, 1, said.append) == []
    assert any("changed since" in text for text in said)


def test_a_maker_that_fails_stops_nobody(tmp_path, monkeypatch):
    said = []
    monkeypatch.setattr(evidence_run, "diagnosed", answering([]))
    rows = run([Order("tube frame", "thickness-distribution", 500, "fine"), NULL], tmp_path, 1,
               said.append)  # fmt: skip
    assert len(rows) == 1
    assert any("NOT MADE" in text for text in said)


def test_a_folder_that_is_no_case_is_refused(tmp_path):
    """The door itself: a process of its own, its exit code, its words, what it took."""
    (tmp_path / "case").mkdir()
    found = diagnosed(tmp_path / "case", tmp_path / "answer")
    assert found.code == 2
    assert "chladni" in found.said
    assert found.gigabytes > 0.01
    assert not found.crashed


def test_a_diagnosis_that_hangs_is_ended(tmp_path):
    (tmp_path / "case").mkdir()
    found = diagnosed(tmp_path / "case", tmp_path / "answer", limit=0.0)
    assert found.code < 0
    assert found.crashed


def test_command_line_refuses_in_a_sentence(tmp_path, capsys):
    out = ["--out", str(tmp_path)]
    assert main(["run", "--set", "forms", "--seeds", "599-600", *out]) == 2
    assert main(["run", "--set", "forms", "--seeds", "some", *out]) == 2
    assert "write 600-604" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["109-100", "some", "-3", ""])
def test_seeds_that_are_no_range_are_refused(text):
    with pytest.raises(LabelError, match="are no range"):
        seed_range(text)
    assert seed_range("7") == range(7, 8)


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_a_set_runs_from_end_to_end(name, tmp_path):
    """A null of each set on tuning seeds: made, sealed, answered and scored, no crash."""
    chosen = [o for o in orders(name, [520]) if o.mesh != "calculix" or shutil.which("ccx")]
    null = [o for o in chosen if o.kind in ("nothing", "duplicated-pair")][:1]
    (found,) = run(null, tmp_path, 1, str)
    assert found["outcome"] not in ("crash", "refused")
