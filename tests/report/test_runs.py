"""The list of runs and the comparison of two, on folders as the commands write them."""

import json
import os

import numpy as np
import pytest
from tests.builders.commands import ran, refused

from chladni.cli.run import place_of
from chladni.dynamics.frf import FRF
from chladni.output import run_folder
from chladni.report.blocks import Drawing, Section
from chladni.report.drawings import drawings_of
from chladni.report.frf_charts import responses
from chladni.report.page import write_sections
from chladni.report.run_comparison import overlaid
from chladni.report.run_list import finished_run, finished_runs
from chladni.view import charts

EVIL = '<img src=x onerror="hit()">'


def frf(channels=2, gain=1.0):
    f = np.linspace(10, 200, 50)
    H = gain / (40.0**2 - f**2 + 0.8j * f)
    outputs = tuple(f"{k}:+Z" for k in range(channels))
    return FRF(np.tile(H[:, None, None], (1, channels, 1)), f, outputs, ("1:+Z",))


def made(place, command, source=None, lead="", drawn=(), **files):
    """A run of a command with its page and JSON files."""
    with run_folder(place, command, [source] if source else []) as part:
        write_sections(part / "report.html", command, [Section("s", drawn)], lead=lead)
        for name, content in files.items():
            (part / f"{name}.json").write_text(json.dumps(content))
    return place


@pytest.fixture
def runs(tmp_path):
    """A diagnosis, a correlation, a mode analysis of a hostile name, and what is none of ours."""
    root = tmp_path / "runs"
    held = {"held_out": {"Q_nominal": 0.3, "Q_calibrated": 0.2, "Q_with_effect": 0.02}}
    effect = {"name": "point-mass", "claim": "", "parameters": [], "where": {"text": "at 7"}}
    found = {"verdict": "missing physics", "effects": [effect], "fit": held, "alternatives": [{}]}
    found["alternatives"] = [{"name": "crack", "log_evidence": -1.0, "why_not": ""}]
    made(root / "d", "diagnose", tmp_path / "bracket" / "case.toml", diagnosis=found)
    made(
        root / "deep" / "c",
        "correlate",
        tmp_path / "plate.bdf",
        "c",
        correlation={"Q": {"mean": 3}},
    )
    made(root / EVIL, "modes", lead=EVIL, modes={"mass_kg": 2.0})
    (root / "theirs").mkdir()
    (root / "theirs" / "run.json").write_text('{"command": "modes", "files": []}')
    (root / "broken").mkdir()
    (root / "broken" / "run.json").write_text("[" * 100_000)
    (root / "linked").symlink_to(root / "d")
    return root


def test_every_run_below_a_folder_is_found_once(runs):
    """Its command, case and numbers; no folder of others, and nothing behind a link."""
    seen = {run.command: run for run in finished_runs(runs)}
    assert sorted(seen) == ["correlate", "diagnose", "modes"]
    assert seen["diagnose"].source == "bracket"
    assert seen["diagnose"].q() == ("held-out data", 0.3, 0.02)
    assert seen["diagnose"].lead.startswith("The model lacks point-mass, at 7")
    assert seen["correlate"].source == "plate.bdf"
    assert seen["correlate"].q() == ("all data", 3, None)
    assert finished_run(runs / "theirs") is None


def test_cases_of_the_bench_are_told_apart(tmp_path):
    """The bench calls every case ``case``; its own folder says which."""
    made(tmp_path / "run", "diagnose", tmp_path / "article_B" / "case" / "case.toml")
    assert finished_run(tmp_path / "run").source == "article_B/case"
    (tmp_path / "article_B" / "case").mkdir(parents=True)
    assert place_of("diagnose", tmp_path / "article_B" / "case", None).name == (
        "diagnose-article_B-case"
    )


def test_the_list_is_written_again_and_hostile_names_are_text(runs):
    for _ in range(2):  # its own files are no run
        assert "3 runs" in ran("index", runs).stdout
    text = (runs / "index.html").read_text()
    assert EVIL not in text
    assert "&lt;img src=x" in text
    assert 'href="./deep/c/report.html"' in text
    assert "-93 %" in text  # from the given deck, not from the calibrated one


@pytest.mark.parametrize("words", [("index", "empty"), ("compare", "empty", "empty")])
def test_a_folder_without_runs_is_refused(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    assert "run.json" in refused(*words, "--out", tmp_path / "out")
    assert not list((tmp_path / "empty").iterdir())


def test_a_misspelt_run_is_compared_with_those_beside_it(runs, tmp_path):
    said = refused("compare", runs / "d", runs / "deep" / "cc", "--out", tmp_path / "out")
    assert "did you mean 'c'?" in said


def test_two_runs_are_compared(runs, tmp_path):
    """Results side by side; of two commands only the numbers that both have."""
    out = tmp_path / "out"
    said = ran("compare", runs / "d", runs / "deep" / "c", "--out", out).stdout
    assert "d and c come to different results" in said
    assert "0.2" in said
    for folder in (runs / "d", runs / "deep" / "c"):
        link = f"./{os.path.relpath(folder / 'report.html', out)}"
        assert f'href="{link}"' in (out / "report.html").read_text()
    ran("compare", runs / EVIL, runs / EVIL, "--out", out)
    assert EVIL not in (out / "report.html").read_text()


def page_content(tmp_path, chart):
    path = write_sections(tmp_path / "p.html", "t", [Section("s", [Drawing("c", chart)])])
    return drawings_of(path)[1][0].content


def test_charts_of_the_same_quantity_become_one(tmp_path):
    """Channels that both have, with the curves of both; the test once; colours that differ."""
    one, other = (
        page_content(tmp_path, responses({"test": frf(n), "after": frf(n, gain)})[0])
        for n, gain in ((3, 2.0), (2, 3.0))
    )
    both = overlaid(one, other, ("A", "B"))
    assert [o["text"] for o in both["choices"][0]["options"]] == [
        "0:+Z from 1:+Z",
        "1:+Z from 1:+Z",
    ]
    assert [t["name"] for t in both["data"]] == [
        "test", "after (A)", "test", "after (A)", "after (B)", "after (B)"
    ]  # fmt: skip
    assert [o["data"] for o in both["choices"][0]["options"]][1][4:] == [
        other["choices"][0]["options"][1]["data"][k] for k in (1, 3)
    ]
    assert both["data"][4]["line"]["color"] != both["data"][1]["line"]["color"]


def test_other_quantities_stay_apart(tmp_path):
    test, model = np.array([40.0, 50.0]), np.array([41.0, 50.0])
    ladder = page_content(tmp_path, charts.ladder(test, {"model": model}))
    steps = page_content(tmp_path, charts.steps({"fitted": {"a": 1.0, "b": 0.5}}))
    other = page_content(tmp_path, charts.ladder(test + 1, {"model": model}))
    matrix = page_content(tmp_path, charts.mac(test, {"model": (np.eye(2), model, [])}))
    assert overlaid(ladder, steps, ("A", "B")) is None
    assert overlaid(ladder, other, ("A", "B")) is None  # other modes
    assert overlaid(matrix, matrix, ("A", "B")) is None
    assert (
        overlaid(ladder, ladder, ("A", EVIL))["data"][1]["name"]
        == 'model (&lt;img src=x onerror="hit()"&gt;)'
    )
