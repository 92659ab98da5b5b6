"""The mesh error where a mesh is far too coarse for what was measured, and where it is not."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.fem.test_curved_shell import sheet

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.reduction import iterated
from chladni.effects import model_errors
from chladni.effects.model_errors import LIMIT, BeamTheory, limit_of, mesh_errors
from chladni.fem.assemble import Structure, structure
from chladni.fem.modelled import modelled
from chladni.geometry.refine import refined
from chladni.io.nastran import assembly, read_deck
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.units import UNITS
from chladni_specimens.plates import folded_panel, plate

TOP = 450.0  # [Hz]; eight flexible modes on eight shells


def test_no_mode_loses_all_its_stiffness():
    """Laid out as linear, three times the change to the finer mesh would leave less than none."""
    coarse = modelled(plate(0.4, 0.3, 4, 2, 1.5e-3), 4 * TOP)
    error = mesh_errors(coarse, TOP)[0]
    w, V = np.linalg.eigh(error.log)
    assert w.min() < np.log(0.6)  # it is as coarse as that
    model = reduced_problem(coarse, TOP).model
    for x in (-1.0, 1.0, 3.0):
        lam = evaluate(model, [error], np.array([x]), False).lam
        root = error.omega[:, None] * V
        due = np.linalg.eigvalsh((root * np.exp(x * w)) @ root.T)
        assert_allclose(np.sort(lam[6:])[: len(due) // 2], due[: len(due) // 2], rtol=1e-6)


def test_the_error_of_shells_with_nodes_on_their_edges_falls_as_h4():
    """The limit that two meshes give is near the modes of one a quarter as fine again."""
    top = 20.0  # [Hz] seven modes of a free plate on nine shells
    coarse = modelled(sheet(3, 3, t=2e-3), 2.0 * top)
    (error,) = mesh_errors(coarse, top)
    assert error.order == 4
    due = normal_modes(structure(refined(refined(coarse.assembly))).system, 12).frequency[6:]
    n = min(len(error.limit), len(due))
    own = coarse.modes.frequency[6:]
    off, left = (np.abs(f[:n] / due[:n] - 1) for f in (own, error.limit))
    assert off.max() > 2e-3
    assert left.max() < 0.15 * off.max()
    assert limit_of(4) == pytest.approx(16 / 15)
    (mixed,) = mesh_errors(modelled(plate(0.4, 0.3, 4, 2, 1.5e-3), 4 * TOP), TOP)
    assert (mixed.order, limit_of(2)) == (2, pytest.approx(LIMIT))


def test_sheets_of_shells_with_nodes_on_their_edges_are_one():
    """Parts that share grids are connected, whatever the nodes of their shells."""
    assert set(reduced_problem(sheet(4, 3), 60.0).groups.connected) == {0}


def test_the_halved_mesh_is_the_mesh_error_at_one():
    """The same state, with no parameter left."""
    coarse = modelled(plate(0.4, 0.3, 4, 2, 1.5e-3), 4 * TOP)
    error = mesh_errors(coarse, TOP, lambda built: built.rows(built.system.dofs[:12]))[0]
    model = reduced_problem(coarse, TOP).model
    a, b = evaluate(model, [error], np.ones(1)), evaluate(model, [error.halved], np.zeros(0))
    assert_allclose(a.lam, b.lam)
    assert_allclose(a.moved, b.moved)
    assert b.dK.count == 0


def test_the_softest_mode_of_a_row_of_bars_goes_to_its_limit(tmp_path):
    """f = (1.8751/L)² √(EI/ρA) / 2π, for a third more than what a mesh twice as fine changes.

    Lumped masses put much of soft modes into stiff ones, whose stiffness is 10⁴ times theirs.
    """
    L, h, n = 0.9, 0.008, 20
    cards = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,210.+9,,.3,7850."]
    cards += ["PBARL,1,1,,BAR", f"+,.03,{h}", "SPC1,1,123456,1"]
    cards += [f"GRID,{k + 1},,{L * k / n:.6g},0.,0." for k in range(n + 1)]
    cards += [f"CBAR,{k + 1},1,{k + 1},{k + 2},0.,1.,0." for k in range(n)]
    (tmp_path / "bar.bdf").write_text("\n".join([*cards, "ENDDATA"]) + "\n")
    bar = modelled(assembly(read_deck(tmp_path / "bar.bdf"), UNITS["SI"]), 3200.0)
    error, theory = mesh_errors(bar, 800.0)
    assert type(theory) is BeamTheory
    w, V = np.linalg.eigh(error.log)
    root = error.omega[:, None] * V
    due = (1.8751 / L) ** 2 * np.sqrt(210e9 * h**2 / 12 / 7850) / (2 * np.pi)

    def away(x):
        K = (root * np.exp(x * w)) @ root.T
        return abs(np.sqrt(np.linalg.eigvalsh(K)[0]) / (2 * np.pi) / due - 1)

    assert away(LIMIT) < 0.1 * away(0.0)
    assert abs(error.limit[0] / due - 1) == away(LIMIT)
    assert away(2.0) < away(0.0)


def test_two_steps_from_the_modes_of_the_deck_reach_those_of_the_finer_mesh(monkeypatch):
    """Frequencies come from above, by a small part of the mesh error; L and shapes are those."""
    coarse = modelled(folded_panel(0.6, 0.3, 0.04, 0.01, 0.03, 1e-3), 1.6 * 300.0)
    places = partial(Structure.rows, dofs=coarse.structure.system.dofs[2:200:12])
    near = mesh_errors(coarse, 300.0, places)[0]
    made = structure(refined(coarse.assembly))
    loads = made.rows(coarse.structure.system.dofs).T @ (
        coarse.structure.system.M @ coarse.modes.shapes
    )
    whole = normal_modes(made.system, band=300.0).frequency[6:]
    once, twice = (iterated(made.system, loads, 10.0, k).frequency[6:] for k in (1, 2))
    once, twice = once[: len(whole)], twice[: len(whole)]
    off = coarse.modes.frequency[6:][: len(whole)] / whole - 1
    assert (twice > whole * (1 - 1e-9)).all()
    assert (twice - whole < 0.1 * (once - whole) + 1e-9 * whole).all()
    assert (twice / whole - 1).max() < 0.02 * np.abs(off).max()
    monkeypatch.setattr(model_errors, "FAR", -1.0)
    full = mesh_errors(coarse, 300.0, places)[0]
    own = full.omega < 2 * np.pi * 300.0
    here, there = near.log[np.ix_(own, own)], full.log[np.ix_(own, own)]
    assert np.linalg.norm(here - there) < 0.01 * np.linalg.norm(there)
    here, there = near.shapes[:, own], full.shapes[:, own]
    assert np.linalg.norm(here - there) < 0.15 * np.linalg.norm(there)
