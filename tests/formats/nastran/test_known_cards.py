"""What is not known to leave the structure as it is is refused by name, unless it is allowed."""

import os
import re
from time import process_time

import pytest
from tests.builders.refusals import says

from chladni.io.nastran import assembly, read_deck
from chladni.io.nastran.read.analysis_requests import LEFT_OUT, STRUCTURAL, remarks
from chladni.io.nastran.text.card_layout import tables
from chladni.io.nastran.text.known_cards import refusal
from chladni.io.nastran.text.source_files import sources

from .conftest import PLATE


@pytest.mark.parametrize(
    ("name", "meant"), [("SPCC1", "SPC1"), ("RBE22", "RBE2"), ("GRIDD", "GRID")]
)
def test_a_misspelt_card_is_told_what_is_meant(name, meant):
    assert f"did you mean {meant}?" in refusal(name, 1)


def test_what_is_left_out_with_a_note_is_known():
    assert not [name for name in LEFT_OUT if refusal(name, 1)]


@pytest.mark.parametrize(
    "line",
    """OTEMP AEROF APRES MONITOR CMSENERGY PFMODE ERP INTENSITY HARMONICS HDF5OUT MODTRAK MPFACTOR
    ELDATA NLOPRM STITLE RCROSS ELSDCON OPRES""".split(),
)
def test_a_request_for_output_is_passed_over(bulk, line):
    """Whatever it asks for, it changes no structure (Quick Reference Guide, section 4)."""
    assert bulk(PLATE, before=f"SOL 103\nCEND\n{line}(PRINT) = ALL\n").case.sol == 103


@pytest.mark.parametrize(
    "card",
    ["BSURF,1,2", "BCPARA,1", "PARVEC,1", "ACMODL,IDENT", "MONSUM,A", "RCROSS,1", "AECOMPL,A",
     "PARAM,CM1,1.0"],
)  # fmt: skip
def test_a_card_for_output_or_other_analyses_is_passed_over(bulk, card):
    assert assembly(bulk(f"{PLATE}{card}\n")).parts == assembly(bulk(PLATE)).parts


def test_all_that_is_not_known_is_said_at_once(bulk):
    """With count, meaning and line of each, and the words that allow all of them."""
    text = f"{PLATE}CSEAM,1,2\nCSEAM,2,2\nXYZ,1\nRJOINT,9\n"
    before = "SOL 103\nCEND\nSTATSUB = 2\nNOSUCH = 1\n"
    said = says("5 kinds of cards and commands", bulk, text, before)
    for part in (
        "CSEAM (2 cards: spot welds, fasteners and seams, line 13)",
        "XYZ (1 card, line 15)", "RJOINT (1 card: ties, line 16)",
        "the command STATSUB (stiffness of a loaded state, line 3)", "command NOSUCH (line 4)",
    ):  # fmt: skip
        assert part in said
    assert assembly(bulk(text, before=before, allow=re.findall(r"--allow (\w+)", said))).parts


@pytest.mark.parametrize(
    ("card", "command"),
    [("BGSET,1,1", "BGSET"), ("TF,1,1,1", "TFL"),
     ("MFLUID,1", "MFLUID")],
)  # fmt: skip
def test_what_the_case_control_would_have_to_select_acts_where_it_does(bulk, card, command):
    """QRG, BGSET: it is used where the case control names its set."""
    text, name = f"{PLATE}{card}\n", card.partition(",")[0]
    assert assembly(bulk(text, before="SOL 103\nCEND\n")).parts == assembly(bulk(PLATE)).parts
    said = rf"the command {command} .*{name}: 1 card.* not understood"
    says(said, bulk, text, f"SOL 103\nCEND\n{command} = 5\n")
    says("and no case control says whether it acts", bulk, text)


def test_text_in_cards_is_no_list_of_fields(bulk):
    """DEQATN with commas beyond its name, and signs that repeat fields elsewhere."""
    text = "DEQATN  10      F(A,B,C) = MAX(A,B)*\n+       SQRT(C,   =       )\n        A, B\n"
    assert len(bulk(PLATE + text, fold=False)["DEQATN"]) == 1


def test_work_grows_as_the_names_do(tmp_path):
    """Sixteen times as many names took a hundred times as long when each searched all lines."""

    def spent(n):
        path = tmp_path / f"{n}.csv"
        path.write_text("x,y\n" + "".join(f"A{k},1\n" for k in range(n)))
        source = sources(path).sources[0]
        begun = process_time()
        assert len(tables(source, 0, (path,))) == n + 1
        return process_time() - begun

    assert spent(8000) < 20 * max(spent(1000) for _ in range(3))


