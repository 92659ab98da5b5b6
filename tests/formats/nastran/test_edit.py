"""Changed decks: only what changed is changed, and it says what was asked."""

import numpy as np
import pytest
from tests.builders.decks import differing
from tests.builders.refusals import says

from chladni.io.nastran import (
    Add,
    Delete,
    Replace,
    SetColumns,
    SetField,
    assembly,
    changed_lines,
    read_deck,
    write_deck,
)
from chladni.model.properties import Orthotropic

from .conftest import PLATE, read_real, real_decks

CASE = "SOL 103\nCEND\nMETHOD = 1\n"


def rewritten(deck, *changes, name="new.bdf"):
    """The deck written with changes and read again, and the lines that differ."""
    path = write_deck(deck, deck.path.parent / "out" / name, changes)
    return read_deck(path), differing(deck.path, path)


def test_the_lines_that_change_are_those_that_are_written(bulk):
    """In an edit, a card that goes, one that is added: what a page shows is what the deck has."""
    deck = bulk(PLATE, before=CASE)
    changes = [SetField("PSHELL", 101, "T", 1.25), Add((("CONM2", 900, 1, 0, 0.5),), "put in")]
    _, (gone, fresh) = rewritten(deck, *changes)
    said = changed_lines(deck, changes)
    assert sorted(line[2:] for line in said if line[0] == "-") == sorted(gone)
    assert sorted(line[2:] for line in said if line[0] == "+") == sorted(fresh)
    assert said[0].startswith(f"@ {deck.path.name}, line ")
    assert changed_lines(deck, []) == []


def test_nothing_changed_is_the_same_bytes(bulk):
    deck = bulk(PLATE.replace("\n", "   \r\n") + "$ end\n", before=CASE)
    path = write_deck(deck, deck.path.parent / "copy.bdf", [])
    assert path.read_bytes() == deck.path.read_bytes()


@pytest.mark.parametrize(
    "line",
    [
        "PSHELL       101       5      2.       5               5     $ steel",
        "PSHELL,101,5,2.,5,,5 $ steel",
        "PSHELL* 101             5               2.0             5",
        "pshell\t101\t5\t2.\t5",
    ],
)
@pytest.mark.parametrize("value", [0.8, 1.23456, 0.0012345678901, 1e-12])
def test_one_field_of_one_card(bulk, line, value):
    """Any format; a value that loses more than 1e-6 in 8 columns makes the card wide."""
    text = PLATE.replace("PSHELL,101,5,2.,5,,5", line)
    deck = bulk(text, before=CASE, fold=False)
    again, (gone, fresh) = rewritten(deck, SetField("PSHELL", 101, "T", value))
    assert gone == [line]
    assert 1 <= len(fresh) <= 2
    assert again["PSHELL"].real(0, 3) == pytest.approx(value, rel=1e-6, abs=0)
    now, before = ([d["PSHELL"].word(0, k) for k in range(1, 9) if k != 3] for d in (again, deck))
    assert now == before


QUADS = {
    "free field": "CQUAD4,7,101,1,2,3,4\nCQUAD4,8,101,1,2,3,4,,\n",
    "columns": f"CQUAD4  {7:8}{101:8}{1:8}{2:8}{3:8}{4:8}                \n"
    f"CQUAD4  {8:8}{101:8}{1:8}{2:8}{3:8}{4:8}                +Q8\n+Q8     {'':16}     1.5\n",
}  # fmt: skip


@pytest.mark.parametrize("form", QUADS)
def test_corner_thickness_of_many_quadrilaterals(bulk, form):
    """T1 to T4 open a continuation, or stand in the one that is there; the element's line stays."""
    text = PLATE.replace("CQUAD4,7,101,1,2,3,4\n", QUADS[form])
    deck = bulk(text, before=CASE, fold=False)
    t = np.array([[1.0, 1.1, 1.2, 1.25], [0.9, np.nan, 0.7, 0.6]])
    fields = ("T1", "T2", "T3", "T4")
    again, (gone, fresh) = rewritten(deck, SetColumns("CQUAD4", np.array([7, 8]), fields, t))
    thickness = assembly(again, loose=True).shells.thickness
    np.testing.assert_allclose(thickness, np.where(np.isnan(t), 2.0, t))
    assert gone in ([], [QUADS[form].splitlines()[-1]])
    assert len(fresh) <= 3


