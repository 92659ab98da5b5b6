"""The reader: every format says the same, nothing is lost, every mistake is one sentence."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.errors import FileError
from chladni.io.nastran import SetField, read_deck, write_deck
from chladni.io.nastran.read.context import id_list
from chladni.io.nastran.text import numbers

from .conftest import ANCHORS, PLATE, real_decks

SAME_CARD = {
    "small": f"CBAR    {1:8}{2:8}{3:8}{4:8}     1.5    2.-3     0.3        +A\n"
    f"+A      {456:16d}    0.25",
    "unnamed continuation": "CBAR    1       2       3       4       1.5     2.-3    .3\n"
    f"+       {456:16d}  2.5E-1",
    "blank continuation": "CBAR    1       2       3       4       1.5     2.-3    .3\n"
    "                456     .25",
    "large": "CBAR*                  1               2               3               4\n"
    "*                    1.5           2.D-3             0.3\n"
    "*                                    456            0.25\n*",
    "large then small": "CBAR*                  1               2               3               4\n"
    "*                    1.5          2.0E-3              .3\n"
    "+                    456    .250",
    "free": "CBAR,1,2,3,4,1.5,2.-3,.3\n,,456,.25",
    "free, named": "cbar, 1, 2, 3, 4, 1.5, .002, 0.3, , +X\n+X, , 456, .25",
    "free, wide": "CBAR*,1,2,3,4\n*,1.5,2.0e-3,.3\n*,,456,.25\n*",
    "tabs": "CBAR\t1\t2\t3\t4\t1.5\t2.-3\t.3\n\t\t456\t.25",
    "comments between": "CBAR,1,2,3,4,1.5,2.-3,.3 $ of\n$ no\n\n,,456,.25 $ import, either",
    "windows": "CBAR,1,2,3,4,1.5,2.-3,.3\r\n,,456,.25\r",
}


@pytest.mark.parametrize("text", SAME_CARD.values(), ids=SAME_CARD)
def test_every_format_says_the_same(bulk, text):
    cards = bulk(text + "\nGRID,9\n", fold=False)["CBAR"]
    assert len(cards) == 1
    assert cards.ids(1, 4).tolist() == [[1, 2, 3, 4]]
    assert cards.block(5, 3).tolist() == [[1.5, 0.002, 0.3]]
    assert [cards.word(0, k) for k in (8, 9, 10)] == ["", "", "456"]
    assert cards.real(0, 11) == 0.25


def test_a_small_line_begins_a_row_of_eight(bulk):
    """One wide line holds four fields; the small line after it goes on with the ninth."""
    wide = "".join(f"{k:16}" for k in (1, 2, 3, 4))
    cards = bulk(
        f"CBAR*   {wide}\n+       {5:8}{6:8}\nCBAR*   {wide}\n*\n+       {7:8}\n", fold=False
    )
    assert [cards["CBAR"].word(i, 9) for i in (0, 1)] == ["5", "7"]
    assert cards["CBAR"].word(0, 5) == ""


def test_continuations_find_their_card_by_name(bulk):
    """Sorted decks of old put all continuations after all cards."""
    text = (
        "CHEXA          1      34       1       2       3       4       5       6+AA\n"
        "CHEXA          2      34      11      12      13      14      15      16+BB\n"
        "+BB           17      18\n"
        "+AA            7       8\n"
    )
    ids = bulk(text)["CHEXA"].ids(3, 8)
    assert ids.tolist() == [[*range(1, 9)], [*range(11, 19)]]


@pytest.mark.parametrize(
    ("text", "value"),
    [("1.5-3", 1.5e-3), ("-1.5+3", -1500.0), ("1.D+3", 1000.0), (".5", 0.5), ("7.", 7.0),
     ("-.25E2", -25.0), ("1.e-3", 1e-3), ("+3.0", 3.0), ("4", 4.0), ("2.5d1", 25.0)],
)  # fmt: skip
def test_lenient_reals(bulk, text, value):
    assert bulk(f"GRID,1,,{text}\n")["GRID"].reals(3).tolist() == [value]
    assert numbers.parse_real(text) == value


@pytest.mark.parametrize("text", ["1.2.3", "abc", "1.5-", "--3.", "nan", "inf", "1e999", "1 5."])
def test_no_number_is_refused_with_its_place(bulk, text):
    deck = bulk(f"$\nGRID,1,,{text}\n")
    with pytest.raises(FileError, match=r"deck.bdf:2: GRID 1: X1 is .* not a number"):
        deck["GRID"].reals(3)


@given(st.floats(-1e300, 1e300), st.sampled_from([8, 16]))
def test_numbers_keep_what_the_columns_hold(value, width):
    """Sign, point and a three-digit exponent leave two digits of 8 columns, ten of 16."""
    text = numbers.real(value, width)
    assert len(text) <= width
    assert "." in text
    back = numbers.parse_real(text)
    assert abs(back - value) <= (0.05 if width == 8 else 1e-9) * abs(value) + 1e-307


@given(st.floats(1e-4, 1e6))
def test_ordinary_numbers_keep_a_millionth(value):
    """8 columns hold five digits at least (.0010000, 1.0000-4), hence half a unit of the fifth."""
    assert abs(numbers.parse_real(numbers.real(value, 8)) - value) <= 5e-5 * value
    assert abs(numbers.parse_real(numbers.real(value, 16)) - value) <= 1e-10 * value


def test_include_is_relative_nested_and_long(tmp_path):
    """Relative to the including file; a quoted name may run over lines."""
    (tmp_path / "parts" / "deep").mkdir(parents=True)
    (tmp_path / "parts" / "deep" / "grids.bdf").write_text("GRID,1\nGRID,2\n")
    (tmp_path / "parts" / "a.bdf").write_text("include 'deep/\n  grids.bdf'\nGRID,3\n")
    main = tmp_path / "main.bdf"
    main.write_text('SOL 103\nCEND\nBEGIN BULK\nInclude "parts/a.bdf" $ parts\nGRID,4\nENDDATA\n')
    deck = read_deck(main)
    assert sorted(deck["GRID"].integers(1)) == [1, 2, 3, 4]
    grid = deck["GRID"]
    places = {grid.integer(i, 1): grid.where(i) for i in range(4)}
    assert places[2].endswith("grids.bdf:2")
    assert places[4].endswith("main.bdf:5")


def test_include_in_other_capitals(tmp_path):
    (tmp_path / "Grids.BDF").write_text("GRID,1\n")
    (tmp_path / "main.bdf").write_text("INCLUDE 'grids.bdf'\n")
    assert len(read_deck(tmp_path / "main.bdf")["GRID"]) == 1


def test_include_cycle_and_missing_file(tmp_path):
    a, b = tmp_path / "a.bdf", tmp_path / "b.bdf"
    a.write_text("GRID,1\nINCLUDE 'b.bdf'\n")
    b.write_text("INCLUDE 'a.bdf'\n")
    with pytest.raises(FileError, match=r"b.bdf:1: INCLUDE .*a.bdf includes itself"):
        read_deck(a)
    b.write_text("INCLUDE 'c.bdf'\n")
    with pytest.raises(FileError, match=r"b.bdf:1: INCLUDE .*c.bdf cannot be read"):
        read_deck(a)
    b.write_text("INCLUDE 'c.b\n")
    with pytest.raises(FileError, match=r"b.bdf:1: .* no closing '"):
        read_deck(a)
    with pytest.raises(FileError, match="folder"):
        read_deck(tmp_path)
    with pytest.raises(FileError, match="cannot be read"):
        read_deck(tmp_path / "none.bdf")


def test_what_stands_before_cend_may_be_missing(bulk):
    """DMAP alters included in the executive section are no part of the model."""
    deck = bulk("GRID,1", before="SOL 103\ninclude 'alters.v9'\nCEND\nSPC = 3\n")
    assert deck.case.sol == 103
    with pytest.raises(FileError, match=r"sets.txt does not exist"):
        bulk("GRID,1", before="SOL 103\nCEND\ninclude 'sets.txt'\n")


def test_case_control():
    """Global selections hold in every subcase unless it selects for itself."""
    from chladni.io.nastran.text.case_control import case_control

    text = """SOL SEMFREQ $ 111
    CEND
    SPC = 1
    METHOD(STRUCTURE) = 7
    SPCFORCES(PLOT) = ALL
    SET 3 = 1,2
    SUBCASE 10
      DLOAD=4
      FREQ = 5
      SDAMPING = 25
    SUBCASE 20
      SPC = 2
      LOAD= 8
      SUPORT1 = 3"""
    made = case_control([("deck", line) for line in text.splitlines()], sections=True)
    assert made.sol == 111
    ten, twenty = made.subcases
    assert ten.selects == {"SPC": 1, "METHOD": 7, "DLOAD": 4, "FREQ": 5, "SDAMP": 25}
    assert twenty.selects == {"SPC": 2, "METHOD": 7, "LOAD": 8, "SUPORT": 3}


@pytest.mark.parametrize("pattern", ["=,*1,,*10.,==", "=       *(1)            *10.    =="])
def test_replicated_cards(bulk, pattern):
    """Rows of grids as a row's first two lines and a count say."""
    deck = bulk(f"GRID,1,,0.,5.,-1.5+1\n{pattern} $ and so on\n=3\nGRID,9\n", fold=False)
    grid = deck["GRID"]
    assert grid.integers(1).tolist() == [1, 2, 3, 4, 5, 9]
    assert grid.reals(3, 0.0).tolist() == [0, 10, 20, 30, 40, 0]
    assert grid.block(4, 2, 0.0)[:5].tolist() == [[5, -15]] * 5
    assert grid.where(4).endswith(":3")
    assert bulk("PBAR,1,5,1.,2.\nPBAR,2,==\n", fold=False)["PBAR"].fields(1) == [
        "2",
        "5",
        "1.",
        "2.",
    ]
    with pytest.raises(FileError, match=r":3: GRID 4: it is replicated"):
        write_deck(deck, deck.path.parent / "new.bdf", [SetField("GRID", 4, "X1", 1.0)])


