"""What is not known to leave the structure as it is is refused by name, unless it is allowed."""

import re
from time import process_time

import pytest

from chladni.errors import ChladniError, FileError
from chladni.io.nastran import assembly, read_deck
from chladni.io.nastran.read.analysis_requests import LEFT_OUT, STRUCTURAL, remarks
from chladni.io.nastran.text.card_layout import tables
from chladni.io.nastran.text.known_cards import refusal
from chladni.io.nastran.text.source_files import sources

from .conftest import PLATE


@pytest.mark.parametrize(
    "card",
    """NSM,5,PSHELL,101,1. NSM1,5,PSHELL,NSM,1. NSML1,5,PSHELL,NSM,1. NSMADD,5,1 RBAR1,9,1,3,123456
    RBE22,9,1,123456,3 SPCC1,1,123456,1 MFLUID,1 MLIST,1 SESET,1,2 BCTABLE,1 TF,1,1,1
    BCPROP,1 SNORM,1 XYZ,4 CGAP,9,1,1,2 CWELD,9,1 CFAST,9,1 CQUAD8,9,1 CTRIA6,9,1 GENEL,9
    CPYRAM,9,1""".split(),
)
def test_a_card_not_known_is_refused_unless_allowed(bulk, card):
    name = card.partition(",")[0]
    with pytest.raises(FileError, match=rf"deck.bdf:8: {name} .*--allow {name}$"):
        bulk(f"{PLATE}{card}\n")
    assert len(bulk(f"{PLATE}{card}\n", allow=(name.lower(),))[name]) == 1


@pytest.mark.parametrize(
    ("name", "meant"), [("SPCC1", "SPC1"), ("RBE22", "RBE2"), ("GRIDD", "GRID")]
)
def test_a_misspelt_card_is_told_what_is_meant(name, meant):
    assert f"did you mean {meant}?" in refusal(name, 1)


def test_what_is_left_out_with_a_note_is_known():
    assert not [name for name in LEFT_OUT if refusal(name, 1)]


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("NSM = 5", "NSM"), ("SPCC = 1", "SPCC"), ("MFLUID = 1", "MFLUID"),
        ("BCONTACT = 1", "BCONTACT"), ("STATSUB = 1", "STATSUB"), ("TFL = 3", "TFL"),
        ("SUBCASE 1\n  LOADD = 3", "LOADD"), ("NOSUCH", "NOSUCH"),
    ],
)  # fmt: skip
def test_a_command_not_known_is_refused_unless_allowed(bulk, line, name):
    with pytest.raises(FileError, match=rf"deck.bdf:\d+: the command {name} .*--allow {name}$"):
        bulk(PLATE, before=f"SOL 103\nCEND\n{line}\n")
    assert bulk(PLATE, before=f"SOL 103\nCEND\n{line}\n", allow=(name,)).case.sol == 103


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
    ["BSURF,1,2", "BCPARA,1", "PARVEC,1", "ACMODL,IDENT", "MONSUM,A", "RCROSS,1", "AECOMPL,A"],
)
def test_a_card_for_output_or_other_analyses_is_passed_over(bulk, card):
    assert assembly(bulk(f"{PLATE}{card}\n")).parts == assembly(bulk(PLATE)).parts


def test_all_that_is_not_known_is_said_at_once(bulk):
    """With count, meaning and line of each, and the words that allow all of them."""
    cards = "CWELD,1,2\nCWELD,2,2\nXYZ,1\nCGAP,9,1\n"
    with pytest.raises(FileError) as caught:
        bulk(PLATE + cards, before="SOL 103\nCEND\nSTATSUB = 2\nNOSUCH = 1\n")
    said = str(caught.value)
    for part in (
        "5 kinds of cards and commands",
        "CWELD (2 cards: spot welds, fasteners and seams, line 13)",
        "XYZ (1 card, line 15)", "CGAP (1 card: gaps, line 16)",
        "the command STATSUB (stiffness of a loaded state, line 3)", "command NOSUCH (line 4)",
    ):  # fmt: skip
        assert part in said
    allow = re.findall(r"--allow (\w+)", said)
    text, before = PLATE + cards, "SOL 103\nCEND\nSTATSUB = 2\nNOSUCH = 1\n"
    assert assembly(bulk(text, before=before, allow=allow)).parts


