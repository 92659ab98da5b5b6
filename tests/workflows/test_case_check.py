"""A case looked over: what is wrong is said before minutes are spent, and nothing else is."""

import json
import shutil
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from PIL import Image
from tests.builders.commands import ran
from tests.builders.quick_runs import coarse_pictures
from tests.builders.structures import stiffer

import chladni
from chladni.errors import ChladniError
from chladni.fem.energy import mass_properties
from chladni.io.uff.uff_function import Axis, FunctionSet
from chladni.io.uff.write_shapes import write_shapes
from chladni.io.uff.write_uff import binary_set, head_records, write_sets
from chladni.output import plain
from chladni.report.check_page import as_page
from chladni.results import to_json
from chladni.workflows.case_check import CaseFinding
from chladni.workflows.output_only import with_natural_frequencies
from chladni.workflows.ready_case import ready
from chladni.workflows.states import each_state
from chladni.workflows.unit_check import refuse_other_units


@pytest.fixture
def copied(folder, tmp_path):
    """The plate's case, to be spoilt."""
    place = tmp_path / "case"
    shutil.copytree(folder, place)
    return place


def rewritten(place, old, new):
    text = (place / "case.toml").read_text()
    assert old in text
    (place / "case.toml").write_text(text.replace(old, new))
    return place


def weighed(place):
    """The line of case.toml that says the mass."""
    return next(x for x in (place / "case.toml").read_text().splitlines() if x.startswith("mass"))


def test_a_good_case_is_not_blamed(case):
    found = chladni.check(case)
    assert not found.findings
    assert found.frequency[0] == pytest.approx(chladni.modes(case, 7).modal.frequency[6], rel=1e-6)
    assert [d.label for d in found.dofs if d.role == "output"] == list(case.outputs.labels)


def test_what_the_command_writes(copied, tmp_path):
    out = tmp_path / "out"
    with coarse_pictures():
        done = ran("check", copied, "--pictures", "--out", out)
    assert "Nothing looks wrong" in done.output
    case = chladni.load_case(copied)
    assert json.loads((out / "check.json").read_text()) == plain(to_json(chladni.check(case)))
    with Image.open(out / "sensors.png") as picture:
        assert np.asarray(picture.convert("L")).std() > 5
    page = (out / "report.html").read_text(encoding="utf-8")
    for word in ("sensors.png", "Data and settings in use", *case.outputs.labels):
        assert word in page


def test_the_page_counts_what_it_found(case, copied):
    checked = chladni.check(replace(case, recordings=()))
    for faults, rest, said in (
        (1, 0, "1 thing is to be corrected first."),
        (2, 1, "2 things are to be corrected first, 1 thing is to be checked."),
        (0, 2, "2 things are to be checked."),
        (0, 0, "Nothing looks wrong with the case."),
    ):
        found = (CaseFinding("a", "b", True),) * faults + (CaseFinding("c", "d"),) * rest
        assert as_page(copied, replace(checked, findings=found)).lead == said


def test_words_nobody_reads_are_told_by_command(copied):
    rewritten(copied, "[band]", "hangers = [1]\n[band]")
    found = chladni.check(chladni.load_case(copied))
    assert any("hangers" in said for said in found.unused["correlate"])
    assert not any("hangers" in said for said in found.unused["diagnose"])


FAULTS = {  # how a case is spoilt: what must be said
    "grams": ("mass = 0.", "mass = 1", "is in kg"),
    "kilohertz": ("fit = [20.0, 170.0]", "fit = [15.0, 16.0]", "the band ends at 16 Hz"),
}


@pytest.mark.parametrize("spoilt", FAULTS)
def test_what_cannot_be_right_is_exit_3_and_said(copied, tmp_path, spoilt):
    old, new, said = FAULTS[spoilt]
    if spoilt == "grams":
        mass = weighed(copied)
        old, new = mass, f"mass = {1e3 * float(mass.split('=')[1]):.4g}"
    rewritten(copied, old, new)
    done = ran("check", copied, "--out", tmp_path / "out", code=3)
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Fault" in (tmp_path / "out/report.html").read_text(encoding="utf-8")


def test_an_odd_material_is_the_users_own(case):
    """A modulus that is known in no system says nothing of the units."""
    odd = replace(case, assembly=stiffer(case.assembly, 1e-4))
    refuse_other_units(odd)
    (finding,) = (f for f in chladni.check(odd).findings if "usual in no unit" in f.text)
    assert not finding.fault


def test_a_mass_that_is_far_off_is_worth_a_look(case):
    heavier = replace(case, setup=replace(case.setup, mass=1.3 * case.setup.mass))
    (finding,) = chladni.check(heavier).findings
    assert "weighs" in finding.text
    assert not finding.fault
    deck = mass_properties(heavier.assembly)[0]
    away = 100 * (heavier.setup.mass / deck - 1)
    assert dict(chladni.check(heavier).facts)["mass"].endswith(f"weighed ({away:+.2g} %)")


