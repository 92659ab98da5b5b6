"""An object at several levels: the verdict, the page, the updated deck; and the same if linear."""

import csv
import json
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from tests.builders.cases import changed_case
from tests.builders.commands import call, ran, refused
from tests.builders.recordings import noisy

import chladni
from chladni.dynamics.frf import FRF
from chladni.ema.describing_functions import micro_slip
from chladni.ema.level_table import LevelTable
from chladni.fem.energy import part_energies
from chladni.fem.modelled import modelled
from chladni.inference.result import NamedEffect
from chladni.io.nastran import read_deck, write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.output import plain
from chladni.report.diagnosis_json import diagnosis_json, from_json
from chladni.report.level_blocks import level_section
from chladni.report.typed_fields import made
from chladni.search.question import Prepared
from chladni.workflows.diagnosis_result import DiagnosisResult, UpdatedModels
from chladni.workflows.over_levels import over_levels
from chladni_specimens.plates import plate

LEVELS = (1.0, 4.0, 7.0, 10.0)
SENSORS = (2, 7, 18, 43)
F = np.arange(20, 75, 0.2)
SPRING = 5000.0  # [N/m], under each corner
CASE = """
[model]
deck = "plate.bdf"
units = "SI"
[band]
fit = [21.0, 74.0]
"""
RECORDING = '[[recording]]\nfile = "{}.npz"\nlevel = {}\ncontrol = "response"\n'


def kappa(level):
    """Of the springs, over their stiffness: micro-slip, as of joints that hold by friction."""
    return complex(micro_slip(np.array([level / LEVELS[-1]]), 0.08, 1.0)[0])


def sprung(folder, name, k):
    """The plate on a spring under each corner."""
    write_assembly(plate(0.3, 0.22, 6, 6, 1e-3), folder / name)
    springs = [f"CELAS2,{900 + g},{k},{g},3\n" for g in (1, 7, 43, 49)]
    text = (folder / name).read_text().replace("ENDDATA", f"{''.join(springs)}ENDDATA")
    (folder / name).write_text(text)
    return modelled(chladni.load(folder / name, "SI").assembly, 400.0)


def recorded(folder, level, joint, seed):
    """Accelerances with springs of K (1 + κ), 0.5 % damping beside what they lose, 1 % noise."""
    model = sprung(folder, "article.bdf", SPRING * (1 + joint.real))
    phi, f = model.modes.shapes, model.modes.frequency
    e = 1 - part_energies(model.structure, phi).sum(axis=0)
    loss = 0.01 + np.nan_to_num(e) * joint.imag / (1 + joint.real)
    rows = model.structure.rows(np.array([(g, 3) for g in SENSORS])) @ phi
    w, W = 2 * np.pi * f, 2 * np.pi * F[:, None]
    q = -(W**2) / (w**2 * (1 + 1j * loss) - W**2)
    H = np.einsum("or,fr,r->fo", rows, q, rows[0])[:, :, None]
    H = noisy(H, 0.01, seed)
    labels = tuple(f"{g}:+Z" for g in SENSORS)
    write_npz(folder / f"at_{level:g}.npz", FRF(H, F, labels, labels[:1], "accelerance"))


def a_case(folder, joints):
    sprung(folder, "plate.bdf", SPRING)
    for k, (level, joint) in enumerate(zip(LEVELS, joints, strict=True)):
        recorded(folder, level, joint, 550 + k)
    files = "".join(RECORDING.format(f"at_{level:g}", level) for level in LEVELS)
    (folder / "case.toml").write_text(CASE + files)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return a_case(tmp_path_factory.mktemp("slips"), [kappa(x) for x in LEVELS])


@pytest.fixture(scope="module")
def run(folder):
    """The command itself, and what it wrote."""
    out = folder / "out"
    done = call("diagnose", folder, "--pictures", "--out", out)
    assert done.exit_code in (0, 3), done.output
    return done, out, json.loads((out / "diagnosis.json").read_text())


def test_joints_that_slip_are_named_and_found_in_the_springs(run):
    done, _, found = run
    assert found["verdict"] == "nonlinear"
    (effect,) = found["effects"]
    assert effect["name"] == "joint-friction"
    assert "springs and bushes" in effect["where"]["text"]
    assert "joint-friction" in done.output
    assert any("for the fitted level alone" in note for note in found["notes"])


