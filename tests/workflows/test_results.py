"""Every result explains itself: in words, drawn, saved as its command does, in a notebook."""

import json
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

import chladni
from chladni.errors import ChladniError
from chladni.report.diagnosis_json import read_diagnosis
from chladni.report.result_views import _PAGES
from chladni.results import Result, _views, full_name
from chladni.workflows.diagnosis_result import DiagnosisResult


def with_own_modes(case):
    """The model against the shapes it wrote itself."""
    with TemporaryDirectory() as folder:
        own = chladni.modes(case, 12).save(Path(folder) / "own")
        return chladni.other_modes(case, own / "modes.unv")


MADE = {  # (file of the result, a picture): call
    "modes": ("modes.json", "modes", lambda case: chladni.modes(case, 8)),
    "other modes": ("correlation.json", "mac", lambda case: with_own_modes(case)),
    "frf": ("frf.npz", "", lambda case: chladni.frf(case)),
    "correlate": ("correlation.json", "mac", lambda case: chladni.correlate(case)),
    "identify": ("identified.json", "stabilisation", lambda case: chladni.identify(case)),
    "test": ("test.json", "frf_grid", lambda case: chladni.evaluate_recordings(case)),
    "check": ("check.json", "sensors", lambda case: chladni.check(case)),
    "plan": (
        "plan.json",
        "sensors",
        lambda case: chladni.plan(case, chladni.PlanSettings(sensors=6, modes=4, draws=0)),
    ),
    "study": (
        "study.json",
        "",
        lambda case: chladni.study(case, ["t=90%:110%"], chladni.StudySettings(samples=4, modes=3)),
    ),
}


def subclasses(kind: type) -> set[type]:
    return {kind, *(s for one in kind.__subclasses__() for s in subclasses(one))}


def test_every_type_of_result_has_a_view():
    """No result can be added that prints as a heap of arrays; a package brings its own views."""
    assert all(hasattr(chladni, name) for name in chladni.__all__)  # loads the packages
    paged = {f"chladni.workflows.{name}" for name in _PAGES}
    for name in paged:
        import_module(name.rpartition(".")[0])
    assert set(_views) == {full_name(kind) for kind in subclasses(Result) - {Result}}
    packages = {name: name.split(".")[0] for name in _views}
    own = {name for name, package in packages.items() if package == "chladni"}
    assert own == {*paged, full_name(DiagnosisResult)}
    others = sorted(package for package in packages.values() if package != "chladni")
    assert others == ["chladni_bench", "chladni_contract", "chladni_planning", "chladni_studies"]


@pytest.mark.parametrize("command", MADE)
def test_a_result_explains_itself(case, tmp_path, command):
    name, picture, call = MADE[command]
    found = call(case)
    first = found.summary().splitlines()[0]
    assert first in repr(found)
    assert len(repr(found)) < 400
    html = found._repr_html_()
    assert 'sandbox=""' in html, "a notebook runs none of its scripts"
    assert first[:40] in html
    assert found.plot(picture).png.startswith(b"\x89PNG")
    place = found.save(tmp_path / "out")
    assert {name, "report.html", "run.json"} <= {p.name for p in place.iterdir()}
    assert first[:40] in (place / "report.html").read_text()


def test_a_result_replaces_that_of_its_own_command_alone(case, tmp_path):
    """And a picture it has not is named with those it has."""
    found = chladni.modes(case, 7)
    place = found.save(tmp_path / "out")
    found.save(place)
    with pytest.raises(ChladniError, match="has the results of chladni"):
        chladni.correlate(case).save(place)
    with pytest.raises(ChladniError, match=r"no picture 'nothing'; .*there are \w+"):
        found.plot("nothing")


def test_commands_count_the_same_modes_of_a_recording(case, diagnosed):
    identified = chladni.identify(case).recordings[0]
    count = int(identified.firm.sum())
    compared = chladni.correlate(case)
    assert len(compared.f_test) == count
    for checks in (identified.screening.checks, compared.screening.checks):
        (lines,) = (c.result for c in checks if c.name == "lines per half-bandwidth")
        assert f"of {count} modes" in lines
    said = f" {count} modes identified between 20 and 170 Hz"
    assert sum(said in note for note in diagnosed.notes) == 1


def test_a_diagnosis_is_saved_as_its_command_does(diagnosed, tmp_path):
    place = diagnosed.save(tmp_path / "out")
    names = {p.name for p in place.iterdir()}
    assert {"diagnosis.json", "updated.bdf", "report.html"} <= names
    found = json.loads((place / "diagnosis.json").read_text())
    assert found["verdict"] == diagnosed.verdict
    first, *rest = diagnosed.summary().splitlines()
    assert diagnosed.effects[0].name in first
    assert any("kg" in line for line in rest)
    assert diagnosed.plot("where").png != diagnosed.plot("frequencies").png


def test_a_result_of_a_file_says_that_it_holds_no_structure(diagnosed, tmp_path):
    read = read_diagnosis(diagnosed.save(tmp_path / "out"))
    assert read.summary().splitlines()[0] == diagnosed.summary().splitlines()[0]
    for ask in (read.plot, lambda: read.save(tmp_path / "again")):
        with pytest.raises(ChladniError, match="was read from a file"):
            ask()


def reached(value, depth):
    """All dataclasses within a value, so many fields deep."""
    if isinstance(value, tuple | list):
        for one in value[:2]:
            yield from reached(one, depth)
    elif is_dataclass(value) and not isinstance(value, type):
        yield value
        for held in fields(value) if depth else ():
            yield from reached(getattr(value, held.name), depth - 1)


def test_every_object_fits_on_a_screen(case, diagnosed):
    """A notebook shows its text, in place of all numbers of a deck."""
    model, found = chladni.load(case.assembly), chladni.correlate(case)
    for one in (case, model, found, found.test, chladni.modes(model, 8), diagnosed):
        for each in reached(one, 3):
            assert len(repr(each)) <= 2000, type(each)
    assert "(450, 6, 1) complex128" in repr(case.frfs[0])
