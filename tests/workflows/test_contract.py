"""Every command is a workflow: what it writes is what the function returns to a notebook."""

import json
from importlib import import_module

import pytest
from tests.builders.commands import call

import chladni
from chladni.cli.app import commands
from chladni.output import plain
from chladni.report.diagnosis_json import read_diagnosis
from chladni.results import to_json
from chladni_planning import PlanSettings

WORKFLOW = {  # command: the function it calls
    "diagnose": "chladni.workflows.diagnose.diagnose",
    "demo": "chladni.workflows.diagnose.diagnose",
    "calibrate": "chladni.workflows.calibrate.calibrate",
    "correlate": "chladni.workflows.correlate.correlate",
    "test": "chladni.workflows.evaluation.evaluate_recordings",
    "bench": "chladni_bench.virtual_test",
    "identify": "chladni.workflows.identify.identify",
    "map": "chladni.workflows.map.map_formed",
    "modes": "chladni.workflows.modes.modes",
    "frf": "chladni.workflows.frf.frf",
    "plan": "chladni_planning.plan",
    "render": "chladni.workflows.loaded_model.load_model",
    "init": "chladni.workflows.case_draft.draft",
    "check": "chladni.workflows.case_check.check",
    "study": "chladni_studies.study",
    "blind": "chladni_evidence.blind_run.run",
    "check-effect": "chladni_contract.check_effect",
    "specimen": "chladni_specimens.tailgate_specimen",
    "report": "chladni.report.page.write_page",
    "index": "chladni.report.run_list.index_page",
    "compare": "chladni.report.run_comparison.compared_runs",
    "next": "chladni.search.next_measurement.advised",
    "convert": "chladni.workflows.loaded_model.load_model",
}


def written(command, name, folder, out, *options, code=0):
    done = call(command, folder, *options, "--out", out)
    assert done.exit_code == code, (done.output, done.exception)
    return json.loads((out / name).read_text())


@pytest.mark.parametrize("command", commands())
def test_every_command_has_a_function_that_a_notebook_can_call(command):
    module, _, name = WORKFLOW[command].rpartition(".")
    function = getattr(import_module(module), name)
    assert callable(function)
    assert function.__doc__
    if module == f"chladni.workflows.{command}" or command in ("bench", "plan", "study"):
        assert getattr(chladni, name) is function


@pytest.mark.parametrize(
    ("command", "name", "call", "options"),
    [
        ("correlate", "correlation.json", chladni.correlate, ()),
        ("identify", "identified.json", chladni.identify, ()),
        ("modes", "modes.json", lambda case: chladni.modes(case, 9), ("--count", "9")),
        (
            "plan",
            "plan.json",
            lambda case: chladni.plan(case, PlanSettings(sensors=8, modes=5, draws=0)),
            ("--sensors", "8", "--modes", "5", "--drawn", "0"),
        ),
    ],
)
def test_json_of_a_command_is_the_result_of_its_function(
    case, folder, tmp_path, command, name, call, options
):
    due = plain(to_json(call(case)))
    assert written(command, name, folder, tmp_path / "out", *options) == due


def test_a_diagnosis_compares_its_name_with_what_calibrate_answers(diagnosed, calibrated):
    assert diagnosed.effects
    for one, other in (
        (diagnosed.agreement.fitted, calibrated.agreement.fitted),
        (diagnosed.agreement.held_out, calibrated.agreement.held_out),
    ):
        assert one.calibrated == pytest.approx(other.calibrated, rel=0.01)


def test_json_of_a_calibration_is_the_result_of_its_function(calibrated, folder, tmp_path):
    """E, rho and t stand for a mass here and foretell worse, so that the exit code is 3."""
    found = written("calibrate", "diagnosis.json", folder, tmp_path / "out", code=3)
    assert "the calibration is compensating" in calibrated.distrust[0]
    assert any("predicts the held-out data worse" in said for said in calibrated.distrust)
    files = found.pop("files")
    assert (files["deck"], files["calibration"]) == ("calibrated.bdf", "calibration.json")
    due = plain(to_json(calibrated))
    due.pop("files")
    assert found == due
    own = json.loads((tmp_path / "out" / "calibration.json").read_text())
    assert {key: own[key] for key in due["study"]} == due["study"]
    assert read_diagnosis(tmp_path / "out").study == calibrated.study


def test_json_of_a_diagnosis_is_the_result_of_its_function(
    case, diagnosed, folder, tmp_path, monkeypatch
):
    """The command hands its case to the function and writes what comes back."""
    given = []
    monkeypatch.setattr(
        "chladni.cli.diagnose.diagnose", lambda case, progress: given.append(case) or diagnosed
    )
    found = written("diagnose", "diagnosis.json", folder, tmp_path / "out")
    assert [one.path for one in given] == [case.path]
    assert found.pop("files") == {
        "deck": "updated.bdf",
        "calibrated": "calibrated.bdf",
        "report": "report.html",
        "diagnosis": "diagnosis.json",
        "outlook": "outlook.npz",
        "posterior": "posterior.json",
    }
    due = plain(to_json(diagnosed))
    assert due.pop("files") == {}
    assert found == due


def test_progress_is_a_callback_that_only_rises(case):
    told = []
    chladni.correlate(case, progress=lambda what, share: told.append((what, share)))
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert all(what and 0 <= share <= 1 for what, share in told)