NAMES = {
    "ANSA": "$ANSA_NAME_COMMENT;101;PSHELL;Inner Panel;NO;NO;NO;",
    "HyperMesh property": '$HMNAME PROP                 101"Inner Panel" 4',
    "HyperMesh component": '$HMNAME COMP                   3"Inner Panel"\n$HWCOLOR COMP 3 5',
    "HyperMesh assigned": '$HMNAME COMP                   3"Inner Panel"  101 "PSHELL_101" 4',
    "Femap": "$ Femap Property 101 : Inner Panel",
    "Femap with NX": "$ Femap with NX Nastran Property 101 : Inner Panel",
    "Patran": '$ Pset: "Inner Panel" will be imported as: "pshell.101"',
    "Patran region": "$ Elements and Element Properties for region : Inner Panel",
    "I-DEAS": "$*  I-DEAS property: 101  name: Inner Panel",
}


@pytest.mark.parametrize("comment", NAMES.values(), ids=NAMES)
def test_part_names_in_comments(bulk, comment):
    deck = bulk(
        f"$ANSA_NAME_COMMENT;101;PBUSH;rubber;\n{comment}\n{PLATE[PLATE.index('PSHELL') :]}"
    )
    assert deck.names == {101: "Inner Panel"}


def test_harmless_cards_are_kept(bulk):
    deck = bulk(PLATE + "MDLPRM,HDF5,0\nCREEP,1\nDTI,4,,text\n")
    assert deck["DTI"].fields(0) == ["4", "", "TEXT"]
    assert len(deck["MDLPRM"]) == 1