@pytest.mark.parametrize(
    ("right", "said"), [(True, "the table of sensors has"), (False, "0 of 1 row is used")]
)
def test_a_label_that_is_mistyped_in_the_table_is_seen(copied, right, said):
    """Its row would be left out without a word: place, gain and mass of that sensor.

    A table of which no row is used stops the check.
    """
    first, *_ = chladni.load_case(copied).outputs.labels
    rows = "label,grid,mass\n99:+Z,1,0.002\n" + f"{first},1,0.002\n" * right
    (copied / "sensors.csv").write_text(rows)
    rewritten(copied, "[band]", 'sensors = "sensors.csv"\n[band]')
    case = chladni.load_case(copied)
    assert "1 row of the table of sensors is in no recording: 99:+Z" in case.notes
    (finding,) = (f for f in chladni.check(case).findings if "99:+Z" in f.text)
    assert finding.text.startswith(said)
    assert finding.fault != right


def test_places_off_the_mesh_and_double_ones(copied):
    rows = "label,grid,x,y,z,direction,role\n2:+Z,,0.0,0.04,0.009,+Z,output\n4:+Z,7,,,,+Z,output\n"
    (copied / "sensors.csv").write_text(rows)
    rewritten(copied, "[band]", 'sensors = "sensors.csv"\n[band]')
    found = chladni.check(chladni.load_case(copied))
    off, double = found.findings
    assert "2:+Z by 9 mm" in off.text
    assert "4:+Z and 7:+Z are one place" in double.text
    assert np.isclose(max(d.off_mesh_m for d in found.dofs), 0.009)


def test_only_axes_that_differ_are_spoken_of():
    """Half along X that are along Z, half along Y as declared."""
    said = import_module("chladni.workflows.axes_check")._where_declared
    ways = np.eye(3)[[0, 1, 0, 1]]
    assert said(ways, ways[:, [2, 1, 0]]) == "along Z where X is declared"
    assert (
        said(ways, -ways[:, [1, 0, 2]])
        == "along Y where X is declared, along X where Y is declared"
    )


def test_a_dead_channel_is_named(copied):
    """It is left out, so nothing downstream stumbles over it; that is said, and where to look."""
    held = dict(np.load(copied / "frf.npz", allow_pickle=False))
    held["values"][:, 2] = 0.0
    np.savez(copied / "frf.npz", **held)
    dead = str(held["outputs"][2])
    found = chladni.check(chladni.load_case(copied))
    (said,) = (f for f in found.findings if dead in f.text)
    assert "zero throughout and left out" in said.text
    assert dead not in [d.label for d in found.dofs if d.role == "output"]


def test_a_case_without_a_recording_is_told_what_that_means(copied):
    """It may be planned and drawn; what compares needs a recording."""
    text = (copied / "case.toml").read_text()
    (copied / "case.toml").write_text(text[: text.index("[test]")])
    facts = dict(chladni.check(chladni.load_case(copied)).facts)
    assert "all commands need one except modes" in facts["recording"]


def test_of_a_long_recording_few_lines_are_identified(case, monkeypatch):
    """What is said stays; a fit has all lines."""
    preparation, lines = import_module("chladni.search.preparation"), []
    plainly = preparation.identify

    def counted(*words, use, **more):
        lines.append(int(use.sum()))
        return plainly(*words, use=use, **more)

    monkeypatch.setattr(preparation, "identify", counted)
    ready(case, diagnosing=True)
    for name, few in (("LONG", 0), ("BETWEEN", 100)):
        monkeypatch.setattr(f"chladni.ema.screening_lines.{name}", few)
    assert not chladni.check(case).findings
    ready(case, diagnosing=True)
    assert lines[0] == lines[2] > lines[1] > 0


def with_recording(place, name, write):
    write(place / name)
    return rewritten(place, "frf.npz", name)


def poles(path):
    path.write_text("mode,frequency_hz\n1,40.5\n2,77.0\n3,90.0\n")


def shapes(path):
    write_shapes(path, np.array([40.5, 77.0, 90.0]), np.ones((1, 3, 3)), np.array([2]),
                 np.zeros((1, 3)))  # fmt: skip


def noise(path):
    rng = np.random.default_rng(3)
    values = rng.normal(size=(400, 2, 1)) + 1j * rng.normal(size=(400, 2, 1))
    np.savez(path, frequency_hz=np.linspace(15, 200, 400), values=values,
             outputs=["4:+Z", "7:+Z"], inputs=["2:+Z"], quantity="accelerance")  # fmt: skip


def steady(path):
    """A motion without a force and without a resonance."""
    np.savez(path, rate=500.0, acceleration=np.random.default_rng(4).normal(size=4096))


