"""Files appear whole or not at all."""

import json
import subprocess
import sys
from contextlib import nullcontext
from errno import ENOLCK, ENOSPC, EROFS
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.errors import FileError
from chladni.output import atomic, lock, plain, run_folder, write_json, write_npz, write_text
from chladni.own_folder import OwnFolder, own_folder
from chladni.progress import silent, terminal, within

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@settings(max_examples=40)
@given(VALUES)
def test_everything_plain_is_valid_json(value):
    """Strict JSON: no NaN, and what is read back is what was written."""
    text = json.dumps(plain(value), allow_nan=False)
    assert json.loads(text) == plain(value)


def test_numpy_values_are_numbers():
    held = {"a": np.arange(2), "b": np.float32(0.5), "c": np.bool_(True), 4: np.nan, "z": 1 + 2j}
    assert plain(held) == {"a": [0, 1], "b": 0.5, "c": True, "4": None, "z": [1.0, 2.0]}


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = write_text(tmp_path / "a.txt", "old")

    def fails(part):
        part.write_text("half")
        raise RuntimeError("power cut")

    with pytest.raises(RuntimeError):
        atomic(path, fails)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failed_run_leaves_nothing(tmp_path):
    def run(out):
        with run_folder(out, "modes") as part:
            write_text(part / "half.txt", "half")
            raise RuntimeError("no")

    (tmp_path / "there").mkdir()
    for name in ("new", "there"):
        with pytest.raises(RuntimeError):
            run(tmp_path / name)
    assert [p.name for p in tmp_path.rglob("*")] == ["there"]


def wrote(out, *names, command="modes", **more):
    with run_folder(out, command, **more) as part:
        for name in names:
            write_text(part / name, f"new {name}")


def listed(out):
    return {p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file()}


def test_a_run_replaces_what_an_earlier_one_wrote_and_nothing_else(tmp_path):
    out = tmp_path / "run"
    out.mkdir()
    (out / "mine.txt").write_text("mine")
    wrote(out, "a.json", "where.png", "sub/b.txt")
    assert listed(out) == {"mine.txt", "run.json", "a.json", "where.png", "sub/b.txt"}
    wrote(out, "a.json")  # the picture of the first run would be shown as one of the second
    assert listed(out) == {"mine.txt", "run.json", "a.json"}
    assert not (out / "sub").exists()
    assert (out / "mine.txt").read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_command_that_adds_keeps_what_it_wrote(tmp_path):
    """Two specimens in one folder; the second of the same name replaces the first."""
    wrote(tmp_path, "plate.bdf", "report.html", adds=True)
    wrote(tmp_path, "box.bdf", "report.html", adds=True)
    wrote(tmp_path, "plate.bdf", "report.html", adds=True)
    assert listed(tmp_path) == {"plate.bdf", "box.bdf", "report.html", "run.json"}


@pytest.mark.parametrize(("mark", "by"), [("study_begun.json", "study"), ("blind.json", "blind")])
def test_a_folder_that_fills_bit_by_bit_is_no_other_commands(tmp_path, mark, by):
    (tmp_path / mark).write_text("{}")
    with pytest.raises(FileError, match=f"has the results of chladni {by}"):
        wrote(tmp_path, "a.json")
    wrote(tmp_path, "a.json", command=by)


def test_a_folder_holds_the_results_of_one_command(tmp_path):
    wrote(tmp_path / "run", "a.json")
    with pytest.raises(FileError, match="has the results of chladni modes; give another --out"):
        wrote(tmp_path / "run", "a.json", command="frf")
    assert (tmp_path / "run" / "a.json").read_text() == "new a.json"