def test_selected_direct_matrices_are_refused(bulk):
    with pytest.raises(FileError, match="K2GG = KAAX"):
        bulk(PLATE, before="SOL 103\nCEND\nK2GG = KAAX\n")


BROKEN = {
    "continuation of nothing": ("+,1,2\n", r":1: a continuation line with no card"),
    "nothing to repeat": ("=,*1,=\n", r":1: there is no card of one line above"),
    "no pattern": ("GRID,1\n=5\n", r":2: =5 has no replicated card above it"),
    "step of nothing": ("GRID,1,,A\n=,*1,,*2.\n", r":2: 'A' \+ '2.' cannot be added"),
    "columns": ("GRID 1 0 0.0 0.0 0.0\n", r":1: 'GRID 1 0' is not a card name"),
    "no BEGIN BULK": ("SOL 103\nCEND\nGRID,1\n", r":2: CEND without a BEGIN BULK"),
    "superelement": ("CEND\nBEGIN BULK\nGRID,1\nBEGIN SUPER=1\n", r":4: superelement"),
    "empty": ("$ nothing\n\n", "has no bulk data"),
}


@pytest.mark.parametrize(("text", "match"), BROKEN.values(), ids=BROKEN)
def test_broken_decks(bulk, text, match):
    with pytest.raises(FileError, match=match) as caught:
        bulk(text, fold=False)
    assert "deck.bdf" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_binary_file(tmp_path):
    path = tmp_path / "deck.op2"
    path.write_bytes(b"\0\1\2\3" * 100)
    with pytest.raises(FileError, match="binary"):
        read_deck(path)


