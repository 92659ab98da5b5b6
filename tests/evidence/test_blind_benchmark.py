"""Make, run, score: seals first, nothing done twice, truths opened last, seeds kept apart."""

import json
import shutil
import subprocess
import sys

import pytest
from tests.builders.commands import call, ran, refused

from chladni.errors import AccuracyError, FileError, LabelError
from chladni_evidence import blind_make, blind_run, kratos
from chladni_evidence.__main__ import main
from chladni_evidence.blind_diagnosis import Answer, answered
from chladni_evidence.blind_folder import BlindFolder, Seals, hash_of, hash_of_case, published
from chladni_evidence.blind_make import make
from chladni_evidence.blind_run import run
from chladni_evidence.blind_score import score
from chladni_evidence.evidence_sets import (
    HOMES,
    OURS,
    SETS,
    Order,
    chosen,
    orders,
    purpose,
    seed_range,
)
from chladni_evidence.hidden_kinds import CATALOGUED
from chladni_evidence.outside_kinds import OUTSIDE

NULL = Order("tube frame", "nothing", 560, "fine")
MASS = Order("tube frame", "point-mass", 560, "fine")
IMPOSSIBLE = Order("tube frame", "thickness-distribution", 560, "fine")  # it has no sheet
PLAIN = {"verdict": "nothing missing", "effects": []}
TRUTH = {
    "effect": "nothing", "structure": "plate", "mesh": "fine", "values": {}, "part_mass_kg": {},
    "mass_kg": 1.0, "unweighed_kg": 0.0,
}  # fmt: skip


def sealed(out, seeds=(560, 561), why="tune"):
    """A folder as making leaves it; its cases hold a word."""
    place, names = BlindFolder(out), [f"case-{k}" for k in range(1, len(seeds) + 1)]
    for name, seed in zip(names, seeds, strict=True):
        place.case(name).mkdir(parents=True)
        (place.case(name) / "case.toml").write_text(name)
        place.truth(name).parent.mkdir(exist_ok=True)
        place.truth(name).write_text(json.dumps({**TRUTH, "seed": seed}))
    truths = {n: hash_of(place.truth(n)) for n in names}
    files = {n: hash_of_case(place.case(n)) for n in names}
    Seals(why, "panels", "560-561", "0.1.0", 0, truths, files).write(place.seals)
    return place


@pytest.fixture
def calls(monkeypatch):
    """Diagnoses that were asked for, answered without one; the second case crashes."""
    asked = []

    def answer(command, case, out, limit, stop):
        asked.append((command, case.name))
        if case.name == "case-2":
            return Answer(1, 1.0, 0.1, "ZeroDivisionError: division by zero")
        return Answer(0, 1.0, 0.1, "", PLAIN)

    monkeypatch.setattr(blind_run, "answered", answer)
    return asked


@pytest.mark.parametrize(
    "name", ["answers", "answers/case-1.diagnose", "answers/case-1.diagnose.log"]
)
def test_no_link_leads_answers_out_of_the_folder(tmp_path, calls, name):
    """Remains of a killed run are removed in the folder alone."""
    place, mine = sealed(tmp_path / "out"), tmp_path / "mine"
    (mine / "case-1.diagnose").mkdir(parents=True)
    (mine / "case-1.diagnose" / "precious").write_text("mine")
    link = tmp_path / "out" / name
    link.parent.mkdir(exist_ok=True)
    link.symlink_to(mine)
    if name == "answers":
        with pytest.raises(FileError, match="is a link or no folder"):
            run(place.out, 1, str)
    else:
        run(place.out, 1, str)
        assert not link.is_symlink()
    assert [p.name for p in mine.rglob("*")] == ["case-1.diagnose", "precious"]


@pytest.mark.parametrize("name", ["cases", "sealed", "cases/case-1"])
def test_no_link_leads_cases_out_of_the_folder(tmp_path, monkeypatch, name):
    mine, out = tmp_path / "mine", tmp_path / "out"
    (mine / "case-1").mkdir(parents=True)
    (mine / "case-1" / "precious").write_text("mine")

    def write_case(made, folder, truth):
        folder.mkdir(parents=True)
        truth.write_text("{}")

    monkeypatch.setattr(blind_make, "made_of", lambda order, cache: None)
    monkeypatch.setattr(blind_make, "write_case", write_case)
    link = out / name
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(mine / "case-1" if "/" in name else mine)
    if "/" in name:
        assert blind_make._made("case-1", NULL, BlindFolder(out))
    else:
        with pytest.raises(FileError, match="is a link or no folder"):
            blind_make._made("case-1", NULL, BlindFolder(out))
    assert [p.name for p in mine.rglob("*")] == ["case-1", "precious"]


