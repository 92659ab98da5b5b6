"""A damaged file of arrays or bytes ends in one sentence that names it."""

import re
import wave
import zipfile

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.case.case_file import request_of
from chladni.dynamics.frf import FRF
from chladni.io.tables.read_tables import read_csv, read_npz
from chladni.io.time.read_time import read_wav
from chladni.io.uff.read_uff import read_uff, write_uff

from . import foreign_uff

F = np.linspace(10.0, 20.0, 6)
ONE = np.ones((6, 2, 1))
GOOD = {
    "frequency_hz": F,
    "values": ONE.astype(complex),
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
        ("values", np.where(F[:, None, None] == F[2], np.nan, ONE), "1:.Z is not a number at 14 H"),
        ("values", np.where(F[:, None, None] == F[2], 1e280, ONE), "not a number"),
        ("variance", np.full((6, 2, 1), "<script>"), "variance has <U8"),
        ("outputs", np.array(["1:+Z", "1:+Z"]), "output 1:.Z occurs twice"),
        ("outputs", np.array([["1:+Z"], ["2:+Z"]]), "outputs has an array of 2 dimensions"),
        ("outputs", np.array(["1:+Z"]), r"labels and frequencies say \(6, 1, 1\)"),
        ("outputs", np.array([{}], dtype=object), "cannot be read"),
        ("frequency_hz", np.append(F[:-1], np.inf), "negative or not a number"),
        ("frequency_hz", F[:, None], r"frequencies are \(6, 1\); one list is due"),
        ("frequency_hz", F - 15.0, "negative or not a number"),
        ("frequency_hz", np.ones(6), "frequencies must increase"),
        ("quantity", np.array(["mobility", "mobility"]), "quantity has 2 texts; it must be one"),
        ("coherence", 100 * 0.999 * ONE, "a coherence must be between 0 and 1"),
        ("coherence", -0.999 * ONE, "a coherence must be between 0 and 1"),
    ],
)
def test_npz(tmp_path, name, value, said):
    np.savez(tmp_path / "a.npz", **{**GOOD, name: value})
    says(rf"a\.npz.*{said}", read_npz, tmp_path / "a.npz")


@pytest.mark.parametrize("made", [str, lambda text: [text], str.encode])
def test_a_text_of_an_npz_may_be_the_only_one_of_a_row(tmp_path, made):
    """And a coherence may be rounded to a little more than one."""
    words = {"inputs": [b"1:+Z"], "quantity": made("mobility"), "article": made("B")}
    np.savez(tmp_path / "a.npz", **{**GOOD, **words, "coherence": 1.004 * ONE})
    found = read_npz(tmp_path / "a.npz")
    assert (found.frf.inputs, found.frf.quantity, found.article) == (("1:+Z",), "mobility", "B")
    assert found.frf.coherence.max() <= 1


def test_an_unknown_array_is_refused_before_it_is_unpacked(tmp_path, monkeypatch):
    path, opened = tmp_path / "a.npz", []
    np.savez_compressed(path, **GOOD, huge=np.zeros(1000))
    read = np.lib.npyio.NpzFile.__getitem__
    monkeypatch.setattr(
        np.lib.npyio.NpzFile, "__getitem__", lambda s, k: (opened.append(k), read(s, k))[1]
    )
    says("unknown array huge", read_npz, path)
    assert opened == []


def test_an_archive_that_breaks_off_is_a_sentence(tmp_path):
    """A bracket that is never closed ends in the tokenizer of Python itself."""
    path, header = tmp_path / "a.npz", b"{'descr': ('<f8', 'shape': (3L,\n"
    with zipfile.ZipFile(path, "w") as archive:
        head = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
        for name in ("frequency_hz", "frf", "outputs", "inputs", "quantity"):
            archive.writestr(f"{name}.npy", head)
    assert "('" not in says(r"a\.npz", read_npz, path)
    np.savez(path, **GOOD)
    path.write_bytes(path.read_bytes()[:100])
    says("cannot be read", read_npz, path)


def test_words_and_numbers_without_end_are_not_repeated(tmp_path):
    path = tmp_path / "case.toml"
    for text in ("[" * 3000 + "]" * 3000, "9" * 5000):
        path.write_text(f"[model]\na = {text}\n")
        assert len(says("is not TOML", request_of, path)) < 300
    for word in (f"mass = {'1' * 400}", f"hangers = [{'1' * 30}]", f"use = {'1' * 100}"):
        path.write_text(f'[model]\ndeck = "a.bdf"\nunits = "SI"\n[test]\n{word}\n')
        assert len(says(word.partition(" =")[0], request_of, path)) < 200
    (tmp_path / "a.csv").write_text('frequency_hz,output,input,real,imag\n1,"' + "x" * 200_000)
    says(r"a\.csv is not a table", read_csv, tmp_path / "a.csv", "mobility")


def test_bytes_that_are_no_text_say_where(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"frequency_hz,output,input,real,imag\n1,1:+Z,\x81,1,1\n")
    said = r"a\.csv is not UTF-8 text: byte 44 \(line 2\) is 0x81; save it as UTF-8"
    says(said, read_csv, path, "mobility")


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
    says(r"a\.wav cannot be read as WAV: .* 0 channels", read_wav, path)