@pytest.mark.parametrize("blocked", ["c.txt", "c.txt/inside", "c.txt as a link"])
def test_what_is_in_the_way_stays_and_nothing_is_lost(tmp_path, blocked):
    """A foreign file, a folder or a link of a result's name: no file of the run is put in place."""
    out = tmp_path / "run"
    wrote(out, "a.json", "b.json")
    if "link" in blocked:
        (out / "c.txt").symlink_to("nowhere")
    else:
        write_text(out / blocked, "mine")
    before = {name: (out / name).read_text() for name in listed(out)}
    with pytest.raises(FileError, match=r"c\.txt exists and no .*results are in .*results-1"):
        wrote(out, "a.json", "c.txt", "d.txt")
    kept = out / "results-1"
    assert {"a.json", "c.txt", "d.txt"} <= {p.name for p in kept.iterdir()}
    assert {n: (out / n).read_text() for n in listed(out) if "results-1" not in n} == before


def test_a_file_the_run_reads_is_never_replaced(tmp_path):
    """Not even where an earlier run of the command wrote it."""
    wrote(tmp_path, "updated.bdf")
    with pytest.raises(FileError, match=r"updated\.bdf is an input file of this run"):
        wrote(tmp_path, "updated.bdf", "b.json", inputs=[tmp_path / "updated.bdf"])
    assert (tmp_path / "results-1" / "b.json").exists()


def breaking_at(monkeypatch, fault):
    """Moves break where the new b.json would come to its place."""
    move = OwnFolder.move

    def fails(self, source, target):
        if target == "b.json" and ".old" not in source:
            raise fault
        return move(self, source, target)

    monkeypatch.setattr(OwnFolder, "move", fails)


def test_a_move_that_fails_half_way_is_taken_back(tmp_path, monkeypatch):
    wrote(tmp_path, "a.json", "b.json")
    (tmp_path / "a.json").write_text("of the first run")
    with monkeypatch.context() as patch:
        breaking_at(patch, OSError(28, "No space left on device"))
        with pytest.raises(FileError, match="No space left on device; no file was replaced"):
            wrote(tmp_path, "a.json", "b.json")
    assert (tmp_path / "a.json").read_text() == "of the first run"
    assert (tmp_path / "b.json").exists()