TABLE = "TEMP,4,1,80.\nTABLEM1,7\n,0.,1.,100.,.5,ENDT\n"


@pytest.mark.parametrize("card", ["MATT1,5,7", "MATT8,5,7", "MATT9,5,7", "MATTVE,5,7"])
@pytest.mark.parametrize("chosen", ["", "TEMP(LOAD) = 4\n", "TEMPERATURE(INITIAL) = 4\n"])
def test_materials_follow_no_temperature_that_is_not_chosen(bulk, card, chosen):
    """Nastran takes MAT1 itself then (MATT1, remark 1), and so do we, with a note."""
    plain = assembly(bulk(PLATE))
    deck = bulk(f"{PLATE}{TABLE}{card}\n", before=f"CEND\n{chosen}")
    assert assembly(deck).parts == plain.parts
    assert [note for note in remarks(deck, STRUCTURAL) if card.partition(",")[0] in note]


@pytest.mark.parametrize(
    "chosen",
    ["TEMPERATURE(MATERIAL) = 4", "TEMP(MATE) = 4", "temp = 4", "TEMPERATURE(BOTH)=4",
     "SUBCASE 2\n TEMP( MAT )=4"],
)  # fmt: skip
def test_materials_that_follow_a_chosen_temperature_are_refused(bulk, chosen):
    text, before = f"{PLATE}{TABLE}MATT1,5,7\n", f"CEND\n{chosen}\n"
    said = r"deck.bdf:[23]: .*MATT1 at .*deck.bdf:\d+ .*allow MATT1$"
    says(said, bulk, text, before)
    assert bulk(text, before=before, allow=("matt1",))
    assert bulk(PLATE + TABLE, before=before)  # nothing follows it


def test_bulk_data_alone_says_not_whether_temperatures_are_chosen(bulk):
    said = r"deck.bdf:8: the case control does not select TEMP .*MATT1"
    says(said, bulk, f"{PLATE}{TABLE}MATT1,5,7\n")
    assert bulk(f"{PLATE}MATT1,5,7\n")


def test_usual_commands_pass(bulk):
    """Abbreviations, titles with anything, requests, plots to the end of the case control."""
    text = """ASSIGN OUTPUT2 = 'a.op2'
SOL 103
CEND
TITLE = SPCC = 1
SUBTI = x
LABEL = NSM = 4
ECHO = NONE
DISP(PLOT) = ALL
SPCF = ALL
ELFOR = ALL
SET 1 = 1,
  2, THRU, 4
AUTOSPC(NOPRINT) = NO
RIGID = LINEAR
SUBCASE 1
  ACCELER(SORT2) = 1
OUTPUT(XYPLOT)
XTITLE = f
ANY NOISE = 1
"""
    assert not assembly(bulk(PLATE, before=text)).auto_spc  # as PARAM,AUTOSPC does


def test_a_long_range_of_supports_passes_over_what_is_not_there(bulk, work):
    """Work follows the grids of the deck, not the numbers a THRU runs through."""

    def held(last):
        deck = bulk(f"{PLATE}SPC1,1,3,1,THRU,{last}\n", before="CEND\nSPC = 1\n")
        return assembly(deck).supports

    short, long = (work(lambda last=last: held(last)) for last in (4, 49_000_000))
    assert len(held(49_000_000)) == 4
    assert long < 1.1 * short


def test_two_parts_of_one_name_are_told_apart(bulk):
    names = '$HMNAME PROP 101 "sheet"\n$HMNAME PROP 102 "sheet"\n'
    assert bulk(names + PLATE).names == {101: "sheet (101)", 102: "sheet (102)"}


def test_an_include_without_end_or_of_no_file_is_refused(tmp_path):
    for k in range(110):
        (tmp_path / f"{k}.inc").write_text(f"INCLUDE '{k + 1}.inc'\n")
    (tmp_path / "a.inc").symlink_to("b.inc")
    (tmp_path / "b.inc").symlink_to("a.inc")
    os.mkfifo(tmp_path / "fifo")
    for name, said in (
        ("0.inc", "nested more than 100"), ("a.inc", "too many links|cannot be"),
        ("/dev/zero", r":2: INCLUDE .* is a device or a pipe"),
        ("fifo", r":2: INCLUDE .* is a device or a pipe"),
    ):  # fmt: skip
        (tmp_path / "d.bdf").write_text(f"BEGIN BULK\nINCLUDE '{name}'\nENDDATA\n")
        says(said, read_deck, tmp_path / "d.bdf")
