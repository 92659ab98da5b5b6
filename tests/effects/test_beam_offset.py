"""The distance of a stiffener from its sheet is a number of the deck that a fit may change."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni import load
from chladni.case.free_parameters import fields_of
from chladni.effects.user_parameters import (
    offset_of,
    offset_sd,
    sd_of,
    stiffener_offsets,
    user_parameter,
    values_of,
)
from chladni.fem.assemble import structure
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.model.assembly import picked
from chladni.model.free_parameter import FreeParameter
from chladni.reduced.accuracy import products
from chladni.reduced.reduced_problem import reduced_problem
from chladni.search.base_effects import freed_by
from chladni.search.question import Question

T, AWAY = 1.2, 6.5  # [mm] of the sheet, and of the stiffener from its middle


def deck_of(path, offset="0.,0.,6.5,0.,0.,6.5", flag="GGG", kind="CBAR"):
    """A sheet of 4 x 2 shells with a blade along its middle, and a mast without a distance."""
    cards = [
        f"GRID,{10 * i + j},,{100 * i}.,{100 * j}.,0." for i in range(1, 6) for j in range(1, 4)
    ]
    cards += [
        f"CQUAD4,{10 * i + j},1,{10 * i + j},{10 * i + j + 10},{10 * i + j + 11},{10 * i + j + 1}"
        for i in range(1, 5) for j in (1, 2)
    ]  # fmt: skip
    for i in range(1, 5):
        ends = f"{10 * i + 2},{10 * i + 12}"
        cards += [f"{kind},{100 + i},2,{ends},0.,0.,1.,{flag}", f"+,,,{offset}"]
    cards += ["GRID,99,,100.,100.,80.", "CBAR,200,3,12,99,1.,0.,0."]
    blade = f"P{kind[1:]},2,1,24.,288.,8.,{'24.,2.-6' if kind == 'CBAR' else ',24.,2.-6'}"
    cards += [
        f"PSHELL,1,1,{T},1,,1", blade, "PBAR,3,1,20.,30.,30.,50.", "MAT1,1,70000.,,.33,2.7-9",
    ]  # fmt: skip
    path.write_text("\n".join(["BEGIN BULK", *cards, "ENDDATA", ""]))
    return path


@pytest.fixture
def model(tmp_path):
    return load(deck_of(tmp_path / "deck.bdf"), units="mm-t-s")


def test_a_stiffener_has_a_distance_and_half_its_sheet_is_a_deviation(model):
    """The mast stands on the sheet as well, but it has no distance from it."""
    made = model.assembly
    stiffener = made.part(2)
    assert offset_of(made, stiffener) == pytest.approx(AWAY / 1e3)
    assert [p.positions for p in stiffener_offsets(made)] == [(stiffener,)]
    half = pytest.approx(T / 2 / AWAY)
    free = FreeParameter("offset", "offset", positions=(stiffener,))
    assert offset_sd(made, stiffener) == sd_of(made, free) == half
    assert_allclose(values_of(made, free), AWAY / 1e3)
    assert "offset" in fields_of(made, stiffener)
    assert "offset" not in (*fields_of(made, made.part(3)), *fields_of(made, made.part(1)))


def test_beams_without_a_sheet_have_no_distance_from_it(model):
    made = model.assembly
    assert stiffener_offsets(replace(made, shells=picked(made.shells, made.shells.ids < 0))) == []


@pytest.mark.parametrize("x", [-0.3, 0.2])
def test_the_factor_is_exact(model, x):
    """K(x) q and M(x) q are those of the structure whose beams are moved."""
    made = model.assembly
    reduced = reduced_problem(made, 200.0, groups=4)
    effect = user_parameter(reduced.groups, stiffener_offsets(made)[0])
    moved = effect.apply(made, np.array([x]))
    assert offset_of(moved, made.part(2)) == pytest.approx(AWAY / 1e3 * np.exp(x))
    q = np.random.default_rng(0).normal(size=(len(reduced.model.basis), 2))
    before, after = (structure(a).system for a in (made, moved))
    for found, old, due in zip(
        products(reduced.model, [effect], np.array([x]), q),
        (before.K @ q, before.M @ q), (after.K @ q, after.M @ q), strict=True,
    ):  # fmt: skip
        assert_allclose(found, due, atol=1e-9 * np.abs(due).max())
        assert np.abs(due - old).max() > 1e-6 * np.abs(due).max()


def test_a_softer_stiffener_is_softer_in_its_distance_too(model):
    """With E halved the change by the distance is halved: no motion gains energy by it."""
    made = model.assembly
    reduced = reduced_problem(made, 200.0, groups=4)
    E = user_parameter(reduced.groups, FreeParameter("E", "E", positions=(made.part(2),), sd=1.0))
    e = user_parameter(reduced.groups, stiffener_offsets(made)[0])
    x = np.array([np.log(0.5), -0.4])
    q = np.random.default_rng(1).normal(size=(len(reduced.model.basis), 2))
    due = structure(e.apply(E.apply(made, x[:1]), x[1:])).system.K @ q
    found, _ = products(reduced.model, [E, e], x, q)
    assert_allclose(found, due, atol=1e-9 * np.abs(due).max())


@pytest.mark.parametrize("kind", ["CBAR", "CBEAM"])
@pytest.mark.parametrize(
    ("flag", "offset"), [("GGG", "0.,0.,6.5,0.,0.,6.5"), ("GOO", "0.,6.5,,,6.5,")]
)
def test_the_written_deck_has_the_distance(tmp_path, kind, flag, offset):
    """Whatever the frame, the numbers of the card are multiplied, and other lines stay."""
    given = deck_of(tmp_path / "deck.bdf", offset, flag, kind)
    model = load(given, units="mm-t-s")
    effect = user_parameter(
        reduced_problem(model.assembly, 200.0, groups=2).groups,
        stiffener_offsets(model.assembly)[0],
    )
    moved = replace(model, assembly=effect.apply(model.assembly, np.array([np.log(0.9)])))
    written = moved.write(tmp_path / "new.bdf")
    assert_allclose(
        load(written, units="mm-t-s").assembly.beams.offset, 0.9 * model.assembly.beams.offset,
        rtol=1e-6, atol=1e-12,
    )  # fmt: skip
    lines = given.read_text().splitlines()
    assert sum(line not in lines for line in written.read_text().splitlines()) == 4


def test_a_fit_has_it_by_default(model):
    """As its last number; with numbers that the user frees it is one of them or none."""
    reduced = reduced_problem(model.assembly, 200.0, groups=2)
    nowhere = MeasuredDofs.__new__(MeasuredDofs)
    question = Question(model.assembly, nowhere, nowhere)
    assert freed_by(question, reduced)[-1].text == "offset of PBAR 2"
    own = FreeParameter("e", "offset", positions=(model.assembly.part(2),))
    (freed,) = freed_by(replace(question, parameters=(own,)), reduced)
    assert freed.parameters[0].sd == pytest.approx(T / 2 / AWAY)
