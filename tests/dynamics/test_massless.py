"""A chain of bars without inertia about its axis answers forces; what turns it is refused."""

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import residual_flexibility
from chladni.dynamics.massless import static_solver
from chladni.dynamics.reduction import beyond, shifted
from chladni.dynamics.residual import with_residual_vectors
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck
from chladni.units import UNITS

BAR = (
    "BEGIN BULK\nMAT1,1,2.1+11,,0.3,7850.\nPBAR,1,1,1.-4,1.-9,2.-9,2.-9\n"
    + "".join(f"GRID,{k},,{0.1 * k:.1f},0.,0.\n" for k in range(1, 9))
    + "".join(f"CBAR,{k},1,{k},{k + 1},0.,0.,1.\n" for k in range(1, 8))
    + "ENDDATA\n"
)


@pytest.fixture
def bar(tmp_path):
    (tmp_path / "bar.bdf").write_text(BAR)
    return structure(assembly(read_deck(tmp_path / "bar.bdf"), UNITS["SI"]))


def column(built, grid, component):
    return built.rows(np.array([(grid, component)])).T.toarray()


def test_modes_and_rest_are_the_whole_answer(bar):
    """Few modes and the static rest of the others, and all modes: the same flexibility far below.

    Σ over all r of φφᵀ/(λ_r - σ) = bᵀ(K - σM)⁻¹b where b does not turn the chain.
    """
    system = bar.system
    every = normal_modes(system)
    b = column(bar, 8, 3)
    for kept in (8, 12):
        few = every.sel(slice(0, kept))
        rest = residual_flexibility(system, few, b, b, shift=-1e4)
        lam = (2 * np.pi * every.frequency) ** 2
        phi = b.T @ every.shapes
        due = float(((phi**2) / (lam + 1e4))[0, kept:].sum())
        assert rest.static[0, 0] == pytest.approx(due, rel=1e-5)


def test_residual_vectors_are_found_too(bar):
    few = normal_modes(bar.system, 8)
    more = with_residual_vectors(bar.system, few, column(bar, 8, 3))
    assert len(more) == len(few) + 1


def test_its_shifted_factor_answers_forces_and_a_basis_has_no_spin(bar):
    """As :func:`static_solver` does; a unit torque brings no vector, for it moves no mass."""
    system, hertz = bar.system, 100.0
    force, torque = column(bar, 8, 3), column(bar, 8, 4)
    factor = shifted(system, hertz)
    due = static_solver(system, -((2 * np.pi * hertz) ** 2))(force)
    np.testing.assert_allclose(factor.solve(force), due, rtol=1e-6, atol=1e-6 * abs(due).max())
    turned = np.hstack([due, factor.solve(torque)])
    basis = beyond(system.M, (), turned)
    assert basis.shape[1] == 1
    assert np.abs(basis).max() < 1e3  # [1/sqrt(kg), 1/(m sqrt(kg))]: the bar weighs half a kilogram


def test_a_load_that_turns_it_is_refused(bar):
    solve = static_solver(bar.system, -1e4)
    says("neither stiffness nor mass", solve, column(bar, 8, 4))