def test_sets_hold_what_they_promise():
    """Five seeds: 60 cases on forms, half of them nulls; 30 outside; all kinds on the tailgate."""
    five = range(560, 565)
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
        every = orders(name, five)
        assert len(set(every)) == len(every)


def test_some_of_a_set():
    some = chosen("panels", [560], ["crack", "nothing"], ["panel"])
    assert {(o.structure, o.kind) for o in some} == {("panel", "crack"), ("panel", "nothing")}
    for asked, said in (
        (("panels", [560], ["point-mas"]), "did you mean 'point-mass'"),
        (("panels", [560], (), ["teapot"]), "no structure 'teapot'"),
        (("panels", [560], ["rotor"]), "no case of the set panels"),
        (("pans", [560]), "no set 'pans'"),
    ):
        with pytest.raises(LabelError, match=said):
            chosen(*asked)


@pytest.mark.parametrize("step", ["make", "run", "score", "power"])
def test_every_step_explains_itself(step):
    done = ran("blind", step, "--help")
    assert "DIR" in done.output


@pytest.mark.parametrize("text", ["109-100", "some", "-3", ""])
def test_seeds_that_are_no_range_are_refused(text):
    with pytest.raises(LabelError, match="are not a range"):
        seed_range(text)
    assert seed_range("7") == range(7, 8)


def test_seeds_that_tune_never_report(tmp_path):
    """By the seeds, by the command, and before anything is written."""
    assert purpose([500, 599]) == "tune"
    assert purpose([600, 601]) == "report"
    with pytest.raises(LabelError, match="a run has one purpose"):
        purpose([599, 600])
    for option in (("--seeds", "600"), ("--seeds", "560", "--purpose", "report")):
        assert "must differ" in refused(
            "blind", "make", "--set", "panels", *option, "--out", tmp_path / "run"
        )
    assert not (tmp_path / "run").exists()


def test_made_cases_are_sealed_and_kept(tmp_path):
    """Names tell nothing, hashes are those of the files, what cannot be made is counted."""
    said, asked = [], [MASS, IMPOSSIBLE, NULL]
    seals = make(asked, tmp_path, "tune", "forms", 2, said.append)
    place = BlindFolder(tmp_path)
    assert (len(seals.truths), seals.failed, seals.purpose) == (2, 1, "tune")
    assert seals == published(place)
    for name, due in seals.truths.items():
        assert hash_of(place.truth(name)) == due
        assert hash_of_case(place.case(name)) == seals.files[name]
        assert name.startswith("case-")
    assert any(hash_of(place.seals) in text for text in said)
    public = place.seals.read_text() + (tmp_path / "blind.json").read_text()
    assert not any(word in public for word in ("point-mass", "thickness"))
    (why,) = (tmp_path / "sealed").glob("*.txt")
    assert "no sheet" in why.read_text()

    before = place.seals.read_bytes()
    place.truth(name).write_text("{}")
    make(asked, tmp_path, "tune", "forms", 1, str)  # again: what was published stays published
    assert place.seals.read_bytes() == before
    with pytest.raises(FileError, match="other blind cases"):
        make([NULL], tmp_path, "tune", "forms", 1, str)


def test_a_half_made_case_is_made_again(tmp_path, monkeypatch):
    """A truth is written last; without one the case's folder is a torso."""
    asked, place, made = [NULL, MASS], BlindFolder(tmp_path), []
    make(asked, tmp_path, "tune", "forms", 1, str)
    due = published(place)
    place.seals.unlink()
    place.truth("case-1").unlink()
    (place.case("case-1") / ".part-left").write_text("half")
    honest = blind_make.made_case
    monkeypatch.setattr(blind_make, "made_case", lambda *a: made.append(a) or honest(*a))
    again = make(asked, tmp_path, "tune", "forms", 1, str)
    assert again.truths == due.truths  # a recording holds the time it was written at
    assert len(made) == 1
    assert not (place.case("case-1") / ".part-left").exists()


