"""A study's folder: how it goes on where it stopped, and that nothing is run twice."""

import json
import shutil

import numpy as np
import pytest

import chladni
from chladni.dynamics.frf import FRF
from chladni.errors import FileError, Interrupted
from chladni.output import write_json, write_text
from chladni_studies import StudySettings, parameter_study
from chladni_studies.sample import SampleResult
from chladni_studies.study_store import BEGUN, FRFS, LOCK, ROWS, opened_store

from .conftest import THREE

SETTINGS = StudySettings(samples=12, modes=2)


@pytest.fixture(scope="module")
def whole(model, tmp_path_factory):
    """A finished study: its result and folder, which is copied before anything changes in it."""
    folder = tmp_path_factory.mktemp("study") / "whole"
    return chladni.study(model, THREE, SETTINGS, out=folder), folder


@pytest.fixture
def out(whole, tmp_path):
    """A copy of the folder of a finished study."""
    return shutil.copytree(whole[1], tmp_path / "out")


def rows(folder):
    return [json.loads(line) for line in (folder / ROWS).read_text().splitlines()]


@pytest.fixture
def calls(monkeypatch):
    """Numbers of the samples that are computed, in order; -1 is the nominal one."""
    seen = []
    computed = parameter_study.computed

    def counted(study, number, values):
        seen.append(number)
        return computed(study, number, values)

    monkeypatch.setattr(parameter_study, "computed", counted)
    monkeypatch.setattr("chladni_studies.workers.computed", counted)
    return seen


def results(found):
    return {c: found.column(c) for c in (*found.names, *found.columns)}


@pytest.mark.parametrize("torn", [b"", b'{"sample": 5, "st', b"{"])
def test_it_goes_on_where_it_stopped(model, whole, out, calls, torn):
    kept = (out / ROWS).read_bytes().splitlines(keepends=True)[:5]
    (out / ROWS).write_bytes(b"".join(kept) + torn)
    part = chladni.study(model, THREE, SETTINGS, out=out)
    assert calls == [-1, *range(5, 12)]
    assert part.kept == 5
    for name, values in results(whole[0]).items():
        np.testing.assert_array_equal(results(part)[name], values)
    calls.clear()
    again = chladni.study(model, THREE, SETTINGS, out=out)
    assert calls == [-1]
    assert again.rows == part.rows
    assert sorted(r["sample"] for r in rows(out)) == list(range(12))


def test_a_failed_sample_is_finished_too(model, out, calls):
    text = (out / ROWS).read_text().splitlines()
    failed = {"sample": 3, "status": "failed", "why": "no", "seconds": 0.0}
    text[3] = json.dumps(failed)
    (out / ROWS).write_text("\n".join([*text, ""]))
    found = chladni.study(model, THREE, SETTINGS, out=out)
    assert calls == [-1]
    assert found.failed == [(3, "no")]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"vary": THREE[:2]}, "the parameters and their ranges"),
        ({"vary": ("t=90%:111%", *THREE[1:])}, "the parameters and their ranges"),
        ({"settings": StudySettings(samples=13, modes=2)}, "samples (12 there, 13 now)"),
        ({"settings": StudySettings(samples=12, modes=2, seed=1)}, "seed (0 there, 1 now)"),
        ({"settings": StudySettings(samples=12, modes=2, sampler="lhs")}, "sampler (sobol there"),
        ({"settings": StudySettings(samples=12, modes=3)}, "the results of a sample"),
    ],
)
def test_another_study_is_refused(model, out, change, named):
    before = (out / ROWS).read_bytes()
    given = {"vary": THREE, "settings": SETTINGS} | change
    with pytest.raises(FileError, match="another study") as caught:
        chladni.study(model, **given, out=out)
    assert named in str(caught.value)
    assert (out / ROWS).read_bytes() == before


def test_another_deck_is_another_study(deck, out, tmp_path):
    same = chladni.load(shutil.copy(deck, tmp_path / "copy.bdf"), "SI")
    assert chladni.study(same, THREE, SETTINGS, out=out).kept == 12
    parts = tuple(p.with_section(nonstructural=0.1) for p in same.assembly.parts)
    other = type(same)(same.source, same.assembly.with_parts(parts))
    with pytest.raises(FileError, match="the deck, the case or the recording differs"):
        chladni.study(other, THREE, SETTINGS, out=out)


