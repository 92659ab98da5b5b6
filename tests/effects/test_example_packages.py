"""Packages of one file each: their effects act on a panel, are concealed and found."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from chladni.cli.app import application
from chladni.dynamics.eigen import normal_modes
from chladni.effects import EffectContext
from chladni.effects.effect_context import Setup
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.reduced.reduced_problem import reduced_problem
from chladni_evidence.bench_of_structure import SPECIMENS, Specimen
from chladni_evidence.blind_make import made_of
from chladni_evidence.evidence_sets import Order, chosen
from chladni_evidence.made_case import write_case
from chladni_specimens import bushed_plates, folded_panel
from chladni_specimens.plates import plate

TOP = 420.0  # Hz
FIRST = 6  # a free plate has six rigid modes
X = {"edge-mass": 0.5, "corner-feet": 0.4, "wedged-sheet": 0.12, "slipping-bolts": -2.5}


def small_plate(times=1):
    """300 x 200 x 1.2 mm."""
    return plate(0.3, 0.2, 8 * times, 6 * times, 1.2e-3)


def small(family):
    """The structure on which an example is tried."""
    return bushed_plates if family.needs else small_plate


def test_it_acts_on_a_folded_panel(example_family):
    """Where sheets are curved and flanges go down at the edges, each of its places as well."""
    deck = (
        folded_panel(0.6, 0.3, 0.04, 0.01, 0.05, 1e-3)
        if not example_family.needs
        else bushed_plates()
    )
    reduced = reduced_problem(deck, 60.0)
    setup = Setup((), (), mass_properties(deck)[0], 60.0)
    where = EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)
    proposed = example_family.placed(where)
    assert proposed
    for effect in proposed:
        x = np.array([X.get(effect.name, 0.2)])
        assert np.abs(modes(effect.apply(deck, x)) / modes(deck) - 1).max() > 1e-4


def modes(made, count=FIRST + 6):
    return normal_modes(structure(made).system, count).frequency[FIRST:]


def test_it_is_hidden_in_the_blind_panels(example_family):
    """If it acts on any structure."""
    name = example_family.name
    orders = [o for o in chosen("panels", [560], (), ["panel"]) if o.kind == name]
    assert orders == ([] if example_family.needs else [Order("panel", name, 560, "fine")])


@pytest.mark.slow
def test_concealed_it_is_named_and_written(example_family, tmp_path, monkeypatch):
    """On a recording of a finer article that no deck has seen."""
    name, build = example_family.name, small(example_family)
    small_one = Specimen(build, lambda: build(3), TOP, (25.0, 330.0), sensors=8)
    monkeypatch.setitem(SPECIMENS, "small", small_one)
    case = made_of(Order("small", name, 560, "fine"))
    folder, out = tmp_path / "case", tmp_path / "out"
    write_case(case, folder, tmp_path / "sealed.json")
    done = CliRunner().invoke(application(), ["diagnose", str(folder), "--out", str(out)])
    assert done.exit_code == 0, done.output
    d = json.loads((out / "diagnosis.json").read_text())
    assert d["verdict"] == "missing physics"
    assert d["effects"][0]["name"] == name
    size = d["effects"][0]["parameters"][0]
    sd = (size["high"] - size["low"]) / (2 * 1.96)
    assert abs(size["value"] - case.truth["value"]) < 3 * sd
    held = d["fit"]["held_out"]
    assert held["Q_with_effect"] < held["Q_calibrated"]
    assert (out / "updated.bdf").exists()