def test_a_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(FileError, match="other files"):
        make([NULL], tmp_path, "tune", "forms", 1, str)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]
    ran("blind", "run", tmp_path, code=2)
    assert "blind make" in call("blind", "score", tmp_path).stderr


def test_answers_are_given_once_and_scored_after_all(tmp_path, calls):
    """A crash is a row; a half-written answer is given again, a whole one never."""
    place, said = sealed(tmp_path), []
    assert run(tmp_path, 2, said.append) == ["case-1", "case-2"]
    assert set(calls) == {(c, n) for c in ("diagnose", "calibrate") for n in ("case-1", "case-2")}
    assert any("ZeroDivisionError" in text for text in said)
    place.answer("case-1").unlink()
    torso = place.work("case-1", "diagnose") / "diagnosis.json"
    torso.parent.mkdir(parents=True)
    torso.write_text('{"verdict": "missing')
    with pytest.raises(FileError, match="case-1 has no answer yet, so no truth is opened"):
        score([tmp_path], str)
    assert not place.opened.exists()
    assert run(tmp_path, 1, str, calibrated=False) == ["case-1"]
    assert not torso.exists()
    assert run(tmp_path, 1, str) == []
    rows = score([tmp_path], str)
    assert [r["outcome"] for r in rows] == ["right", "crash"]
    assert json.loads((tmp_path / "score.json").read_text()) == rows
    assert "false alarms: 0 of 2" in (tmp_path / "table.txt").read_text()


def test_an_interruption_ends_diagnoses_and_keeps_answers(tmp_path, calls, monkeypatch):
    """What was at work is stopped and leaves no answer; the same call goes on."""
    place, at_once = sealed(tmp_path), blind_run.answered

    def answer(command, case, out, limit, stop):
        if case.name == "case-2":
            assert stop.wait(60)
        return at_once(command, case, out, limit, stop)

    def interrupted(text):
        if text.startswith("case-1"):
            raise KeyboardInterrupt

    monkeypatch.setattr(blind_run, "answered", answer)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, 2, interrupted)
    assert place.answer("case-1").exists()
    assert not place.answer("case-2").exists()
    monkeypatch.setattr(blind_run, "answered", at_once)
    assert run(tmp_path, 2, str) == ["case-2"]


def test_what_is_not_as_published_is_refused(tmp_path, calls):
    """A case, an answer to something else, a truth: each in a sentence, each undone by itself."""
    place = sealed(tmp_path)
    run(tmp_path, 1, str)

    def changed(path, old, new):
        path.write_text(path.read_text().replace(old, new))

    for path, old, new, error, said in (
        (place.case("case-2") / "case.toml", "2", "3", FileError, "files of case-2 are not those"),
        (place.answer("case-1"), hash_of(place.seals), "older", FileError, "older than the seals"),
        (place.truth("case-1"), "nothing", "suspension", AccuracyError, "whose hash was published"),
    ):
        changed(path, old, new)
        with pytest.raises(error, match=said):
            score([tmp_path], str)
        changed(path, new, old)
    score([tmp_path], str)
    changed(place.answer("case-2"), "gigabytes", "bytes")
    with pytest.raises(FileError, match="form of an answer"):
        score([tmp_path], str)
    changed(place.case("case-1") / "case.toml", "1", "3")
    with pytest.raises(FileError, match="files of case-1"):
        run(tmp_path, 1, str)


def test_a_report_answers_once(tmp_path, calls):
    """After the truths were opened no answer is taken any more; tuning may go on as it likes."""
    for out, why, seeds in (("a", "report", (600, 601)), ("b", "tune", (560, 561))):
        place = sealed(tmp_path / out, seeds, why)
        run(place.out, 1, str)
        score([place.out], str)
        place.answer("case-1").unlink()
        if why == "report":
            with pytest.raises(FileError, match="cannot be answered blindly"):
                run(place.out, 1, str)
            place.opened.rename(tmp_path / "aside")
            run(place.out, 1, lambda text: None, limit=1.0)
            changed = json.loads(place.answer("case-1").read_text()) | {"version": "another"}
            place.answer("case-1").write_text(json.dumps(changed))
            (tmp_path / "aside").rename(place.opened)
            with pytest.raises(AccuracyError, match="younger than the opening"):
                score([place.out], str)
        else:
            run(place.out, 1, str)
            score([place.out], str)