@pytest.mark.parametrize(
    ("card", "command"),
    [("NSM1,5,PSHELL,NSM,1.", "NSM"), ("BGSET,1,1", "BGSET"), ("TF,1,1,1", "TFL"),
     ("MFLUID,1", "MFLUID")],
)  # fmt: skip
def test_what_the_case_control_would_have_to_select_acts_where_it_does(bulk, card, command):
    """QRG, NSM1: it is used where NSM of the case control names its set."""
    text, name = f"{PLATE}{card}\n", card.partition(",")[0]
    assert assembly(bulk(text, before="SOL 103\nCEND\n")).parts == assembly(bulk(PLATE)).parts
    with pytest.raises(
        FileError, match=rf"the command {command} .*{name}: 1 card.* not understood"
    ):
        bulk(text, before=f"SOL 103\nCEND\n{command} = 5\n")
    with pytest.raises(FileError, match="and no case control says whether it acts"):
        bulk(text)


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

    assert min(spent(16000) for _ in range(2)) < 40 * max(spent(1000) for _ in range(3))


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
    with pytest.raises(FileError, match=r"deck.bdf:[23]: .*MATT1 at .*deck.bdf:\d+ .*allow MATT1$"):
        bulk(text, before=before)
    assert bulk(text, before=before, allow=("matt1",))
    assert bulk(PLATE + TABLE, before=before)  # nothing follows it


def test_bulk_data_alone_says_not_whether_temperatures_are_chosen(bulk):
    with pytest.raises(
        FileError, match=r"deck.bdf:8: the case control does not select TEMP .*MATT1"
    ):
        bulk(f"{PLATE}{TABLE}MATT1,5,7\n")
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
    deck = bulk(PLATE, before=text)
    assert not assembly(deck).auto_spc  # as PARAM,AUTOSPC does


@pytest.mark.parametrize("place", ["", "PARAM,CK1,2.0\n"])
def test_parameters_that_scale_a_matrix_are_refused(bulk, place):
    card = "" if place else "PARAM,CM1,2.\n"
    with pytest.raises(FileError, match=r"scales a matrix.*--allow C[KM]1"):
        bulk(PLATE + card, before=f"SOL 103\nCEND\n{place}")
    assert bulk(f"{PLATE}PARAM,CM1,1.0\n")  # as it is without


@pytest.mark.parametrize(
    ("cards", "said"),
    [
        ("GRID,9,,1.,1.,1.,,,3\n", "GRID 9: SEID .*superelement"),
        ("CTUBE,90,9,1,3\nPTUBE,9,5,2.,.2,,4.\n", r"PTUBE 9: a tapered tube \(OD2 = 4\)"),
        ("CBUSH,90,9,1,3,,,,0\nPBUSH,9,M,5.\n", "PBUSH 9: a mass M is not supported"),
        ("GRID,9,,1.,1.,1.\nCONM2,90,9,,3.\n", "mass 90 is on grid 9, which is not connected"),
        ("CMASS2,90,-1.,1,3\n", "CMASS2 90: its mass is negative"),
        ("PMASS,9,-1.\nCMASS1,90,9,1,3\n", "CMASS1 90: its mass is negative"),
        ("MAT8,7,1.,1.,.3\nPCOMP,7\n,7,1.\nCQUAD4,90,7,1,2,3,4\n", "MAT8 7: .*G12 0 are to be"),
        ("RBE3,90,,1,123,1.,123,2,THRU\n", "RBE3 90: 'THRU' is not an integer"),
        ("RBE3,90,,1,123,1.,123,2,THRU,x\n", "RBE3 90"),
        ("SPOINT,100,THRU,40000000\n", "SPOINT 100: the range .* more than 1000000"),
        ("RBE2,90,1,123,2,THRU,49000000\n", "RBE2 90: the range .* more than 1000000"),
    ],
)
def test_fields_are_heeded_or_refused(bulk, cards, said):
    with pytest.raises(ChladniError, match=said):
        assembly(bulk(PLATE + cards))


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


def test_includes_without_end(tmp_path):
    for k in range(200):
        (tmp_path / f"{k}.inc").write_text(f"INCLUDE '{k + 1}.inc'\n")
    (tmp_path / "a.inc").symlink_to("b.inc")
    (tmp_path / "b.inc").symlink_to("a.inc")
    for name, said in (("0.inc", "nested more than 100"), ("a.inc", "too many links|cannot be")):
        (tmp_path / "d.bdf").write_text(f"BEGIN BULK\nINCLUDE '{name}'\nENDDATA\n")
        with pytest.raises(FileError, match=said):
            read_deck(tmp_path / "d.bdf")


@pytest.mark.parametrize("name", ["/dev/zero", "fifo"])
def test_what_is_no_file_is_not_read(tmp_path, name):
    import os

    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "d.bdf").write_text(f"BEGIN BULK\nINCLUDE '{name}'\nENDDATA\n")
    with pytest.raises(FileError, match=r":2: INCLUDE .* is a device or a pipe"):
        read_deck(tmp_path / "d.bdf")
