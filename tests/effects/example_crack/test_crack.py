"""An effect that is one file of its own goes the whole road: concealed, found, written."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from chladni.cli.app import application
from chladni.dynamics.eigen import normal_modes
from chladni.effects.surroundings import Setup, Surroundings
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck
from chladni.model.properties import Isotropic
from chladni.units import UNITS
from chladni.updating.reduced_model import evaluate
from chladni.updating.reduced_problem import reduced_problem
from chladni_evidence.concealed import Specimen, concealable, made, write
from chladni_specimens.plates import plate


def small_plate(times):
    return plate(0.3, 0.2, 9 * times, 6 * times, 1.2e-3)


SMALL = Specimen("tiny plate", small_plate, 420.0, (25.0, 330.0), sensors=8)


@pytest.fixture(scope="module")
def crack(example_crack):
    """The module of the installed package."""
    import crack

    assert crack.FAMILY is example_crack
    return crack


def test_lines_cross_a_plate_both_ways(crack):
    """A grid of 9 x 6 shells has nine lines of six and six of nine."""
    found = crack.lines(small_plate(1))
    assert sorted(int(line.shells.sum()) for line in found) == [6] * 9 + [9] * 6
    assert sum(line.shells.astype(int) for line in found).tolist() == [2] * 54


def test_first_frequency_of_a_strip_falls_as_beam_theory_says(crack):
    """∂ln λ/∂ln f = ∫_line φ''² dx / ∫ φ''² dx, φ'' of a free beam's first mode, nu = 0."""
    n, length = 25, 0.5
    strip = plate(length, 0.06, n, 3, 1e-3, Isotropic(2.1e11, 0.0, 7850.0))
    reduced = reduced_problem(strip, 60.0)
    middle = [k for k in crack.lines(strip) if abs(k.centre[0] - length / 2) < 1e-6]
    (line,) = [k for k in middle if k.shells.sum() == 3]
    effect, x = crack.crack(reduced.groups, line, 1), np.array([-8.0])
    state = evaluate(reduced.model_for(effect, x), [effect], x)
    got = state.dK[0, 6, 6] / state.lam[6] / effect.matrices(x)[0].gradient[0]
    k, s = 4.730040744862704, np.linspace(0, 1, 5001)  # cos k cosh k = 1
    r = (np.cosh(k) - np.cos(k)) / (np.sinh(k) - np.sin(k))
    bent = np.cosh(k * s) - np.cos(k * s) - r * (np.sinh(k * s) - np.sin(k * s))
    inside = np.abs(s - 0.5) <= 0.5 / n
    due = (bent[inside] ** 2).sum() / (bent**2).sum()
    assert_allclose(got, due, rtol=(k / n) ** 2)  # elements of length 1/n err with its square


def test_reduced_model_agrees_with_the_changed_structure(crack):
    """To second order of what a basis of first order lacks."""
    deck = small_plate(1)
    reduced = reduced_problem(deck, 420.0)
    setup = Setup((), (), 0.5, 420.0)
    where = Surroundings(reduced.groups, reduced.grids, reduced.candidates, setup)
    line = crack.lines(deck)[3]
    effect = crack.crack(where.groups, line, 1)
    x = np.array([0.0])  # 55 % is left
    lam = evaluate(reduced.model_for(effect, x), [effect], x, False).lam[6:14]
    due = normal_modes(structure(effect.apply(deck, x)).system, 14).frequency[6:]
    nominal = normal_modes(structure(deck).system, 14).frequency[6:]
    moved = np.abs(due / nominal - 1).max()
    assert_allclose(np.sqrt(lam) / (2 * np.pi), due, rtol=0.1 * moved)


def test_it_can_be_concealed_and_others_keep_their_cases(crack):
    """It stands after all that were there, so their random numbers stay as they are."""
    assert concealable()[-1] == "crack"
    assert concealable()[7:9] == ("nothing", "calibration")


def test_concealed_in_a_plate_it_is_named_and_written(crack, tmp_path):
    case = made(SMALL, "crack", 2)
    folder, out = tmp_path / "case", tmp_path / "out"
    write(case, folder, tmp_path / "sealed.json")
    done = CliRunner().invoke(application(), ["diagnose", str(folder), "--out", str(out)])
    assert done.exit_code == 0, done.output
    d = json.loads((out / "diagnosis.json").read_text())
    assert d["verdict"] == "missing physics"
    assert d["effects"][0]["name"] == "crack"
    assert_allclose(d["effects"][0]["where"]["point_m"], case.truth["point_m"], atol=1e-6)
    (left,) = d["effects"][0]["parameters"]
    assert left["low"] < case.truth["value"] < left["high"]
    held = d["fit"]["held_out"]
    assert held["Q_with_mesh_error"] < held["Q_calibrated_with_mesh_error"] / 2

    updated = assembly(read_deck(out / "updated.bdf"), UNITS["mm-t-s"])
    ratio = {p.name: p.section.bending_ratio for p in updated.parts}
    assert sorted(ratio.values()) == pytest.approx([left["value"], 1.0])
    line = np.bincount(updated.shells.part)
    assert line.min() == 6