def test_linear_joints_at_each_level_are_those_that_were_measured(run):
    """K and GE of the springs, to first order in what they lose."""
    _, out, found = run
    assert {round(j["level"], 6) for j in found["joints"]} == set(LEVELS)
    for j in found["joints"]:
        due = kappa(j["level"])
        assert j["stiffness"] == pytest.approx((1 + due.real) / (1 + kappa(1.0).real), abs=0.012)
        assert j["loss"] == pytest.approx(due.imag / (1 + due.real), abs=0.006)
    text = (out / "updated.bdf").read_text()
    assert text.count("$ mode near") == len(found["joints"])
    assert len(read_deck(out / "updated.bdf").cards["CELAS2"]) == 4


def test_page_and_json_hold_the_levels(run):
    _, out, found = run
    moving = [t for t in found["levels"] if t["signature"] == "friction"]
    assert moving
    assert all(len(t["rows"]) == len(LEVELS) for t in moving)
    text = (out / "report.html").read_text()
    assert "predicted" in text
    assert "Joints at each level" in text
    assert list(out.glob("levels_*.png"))
    assert plain(diagnosis_json(from_json(found))) == found
    ran("report", out, "--out", out / "again")
    assert (out / "again" / "report.html").read_text().count("data:image") == text.count(
        "data:image"
    )


@pytest.fixture(scope="module")
def identified(folder):
    """The command that identifies, and where it wrote."""
    out = folder / "identified"
    return call("identify", folder, "--pictures", "--out", out), out


def test_identify_says_it_on_the_terminal_and_in_its_files(identified):
    done, out = identified
    assert done.exit_code == 0, done.output
    assert "Levels" in done.output
    assert "friction" in done.output
    found = json.loads((out / "identified.json").read_text())
    assert any(t["signature"] == "friction" for study in found["levels"] for t in study)
    page = (out / "report.html").read_text()
    assert "levels_1.png" in page
    assert "Every mode at every level" in page
    assert "Every mode at every level" in done.output
    assert "<h1>4 recordings of " in page


def test_a_table_holds_every_mode_at_every_level(identified):
    """The file has a row where a mode was found; the page one of dashes where it was not."""
    _, out = identified
    (study,) = json.loads((out / "identified.json").read_text())["levels"]
    with (out / "levels.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(len(t["rows"]) for t in study)
    for row in rows:
        held = {r["level"]: r for r in study[int(row["mode"]) - 1]["rows"]}[float(row["level"])]
        for name, value in held.items():
            if name in row:
                assert float(row[name]) == value
        assert float(row["damping_low"]) < float(row["damping"]) < float(row["damping_high"])
    first, *others = (made(LevelTable, t) for t in study)
    section = level_section([replace(first, rows=first.rows[1:]), *others], {})
    (table,) = [b for b in section.blocks if getattr(b, "columns", ("",))[-1] == "damping, 95 %"]
    assert len(table.rows) == len(LEVELS) * len(study)
    assert table.rows[0] == ("1", "1", *["–"] * 5)


def at_levels(study, found, diagnosing=True):
    """The result of the fitted level with what other levels say; nothing else is asked."""
    prepared = SimpleNamespace(levels=study, question=SimpleNamespace(level=None))
    return over_levels(cast(Prepared, prepared), cast(UpdatedModels, None), found, diagnosing)


def test_linear_recordings_are_not_called_nonlinear(tmp_path):
    """Their levels are in the result, and the verdict stays that of the fitted level."""
    (study,) = chladni.identify(chladni.load_case(a_case(tmp_path, [0j] * len(LEVELS)))).levels
    found = at_levels(study, DiagnosisResult("calibration only"))
    assert found.verdict == "calibration only"
    assert {t.signature for t in found.levels} <= {"linear", "runs differ"}
    assert not found.joints


def test_what_is_held_must_have_a_level(folder, tmp_path):
    """One sentence, and no result."""
    bad = changed_case(folder, tmp_path / "bad", ("level = 1.0\n", ""))
    assert "has no level" in refused("diagnose", bad, "--out", tmp_path / "o")


def test_a_linear_effect_that_was_named_stays_and_is_said_to_be_of_its_level(folder):
    """No level takes its name away; a note says what it does not explain."""
    case = chladni.load_case(folder)
    (study,) = chladni.identify(case).levels
    named = DiagnosisResult("missing physics", (NamedEffect("point-mass"),))
    kept = at_levels(study, named)
    assert (kept.verdict, kept.effects) == (named.verdict, named.effects)
    assert "point-mass does not explain" in kept.notes[-1]
    assert len(kept.levels) == len(study.modes)
    plainly = at_levels(study, DiagnosisResult("calibration only"), diagnosing=False)
    assert plainly.verdict == "calibration only"
