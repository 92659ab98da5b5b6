"""A damaged file ends in one sentence that names it, whatever library stumbled over it."""

from pathlib import Path

import numpy as np
import pytest

from chladni.case.toml_sections import read_keys
from chladni.dynamics.frf import FRF
from chladni.errors import ChladniError
from chladni.io.nastran import assembly, read_deck
from chladni.io.tables.read_tables import read_csv, read_npz
from chladni.io.uff.read_uff import read_uff, write_uff
from chladni.units import UNITS

F = np.linspace(10.0, 20.0, 6)
GOOD = {
    "frequency_hz": F,
    "values": np.ones((6, 2, 1), complex),
    "outputs": np.array(["1:+Z", "2:+Z"]),
    "inputs": np.array(["1:+Z"]),
    "quantity": np.array("mobility"),
}


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("level", np.ones(3), "level holds 3 values"),
        ("level", np.array("2020-01-01", dtype="datetime64[s]"), "level holds datetime64"),
        ("values", np.full((6, 2, 1), "x"), "values holds <U1, not numbers"),
        ("variance", np.full((6, 2, 1), "<script>"), "variance holds <U8"),
        ("outputs", np.array(["1:+Z", "1:+Z"]), "output 1:.Z is there twice"),
        ("frequency_hz", np.append(F[:-1], np.inf), "negative or not a number"),
        ("frequency_hz", F - 15.0, "negative or not a number"),
        ("huge", np.zeros(3), "unknown array huge"),
    ],
)
def test_npz(tmp_path: Path, name: str, value: np.ndarray, said: str) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, **{**GOOD, name: value})
    with pytest.raises(ChladniError, match=rf"a\.npz.*{said}"):
        read_npz(path)


def test_an_unknown_array_is_refused_before_it_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, **GOOD, huge=np.zeros(1000))
    opened: list[str] = []
    read = np.lib.npyio.NpzFile.__getitem__
    monkeypatch.setattr(
        np.lib.npyio.NpzFile, "__getitem__", lambda s, k: (opened.append(k), read(s, k))[1]
    )
    with pytest.raises(ChladniError, match="unknown array huge"):
        read_npz(path)
    assert opened == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = " + "[" * 3000 + "]" * 3000, "is no TOML"),
        ("a = " + "9" * 5000, "is no TOML"),
    ],
)
def test_toml_beyond_any_use(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "case.toml"
    path.write_text(f"[model]\n{text}\n")
    with pytest.raises(ChladniError, match=said) as error:
        read_keys(path, ("model",))
    assert len(str(error.value)) < 300


def test_numbers_of_hundreds_of_digits_are_not_repeated(tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(f"[test]\nmass = {'1' * 400}\nhangers = [{'1' * 30}]\nuse = {'1' * 100}\n")
    section = read_keys(path, ("test",)).section("test", ("mass", "hangers", "use"))
    for read in (
        lambda: section.number("mass"),
        lambda: section.list("hangers", int),
        lambda: section.text("use"),
    ):
        with pytest.raises(ChladniError) as error:
            read()
        assert len(str(error.value)) < 200


def test_a_cell_without_end(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text('frequency_hz,output,input,real,imag\n1,"' + "x" * 200_000 + "\n")
    with pytest.raises(ChladniError, match=r"a\.csv is no table"):
        read_csv(path, "mobility")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("         1   3", "         1   9", "direction 9 of node 1"),
        ("         6         1", "       -20         1", "it says it holds -20 values"),
    ],
)
def test_universal_files(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "a.uff"
    write_uff(path, FRF(np.ones((6, 1, 1), complex), F, ("1:+Z",), ("1:+Z",), "mobility"))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ChladniError, match=rf"a\.uff, dataset \d+ \(type 58\).*{said}"):
        read_uff(path, "mobility")


def test_a_number_no_structure_has(tmp_path: Path) -> None:
    path = tmp_path / "a.bdf"
    path.write_text("BEGIN BULK\nGRID,1,,1.+308,0.,0.\nENDDATA\n")
    with pytest.raises(ChladniError, match=r"GRID 1: X1 is '1\.\+308', not a number of any"):
        assembly(read_deck(path), UNITS["SI"])
