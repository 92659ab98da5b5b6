"""Recordings that are one test are stacked; what a [[recording]] says is heard, once."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.case import load_case
from chladni.case.recording_groups import described, refuse_copies, relation, stacked
from chladni.case.recordings import notes_of
from chladni.case.request import Stated
from chladni.case.schema import RecordingWords
from chladni.dynamics.frf import FRF
from chladni.ema.setup import PoleTable, Recording
from chladni.errors import FileError
from chladni.io.tables.write_tables import write_npz

from .test_case import a_frf, deck

OUT = ("12:+Z", "16:+Z", "22:+Z")


def told(**values):
    return Stated(values, {name: name for name in RecordingWords.__annotations__})


def one(name, input, **more):
    return Recording(name, frf=a_frf(OUT, (input,)), **more)


def test_other_shaker_places_are_columns():
    a, b = one("a.npz", "8:+Z"), one("b.npz", "3:+Z")
    (both,) = stacked([a, b])
    assert both.frf.inputs == ("8:+Z", "3:+Z")
    np.testing.assert_array_equal(both.frf.values[:, :, :1], a.frf.values)
    np.testing.assert_array_equal(both.frf.values[:, :, 1:], b.frf.values)
    assert "b.npz: stacked with a.npz as one test with 2 inputs" in both.notes


def test_lines_and_outputs_that_one_has_alone_are_left_out_and_named():
    a, b = one("a.npz", "8:+Z"), one("b.npz", "3:+Z")
    f, values = b.frf.frequency, b.frf.values
    fewer = FRF(values[1:, :2], f[1:], OUT[:2], ("3:+Z",), b.frf.quantity)
    (both,) = stacked([a, replace(b, frf=fewer)])
    assert both.frf.outputs == OUT[:2]
    np.testing.assert_array_equal(both.frf.values[:, :, 0], a.frf.values[1:, :2, 0])
    assert "22:+Z" in both.notes[-1]
    assert "1 lines in only one of them" in both.notes[-1]


def test_a_test_at_other_lines_is_refused():
    a, b = one("a.npz", "8:+Z"), one("b.npz", "3:+Z")
    other = replace(b.frf, frequency=b.frf.frequency + 0.013)
    with pytest.raises(FileError, match=r"a.npz and b.npz drive one article .* only 0 of"):
        stacked([a, replace(b, frf=other)])


@pytest.mark.parametrize(
    ("more", "what"),
    [
        ({"article": "B"}, "article"),
        ({"level": 2.0, "article": "B"}, "article"),
        ({"level": 2.0}, "level"),
        ({"state": "loaded", "level": 2.0}, "state"),
        ({}, "repeat"),
    ],
)
def test_what_differs_keeps_recordings_apart(more, what):
    a = one("a.npz", "8:+Z", level=1.0)
    b = one("b.npz", "3:+Z" if more else "8:+Z", **more)
    assert relation(a, b) == what
    assert len(stacked([a, b])) == 2


def test_the_same_numbers_are_no_repeat():
    """Two measurements never agree to the digits of a text; a copy does, whatever it is called."""
    a, b = one("a.npz", "8:+Z", level=1.0), one("b.npz", "8:+Z")
    noisy = replace(b, frf=replace(a.frf, values=a.frf.values * (1 + 1e-3j)))
    rounded = replace(b, frf=replace(a.frf, values=a.frf.values.astype(np.complex64)))
    refuse_copies([a, noisy], "[test] recordings")
    for copy in (b, rounded):
        with pytest.raises(FileError, match=r"\[test\] recordings: b.npz has the same .* a.npz"):
            refuse_copies([a, noisy, copy], "[test] recordings")
        refuse_copies([a, noisy, replace(copy, article="B")], "[test] recordings")
    said = notes_of([a, replace(b, article="B")])
    assert any("b.npz (article B; the same numbers: a copy" in note for note in said)


def test_a_file_is_listed_once(tmp_path):
    (tmp_path / "plate.bdf").write_text(deck())
    (tmp_path / "poles.csv").write_text("mode,frequency_hz\n1,20\n")
    head = '[model]\ndeck = "plate.bdf"\nunits = "mm-t-s"\n'
    listed = '[test]\nrecordings = ["poles.csv", "./poles.csv"]\n'
    (tmp_path / "case.toml").write_text(head + listed)
    with pytest.raises(FileError, match=r"line 5: .*recordings lists './poles.csv' twice"):
        load_case(tmp_path)


def test_a_word_is_said_once_and_not_against_the_file():
    a = one("a.npz", "8:+Z", level=1.0, article="A")
    (named,) = described([told(file="a.npz", state="cold")], "a.npz", [a])
    assert (named.state, named.article, named.level) == ("cold", "A", 1.0)
    with pytest.raises(FileError, match=r"level = 2\.0, but a\.npz states 1\.0"):
        described([told(file="a.npz", level=2.0)], "a.npz", [a])
    with pytest.raises(FileError, match="described twice"):
        described([told(file="a.npz"), told(file="a.npz")], "a.npz", [a])
    nothing = np.full(1, np.nan)
    table = PoleTable(np.ones(1), nothing, nothing, np.ones(1, int), ("bare",))
    with pytest.raises(FileError, match="has its own column state"):
        described([told(file="p.csv", state="x")], "p.csv", [Recording("p.csv", poles=table)])


def test_a_case_with_two_shakers_is_one_test(tmp_path):
    (tmp_path / "plate.bdf").write_text(deck())
    for name, input in (("a.npz", "8:+Z"), ("b.npz", "3:+Z")):
        H = a_frf(OUT, (input,))
        write_npz(tmp_path / name, FRF(H.values, H.frequency, OUT, (input,), "accelerance"))
    head = '[model]\ndeck = "plate.bdf"\nunits = "mm-t-s"\n'
    (tmp_path / "case.toml").write_text(
        f'{head}[[recording]]\nfile = "a.npz"\n[[recording]]\nfile = "b.npz"\n'
    )
    case = load_case(tmp_path)
    assert case.inputs.labels == ("8:+Z", "3:+Z")
    assert len(case.recordings) == 1
    assert any("stacked" in note for note in case.notes)
    (tmp_path / "case.toml").write_text(f'{head}[[recording]]\nfile = "c.npz"\n')
    with pytest.raises(FileError, match=r"\[recording\] file: there is no file 'c.npz'"):
        load_case(tmp_path)
