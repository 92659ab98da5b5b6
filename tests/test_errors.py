"""Sentences: of a long value its beginning, and nothing that steers a terminal."""

import pickle

import pytest

from chladni.errors import LONGEST, ChladniError, FileError, named

LONG = "x" * 2_000_000


@pytest.mark.parametrize(
    "value", [LONG, "y z " * 500_000, "it's " * 400_000, 'a"' * 10**6, "/a" * 10**6]
)
@pytest.mark.parametrize("quoted", [True, False])
def test_a_sentence_repeats_the_beginning_of_a_long_value(value, quoted):
    shown = repr(value) if quoted else value
    said = str(FileError(f"a.bdf, line 3: name = {shown} is too long; write a shorter one"))
    assert len(said) < 5000
    assert said.startswith("a.bdf, line 3: name = ")
    assert said.endswith(" is too long; write a shorter one")


def test_what_is_not_quoted_stays_whole():
    """Apostrophes of words are no quotation marks; a path is never cut."""
    path = "/a long folder" * 20
    text = f"{path}/a.bdf: the deck's unit is not that of the sensors' table, " + "word " * 60
    assert str(FileError(text)) == text


def test_a_short_quotation_stays_whole():
    text = f"name = {'x' * LONGEST!r} is no name"
    assert str(FileError(text)) == text


def test_a_list_of_long_names_is_short():
    assert len(named([LONG, LONG])) < 300


def test_nothing_steers_a_terminal():
    """Also where Python shows it, without the command line."""
    assert str(ChladniError("part \x1b[31mred\x9b\x07")) == "part ?[31mred??"


def test_an_error_comes_back_from_another_process():
    error = FileError(f"name = {LONG!r}")
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
