"""Effects of the catalogue over a range: what a sample holds is what the catalogue would write."""

import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose

import chladni
from chladni.arrays import fingerprint
from chladni.dynamics.eigen import normal_modes
from chladni.errors import FileError
from chladni.fem.assemble import structure
from chladni.model.ground_springs import with_ground_bushes
from chladni.model.point_masses import with_masses
from chladni.units import UNITS
from chladni.workflows.loaded_model import Model
from chladni_specimens.forms import FORMS
from chladni_specimens.plates import plate
from chladni_studies import StudySettings
from chladni_studies.parameter_study import _varied, study
from chladni_studies.varied_effects import of_effect
from chladni_studies.vary_text import vary_text

GRID = 12


def sheet():
    return plate(0.4, 0.3, 5, 4, 1.5e-3)


def first(assembly):
    return normal_modes(structure(assembly).system, 12).frequency[6:]


def model(tmp_path, made=None):
    return Model(tmp_path / "plate", sheet() if made is None else made)


def test_a_mass_at_a_grid_is_a_mass_at_that_grid():
    varied = of_effect(vary_text(f"point-mass at {GRID}=1e-5:2e-4"), sheet(), None, UNITS["mm-t-s"])
    assert (varied.low, varied.high, varied.unit) == pytest.approx((0.01, 0.2, "kg"))
    made, due = varied.applied(sheet(), 0.15), with_masses(sheet(), (GRID,), 0.15)
    assert_allclose(made.masses.matrix, due.masses.matrix, atol=1e-15)
    assert made.masses.node.tolist() == due.masses.node.tolist()
    assert varied.applied(sheet(), 0.0) is not None
    assert not len(varied.applied(sheet(), 0.0).masses)


def test_masses_that_far_exceed_the_structure_are_in_another_unit():
    """1.4 kg of sheet: 5 to 50 t are 5 to 50 g of someone who reads kg/1000."""
    with pytest.raises(FileError, match=r"5e\+04 kg are more than 20 times .*, 1.413 kg"):
        of_effect(vary_text(f"point-mass at {GRID}=5:50"), sheet(), None, UNITS["mm-t-s"])


def test_a_support_pushes_across_the_sheet():
    varied = of_effect(vary_text(f"extra-support at {GRID}=1e2:1e5:log"), sheet(), None, None)
    row = sheet().rows([GRID])
    due = with_ground_bushes(sheet(), row, np.array([[0.0, 0, 1]]), 5e3)
    assert_allclose(first(varied.applied(sheet(), 5e3)), first(due), rtol=1e-9)
    assert (varied.unit, varied.log) == ("deck units", True)


def test_it_goes_to_workers_and_is_known_again():
    a, b, c = (
        of_effect(vary_text(f"point-mass at {grid}=0.01:0.2"), sheet(), None, UNITS["SI"])
        for grid in (GRID, GRID, GRID + 1)
    )
    again = pickle.loads(pickle.dumps(a))
    assert_allclose(again.applied(sheet(), 0.1).masses.matrix[0, 0, 0], 0.1)
    assert fingerprint(a) == fingerprint(b) != fingerprint(c)


@pytest.mark.parametrize("sampler", ["sobol", "oat", "morris"])
def test_a_study_weighs_what_it_puts_on(tmp_path, sampler):
    ranges = (
        f"point-mass at {GRID}=0.01:0.2",
        f"extra-support at {GRID + 5}=1e2:1e5:log",
        "t=90%:110%",
    )
    found = study(model(tmp_path), ranges, StudySettings(samples=16, sampler=sampler))
    assert not found.failed
    assert found.nominal[f"point-mass at {GRID}"] == 0
    t = found.column("t") / sheet().parts[0].section.thickness
    bare = found.nominal["mass_kg"] * t
    assert_allclose(
        found.column("mass_kg") - bare, found.column(f"point-mass at {GRID}"), atol=1e-9
    )


def test_a_mass_on_a_tube(tmp_path):
    frame = FORMS["tube frame"].made(1)
    found = study(model(tmp_path, frame), ("point-mass at 20=0.1:0.5",), StudySettings(samples=4))
    heavier = found.column("point-mass at 20")[:4]
    assert_allclose(found.column("mass_kg") - found.nominal["mass_kg"], heavier, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("point-mass=0.1:0.2", "no place; write point-mass at GRID"),
        ("point-mass at 99999=0.1:0.2", "grid 99999 is on no shell and no beam"),
        ("crack=1:2", "crack takes more than one number or a grid; point-mass"),
        ("local-resonator at 12=1:2", "local-resonator takes more than one number"),
        ("orthotropic-material=1:2", "takes more than one number"),
        ("suspension=1:2", "its place is not known; a case"),
        ("point-mass at 12=90%:110%", "no value there, so a share is not possible"),
        ("point-mass at 12=2:1", "must increase"),
        ("point-mass at 12=0:1:log", "must increase and be above zero"),
        ("point-mass at 12=-1:1", "must increase and not begin below zero"),
        ("point-mass at 12=a:b", "is not a range"),
        ("point-mass of plate=1:2", 'write "point-mass at GRID=LOW:HIGH"'),
    ],
)
def test_what_cannot_be_varied_is_told(text, said):
    asked = vary_text(text)
    assert asked.is_effect
    with pytest.raises(FileError, match=said):
        of_effect(asked, sheet(), None, UNITS["SI"])


def test_numbers_of_the_deck_are_no_effects():
    texts = ("t of inner=0.6:0.8", "E=90%:110%", "K of PBUSH 7=1:2", "t of a at 5=1:2")
    assert not any(vary_text(text).is_effect for text in texts)


def test_cords_of_a_case_are_used_where_they_are_varied(deck, tmp_path):
    text = '[model]\ndeck = "plate.bdf"\nunits = "SI"\n[test]\nhangers = [1, 8]\n'
    (tmp_path / "plate.bdf").write_text(deck.read_text())
    (tmp_path / "case.toml").write_text(text)
    case, few = chladni.load_case(tmp_path), StudySettings(samples=4, modes=3)
    held = chladni.study(case, ("suspension=10:1e3:log",), few)
    assert held.nominal["suspension"] == 0
    stiffer = held.column("f1_hz") / held.nominal["f1_hz"]  # Rayleigh: no spring lowers a mode
    assert stiffer.min() > 1 - 1e-9
    assert stiffer[np.argmax(held.column("suspension"))] > 1 + 1e-5
    assert not [n for n in held.notes if "hangers" in n]
    idle = chladni.study(case, ("t=90%:110%",), few)
    assert [n for n in idle.notes if "hangers" in n]


def test_plain_numbers_are_those_of_the_cards_where_a_deck_counts_masses_its_own_way(
    deck, tmp_path
):
    """With PARAM,WTMASS a density or a lump stands in the cards in other numbers; so it is here."""
    heavy = tmp_path / "heavy.bdf"
    text = deck.read_text()
    heavy.write_text(text.replace("BEGIN BULK\n", "BEGIN BULK\nPARAM,WTMASS,2.59-3\n"))
    model = chladni.load(heavy, "SI")
    (rho,) = model.assembly.parts
    own = rho.section.membrane.rho / 2.59e-3  # as the card has it
    vary = (f"rho={0.9 * own:g}:{1.1 * own:g}", "point-mass at 8=1:3")
    (a, b), _ = _varied(model, None, tuple(map(vary_text, vary)))
    assert a.low / a.nominal == pytest.approx(0.9, rel=1e-5)
    assert a.high / a.nominal == pytest.approx(1.1, rel=1e-5)
    assert (b.low, b.high) == pytest.approx((2.59e-3, 3 * 2.59e-3))