def test_diagnosis_writes_its_effects(bulk):
    """MAT1 becomes MAT8 under its own id; masses and springs are added; a card goes."""
    deck = bulk(PLATE + "CONM2,60,1,,5.\n", before=CASE)
    added = [("CONM2", 901, 3, None, 1.5e-5), ("CELAS2", 902, 123.456789, 2, 3)]
    again, (gone, fresh) = rewritten(
        deck,
        Replace("MAT1", 5, ("MAT8", 5, 2.1e5, 1.9e5, 0.3, 8e4, None, None, 7.85e-9)),
        Add(added, "found by the diagnosis"),
        Delete("CONM2", 60),
    )
    assert gone == ["MAT1,5,2.1+5,,.3,7.85-9", "CONM2,60,1,,5."]
    assert "$ found by the diagnosis" in fresh
    made = assembly(again, loose=True)
    assert isinstance(made.parts[0].section.membrane, Orthotropic)
    assert made.masses.ids.tolist() == [901]
    assert made.springs.value[0] == pytest.approx(123.456789, rel=1e-6)


def test_several_changes_of_one_card(bulk):
    deck = bulk(PLATE, before=CASE)
    again, (gone, _) = rewritten(
        deck, SetField("MAT1", 5, "E", 2.05e5), SetField("MAT1", 5, "RHO", 7.8e-9),
        SetField("MAT1", 5, "GE", 0.01),
    )  # fmt: skip
    assert gone == ["MAT1,5,2.1+5,,.3,7.85-9"]
    assert again["MAT1"].block(2, 4, 0.0).tolist() == [[2.05e5, 0, 0.3, 7.8e-9]]
    assert again["MAT1"].real(0, 8) == 0.01


@pytest.fixture
def nested(tmp_path):
    """main -> parts/a.bdf -> deep/b.bdf, and c.bdf."""
    home = tmp_path / "home"
    (home / "parts" / "deep").mkdir(parents=True)
    grids, rest = PLATE.split("CQUAD4")
    (home / "parts" / "deep" / "b.bdf").write_text("CQUAD4" + rest)
    (home / "parts" / "a.bdf").write_text("$ a\nINCLUDE 'deep/b.bdf'\n")
    (home / "c.bdf").write_text(grids)
    main = home / "main.bdf"
    main.write_text(CASE + "BEGIN BULK\nEIGRL,1\nINCLUDE 'parts/a.bdf'\nINCLUDE 'c.bdf'\nENDDATA\n")
    return main


def test_includes_are_written_only_where_they_change(nested, tmp_path):
    deck = read_deck(nested)
    out = tmp_path / "out" / "main.bdf"
    before = {p: p.read_bytes() for p in nested.parent.rglob("*.bdf")}
    write_deck(deck, out, [SetField("PSHELL", 101, "T", 3.0)])
    written = {p.relative_to(out.parent).as_posix() for p in out.parent.rglob("*.bdf")}
    assert written == {"main.bdf", "parts/a.bdf", "parts/deep/b.bdf"}
    again = read_deck(out)
    assert again["PSHELL"].real(0, 3) == 3.0
    assert len(again["GRID"]) == 4  # c.bdf is found where it was
    assert (out.parent / "parts/a.bdf").read_bytes() == before[nested.parent / "parts/a.bdf"]
    assert before == {p: p.read_bytes() for p in before}


