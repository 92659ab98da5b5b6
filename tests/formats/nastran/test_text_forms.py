"""One structure, however its text is written: encoded, cut down, wrapped, included, permuted."""

import random
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.fem.assemble import structure
from chladni.io.nastran import Add, SetField, analysis, assembly, read_deck, write_deck
from chladni.io.nastran.text.format import lines as card_lines

from .conftest import PLATE

CONTROL = """\
TITLE = A PLATE, OF STEEL,
SUBTITLE = SPC = 9
ECHO = SORT,PUNCH,
SPC = 1
SET 5 = 1, 2,
   3 THRU 4
DISPLACEMENT(PLOT,
   PRINT) = 5
MPC = 6
SUBCASE 1
  METHOD = 3
  SPCFORCES = ALL
SUBCASE 2
  SPC = 2
  LOAD = 8
"""
BULK = f"""\
{PLATE}SPC1,1,123456,1,2
SPC1,2,123456,1,THRU,4
MPC,6,3,3,1.,4,3,-1.
EIGRL,3,,,4
CBAR,9,9,3,4,.3,.1,1.,,,456
PBAR,9,5,12.5,300.,200.,150.
CONM2,11,4,,2.5-4,.5,,.25
FORCE,8,3,,1.,0.,0.,1.
"""
WHOLE = f"SOL 103\nCEND\n{CONTROL}BEGIN BULK\n{BULK}ENDDATA\n"


def contents(path):
    """(points, matrices, supports' count, subcases) of a deck; what its text says."""
    deck = read_deck(path)
    made = assembly(deck)
    system = structure(made).system
    asked = [(c.id, c.spc, c.mpc, c.load, c.method, c.outputs) for c in analysis(deck).subcases]
    return made.points, system.K.toarray(), system.M.toarray(), made.supports, asked


def same(path, other):
    *found, asked = contents(path)
    *due, wanted = contents(other)
    assert asked == wanted
    for a, b in zip(found, due, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-9 * np.abs(b).max(initial=1e-300))


@pytest.fixture
def written(tmp_path):
    """Write texts beside the plain deck; the first of them is compared with it."""
    (tmp_path / "plain.bdf").write_text(WHOLE)

    def write(data, **others):
        (tmp_path / "other.bdf").write_bytes(data.encode() if isinstance(data, str) else data)
        for name, text in others.items():
            (tmp_path / f"{name}.inc").write_text(text)
        return tmp_path / "other.bdf", tmp_path / "plain.bdf"

    return write


def padded(data):
    """Lines of 80 bytes, filled up with NUL."""
    return b"".join(line.ljust(80, b"\0") + b"\n" for line in data.splitlines())


ENCODED = {
    "CRLF": lambda data: data.replace(b"\n", b"\r\n"),
    "CR": lambda data: data.replace(b"\n", b"\r"),
    "byte order mark": lambda data: b"\xef\xbb\xbf" + data,
    "Latin-1": lambda data: data.replace(b"STEEL", b"ST\xc4HL").replace(b"GRID,", b"$\xe9\nGRID,"),
    "UTF-8": lambda data: data.replace(b"STEEL", "ST\u00c4HL \u2713".encode()),
    "UTF-16": lambda data: data.decode("latin-1").encode("utf-16"),
    "UTF-16, big, without mark": lambda data: data.decode("latin-1").encode("utf-16-be"),
    "UTF-16, little, without mark": lambda data: data.decode("latin-1").encode("utf-16-le"),
    "lines padded with NUL": padded,
    "file padded with NUL": lambda data: data + b"\0" * 3000,
    "end of a DOS file": lambda data: data + b"\x1a",
    "lower case": bytes.lower,
    "tabs": lambda data: data.replace(b"  METHOD", b"\tMETHOD"),
    "trailing blanks": lambda data: data.replace(b"\n", b"   \n"),
    "comments": lambda data: data.replace(b"\n", b" $ , = 7,\n$\n", 40),
}


@pytest.mark.parametrize("kind", ENCODED)
def test_an_encoding_changes_nothing(written, kind):
    same(*written(ENCODED[kind](WHOLE.encode())))


def cut(text):
    """Every command cut down to its first four letters."""
    return re.sub(r"(?m)^(\s*)([A-Z]{4})[A-Z]+(?=[\s=(])", r"\1\2", text)


CUT, HALF = CONTROL.index("ECHO"), BULK.index("SPC1,1")
INCLUDED = {
    "case control": ("SOL 103\nCEND\nINCLUDE 'a.inc'\nBEGIN BULK\nINCLUDE 'bulk.inc'\nENDDATA\n",
                     {"a": "$\nINCLUDE 'b.inc'\n", "b": f"INCLUDE 'c.inc'\n{CONTROL[CUT:]}",
                      "c": CONTROL[:CUT], "bulk": BULK}),
    "all": ("INCLUDE 'a.inc'\n", {"a": "INCLUDE 'b.inc'\n", "b": WHOLE}),
    "BEGIN BULK": (f"SOL 103\nCEND\n{CONTROL}INCLUDE 'a.inc'\nENDDATA\n",
                   {"a": f"BEGIN BULK\n{BULK}"}),
    "CEND to BEGIN BULK": (f"SOL 103\nINCLUDE 'a.inc'\n{BULK}",
                           {"a": f"CEND\n{CONTROL}BEGIN BULK\n"}),
    "halves": (f"SOL 103\nCEND\n{CONTROL}INCLUDE 'a.inc'\n{BULK[HALF:]}ENDDATA\n",
               {"a": f"BEGIN BULK\n{BULK[:HALF]}"}),
}  # fmt: skip


