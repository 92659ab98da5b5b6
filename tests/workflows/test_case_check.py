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

import chladni
from chladni.output import plain
from chladni.report.check_page import check_page
from chladni.report.result_json import to_json
from chladni.workflows.case_check import CaseFinding
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


def test_a_good_case_is_not_blamed(case):
    found = chladni.check(case)
    assert not found.findings
    assert found.frequency[0] == pytest.approx(chladni.modes(case, 7).modal.frequency[6], rel=1e-6)
    assert [d.label for d in found.dofs if d.role == "output"] == list(case.outputs.labels)


def test_what_the_command_writes(copied, tmp_path):
    out = tmp_path / "out"
    with coarse_pictures():
        done = ran("check", copied, "--out", out)
    assert "Nothing looks wrong" in done.output
    case = chladni.load_case(copied)
    assert json.loads((out / "check.json").read_text()) == plain(to_json(chladni.check(case)))
    with Image.open(out / "sensors.png") as picture:
        assert np.asarray(picture.convert("L")).std() > 5
    page = (out / "report.html").read_text(encoding="utf-8")
    for word in ("sensors.png", "Data and settings in use", *case.outputs.labels):
        assert word in page


def test_the_page_counts_what_it_found(case, tmp_path):
    checked = chladni.check(replace(case, recordings=()))
    for faults, rest, said in (
        (1, 0, "1 thing is to be corrected first."),
        (2, 1, "2 things are to be corrected first, 1 thing is to be checked."),
        (0, 2, "2 things are to be checked."),
        (0, 0, "Nothing looks wrong with the case."),
    ):
        found = (CaseFinding("a", "b", True),) * faults + (CaseFinding("c", "d"),) * rest
        assert check_page(tmp_path, case, replace(checked, findings=found)).lead == said


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
        text = (copied / "case.toml").read_text()
        mass = next(line for line in text.splitlines() if line.startswith("mass"))
        old, new = mass, f"mass = {1e3 * float(mass.split('=')[1]):.4g}"
    rewritten(copied, old, new)
    done = ran("check", copied, "--out", tmp_path / "out", code=3)
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Fault" in (tmp_path / "out/report.html").read_text(encoding="utf-8")


def test_an_odd_material_is_the_users_own(case):
    """A modulus that is known in no system says nothing of the units."""
    parts = tuple(
        p.with_section(**{
            side: replace(m, E=m.E * 1e-4)
            for side in ("membrane", "bending", "shear")
            if (m := getattr(p.section, side)) is not None
        })
        for p in case.assembly.parts
    )  # fmt: skip
    odd = replace(case, assembly=case.assembly.with_parts(parts))
    refuse_other_units(odd)
    (finding,) = (f for f in chladni.check(odd).findings if "usual in no unit" in f.text)
    assert not finding.fault


def test_a_mass_that_is_far_off_is_worth_a_look(case):
    heavier = replace(case, setup=replace(case.setup, mass=1.3 * case.setup.mass))
    (finding,) = chladni.check(heavier).findings
    assert "weighs" in finding.text
    assert not finding.fault


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
    """What is said stays; any other command has all lines."""
    correlation, lines = import_module("chladni.workflows.correlate"), []
    plainly = correlation.identified

    def counted(*words, use, **more):
        lines.append(int(use.sum()))
        return plainly(*words, use=use, **more)

    monkeypatch.setattr(correlation, "identified", counted)
    chladni.correlate(case)
    monkeypatch.setattr("chladni.ema.screening_lines.LONG", 0)
    assert not chladni.check(case).findings
    chladni.correlate(case)
    assert lines[0] == lines[2] > lines[1] > 0