@pytest.mark.skipif(not ANCHORS.exists(), reason="reference decks are not at hand")
@pytest.mark.parametrize(("folder", "main"), real_decks())
def test_real_decks_read(folder, main):
    """Element counts as their providers state them; no card line is left over."""
    deck = read_deck(ANCHORS / folder / main, allow=("GENEL", "CTRPLT1"))
    lines = sum(len(c.lines) for c in deck.cards.values())
    bulk = [t for s in deck.sources for t in s.lines[slice(*s.bulk)]]
    cardlike = [t for t in bulk if t.split(b"$")[0].strip()]
    statements = sum(i.past - i.first for s in deck.sources for i in s.includes if i.file >= 0)
    assert lines == len(cardlike) - statements


def _flat(path, n):
    """n x n quadrilaterals."""
    i, j = np.divmod(np.arange((n + 1) ** 2), n + 1)
    grid = [f"GRID    {k + 1:8d}        {x:8.2f}{y:8.2f}{0.0:8.2f}\n" for k, (x, y) in
            enumerate(zip(i * 1.25, j * 1.25, strict=True))]  # fmt: skip
    i, j = np.divmod(np.arange(n * n), n)
    a = i * (n + 1) + j + 1
    quads = [f"CQUAD4  {k + 1:8d}{1:8d}{g:8d}{g + n + 1:8d}{g + n + 2:8d}{g + 1:8d}\n" for k, g in
             enumerate(a)]  # fmt: skip
    path.write_text("".join(grid + quads))
    return path


def _read(path, n):
    deck = read_deck(path)
    assert deck["CQUAD4"].ids(1, 6).shape == (n * n, 6)
    assert deck["GRID"].block(3, 3).shape == ((n + 1) ** 2, 3)


def test_a_card_more_is_at_most_a_step_more(tmp_path, work):
    """Cards are read by columns; what is done card by card is to look at its line, once."""
    few, many = (work(partial(_read, _flat(tmp_path / f"{n}.bdf", n), n)) for n in (20, 80))
    assert many - few <= 80**2 + 81**2 - 20**2 - 21**2


def test_a_byte_order_mark_is_no_card(tmp_path):
    """The first line counts, whatever an editor put before it."""
    for text in (PLATE, f"SOL 103\nCEND\nBEGIN BULK\n{PLATE}"):
        path = tmp_path / "deck.bdf"
        path.write_text("\ufeff" + text, encoding="utf-8")
        deck = read_deck(path)
        assert deck["GRID"].integers(1).tolist() == [1, 2, 3, 4]
        assert deck.case.sol == (103 if "SOL" in text else 0)


def test_skipped_lines_are_not_read(bulk):
    text = f"{PLATE}SKIPON\nCWELD,1,2\nGRID,9\nSKIPOFF\nGRID,8,,1.,1.,1.\nskipon\nGRID,7\n"
    assert bulk(text)["GRID"].integers(1).tolist() == [1, 2, 3, 4, 8]


def test_exceptions_from_a_range(bulk):
    deck = bulk(PLATE + "SPC1,1,123,1,THRU,9,EXCEPT,2,4,20,21,THRU,25,BY,2\n")
    assert id_list(deck["SPC1"], 0, 3) == [1, 3, 5, 6, 7, 8, 9, 20, 21, 23, 25]