@pytest.mark.parametrize("kind", INCLUDED)
def test_includes_stand_at_any_depth(written, kind):
    text, others = INCLUDED[kind]
    same(*written(text, **others))


@pytest.mark.parametrize(
    "change",
    [cut, lambda t: t.replace("SUBCASE ", "SUBC="), lambda t: t.replace(" = ", "="),
     lambda t: t.replace("METHOD", "METHO"), lambda t: t.replace("SPC = 1\n", "SPC(X)=1\n", 1),
     lambda t: t.replace("SPC = 1", "SPC = 7\nSPC = 1"),
     lambda t: t.replace("SPCFORCES = ALL", "MEFFMASS(SUMMARY,\n  PARTFAC) = YES"),
     lambda t: t.replace("SPCFORCES = ALL", "OTEMP = ALL\nAEROF = ALL\nERP = 3\nMONITOR = ALL")],
)  # fmt: skip
def test_the_case_control_may_be_written_otherwise(written, change):
    text = change(CONTROL)
    assert text != CONTROL
    same(*written(WHOLE.replace(CONTROL, text)))


@settings(max_examples=15, deadline=None)
@given(st.randoms(use_true_random=False))
def test_the_order_of_cards_and_commands_means_nothing(tmp_path_factory, rng):
    """Above the subcases the commands, and all cards, may stand in any order."""
    folder = tmp_path_factory.mktemp("order")
    blocks = re.split(r"\n(?=[A-Z])", CONTROL.partition("SUBCASE")[0].rstrip("\n"))
    cards = re.split(r"\n(?=[A-Z])", BULK.rstrip("\n"))
    random.Random(rng.random()).shuffle(blocks)
    random.Random(rng.random()).shuffle(cards)
    below = CONTROL[CONTROL.index("SUBCASE") :]
    text = "\n".join(["SOL 103", "CEND", *blocks, below + "BEGIN BULK", *cards, "ENDDATA", ""])
    (folder / "plain.bdf").write_text(WHOLE)
    (folder / "other.bdf").write_text(text)
    same(folder / "other.bdf", folder / "plain.bdf")


def in_columns(deck, name, i, large):
    return card_lines(name, deck.cards[name].fields(i), large)


def in_one_line(deck, name, i, large):
    return [",".join([name, *deck.cards[name].fields(i)])]


def with_marks(deck, name, i, large):
    """Continuation marks, of which the last one has no line."""
    out = card_lines(name, deck.cards[name].fields(i), large)
    marks = [f"+{chr(65 + k)}{i}" for k in range(len(out))]
    heads = [None, *marks]
    return [
        f"{(line if head is None else head.ljust(8) + line[8:]).ljust(72)}{mark}"
        for line, head, mark in zip(out, heads, marks, strict=False)
    ]


FORMS = {
    "small": (in_columns, False), "large": (in_columns, True), "one line": (in_one_line, False),
    "marks": (with_marks, False),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_every_format_of_every_card_says_the_same(written, form):
    other, plain = written(WHOLE)
    deck = read_deck(plain)
    control = WHOLE.partition("BEGIN BULK")[0]
    write, large = FORMS[form]
    cards = [(name, i) for name, found in deck.cards.items() for i in range(len(found))]
    bulk = "\n".join(line for name, i in cards for line in write(deck, name, i, large))
    other.write_text(f"{control}BEGIN BULK\n{bulk}\nENDDATA\n")
    same(other, plain)


def test_a_deck_whose_bulk_data_begin_in_an_include_is_edited_there(written, tmp_path):
    """An added card stands where the solver still reads: above the ENDDATA of that file."""
    main, _ = written("INCLUDE 'a.inc'\n", a=WHOLE)
    deck = read_deck(main)
    changes = [SetField("PSHELL", 101, "T", 3.0), Add([["CONM2", 77, 1, None, 1.0]])]
    new = read_deck(write_deck(deck, tmp_path / "out" / "new.bdf", changes))
    assert new["PSHELL"].reals(3).tolist() == [3.0]
    assert 77 in new["CONM2"].integers(1)
    text = (tmp_path / "out" / "a.inc").read_text()
    assert text.index("CONM2         77") < text.index("ENDDATA")


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_added_lines_end_as_the_others_do(written, tmp_path, end):
    main, _ = written(WHOLE.encode().replace(b"\n", end))
    new = write_deck(read_deck(main), tmp_path / "new.bdf", [Add([["CONM2", 77, 1, None, 1.0]])])
    assert {line[-len(end) :] for line in new.read_bytes().splitlines(keepends=True)} == {end}
    assert 77 in read_deck(new)["CONM2"].integers(1)


def test_fields_beyond_the_ninth_are_edited_in_place(tmp_path):
    """A free-field line that goes on for the next keeps its other fields."""
    path = tmp_path / "deck.bdf"
    path.write_text("CORD2R,4,,0.,0.,0.,0.,0.,1.,5.,2.,0.\nGRID,1\n")
    change = [SetField("CORD2R", 4, "C2", 7.0)]
    new = read_deck(write_deck(read_deck(path), tmp_path / "o.bdf", change))
    assert new["CORD2R"].block(3, 9).tolist() == [[0, 0, 0, 0, 0, 1, 5, 7, 0]]
