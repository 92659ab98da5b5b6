"""The reader: every format says the same, and nothing is lost."""

from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.builders.refusals import says

from chladni.io.nastran import SetField, read_deck, write_deck
from chladni.io.nastran.read.context import id_list
from chladni.io.nastran.text import numbers
from chladni.io.nastran.text.case_control import case_control

from .conftest import PLATE, read_real, real_decks

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
    text = f"CBAR*   {wide}\n+       {5:8}{6:8}\nCBAR*   {wide}\n*\n+       {7:8}\n"
    cards = bulk(text, fold=False)["CBAR"]
    assert [cards.word(i, 9) for i in (0, 1)] == ["5", "7"]
    assert cards.word(0, 5) == ""


def test_continuations_find_their_card_by_name(bulk):
    """Sorted decks of old put all continuations after all cards."""
    text = (
        "CHEXA          1      34       1       2       3       4       5       6+AA\n"
        "CHEXA          2      34      11      12      13      14      15      16+BB\n"
        "+BB           17      18\n"
        "+AA            7       8\n"
    )
    assert bulk(text)["CHEXA"].ids(3, 8).tolist() == [[*range(1, 9)], [*range(11, 19)]]


@pytest.mark.parametrize(
    ("text", "value"),
    [("1.5-3", 1.5e-3), ("-1.5+3", -1500.0), ("1.D+3", 1000.0), (".5", 0.5), ("7.", 7.0),
     ("-.25E2", -25.0), ("1.e-3", 1e-3), ("+3.0", 3.0), ("4", 4.0), ("2.5d1", 25.0)],
)  # fmt: skip
def test_lenient_reals(bulk, text, value):
    assert bulk(f"GRID,1,,{text}\n")["GRID"].reals(3).tolist() == [value]
    assert numbers.parse_real(text) == value


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
    """Relative to the including file, in other capitals; a quoted name may run over lines."""
    (tmp_path / "parts" / "deep").mkdir(parents=True)
    (tmp_path / "parts" / "deep" / "Grids.BDF").write_text("GRID,1\nGRID,2\n")
    (tmp_path / "parts" / "a.bdf").write_text("include 'deep/\n  grids.bdf'\nGRID,3\n")
    main = tmp_path / "main.bdf"
    main.write_text('SOL 103\nCEND\nBEGIN BULK\nInclude "parts/a.bdf" $ parts\nGRID,4\nENDDATA\n')
    grid = read_deck(main)["GRID"]
    places = {grid.integer(i, 1): grid.where(i) for i in range(4)}
    assert sorted(places) == [1, 2, 3, 4]
    assert places[2].endswith("Grids.BDF:2")
    assert places[4].endswith("main.bdf:5")


def test_include_cycle_and_missing_file(tmp_path):
    (tmp_path / "a.bdf").write_text("GRID,1\nINCLUDE 'b.bdf'\n")
    for included, said in (
        ("INCLUDE 'a.bdf'\n", "INCLUDE .*a.bdf includes itself"),
        ("INCLUDE 'c.bdf'\n", "INCLUDE .*c.bdf cannot be read"),
        ("INCLUDE 'c.b\n", ".* no closing '"),
    ):
        (tmp_path / "b.bdf").write_text(included)
        says(rf"b.bdf:1: {said}", read_deck, tmp_path / "a.bdf")


def test_what_stands_before_cend_may_be_missing(bulk):
    """DMAP alters included in the executive section are no part of the model."""
    deck = bulk("GRID,1", before="SOL 103\ninclude 'alters.v9'\nCEND\nSPC = 3\n")
    assert deck.case.sol == 103
    before = "SOL 103\nCEND\ninclude 'sets.txt'\n"
    says(r"sets.txt does not exist", bulk, "GRID,1", before)


def test_case_control():
    """Global selections hold in every subcase unless it selects for itself."""
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
    change = [SetField("GRID", 4, "X1", 1.0)]
    says(r":3: GRID 4: it is replicated", write_deck, deck, deck.path.with_name("new.bdf"), change)
    bars = bulk("PBAR,1,5,1.,2.\nPBAR,2,==\n", fold=False)["PBAR"]
    assert bars.fields(1) == ["2", "5", "1.", "2."]


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
    below = PLATE[PLATE.index("PSHELL") :]
    deck = bulk(f"$ANSA_NAME_COMMENT;101;PBUSH;rubber;\n{comment}\n{below}")
    assert deck.names == {101: "Inner Panel"}


def test_harmless_cards_are_kept(bulk):
    deck = bulk(PLATE + "MDLPRM,HDF5,0\nCREEP,1\nDTI,4,,text\n")
    assert deck["DTI"].fields(0) == ["4", "", "TEXT"]
    assert len(deck["MDLPRM"]) == 1


@real_decks()
def test_no_card_line_of_a_real_deck_is_left_over(path):
    deck = read_real(path)
    lines = sum(len(c.lines) for c in deck.cards.values())
    bulk = [t for s in deck.sources for t in s.lines[slice(*s.bulk)]]
    cardlike = [t for t in bulk if t.split(b"$")[0].strip()]
    statements = sum(i.past - i.first for s in deck.sources for i in s.includes if i.file >= 0)
    assert lines == len(cardlike) - statements


def test_a_card_more_is_at_most_a_step_more(tmp_path, work):
    """Cards are read by columns; what is done card by card is to look at its line, once."""

    def read(n):
        (tmp_path / f"{n}.bdf").write_text("".join(
            f"GRID    {k:8d}        {k:8.2f}{0:8.2f}{0:8.2f}\nCQUAD4  " + 6 * f"{k:8d}" + "\n"
            for k in range(1, n + 1)
        ))  # fmt: skip
        deck = read_deck(tmp_path / f"{n}.bdf")
        assert deck["CQUAD4"].ids(1, 6).shape == (n, 6)
        assert deck["GRID"].block(3, 3).shape == (n, 3)

    few, many = (work(partial(read, n)) for n in (400, 4000))
    assert many - few <= 3 * (4000 - 400)  # two cards, and what writes them


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
