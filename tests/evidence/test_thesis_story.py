"""The thesis retold on two small sheets: chapters, what each one shows, an interrupted run."""

import csv
import json
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest

from chladni.dynamics.frf import FRF
from chladni.errors import FileError
from chladni.geometry.formed_mesh import FormedMesh
from chladni.io.nastran import write_assembly
from chladni.progress import silent
from chladni.report.blocks import Drawing, Facts, Items, Picture, Section, Table, Text
from chladni.units import units
from chladni_bench.sine_schedule import Stage
from chladni_evidence.recovery import panel
from chladni_evidence.thesis import retold, steps
from chladni_evidence.thesis_calibration import deviation_fit
from chladni_evidence.thesis_chapter import Chapter, ChapterStore, StoryStep
from chladni_evidence.thesis_corrections import MAPPED, STIFF
from chladni_evidence.thesis_desk import DECK, SENSORS, Desk, ThesisSpecimen
from chladni_evidence.thesis_model import with_drive_sensor
from chladni_evidence.thesis_scores import FIT, band_Q, scored_model

THINNER, GRIP = 0.94, 2e9  # thickness of the article over the gauge, E of its bead [Pa]
E, WRONG = 210e9, 1.15
SHORT = (Stage(10, 60, 60, 30), Stage(60, 310, 60, 80, share=0.7))
KINDS = ("Table 1:", "Table 2:", "Table 3:", "Table 6:", "Figure 28:", "Tables 7 and 8:",
         "Tables 9 and 10:", "Identifiability", "Table 11:", "Table 12:", "Table 13:", "Table 14:",
         "Figure 34:", "Table 15 and figure 35:", "Beyond the thesis")  # fmt: skip


def article():
    """Thinner sheets, and a bead that holds."""
    made = panel(0.05)
    k = made.part("glue")
    stiff = made.parts[k].with_section(material=replace(made.parts[k].section.material, E=GRIP))
    parts = tuple(stiff if n == k else p for n, p in enumerate(made.parts))
    thin = replace(made.shells, thickness=THINNER * made.shells.thickness)
    return replace(made, parts=parts, shells=thin)


def formed():
    made = article()
    names = {k + 1: p.name for k, p in enumerate(made.parts)}
    s = made.shells
    return FormedMesh(made.ids, made.points, s.nodes, s.part + 1, s.thickness, names)


def story(folder):
    """The panel with a short schedule and eight sensors."""
    specimen = ThesisSpecimen(
        lambda: panel(0.05), article, formed, lambda a: a.ids[[0, 8]].tolist(), "glue", ""
    )
    return Desk(folder, specimen, 3, SHORT, 0.5, 8, ("adhesive-stiffness", "weld-compliance"))


@pytest.fixture(scope="module")
def tested(tmp_path_factory):
    """The first chapters: model, plan, test, thickness, adhesive."""
    desk = story(tmp_path_factory.mktemp("chapters"))
    chapters = ChapterStore(desk.folder).run(steps(desk)[:5], lambda text: None, silent)
    return desk, chapters


def every_block(folder):
    picture = folder / "drawn.png"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n")
    return [
        Text(["a"]), Items(["b"]), Facts([("c", "d")]), Table(("e",), [("f",)], ("e",), "g"),
        Picture(picture, "h"),
    ]  # fmt: skip


def test_a_chapter_is_read_as_it_was_kept(tmp_path):
    """Every kind of block comes back, its picture from wherever the folder now lies."""
    store = ChapterStore(tmp_path)
    blocks = every_block(tmp_path)
    bytes_of = blocks[-1].path.read_bytes()
    live = Drawing("map", None, blocks[-1].caption, {"drawn": lambda at: at.write_bytes(bytes_of)})
    made = Chapter(
        "lead", (Section("title", [*blocks[:-1], live]),), {"x": np.array([1.0])}, (("f", "what"),)
    )
    kept = store.keep("one", made)
    assert kept == store.kept("one")
    assert [type(b) for b in kept.sections[0].blocks] == [type(b) for b in blocks]
    assert kept.sections[0].blocks[-1].path == tmp_path / "drawn.png"
    assert kept.numbers == {"x": [1.0]}
    assert kept.files == (("f", "what"),)


def test_an_interrupted_run_continues(tmp_path):
    """What was finished is not made again; what failed left nothing."""
    calls = []

    def work(name, fails=False):
        def made(progress):
            calls.append(name)
            if fails:
                raise KeyboardInterrupt
            return Chapter(name, (), {})

        return StoryStep(name, name, made)

    store = ChapterStore(tmp_path, {"size": 0.03})
    with pytest.raises(KeyboardInterrupt):
        store.run((work("a"), work("b", fails=True)), lambda text: None, silent)
    said = []
    store.run((work("a"), work("b")), said.append, silent)
    assert calls == ["a", "b", "b"]
    assert said == ["a (kept from an earlier run): a", "b: b"]
    other = ChapterStore(tmp_path, {"size": 0.02})
    with pytest.raises(FileError, match=r"holds chapters with size 0\.03, not 0\.02"):
        other.run((), lambda text: None, silent)