@pytest.fixture
def uff(tmp_path):
    """Writes a universal file of three channels; its path and its lines."""

    def written(**more):
        f = np.linspace(10.0, 70.0, 61)
        values = np.linspace(1, 2, 3 * 61).reshape(61, 3, 1) * (1 + 0.5j)
        labels = ("1:+Z", "2:+Z", "3:+Z")
        path = tmp_path / "a.uff"
        write_uff(path, FRF(values, f, labels, ("1:+Z",), "accelerance", **more))
        return path, path.read_text().split("\n")

    return written


def starts(lines):
    """Where the datasets 58 begin."""
    return [k for k, line in enumerate(lines) if line.strip() == "58"]


@pytest.mark.parametrize(
    ("unit", "said"),
    [("EU", "unit 'EU' is not known"), ("m/s^2/Nm", "unit 'm/s.2/Nm' is not known"),
     ("furlong/s", "is not known"), ("mV", "no calibration")],
)  # fmt: skip
@pytest.mark.parametrize("axis", ["m/s^2               ", "N                   "])
def test_units_nobody_knows_are_refused(uff, unit, said, axis):
    """Not read as if they were m/s² or N, unless the user says what they are; then it is noted."""
    path, lines = uff()
    path.write_text("\n".join(lines).replace(axis, unit.ljust(20)))
    says(rf"a\.uff, dataset \d+.*{said}", read_uff, path)
    if "known" in said:
        found = read_uff(path, "accelerance")
        assert any("is not known: read as accelerance" in note for note in found.notes)


@pytest.mark.parametrize(("unit", "newton"), [("daN", 10.0), ("kip", 4448.2216), ("kN", 1e3)])
def test_units_of_force_count(uff, unit, newton):
    path, lines = uff()
    SI = read_uff(path).frf
    path.write_text("\n".join(lines).replace("N                   ", unit.ljust(20)))
    np.testing.assert_allclose(read_uff(path).frf.values * newton, SI.values, rtol=1e-6)


def test_a_doubled_or_lost_line_is_refused(uff):
    """Its values would move all later ones along the frequency axis."""
    path, lines = uff()
    at = starts(lines)[1]
    for new, said in (
        ([*lines[: at + 20], lines[at + 19], *lines[at + 20 :]], "a line is doubled"),
        ([*lines[: at + 20], *lines[at + 21 :]], "values are present"),
        ([*lines[:at], *lines[at + 1 :]], "not with its type"),
    ):
        path.write_text("\n".join(new))
        says(rf"a\.uff.*{said}", read_uff, path)
    count = "\n".join(lines).replace("        61         1", "       -20         1", 1)
    path.write_text(count)
    says(r"a\.uff, dataset \d+ \(type 58\).*states -20 values", read_uff, path)


def with_function(path, number, kind):
    """The file with another function type in the head of one of its datasets 58."""
    lines = path.read_text().split("\n")
    at = starts(lines)[number] + 6
    lines[at] = f"{kind:5d}{lines[at][5:]}"
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize("kind", [2, 3, 9, 12, 19, 99])
def test_a_record_that_is_read_as_no_frf_is_named(uff, kind):
    found = read_uff(with_function(uff()[0], 1, kind))
    assert found.frf.outputs == ("1:+Z", "3:+Z")
    (note,) = (note for note in found.notes if "not used" in note)
    assert re.search(rf"1 records .*: 2:\+Z / 1:\+Z \((function type {kind}|[a-z ]+)\)$", note)


@pytest.mark.parametrize(("kind", "said"), [(1, "time history"), (6, "coherence")])
def test_a_real_function_with_complex_values_is_refused(uff, kind, said):
    path = with_function(uff()[0], 1, kind)
    says(rf"a\.uff, dataset 4 .*function type {kind} is a {said}", read_uff, path)


def test_coherence_of_no_frf_is_named_and_twice_it_is_refused(uff):
    coherence = np.full((61, 3, 1), 0.9)
    path, lines = uff(coherence=coherence)
    found = read_uff(with_function(path, 2, 99))  # 0: FRF, 1: its coherence, 2: the next FRF
    assert any("2:+Z / 1:+Z (coherence)" in note for note in found.notes)
    _, second, third, *_ = starts(lines)
    path.write_text("\n".join([*lines[:-1], *lines[second - 1 : third - 1], ""]))
    says(r"coherence of 1:\+Z / 1:\+Z occurs twice", read_uff, path)


def test_a_node_at_two_places_is_refused(tmp_path):
    path, first = tmp_path / "a.uff", foreign_uff.nodes({7: (1.0, 2.0, 0.5)})
    path.write_bytes(foreign_uff.file(first, foreign_uff.old_nodes({7: (1.0, 2.0, 0.5)})))
    np.testing.assert_allclose(read_uff(path).nodes[7], (1.0, 2.0, 0.5))
    path.write_bytes(foreign_uff.file(first, foreign_uff.old_nodes({7: (1.0, 2.5, 0.5)})))
    says(r"a\.uff, dataset 2 .*node 7 occurs twice", read_uff, path)


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
    path, H = tmp_path / "a.ufb", np.linspace(1, 2, 6).reshape(6, 1, 1) * (1 + 2j)
    write_uff(path, FRF(H, F, ("1:+Z",), ("1:+Z",), "mobility"), binary=True)
    data = path.read_bytes()
    at = data.index(b"    58b") + column
    path.write_bytes(data[:at] + value.rjust(width).encode() + data[at + width :])
    if said:
        says(rf"a\.ufb, dataset \d \(type 58\).*{said}", read_uff, path)
    else:
        np.testing.assert_array_equal(read_uff(path).frf.values, H)