def test_an_include_is_not_written_through_a_link(nested, tmp_path):
    """Where its folder is a link to another, nothing is written there."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "parts").symlink_to(tmp_path / "mine")
    change = [SetField("PSHELL", 101, "T", 3.0)]
    said = "is a link or no folder"
    says(said, write_deck, read_deck(nested), tmp_path / "out/x.bdf", change)
    assert not list((tmp_path / "mine").rglob("*"))


def test_main_alone_changes(nested, tmp_path):
    out = tmp_path / "out" / "main.bdf"
    write_deck(read_deck(nested), out, [SetField("EIGRL", 1, "ND", 20)])
    assert [p.name for p in out.parent.rglob("*.bdf")] == ["main.bdf"]
    assert len(read_deck(out)["GRID"]) == 4


def test_beside_the_original(nested):
    """In the same folder a changed include takes another name, and its statement follows."""
    before = {p: p.read_bytes() for p in nested.parent.rglob("*.bdf")}
    change = [SetField("GRID", 2, "X1", 9.0)]
    out = write_deck(read_deck(nested), nested.with_name("new.bdf"), change)
    assert before == {p: p.read_bytes() for p in before}
    again = read_deck(out)
    assert again["GRID"].reals(3).tolist() == [0, 9, 10, 0]
    assert len(again["PSHELL"]) == 1
    says("choose another name", write_deck, again, out, [])


def test_what_does_not_exist(bulk):
    deck = bulk(PLATE + "FORCE,1,1,,1.,1.\nFORCE,1,2,,1.,1.\n")
    out = deck.path.parent / "x.bdf"
    for change, said in (
        (SetField("PSHELL", 7, "T", 1.0), "has no PSHELL 7; there are 101"),
        (SetField("PSHELL", 101, "THICK", 1.0), "PSHELL has no field 'THICK'; there are PID, MID1"),
        (Delete("CTRIA3", 7), "has no CTRIA3 7; there are none at all"),
        (SetField("FORCE", 1, "F", 2.0), "several FORCE 1"),
    ):
        says(said, write_deck, deck, out, [change])
    assert not out.exists()


@real_decks()
def test_real_decks_come_back(path, tmp_path):
    """Unchanged: the same bytes. All grids moved by 1e-3: every grid, and nothing else, differs."""
    deck = read_real(path)
    if len(deck.sources) == 1:
        assert write_deck(deck, tmp_path / "same", []).read_bytes() == path.read_bytes()
    grid = deck["GRID"]
    wanted = np.round(grid.block(3, 3, 0.0) + 1e-3, 6)
    change = SetColumns("GRID", grid.integers(1), ("X1", "X2", "X3"), wanted)
    again = read_real(write_deck(deck, tmp_path / "new" / path.name, [change]))
    np.testing.assert_allclose(again["GRID"].block(3, 3, 0.0), wanted, rtol=1e-6)
    for name, cards in deck.cards.items():
        other = [k for k in range(1, cards.width() + 1) if name != "GRID" or k not in (3, 4, 5)]
        for k in other[:40]:
            assert np.array_equal(cards.words(k), again[name].words(k))


def test_ten_times_the_thicknesses_are_ten_times_the_work(tmp_path, work):
    """Quadrilaterals with four new corner thicknesses each; the time is linear in their number."""

    def changed(n):
        quads = "".join(f"CQUAD4  {k + 1:8}{1:8}{1:8}{2:8}{3:8}{4:8}\n" for k in range(n))
        (tmp_path / "large.bdf").write_text(quads)
        deck = read_deck(tmp_path / "large.bdf")
        t = np.random.default_rng(0).uniform(0.5, 1.5, (n, 4))
        change = SetColumns("CQUAD4", np.arange(n) + 1, ("T1", "T2", "T3", "T4"), t)
        steps = work(lambda: write_deck(deck, tmp_path / "new.bdf", [change]))
        again = read_deck(tmp_path / "new.bdf")
        np.testing.assert_allclose(again["CQUAD4"].block(11, 4), t, rtol=1e-6)
        return steps

    assert changed(1000) <= 10 * changed(100)


def test_a_folder_the_deck_is_moved_to_decides_names_and_ways(tmp_path):
    """Written elsewhere and moved home, where the original is: nothing original is replaced."""
    home, scratch = tmp_path / "case", tmp_path / "case" / ".scratch"
    scratch.mkdir(parents=True)
    (home / "grids.inc").write_text("GRID,1,,0.,0.,0.\n")
    (home / "rest.inc").write_text("GRID,2,,1.,0.,0.\n")
    (home / "d.bdf").write_text("BEGIN BULK\nINCLUDE 'grids.inc'\nINCLUDE 'rest.inc'\nENDDATA\n")
    deck = read_deck(home / "d.bdf")
    write_deck(deck, scratch / "updated.bdf", [SetField("GRID", 1, "X1", 5.0)], home)
    for path in list(scratch.iterdir()):
        assert path.name not in ("d.bdf", "grids.inc", "rest.inc")
        path.rename(home / path.name)
    moved = read_deck(home / "updated.bdf")
    assert moved["GRID"].block(3, 1)[:, 0].tolist() == [5.0, 1.0]
    assert read_deck(home / "d.bdf")["GRID"].block(3, 1)[:, 0].tolist() == [0.0, 1.0]
    change = [SetField("GRID", 1, "X1", 5.0)]
    says("is a file the deck was read from", write_deck, deck, scratch / "d.bdf", change, home)


def test_more_lines_than_the_deck_has_go_to_a_file_of_their_own(bulk):
    """The deck includes them, keeps its own lines and is read as if they stood in it."""
    deck = bulk(PLATE, before=CASE)
    springs = [["CELAS2", 1000 + k, 5.0 + k, 1, 1 + k % 3] for k in range(200)]
    few, many = Add(springs[:1], "a spring"), Add(springs, "many springs")
    path = write_deck(deck, deck.path.parent / "out" / "few.bdf", [few])
    assert "CELAS2" in path.read_text()
    assert [p.name for p in path.parent.iterdir()] == ["few.bdf"]
    found, (gone, fresh) = rewritten(deck, many, name="many.bdf")
    assert not gone
    assert fresh == [
        "$ many springs",
        "$ 201 lines were added, more than this deck has; they are in many_added.bdf",
        "INCLUDE 'many_added.bdf'",
    ]
    assert assembly(found).springs.value.tolist() == [5.0 + k for k in range(200)]
    again = write_deck(found, found.path.parent / "many.2.bdf", [many])  # nothing read is replaced
    assert len(read_deck(again)["CELAS2"].words(1)) == 400