def test_files_that_are_no_study_are_left_alone(model, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(FileError, match="not a study"):
        chladni.study(model, THREE, SETTINGS, out=tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["notes.txt"]
    with pytest.raises(FileError, match="is a file"):
        chladni.study(model, THREE, SETTINGS, out=tmp_path / "notes.txt")


@pytest.mark.parametrize("name", [ROWS, LOCK, FRFS])
def test_no_link_leads_a_study_out_of_its_folder(tmp_path, name):
    """Nothing is written to, cut or made where a link in the folder leads."""
    out, mine = tmp_path / "out", tmp_path / "mine"
    write_text(mine / "rows", '{"sample": 0, "status": "done"}\nhalf a line')
    before = {p.name: p.read_text() for p in mine.iterdir()}
    given = out, {}, {}, ["a"], np.ones((2, 1))
    H = FRF(np.ones((2, 1, 1)), np.array([1.0, 2.0]), ("1:+Z",), ("1:+Z",))
    with opened_store(*given):
        pass
    (out / name).unlink(missing_ok=True)
    (out / name).symlink_to({ROWS: mine / "rows", LOCK: mine / "new", FRFS: mine}[name])
    with pytest.raises(FileError, match="is a link"), opened_store(*given) as store:
        store.keep(SampleResult(0, {}, frf=H), {"a": 1.0})
    assert {p.name: p.read_text() for p in mine.iterdir()} == before


@pytest.mark.parametrize(
    ("file", "content", "named"),
    [
        (ROWS, b"{}\n" + b'{"sample":1,"status":"done"}\n', "line 1 is damaged"),
        (ROWS, b'{"sample":99,"status":"done"}\n', "line 1 is damaged"),
        (ROWS, b"\xff\xfe\n", "line 1 is damaged"),
        (BEGUN, b"{", "is damaged"),
        (BEGUN, b"[]", "is damaged"),
        (BEGUN, b'{"identity": 3}', "is damaged"),
    ],
)
def test_damage_is_said(model, out, file, content, named):
    (out / file).write_bytes(content)
    with pytest.raises(FileError, match=named):
        chladni.study(model, THREE, SETTINGS, out=out)


def test_a_second_process_is_refused(model, tmp_path):
    """While one study has the folder open no other gets in; afterwards it does."""
    tried = []

    def second(what, share):
        if share > 0.3 and not tried:
            tried.append(share)
            with pytest.raises(FileError, match="in use by another process"):
                chladni.study(model, THREE, SETTINGS, out=tmp_path / "out")

    chladni.study(model, THREE, SETTINGS, out=tmp_path / "out", progress=second)
    assert tried
    assert chladni.study(model, THREE, SETTINGS, out=tmp_path / "out").kept == 12


def test_ctrl_c_says_what_is_kept(model, tmp_path):
    def stop(what, share):
        if share >= 0.5:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match=r"6 of 12 samples are kept in .*out; the same command"):
        chladni.study(model, THREE, SETTINGS, out=tmp_path / "out", progress=stop)
    assert len(rows(tmp_path / "out")) == 6


def test_whole_responses_are_there_before_their_row(model, tmp_path):
    settings = StudySettings(
        samples=4, modes=1, outputs=("3:+Z",), inputs=("1:+Z",), lines=50, keep_frf=True
    )
    found = chladni.study(model, THREE, settings, out=tmp_path / "out")
    for row in rows(tmp_path / "out"):
        with np.load(tmp_path / "out/frf" / f"{row['sample']:06d}.npz", allow_pickle=False) as held:
            size = np.abs(held["values"][:, 0, 0])
        assert row["rms 3:+Z from 1:+Z"] == pytest.approx(np.sqrt((size**2).mean()))
    assert found.store == tmp_path / "out"


def test_rows_are_written_as_json_alone(out):
    """A lost mode is null, never NaN, which is no JSON."""
    write_json(out / "x.json", rows(out))
    assert "NaN" not in (out / ROWS).read_text()