def test_a_sensor_stands_next_to_the_shaker():
    """Masses are those of the bench: 5 g each, and the part of the gauge beyond its crystal."""
    head = "label,grid,x,y,z,nx,ny,nz,role,mass\n"
    rows = "1:+Z,1,,,,0,0,1,output,0.004\n2:+Z,2,,,,0,0,1,output,0.004\n9:+Z,9,,,,0,0,1,input,0\n"
    found = list(csv.DictReader(StringIO(with_drive_sensor(head + rows))))
    seen = [(r["label"], r["role"], float(r["mass"])) for r in found]
    assert seen[:3] == [(f"{k}:+Z", "output", 0.005) for k in (1, 2, 9)]
    assert seen[3] == ("9:+Z", "input", pytest.approx(0.4 * 0.023))
    again = with_drive_sensor(head + rows.replace("9:+Z,9", "2:+Z,2"))
    assert [r["role"] for r in csv.DictReader(StringIO(again))].count("output") == 2


def test_Q_leaves_the_cords_out():
    """Lines of the cords' band change nothing; all others count alike."""
    f = np.array([15.0, 25.0, 30.0])
    H = FRF(np.ones((3, 1, 1), complex), f, ("1:+Z",), ("1:+Z",), "accelerance")
    other = replace(H, values=np.array([10.0, 1000.0, 1.0]).reshape(3, 1, 1) + 0j)
    assert band_Q(other, H, (10.0, 40.0)) == pytest.approx(0.5)


@pytest.mark.slow
def test_the_deck_is_that_of_table_1(tested):
    """Values are read back from the deck that was written; the plan sees all modes."""
    desk, chapters = tested
    modulus, nu, rho, t = chapters["model"].numbers["table_1"]["lower"][1:5]
    assert (float(modulus), float(nu), float(rho), float(t)) == (210, 0.3, 7850, 1.5)
    rank, states = chapters["plan"].numbers["table_2"]["rank"]
    assert rank == states
    conditions = chapters["plan"].numbers["table_2"]["conditions"]
    assert conditions == sorted(conditions)
    assert (desk.folder / SENSORS).is_file()
    assert len(desk.case(DECK, tested=False).outputs.labels) in (8, 9)


@pytest.mark.slow
def test_formed_thickness_changes_the_mass(tested):
    """The sheets become as thin as the forming simulation says; the deck is edited, not new."""
    _, chapters = tested
    before, after = chapters["mapping"].numbers["mapping"]["ours_kg"]
    assert after / before == pytest.approx(THINNER, abs=0.003)


@pytest.mark.slow
def test_the_articles_own_model_is_the_best(tested, tmp_path):
    """Mapped thickness and a stiff bead approach it; its Q is near that between two articles."""
    desk, chapters = tested
    write_assembly(article(), tmp_path / "article.bdf", units("mm-t-s"))
    best = scored_model(desk, "article", desk.deck(tmp_path / "article.bdf"))
    nominal = chapters["mapping"].numbers["scores"][0]
    stiff = chapters["adhesive"].numbers["stiff"]
    assert best.fit < stiff["fit"] < nominal["fit"]
    assert best.fit < 2 * chapters["mapping"].numbers["floor_Q"]
    assert np.nanmin(best.mac) > 0.9
    assert best.error < min(stiff["mean_frequency_error"], nominal["mean_frequency_error"])


@pytest.mark.slow
def test_only_what_changed_differs_in_the_decks(tested):
    """Mapping edits shells, the stiff bead one material."""
    desk, _ = tested
    mapped, stiff = ((desk.folder / name).read_text().splitlines() for name in (MAPPED, STIFF))
    changed = [(a, b) for a, b in zip(mapped, stiff, strict=True) if a != b]
    assert len(changed) == 1
    assert "MAT1" in changed[0][0]


@pytest.mark.slow
def test_the_deviation_fit_finds_a_wrong_modulus(tested, tmp_path):
    """The article's own model with E 15 % too high: the metric alone brings it back."""
    desk, _ = tested
    write_assembly(article(), tmp_path / "article.bdf", units("mm-t-s"))
    wrong = desk.deck(tmp_path / "article.bdf").variant(E={"lower": WRONG * E, "upper": WRONG * E})
    parts = ["lower", "upper"]
    free = [{"field": "E", "name": "E of sheets", "parts": parts}]
    found = deviation_fit(desk.case(wrong, band=FIT, parameters=free), silent)
    ((deck, fitted),) = found.values.values()
    assert deck == pytest.approx(WRONG * E)
    assert fitted == pytest.approx(E, rel=0.05)  # articles scatter by some per cent
    assert found.Q[1] < found.Q[0]
    made = found.assembly.parts[found.assembly.part("lower")].section
    assert made.membrane.E == pytest.approx(fitted)


@pytest.mark.slow
def test_the_whole_story(tmp_path):
    """Every table has its section, and the stiff bead is found."""
    desk = story(tmp_path / "chapters")
    retold(tmp_path, desk, {"seed": 3}, lambda text: None, silent)
    page = (tmp_path / "report.html").read_text()
    for title in KINDS:
        assert title in page, title
    found = json.loads((tmp_path / "thesis.json").read_text())
    assert found["hem"]["fit"] < found["calibrated"]["fit"]
    known = {p["name"]: p["frozen"] for p in found["identifiability"][STIFF]}
    assert known["E of screws"]
