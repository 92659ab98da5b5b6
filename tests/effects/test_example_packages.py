"""Packages of one file each: their effects are proposed, reduced, written, concealed and found."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from chladni.cli.app import application
from chladni.dynamics.eigen import normal_modes
from chladni.effects import EffectContext
from chladni.effects.effect_context import Setup
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.io.nastran import assembly, read_deck, write_assembly, write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.assembly import appended
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_evidence.bench_of_structure import SPECIMENS, Specimen
from chladni_evidence.blind_make import made_of
from chladni_evidence.evidence_sets import Order, chosen
from chladni_evidence.made_case import write_case
from chladni_specimens import folded_panel
from chladni_specimens.forms.mesh_pieces import of_pieces, rectangle
from chladni_specimens.plates import STEEL, plate

TOP = 420.0  # Hz
FIRST = 6  # a free plate has six rigid modes
X = {"edge-mass": 0.5, "corner-feet": 0.4, "wedged-sheet": 0.12, "slipping-bolts": -2.5}
CARDS = ("GRID", "CONM2", "CELAS2", "CBUSH", "PBUSH", "CQUAD4", "CBAR", "PBAR", "MAT1")


def small_plate(times=1):
    """300 x 200 x 1.2 mm."""
    return plate(0.3, 0.2, 8 * times, 6 * times, 1.2e-3)


def two_plates(times=1):
    """The plate, and another 4 mm above it on six bushes."""
    u, v = np.linspace(0, 0.3, 8 * times + 1), np.linspace(0, 0.2, 6 * times + 1)
    pieces = [rectangle(name, (0, 0, z), u, v) for name, z in (("lower", 0.0), ("upper", 4e-3))]
    made = of_pieces(pieces, dict.fromkeys(("lower", "upper"), (1.2e-3, STEEL)))
    places = [(x, y) for x in (0.0, 0.15, 0.3) for y in (0.0, 0.2)]
    nodes = [
        [np.linalg.norm(made.points - (x, y, z), axis=1).argmin() for z in (0.0, 4e-3)]
        for x, y in places
    ]
    frame = np.tile(np.eye(3)[[2, 0, 1]], (len(nodes), 1, 1))
    bushes = appended(
        made.bushes, ids=1000000 + np.arange(len(nodes)), nodes=np.array(nodes), frame=frame,
        place=made.points[np.array(nodes)].mean(axis=1),
        stiffness=np.tile([1e7, 1e6, 1e6, 1e2, 1e2, 1e2], (len(nodes), 1)),
    )  # fmt: skip
    return replace(made, bushes=bushes)


def small(family):
    """The structure on which an example is tried."""
    return two_plates if family.needs else small_plate


@pytest.fixture(scope="module")
def acting(example_family):
    """The family, its deck, a reduced model of it, its first effect and an x where it acts."""
    deck = small(example_family)()
    reduced = reduced_problem(deck, TOP)
    weight = mass_properties(deck)[0]
    where = EffectContext(
        reduced.groups, reduced.grids, reduced.candidates, Setup((), (), weight, TOP)
    )
    effect = example_family.placed(where)[0]
    return example_family, deck, reduced, effect, np.array([X.get(effect.name, 0.2)])


def test_it_acts_on_a_folded_panel(example_family):
    """Where sheets are curved and flanges go down at the edges, each of its places as well."""
    deck = (
        folded_panel(0.6, 0.3, 0.04, 0.01, 0.05, 1e-3) if not example_family.needs else two_plates()
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


def test_reduced_model_agrees_with_the_changed_structure(acting):
    """To second order of what a basis of first order lacks."""
    _, deck, reduced, effect, x = acting
    due, nominal = modes(effect.apply(deck, x)), modes(deck)
    lam = evaluate(reduced.model_for(effect, x), [effect], x, False).lam[FIRST : FIRST + 6]
    moved = np.abs(due / nominal - 1).max()
    assert moved > 1e-3
    assert_allclose(np.sqrt(lam) / (2 * np.pi), due, rtol=0.1 * moved)


def test_slopes_are_exact(acting):
    """Of λ and of the weight, by central differences."""
    _, _, reduced, effect, x = acting
    model, h = reduced.model_for(effect, x), 1e-4
    state = evaluate(model, [effect], x)
    high, low = (evaluate(model, [effect], x + s * h, False) for s in (1, -1))
    slope = state.phi.T @ state.dK[0] @ state.phi - state.lam * (
        state.phi.T @ state.dM[0] @ state.phi
    )
    due = (high.lam - low.lam) / (2 * h)
    at = slice(FIRST, FIRST + 6)
    assert_allclose(slope.diagonal()[at], due[at], rtol=1e-4, atol=1e-6 * state.lam[at].max())
    assert_allclose(state.dweight[0], (high.weight - low.weight) / (2 * h), atol=1e-7)


def test_it_weighs_what_it_writes(acting):
    _, deck, reduced, effect, x = acting
    more = mass_properties(effect.apply(deck, x))[0] - mass_properties(deck)[0]
    bare = evaluate(reduced.model, [], np.zeros(0), False).weight
    weighed = evaluate(reduced.model_for(effect, x), [effect], x, False).weight
    assert_allclose(weighed - bare, more, atol=1e-3 * mass_properties(deck)[0])


def test_its_cards_are_its_structure(acting, tmp_path):
    """The edited deck is read back with the modes of the changed structure."""
    family, deck, _, effect, x = acting
    read = read_deck(write_assembly(deck, tmp_path / "plate.bdf", "mm-t-s"))
    before = assembly(read, "mm-t-s")
    after = effect.apply(before, x)
    new = read_deck(write_deck(read, tmp_path / "new.bdf", changes(read, before, after, "mm-t-s")))
    assert_allclose(modes(assembly(new, "mm-t-s")), modes(after), rtol=1e-6)
    count = {k: [len(d[k]) if k in d.cards else 0 for d in (read, new)] for k in CARDS}
    assert {k for k, (was, now) in count.items() if now > was} <= set(family.cards)


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
    assert held["Q_with_mesh_error"] < held["Q_calibrated_with_mesh_error"]
    assert (out / "updated.bdf").exists()