def spectra(path):
    """A coherence and nothing else."""
    f = np.linspace(15, 200, 5)
    made = FunctionSet(
        function=6, response=(4, 3), reference=(2, 3), due=5, x=f, y=f / f.max(),
        abscissa=Axis(18, "Hz"), ordinate=Axis(), denominator=Axis(),
    )  # fmt: skip
    head = head_records(made, "x", even=False)
    write_sets(path, {}, "x", [binary_set(head, np.column_stack([f, made.y]).tobytes())])


def springs_alone(place):
    block = "\n".join(f"GRID,{k},,{0.3 * k},,,,23456" for k in range(1, 9))
    cards = "".join(
        f"CONM2,{100 + k},{k},,0.1\nCELAS2,{k},1.+4,{k},1,{k + 1},1\n" for k in range(1, 8)
    )
    (place / "plate.bdf").write_text(f"BEGIN BULK\n{block}\n{cards}ENDDATA\n")
    return with_recording(rewritten(place, weighed(place), ""), "poles.csv", poles)


def no_line(place):
    return rewritten(place, "[band]", "[band]\nexclude = [[20.0, 169.9]]")


ASKED = {  # how a case is changed: the refusal of diagnose, "" for none
    "as it is": (lambda place: place, ""),
    "poles": (lambda place: with_recording(place, "poles.csv", poles), ""),
    "mode shapes alone": (lambda place: with_recording(place, "modes.unv", shapes), ""),
    "no line": (no_line, "no mode is above the noise"),
    "a steady motion": (
        lambda place: with_recording(place, "steady.npz", steady), "no natural frequency"),
    "neither FRFs nor poles": (
        lambda place: with_recording(place, "coherence.uff", spectra), "neither FRFs nor"),
    "springs alone": (springs_alone, "no shells, beams or solids"),
}  # fmt: skip


@pytest.mark.parametrize("name", ASKED)
def test_what_is_in_order_is_not_refused_before_a_fit(copied, tmp_path, name):
    """Check finds a fault where the preparation of diagnose refuses, and only there."""
    change, due = ASKED[name]
    place = change(copied)
    case, refused = chladni.load_case(place), ""
    found = chladni.check(case)
    try:
        for state in each_state(with_natural_frequencies(case)):
            ready(state, diagnosing=True)
    except ChladniError as error:
        refused = str(error)
    assert due in refused
    assert bool(refused) is bool(due)
    assert due in found.faults[0].text if due else not found.findings
    if not due:
        chladni.correlate(case)
    run = ran("check", place, "--out", tmp_path / "out", code=3 if due else 0)
    assert ("Nothing looks wrong" in run.output) is not bool(due)


DRAFTED = {
    "poles": "the case can be used",
    "noise": "not ready yet: ",
    "steady": "not ready yet: steady.npz: no natural frequency",
    "coherence": "not ready yet: the recordings have neither FRFs nor",
}


@pytest.mark.parametrize("name", DRAFTED)
def test_a_draft_says_usable_only_of_what_check_finds_in_order(copied, tmp_path, name):
    file, write = {"poles": ("poles.csv", poles), "noise": ("noise.npz", noise), "steady": (
        "steady.npz", steady), "coherence": ("coherence.uff", spectra)}[name]  # fmt: skip
    write(tmp_path / file)
    rows = "label,grid,role\n4:+Z,4,output\n7:+Z,7,output\n2:+Z,2,input\n"
    (tmp_path / "table.csv").write_text(rows)
    words = ["init", copied / "plate.bdf", tmp_path / file, "--units", "SI"]
    said = ran(*words, "--sensors", tmp_path / "table.csv", "--out", tmp_path / "out").output
    assert DRAFTED[name] in said
    assert ("can be used" in said) is (name == "poles")


def test_a_draft_of_springs_says_what_takes_them(copied, tmp_path):
    springs_alone(copied)
    words = ["init", copied / "plate.bdf", copied / "poles.csv", "--units", "SI"]
    said = ran(*words, "--out", tmp_path / "out").output
    assert "not ready yet: the deck has no shells, beams or solids" in said
    assert "calibrate and correlate accept any deck" in said


def test_every_state_is_asked(copied):
    """The recording of the second state holds nothing but noise."""
    held = dict(np.load(copied / "frf.npz"))
    rng = np.random.default_rng(3)
    held["values"] = rng.normal(size=held["values"].shape) * (1 + 1j)
    np.savez(copied / "noise.npz", **held)
    more = '[[recording]]\nfile = "{}"\nstate = "{}"\n'
    text = (copied / "case.toml").read_text()
    assert not chladni.check(copied).faults
    both = more.format("frf.npz", "bare") + more.format("noise.npz", "glued")
    (copied / "case.toml").write_text(text + both)
    assert chladni.check(copied).faults
