"""A damaged file ends in one sentence that names it, whatever library stumbled over it."""

import re
import wave
import zipfile

import numpy as np
import pytest

from chladni.case.case_file import request_of
from chladni.dynamics.frf import FRF
from chladni.errors import ChladniError, FileError
from chladni.io.nastran import assembly, read_deck
from chladni.io.tables.read_tables import read_csv, read_npz
from chladni.io.time.read_time import read_wav
from chladni.io.uff.read_uff import read_uff, write_uff
from chladni.units import UNITS

from . import foreign_uff

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
        ("level", np.ones(3), "level has 3 values"),
        ("level", np.array(np.inf), "level is inf; an amplitude must be finite and not negative"),
        ("level", np.array(np.nan), "level is nan"),
        ("level", np.array(-2.0), "level is -2"),
        ("level", np.array("2020-01-01", dtype="datetime64[s]"), "level has datetime64"),
        ("values", np.full((6, 2, 1), "x"), "values has <U1, not numbers"),
        ("variance", np.full((6, 2, 1), "<script>"), "variance has <U8"),
        ("outputs", np.array(["1:+Z", "1:+Z"]), "output 1:.Z occurs twice"),
        ("frequency_hz", np.append(F[:-1], np.inf), "negative or not a number"),
        ("frequency_hz", F[:, None], r"frequencies are \(6, 1\); one list is due"),
        ("frequency_hz", F - 15.0, "negative or not a number"),
        ("huge", np.zeros(3), "unknown array huge"),
        ("quantity", np.array(["mobility", "mobility"]), "quantity has 2 texts; it must be one"),
        ("outputs", np.array([["1:+Z"], ["2:+Z"]]), "outputs has an array of 2 dimensions"),
        (
            "values",
            np.where(F[:, None, None] == F[2], np.nan, np.ones((6, 2, 1))),
            "1:.Z is not a number at 14 Hz",
        ),
    ],
)
def test_npz(tmp_path, name, value, said):
    path = tmp_path / "a.npz"
    np.savez(path, **{**GOOD, name: value})
    with pytest.raises(ChladniError, match=rf"a\.npz.*{said}"):
        read_npz(path)


@pytest.mark.parametrize("made", [str, lambda text: [text], str.encode])
def test_a_text_of_an_npz_may_be_the_only_one_of_a_row(tmp_path, made):
    path = tmp_path / "a.npz"
    words = {"inputs": [b"1:+Z"], "quantity": made("mobility"), "article": made("B")}
    np.savez(path, **{**GOOD, **words})
    found = read_npz(path)
    assert (found.frf.inputs, found.frf.quantity, found.article) == (("1:+Z",), "mobility", "B")


def test_an_unknown_array_is_refused_before_it_is_unpacked(tmp_path, monkeypatch):
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
        ("a = " + "[" * 3000 + "]" * 3000, "is not TOML"),
        ("a = " + "9" * 5000, "is not TOML"),
        ("[model]", r"is not TOML: \[model\] occurs twice \(at line 2,"),
        ("[test.a]\n[test.a]", r"is not TOML: \[test\.a\] occurs twice"),
        ("a = 1\na = 2\nb = 3", "is not TOML: a key occurs twice"),
    ],
)
def test_toml_beyond_any_use(tmp_path, text, said):
    path = tmp_path / "case.toml"
    path.write_text(f"[model]\n{text}\n")
    with pytest.raises(ChladniError, match=said) as error:
        request_of(path)
    assert len(str(error.value)) < 300


def test_numbers_of_hundreds_of_digits_are_not_repeated(tmp_path):
    path = tmp_path / "case.toml"
    for word in (f"mass = {'1' * 400}", f"hangers = [{'1' * 30}]", f"use = {'1' * 100}"):
        path.write_text(f'[model]\ndeck = "a.bdf"\nunits = "SI"\n[test]\n{word}\n')
        with pytest.raises(ChladniError, match=word.partition(" =")[0]) as error:
            request_of(path)
        assert len(str(error.value)) < 200


