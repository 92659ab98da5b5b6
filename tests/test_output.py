"""Files appear whole or not at all."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.errors import FileError
from chladni.output import atomic, plain, run_folder, write_json, write_npz, write_text
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
    def run():
        with run_folder(tmp_path / "runs" / "a") as part:
            write_text(part / "half.txt", "half")
            raise RuntimeError("no")

    with pytest.raises(RuntimeError):
        run()
    assert list((tmp_path / "runs").iterdir()) == []


def test_a_run_replaces_its_files_and_keeps_others(tmp_path):
    out = tmp_path / "run"
    out.mkdir()
    for name in ("mine.txt", "result.json"):
        (out / name).write_text("old")
    with run_folder(out) as part:
        write_json(part / "result.json", {"n": 1})
        write_text(part / "sub" / "b.txt", "b")
        assert (out / "result.json").read_text() == "old"
    assert json.loads((out / "result.json").read_text()) == {"n": 1}
    assert (out / "mine.txt").read_text() == "old"
    assert (out / "sub" / "b.txt").read_text() == "b"
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "f").write_text("")
    with pytest.raises(FileError, match="is a file"), run_folder(tmp_path / "f"):
        pass
    with pytest.raises(FileError, match="no folder can be made"), run_folder(tmp_path / "f" / "g"):
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