def test_tuning_and_report_are_never_scored_together(tmp_path, calls):
    """Nor a case twice, nor a truth of a seed for the other purpose."""
    one, other = sealed(tmp_path / "a"), sealed(tmp_path / "b", (600, 601), "report")
    wrong = sealed(tmp_path / "c", (560, 600))
    for place in (one, other, wrong):
        run(place.out, 1, str)
    done = ran("blind", "score", one.out, other.out, code=2)
    assert "never scored together" in done.stderr
    assert not one.opened.exists()
    with pytest.raises(LabelError, match="would count twice"):
        score([one.out, one.out], str)
    with pytest.raises(AccuracyError, match="seed 600 in a folder with the purpose tune"):
        score([wrong.out], str)
    assert len(score([one.out], str)) == 2


def test_a_truth_of_another_version_is_named(tmp_path, calls, monkeypatch):
    monkeypatch.delitem(TRUTH, "mass_kg")
    monkeypatch.setitem(PLAIN, "mass", {"model_kg": 1.0})
    sealed(tmp_path)
    run(tmp_path, 1, str)
    with pytest.raises(FileError, match="holds no 'mass_kg'; it was made by chladni"):
        score([tmp_path], str)


@pytest.mark.parametrize(
    "text",
    [
        "[1]",
        "{}",
        '{"cases": {"a": "b"}}',
        "not json",
        '{"cases": {}, "purpose": "tune"}',
        '{"cases": {"../a": "truth 1 files 2"}, "purpose": "tune", "set": "", "seeds": "",'
        ' "version": "", "failed": 0}',
    ],
)
def test_seals_that_are_none_are_refused(tmp_path, text):
    (tmp_path / "seals.json").write_text(text)
    done = ran("blind", "run", tmp_path, code=2)
    assert "seals.json" in done.stderr


def test_a_folder_that_is_no_case_is_refused(tmp_path):
    """The door itself: a process of its own, its exit code, its words, what it took."""
    (tmp_path / "case").mkdir()
    found = answered("diagnose", tmp_path / "case", tmp_path / "answer")
    assert found.code == 2
    assert "chladni" in found.said
    assert found.gigabytes > 0.01
    assert not found.crashed


def test_a_diagnosis_that_hangs_is_ended(tmp_path):
    (tmp_path / "case").mkdir()
    found = answered("diagnose", tmp_path / "case", tmp_path / "answer", limit=0.0)
    assert found.code < 0
    assert found.crashed


def test_a_leashed_process_ends_with_its_input():
    """Whatever ends the run closes the pipe, and no diagnosis goes on without it."""
    command = [sys.executable, "-c", "from chladni_evidence import leash; import time, sys\n"
               "leash.runpy.run_module = lambda *a, **k: time.sleep(60)\nleash.main()"]  # fmt: skip
    process = subprocess.Popen(command, stdin=subprocess.PIPE)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.3)
    process.stdin.close()
    assert process.wait(20) == 1


def test_the_evidence_command_takes_the_same_steps(tmp_path, calls, monkeypatch, capsys):
    out = ["--out", str(tmp_path / "run")]
    assert main(["run", "--set", "forms", "--seeds", "599-600", *out]) == 2
    assert main(["run", "--set", "forms", "--seeds", "some", *out]) == 2
    assert "write 600-604" in capsys.readouterr().err
    few = ["--structures", "tube frame", "--kinds", "nothing"]
    assert main(["run", "--set", "forms", "--seeds", "561", *few, *out]) == 0
    assert calls == [("diagnose", "case-1"), ("calibrate", "case-1")]
    assert "1         1" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_a_set_runs_from_end_to_end(name, tmp_path):
    """A null of each set on tuning seeds: made, sealed, answered and scored, no crash."""
    there = {"calculix": bool(shutil.which("ccx")), "kratos": kratos.installed()}
    some = [o for o in orders(name, [520]) if there.get(o.mesh, True)]
    if not some:
        pytest.skip("no Python with KratosMultiphysics")
    null = [o for o in some if o.kind in ("nothing", "duplicated-pair")][:1]
    make(null, tmp_path, "tune", name, 1, str)
    run(tmp_path, 1, str)
    (found,) = score([tmp_path], str)
    assert found["outcome"] not in ("crash", "refused")