def test_a_cell_without_end(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text('frequency_hz,output,input,real,imag\n1,"' + "x" * 200_000 + "\n")
    with pytest.raises(ChladniError, match=r"a\.csv is not a table"):
        read_csv(path, "mobility")


def test_a_count_below_zero(tmp_path):
    path = tmp_path / "a.uff"
    write_uff(path, FRF(np.ones((6, 1, 1), complex), F, ("1:+Z",), ("1:+Z",), "mobility"))
    text, old = path.read_text(), "         6         1"
    assert old in text
    path.write_text(text.replace(old, "       -20         1", 1))
    with pytest.raises(ChladniError, match=r"a\.uff, dataset \d+ \(type 58\).*states -20 values"):
        read_uff(path, "mobility")


def written(path, coherence=None, lines=61):
    """The lines of a universal file of three channels."""
    f = np.linspace(10.0, 70.0, lines)
    values = np.linspace(1, 2, 3 * lines).reshape(lines, 3, 1) * (1 + 0.5j)
    labels = ("1:+Z", "2:+Z", "3:+Z")
    write_uff(path, FRF(values, f, labels, ("1:+Z",), "accelerance", coherence=coherence))
    return path.read_text().split("\n")


@pytest.mark.parametrize(
    ("unit", "said"),
    [("EU", "unit 'EU' is not known"), ("m/s^2/Nm", "unit 'm/s.2/Nm' is not known"),
     ("furlong/s", "is not known"), ("mV", "no calibration")],
)  # fmt: skip
@pytest.mark.parametrize("axis", ["m/s^2               ", "N                   "])
def test_units_nobody_knows_are_refused(tmp_path, unit, said, axis):
    """Not read as if they were m/s² or N, unless the user says what they are; then it is noted."""
    path = tmp_path / "a.uff"
    text = "\n".join(written(path))
    assert axis in text
    path.write_text(text.replace(axis, unit.ljust(20)))
    with pytest.raises(ChladniError, match=rf"a\.uff, dataset \d+.*{said}"):
        read_uff(path)
    if "known" in said:
        found = read_uff(path, "accelerance")
        assert any("is not known: read as accelerance" in note for note in found.notes)


@pytest.mark.parametrize(("unit", "newton"), [("daN", 10.0), ("kip", 4448.2216), ("kN", 1e3)])
def test_units_of_force_count(tmp_path, unit, newton):
    path = tmp_path / "a.uff"
    text = "\n".join(written(path))
    SI = read_uff(path).frf
    path.write_text(text.replace("N                   ", unit.ljust(20)))
    found = read_uff(path).frf
    np.testing.assert_allclose(found.values * newton, SI.values, rtol=1e-6)


def test_a_doubled_or_lost_line_is_refused(tmp_path):
    """Its values would move all later ones along the frequency axis."""
    path = tmp_path / "a.uff"
    lines = written(path)
    start = [k for k, line in enumerate(lines) if line.strip() == "58"][1]
    for new, said in (
        ([*lines[: start + 20], lines[start + 19], *lines[start + 20 :]], "a line is doubled"),
        ([*lines[: start + 20], *lines[start + 21 :]], "values are present"),
        ([*lines[:start], *lines[start + 1 :]], "not with its type"),
    ):
        path.write_text("\n".join(new))
        with pytest.raises(ChladniError, match=rf"a\.uff.*{said}"):
            read_uff(path)


def with_function(path, number, kind):
    """The file with another function type in the head of one of its datasets 58."""
    lines = path.read_text().split("\n")
    at = [k for k, line in enumerate(lines) if line.strip() == "58"][number] + 6
    lines[at] = f"{kind:5d}{lines[at][5:]}"
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize("kind", [2, 3, 9, 12, 19, 99])
def test_a_record_that_is_read_as_no_frf_is_named(tmp_path, kind):
    path = tmp_path / "a.uff"
    written(path)
    found = read_uff(with_function(path, 1, kind))
    assert found.frf.outputs == ("1:+Z", "3:+Z")
    (note,) = (note for note in found.notes if "not used" in note)
    assert re.search(rf"1 records .*: 2:\+Z / 1:\+Z \((function type {kind}|[a-z ]+)\)$", note)


@pytest.mark.parametrize(("kind", "said"), [(1, "time history"), (6, "coherence")])
def test_a_real_function_with_complex_values_is_refused(tmp_path, kind, said):
    path = tmp_path / "a.uff"
    written(path)
    with pytest.raises(
        ChladniError, match=rf"a\.uff, dataset 4 .*function type {kind} is a {said}"
    ):
        read_uff(with_function(path, 1, kind))


def test_coherence_of_no_frf_is_named_and_twice_it_is_refused(tmp_path):
    path = tmp_path / "a.uff"
    written(path, np.full((61, 3, 1), 0.9))
    found = read_uff(with_function(path, 2, 99))  # 0: FRF, 1: its coherence, 2: the next FRF
    assert any("2:+Z / 1:+Z (coherence)" in note for note in found.notes)
    lines = written(path, np.full((61, 3, 1), 0.9))
    start = [k for k, line in enumerate(lines) if line.strip() == "58"]
    path.write_text("\n".join([*lines[:-1], *lines[start[1] - 1 : start[2] - 1], ""]))
    with pytest.raises(ChladniError, match=r"coherence of 1:\+Z / 1:\+Z occurs twice"):
        read_uff(path)


def test_a_node_at_two_places_is_refused(tmp_path):
    for second, good in (((1.0, 2.0, 0.5), True), ((1.0, 2.5, 0.5), False)):
        path = tmp_path / "a.uff"
        first = foreign_uff.nodes({7: (1.0, 2.0, 0.5)})
        path.write_bytes(foreign_uff.file(first, foreign_uff.old_nodes({7: second})))
        if good:
            np.testing.assert_allclose(read_uff(path).nodes[7], (1.0, 2.0, 0.5))
        else:
            with pytest.raises(ChladniError, match=r"a\.uff, dataset 2 .*node 7 occurs twice"):
                read_uff(path)


@pytest.mark.parametrize(
    ("column", "width", "value", "said"),
    [
        (7, 6, "3", "byte order 3 is unknown"),
        (13, 6, "1", r"real numbers are of format 1 \(DEC VMS\)"),
        (13, 6, "3", r"real numbers are of format 3 \(IBM 370\)"),
        (19, 12, "9", "states 9 lines of its head"),
        (31, 12, "100", "states 100 bytes of numbers, but has 144"),
        (31, 12, "288", "states 288 bytes of numbers, but has 144"),
        (31, 12, "many", "does not hold four counts"),
        (31, 12, "0", ""),  # not stated
    ],
)
def test_the_first_line_of_a_binary_dataset_is_held_against_it(
    tmp_path, column, width, value, said
):
    path = tmp_path / "a.ufb"
    H = np.linspace(1, 2, 6).reshape(6, 1, 1) * (1 + 2j)
    write_uff(path, FRF(H, F, ("1:+Z",), ("1:+Z",), "mobility"), binary=True)
    data = path.read_bytes()
    at = data.index(b"    58b") + column
    path.write_bytes(data[:at] + value.rjust(width).encode() + data[at + width :])
    if said:
        with pytest.raises(ChladniError, match=rf"a\.ufb, dataset \d \(type 58\).*{said}"):
            read_uff(path)
    else:
        frf = read_uff(path).frf
        np.testing.assert_array_equal(frf.values, H)


def test_coherence_in_percent_is_refused(tmp_path):
    path = tmp_path / "a.npz"
    for factor, good in ((1.0, True), (1.005, True), (100.0, False), (-1.0, False)):
        np.savez(path, **{**GOOD, "coherence": factor * np.full((6, 2, 1), 0.999)})
        if good:
            frf = read_npz(path).frf
            assert frf.coherence.max() <= 1
        else:
            with pytest.raises(
                ChladniError, match=r"a\.npz: a coherence must be between 0 and 1.*"
            ):
                read_npz(path)


def test_text_that_is_none_says_where(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"frequency_hz,output,input,real,imag\n1,1:+Z,\x81,1,1\n")
    said = r"a\.csv is not UTF-8 text: byte 44 \(line 2\) is 0x81; save it as UTF-8"
    with pytest.raises(ChladniError, match=said):
        read_csv(path, "mobility")


def test_a_number_no_structure_has(tmp_path):
    path = tmp_path / "a.bdf"
    path.write_text("BEGIN BULK\nGRID,1,,1.+308,0.,0.\nENDDATA\n")
    with pytest.raises(ChladniError, match=r"GRID 1: X1 is '1\.\+308', not a number of any"):
        assembly(read_deck(path), UNITS["SI"])


def test_a_header_of_an_npz_that_breaks_off_is_a_sentence(tmp_path):
    """A bracket that is never closed ends in the tokenizer of Python itself."""
    header = b"{'descr': ('<f8', 'shape': (3L,\n"
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        head = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
        for name in ("frequency_hz", "frf", "outputs", "inputs", "quantity"):
            archive.writestr(f"{name}.npy", head)
    with pytest.raises(ChladniError, match=r"a\.npz") as caught:
        read_npz(tmp_path / "a.npz")
    assert "('" not in str(caught.value)


def test_a_wav_without_channels_is_a_sentence(tmp_path):
    path = tmp_path / "a.wav"
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(1000)
        file.writeframes(bytes(400))
    data = bytearray(path.read_bytes())
    data[22:24] = bytes(2)  # nChannels of the format chunk
    path.write_bytes(data)
    with pytest.raises(FileError, match=r"a\.wav cannot be read as WAV: .* 0 channels"):
        read_wav(path)
