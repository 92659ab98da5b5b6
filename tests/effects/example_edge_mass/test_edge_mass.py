"""An effect that is one file of its own goes the whole road: concealed, found, written."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from chladni.cli.app import application
from chladni.dynamics.eigen import normal_modes
from chladni.effects.effect_context import EffectContext, Setup
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.units import UNITS
from chladni_evidence.bench_of_structure import SPECIMENS, Specimen
from chladni_evidence.blind_make import made_of
from chladni_evidence.evidence_sets import Order, chosen
from chladni_evidence.made_case import write_case
from chladni_specimens.plates import plate


def small_plate(times):
    return plate(0.3, 0.2, 9 * times, 6 * times, 1.2e-3)


SMALL = Specimen(small_plate, lambda: small_plate(3), 420.0, (25.0, 330.0), sensors=8)


@pytest.fixture(scope="module")
def edge_mass(example_edge_mass):
    """The module of the installed package."""
    import edge_mass

    assert edge_mass.FAMILY is example_edge_mass
    return edge_mass


def test_shares_follow_the_length_of_the_edge(edge_mass):
    """Of a plate of 9 x 6 equal shells: 30 grids, corners as any other, all on the outline."""
    deck = small_plate(1)
    rows, shares = edge_mass.edge(deck, 0)
    assert len(rows) == 30
    assert_allclose(shares.sum(), 1)
    assert_allclose(shares, 1 / 30)
    X = deck.points[rows]
    assert np.all((X[:, 0] * (X[:, 0] - 0.3) * X[:, 1] * (X[:, 1] - 0.2)) == pytest.approx(0))


def test_reduced_model_agrees_with_the_changed_structure(edge_mass):
    """To second order of what a basis of first order lacks."""
    deck = small_plate(1)
    reduced = reduced_problem(deck, 420.0)
    setup = Setup((), (), 0.5, 420.0)
    where = EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)
    (effect,) = edge_mass.edge_masses(where)
    x = np.array([0.5])
    lam = evaluate(reduced.model_for(effect, x), [effect], x, False).lam[6:14]
    due = normal_modes(structure(effect.apply(deck, x)).system, 14).frequency[6:]
    nominal = normal_modes(structure(deck).system, 14).frequency[6:]
    moved = np.abs(due / nominal - 1).max()
    assert_allclose(np.sqrt(lam) / (2 * np.pi), due, rtol=0.1 * moved)


def test_it_is_hidden_in_the_blind_panels(edge_mass):
    """Beside our own effects, whose cases stay as they are."""
    (order,) = chosen("panels", [560], ["edge-mass"], ["panel"])
    assert order == Order("panel", "edge-mass", 560, "fine")


def test_concealed_in_a_plate_it_is_named_and_written(edge_mass, tmp_path, monkeypatch):
    monkeypatch.setitem(SPECIMENS, "tiny plate", SMALL)
    case = made_of(Order("tiny plate", "edge-mass", 560, "fine"))
    folder, out = tmp_path / "case", tmp_path / "out"
    write_case(case, folder, tmp_path / "sealed.json")
    done = CliRunner().invoke(application(), ["diagnose", str(folder), "--out", str(out)])
    assert done.exit_code == 0, done.output
    d = json.loads((out / "diagnosis.json").read_text())
    assert d["verdict"] == "missing physics"
    assert d["effects"][0]["name"] == "edge-mass"
    (mass,) = d["effects"][0]["parameters"]
    assert mass["low"] < case.truth["value"] < mass["high"]
    held = d["fit"]["held_out"]
    assert held["Q_with_mesh_error"] < held["Q_calibrated_with_mesh_error"]

    updated = assembly(read_deck(out / "updated.bdf"), UNITS["mm-t-s"])
    assert_allclose(updated.masses.matrix[:, 0, 0].sum(), mass["value"], rtol=1e-5)
    assert len(updated.masses) == 30
