"""A stringer is one file: its beams are reduced, concealed, written into the deck, found."""

import json
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from chladni.cli.app import application
from chladni.dynamics.eigen import normal_modes
from chladni.effects.effect_context import EffectContext, Setup
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck, write_assembly, write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.units import UNITS
from chladni_evidence.bench_of_structure import SPECIMENS, Specimen
from chladni_evidence.blind_make import made_of
from chladni_evidence.evidence_sets import Order
from chladni_evidence.made_case import write_case
from chladni_specimens.plates import plate


def small_plate(times):
    return plate(0.3, 0.2, 8 * times, 6 * times, 1.2e-3)


SMALL = Specimen(small_plate, lambda: small_plate(3), 420.0, (25.0, 330.0), sensors=8)


@pytest.fixture(scope="module")
def stringer(example_stringer):
    """The module of the installed package."""
    return sys.modules["stringer"]


@pytest.fixture(scope="module")
def effect(stringer):
    reduced = reduced_problem(small_plate(1), 420.0)
    where = EffectContext(
        reduced.groups, reduced.grids, reduced.candidates, Setup((), (), 0.5, 420.0)
    )
    (found,) = stringer.stringers(where)
    return found, reduced


def test_its_operators_are_its_beams(effect):
    """K and M of the deck with the cards are those of the deck and the terms, at any size."""
    stringer, _ = effect
    deck, x = small_plate(1), np.array([0.4])
    bare, whole = structure(deck).system, structure(stringer.apply(deck, x)).system
    for name in ("K", "M"):
        added = sum(t.coefficient * t.operator for t in stringer.terms(x) if t.matrix == name)
        due = getattr(whole, name).toarray()
        ours = (getattr(bare, name) + added).toarray()
        assert_allclose(ours, due, atol=1e-9 * np.abs(due).max())
    m = whole.M.sum()  # the rows of translations and of turns alike
    assert m == pytest.approx(bare.M.sum() + added.sum())


def test_slopes_are_those_of_the_coefficients(effect):
    """Central differences of c and of the weight, to the third order of the step."""
    stringer, _ = effect
    x, h = np.array([0.3]), 1e-4
    for k, term in enumerate(stringer.terms(x)):
        high, low = (stringer.terms(x + s * h)[k].coefficient for s in (1, -1))
        assert_allclose(term.gradient[0], (high - low) / (2 * h), rtol=1e-6)
    high, low = (stringer.weight(x + s * h)[0] for s in (1, -1))
    assert_allclose(stringer.weight(x)[1][0], (high - low) / (2 * h), rtol=1e-6)


def test_reduced_model_agrees_with_the_changed_structure(effect):
    """To second order of what a basis of first order lacks."""
    stringer, reduced = effect
    deck, x = small_plate(1), np.array([0.0])
    lam = evaluate(reduced.model_for(stringer, x), [stringer], x, False).lam[6:12]
    due = normal_modes(structure(stringer.apply(deck, x)).system, 12).frequency[6:]
    nominal = normal_modes(structure(deck).system, 12).frequency[6:]
    moved = np.abs(due / nominal - 1).max()
    assert_allclose(np.sqrt(lam) / (2 * np.pi), due, rtol=0.1 * moved)


def test_its_cards_are_its_beams(effect, tmp_path):
    stringer, _ = effect
    read = read_deck(write_assembly(small_plate(1), tmp_path / "plate.bdf", "mm-t-s"))
    before = assembly(read, "mm-t-s")
    after = stringer.apply(before, np.array([0.2]))
    new = write_deck(read, tmp_path / "new.bdf", changes(read, before, after, "mm-t-s"))
    again = assembly(read_deck(new), "mm-t-s")
    assert len(again.beams) == len(stringer.grids) - 1
    ours, due = (normal_modes(structure(a).system, 12).frequency[6:] for a in (again, after))
    assert_allclose(ours, due, rtol=1e-6)


@pytest.mark.slow
def test_concealed_in_a_plate_it_is_named_and_written(stringer, tmp_path, monkeypatch):
    monkeypatch.setitem(SPECIMENS, "tiny plate", SMALL)
    case = made_of(Order("tiny plate", "stringer", 560, "fine"))
    folder, out = tmp_path / "case", tmp_path / "out"
    write_case(case, folder, tmp_path / "sealed.json")
    done = CliRunner().invoke(application(), ["diagnose", str(folder), "--out", str(out)])
    assert done.exit_code == 0, done.output
    d = json.loads((out / "diagnosis.json").read_text())
    assert d["effects"][0]["name"] == "stringer"
    (side,) = d["effects"][0]["parameters"]
    sd = (side["high"] - side["low"]) / (2 * 1.96)
    assert abs(side["value"] - case.truth["value"]) < 3 * sd
    updated = assembly(read_deck(out / "updated.bdf"), UNITS["mm-t-s"])
    assert len(updated.beams) == 6, d["effects"]