def test_a_move_that_is_interrupted_is_taken_back(tmp_path, monkeypatch):
    """Ctrl-C between two files: the first run's are where they were, the second's are gone."""
    wrote(tmp_path, "a.json", "b.json", "c.json")
    before = {name: (tmp_path / name).read_text() for name in listed(tmp_path)}
    for name in ("a.json", "b.json", "c.json"):
        before[name] = "of the first run"
        (tmp_path / name).write_text(before[name])
    with monkeypatch.context() as patch:
        breaking_at(patch, KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            wrote(tmp_path, "a.json", "b.json", "d.json")
    assert {name: (tmp_path / name).read_text() for name in listed(tmp_path)} == before


def test_a_disk_that_is_full_is_said(tmp_path):
    with (
        pytest.raises(FileError, match="No space left on device; no file was written"),
        run_folder(tmp_path, "modes"),
    ):
        raise OSError(ENOSPC, "No space left on device")
    assert not list(tmp_path.iterdir())


def test_a_place_that_takes_nothing_is_said(tmp_path, monkeypatch):
    def fails(**where):
        raise OSError(EROFS, "Read-only file system")

    monkeypatch.setattr("tempfile.mkdtemp", fails)
    with pytest.raises(FileError, match=r"no file can be written there .Read-only file system"):
        wrote(tmp_path / "new", "a.json")
    assert not list(tmp_path.iterdir())


def test_a_file_system_without_locks_has_none(tmp_path, monkeypatch):
    def fails(handle, how):
        raise OSError(ENOLCK, "No locks available")

    monkeypatch.setattr("chladni.output.fcntl.flock", fails)
    wrote(tmp_path, "a.json")
    assert listed(tmp_path) == {"a.json", "run.json"}
    with (tmp_path / "a.json").open() as file:
        assert not lock(file.fileno(), tmp_path)


def test_the_lock_is_free_again_however_a_run_ends(tmp_path):
    for fault in (RuntimeError, KeyboardInterrupt, FileError):
        with pytest.raises(fault), run_folder(tmp_path, "modes"):
            raise fault
    (tmp_path / "run.json").write_text("{")
    for _ in range(2):
        with pytest.raises(FileError, match="not a list of results"):
            wrote(tmp_path, "a.json")


def test_results_without_a_list_stay(tmp_path):
    """Of whom they are cannot be told; the sentence says what to do."""
    (tmp_path / "modes.json").write_text("of a run that left no list")
    with pytest.raises(FileError, match=r"modes\.json .*move it away, or give another --out"):
        wrote(tmp_path, "modes.json")
    assert (tmp_path / "modes.json").read_text() == "of a run that left no list"
    (tmp_path / "modes.json").unlink()
    wrote(tmp_path, "modes.json")


def test_a_second_process_is_refused(tmp_path):
    """The lock is the kernel's: it goes with the process, however that ends."""
    code = "import sys, time; from chladni.output import run_folder\n"
    code += "with run_folder(sys.argv[1], 'modes') as part:\n print(part, flush=True)\n"
    code += " time.sleep(60)"
    other = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert other.stdout is not None
    left = Path(other.stdout.readline().strip())
    try:
        with pytest.raises(FileError, match="in use by another process"):
            wrote(tmp_path, "a.json")
    finally:
        other.kill()
        other.communicate()
    assert left.is_dir()  # the killed one could not clear up
    wrote(tmp_path, "a.json")
    assert listed(tmp_path) == {"a.json", "run.json"}
    assert not left.exists()


@pytest.mark.parametrize("text", ["{", "[]", '{"command": 1}', '{"command": "modes", "files": 3}'])
def test_a_damaged_list_is_said(tmp_path, text):
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(FileError, match=r"run\.json is not a list of results"):
        wrote(tmp_path, "a.json")


def test_a_list_does_not_lead_out_of_its_folder(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    out = tmp_path / "run"
    names = ["../mine.txt", str(tmp_path / "mine.txt"), ""]
    write_json(out / "run.json", {"command": "modes", "files": names})
    wrote(out, "a.json")
    assert (tmp_path / "mine.txt").read_text() == "mine"


LINKED = {  # name in run.json: the link on its way, and where that leads
    "s/v1": ("s", "vict"),
    "s/deep/v2": ("s", "vict"),
    "sub/s/v1": ("sub/s", "vict"),
    "v": ("v", "vict/v1"),
}


def foreign(tmp_path):
    """A folder of somebody's, and what is in it."""
    write_text(tmp_path / "vict" / "v1", "precious")
    write_text(tmp_path / "vict" / "deep" / "v2", "precious")
    return lambda: {str(p): p.read_text() for p in (tmp_path / "vict").rglob("*") if p.is_file()}


def link(out, name, target):
    (out / name).parent.mkdir(parents=True, exist_ok=True)
    (out / name).symlink_to(target)


@pytest.mark.parametrize("writes", [False, True])
@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("name", LINKED)
def test_no_link_leads_a_run_out_of_its_folder(tmp_path, name, late, writes):
    """Nothing is deleted, moved or overwritten there, also where the link appears meanwhile."""
    held, out, (at, target) = foreign(tmp_path), tmp_path / "run", LINKED[name]
    before = held()
    write_json(out / "run.json", {"command": "modes", "files": [name, "a.json"]})
    if not late:
        link(out, at, tmp_path / target)
    refused = pytest.raises(FileError, match="results are in") if writes else nullcontext()
    with refused, run_folder(out, "modes") as part:
        write_text(part / (name if writes else "a.json"), "new")
        if late:
            link(out, at, tmp_path / target)
    assert held() == before
    assert (out / at).is_symlink()


def test_the_folder_itself_may_be_a_link(tmp_path):
    """The user has it so; a link that takes its place meanwhile is followed no more."""
    (tmp_path / "disk").mkdir()
    (tmp_path / "out").symlink_to("disk")
    wrote(tmp_path / "out", "a.json", "sub/b.json")
    assert listed(tmp_path / "disk") == {"a.json", "sub/b.json", "run.json"}
    held = foreign(tmp_path)
    before = held()
    with run_folder(tmp_path / "out", "modes") as part:
        write_text(part / "v1", "new")
        (tmp_path / "out").unlink()
        (tmp_path / "out").symlink_to("vict")
    assert held() == before
    assert listed(tmp_path / "disk") == {"v1", "run.json"}


def test_a_link_in_the_place_of_the_list_is_not_read(tmp_path):
    write_json(tmp_path / "mine.json", {"command": "modes", "files": ["a.json"]})
    link(tmp_path / "run", "run.json", tmp_path / "mine.json")
    with pytest.raises(FileError, match=r"run\.json is not a list of results"):
        wrote(tmp_path / "run", "b.json")


@pytest.mark.parametrize("held", [True, False])
def test_an_own_folder_follows_no_link(tmp_path, held):
    """With the calls of the system, and where it has none."""
    there = foreign(tmp_path)
    before, out = there(), tmp_path / "run"
    out.mkdir()
    link(out, "s", tmp_path / "vict")
    link(out, "v", tmp_path / "vict" / "v1")
    write_text(out / "mine", "mine")
    with own_folder(out) as opened:
        here = opened if held else OwnFolder(out, -1)
        for name in ("s/v1", "s/deep/v2", "s/new", "../vict/v1", str(tmp_path / "vict/v1"), ""):
            for use in (
                lambda n: here.move("mine", n), lambda n: here.move(n, "stolen"), here.remove,
                here.make, lambda n: here.open(n, "ab"), here.status,
            ):  # fmt: skip
                with pytest.raises(FileError):
                    use(name)
        with pytest.raises(FileError, match="is a link"):
            here.open("v", "ab")
        assert not here.has_file("v")
        here.move("mine", "v")  # in place of the link
        here.remove("s")  # the link
        here.make("new/deep")
        here.remove("new")
    assert there() == before
    assert listed(out) == {"v"}


def test_a_second_name_elsewhere_is_not_appended_to(tmp_path):
    held, out = foreign(tmp_path), tmp_path / "run"
    before = held()
    out.mkdir()
    (out / "rows").hardlink_to(tmp_path / "vict" / "v1")
    with own_folder(out) as here, pytest.raises(FileError, match="2 names lead to it"):
        here.open("rows", "ab")
    assert held() == before


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "f").write_text("")
    with pytest.raises(FileError, match="is a file"), run_folder(tmp_path / "f", "modes"):
        pass
    with (
        pytest.raises(FileError, match="no folder can be made"),
        run_folder(tmp_path / "f" / "g", "modes"),
    ):
        pass


def test_objects_are_not_pickled(tmp_path):
    with pytest.raises(FileError, match="pickle"):
        write_npz(tmp_path / "a.npz", a=np.array([{}], dtype=object))
    path = write_npz(tmp_path / "a.npz", labels=np.array(["1:+Z"]), f=np.arange(3.0))
    with np.load(path, allow_pickle=False) as read:
        assert read["labels"].tolist() == ["1:+Z"]


def test_progress_is_silent_where_there_is_no_terminal(capsys):
    with terminal() as progress:
        progress("work", 0.5)
    assert progress is silent
    assert capsys.readouterr() == ("", "")


@given(st.floats(0, 1), st.floats(0, 1), st.floats(0, 1))
def test_stages_stay_within_their_share(a, b, x):
    seen = []
    within(lambda _, fraction: seen.append(fraction), min(a, b), max(a, b))("stage", x)
    assert min(a, b) - 1e-12 <= seen[0] <= max(a, b) + 1e-12
