from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from tests.builders.refusals import says

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import (
    FRF,
    residual_flexibility,
    synthesise,
    transfer,
)

from .conftest import inverted, line

F = np.linspace(5, 120, 40)
LABELS = ("2:+Z", "5:+Z")


def superposed(modal, outputs=LABELS, inputs=("8:+Z",), **options):
    o, i = modal.at(outputs), modal.at(inputs)
    return synthesise(modal, o, i, F, outputs=outputs, inputs=inputs, **options)


def test_superposition_equals_inversion(chain):
    """With V = M Φ diag(2 ζ ω) Φᵀ M both roads lead to the same H."""
    modal = normal_modes(chain).with_damping(np.linspace(0.01, 0.05, 10))
    U, d = chain.M @ modal.shapes, 4 * np.pi * modal.damping * modal.frequency
    damped = replace(chain, V=sp.csr_array((U * d) @ U.T))
    direct = inverted(damped, [1, 4], [7], F)
    np.testing.assert_allclose(superposed(modal).values, direct, rtol=1e-8)


def test_structural_damping_equals_complex_stiffness(chain):
    """g = 2 ζ for every mode is K (1 + i g)."""
    modal = normal_modes(chain).with_damping(0.03)
    both = superposed(modal, structural=True).values
    np.testing.assert_allclose(both, inverted(chain, [1, 4], [7], F, structural=0.06))
    lossy = replace(chain, K=sp.csr_array(chain.K * (1 + 0.06j)))
    np.testing.assert_allclose(both, inverted(lossy, [1, 4], [7], F))
    np.testing.assert_allclose(normal_modes(lossy).frequency, modal.frequency)


@pytest.mark.parametrize("free", [False, True])
def test_residual_terms_stand_for_the_modes_left_out(free):
    """Error falls from (ω/ω_k)⁰ without, to (ω/ω_k)⁴ with both terms; all modes leave none."""
    system = line(40, free=free)
    full = normal_modes(system).with_damping(0.0)
    modal, E = full.sel(slice(0, 12)), np.eye(40)[:, [1, 20]]
    f = np.linspace(0.05, 0.3, 9) * modal.frequency[-1] + 0.037
    exact = transfer(full, full.shapes[[1, 20]], full.shapes[[1, 20]], 2j * np.pi * f)
    R = residual_flexibility(system, modal, E, E)
    phi = modal.shapes[[1, 20]]

    def error(residual):
        return np.abs(transfer(modal, phi, phi, 2j * np.pi * f, residual=residual) - exact).max()

    static = replace(R, slope=0 * R.slope)
    assert error(static) < 0.2 * error(None)
    assert error(R) < 0.2 * error(static)
    everything = residual_flexibility(system, full, E, E, shift=-100.0)
    assert np.abs(everything.static).max() < 1e-9 * np.abs(R.static).max()


def test_directions_are_combinations_of_rows(chain):
    modal = normal_modes(chain).with_damping(0.01)
    w = np.array([[0.6, 0.8]])
    mixed = transfer(modal, w @ modal.at(LABELS), modal.at(["8:+Z"]), 2j * np.pi * F)
    np.testing.assert_allclose(mixed, w @ superposed(modal).values)
    np.testing.assert_allclose(modal.at(["5:-Z"]), -modal.at(["5:+Z"]))


@given(st.permutations(["receptance", "mobility", "accelerance"]))
def test_quantity_round_trip(order):
    values = np.ones((3, 1, 1), complex)
    H = FRF(values, np.array([1.0, 2, 3]), ("1:+Z",), ("1:+Z",), order[0], variance=values.real)
    back = H.to(order[1]).to(order[2]).to(order[0])
    np.testing.assert_allclose(back.values, H.values)
    np.testing.assert_allclose(back.variance, H.variance)


def test_relative_spread_survives_a_change_of_quantity():
    """A factor takes value and standard deviation alike."""
    H = FRF(np.full((2, 1, 1), 2.0 + 0j), np.array([3.0, 7]), ("1:+Z",), ("1:+Z",))
    H = replace(H, variance=np.full((2, 1, 1), 0.04))
    to = H.to("accelerance")
    np.testing.assert_allclose(np.sqrt(to.variance) / np.abs(to.values), 0.1)


def test_velocity_and_acceleration_against_formula(chain):
    H = superposed(normal_modes(chain).with_damping(0.02))
    omega = 2 * np.pi * F[:, None, None]
    np.testing.assert_allclose(H.to("mobility").values, 1j * omega * H.values)
    np.testing.assert_allclose(H.to("accelerance").values, -(omega**2) * H.values)


def test_nothing_is_known_of_integrals_at_zero():
    H = FRF(np.ones((2, 1, 1), complex), np.array([0.0, 1]), ("1:+Z",), ("1:+Z",), "accelerance")
    assert np.isnan(H.to("receptance").values[0, 0, 0])
    assert np.isfinite(H.to("receptance").values[1, 0, 0])


def test_transmissibility_stays():
    H = FRF(
        np.ones((1, 1, 1), complex), np.array([1.0]), ("1:+Z",), ("base:+Z",), "transmissibility"
    )
    assert H.to("transmissibility") is H
    says("transmissibility cannot be converted", H.to, "mobility")


def test_selection_keeps_order_and_companions(chain):
    H = superposed(normal_modes(chain).with_damping(0.01), LABELS, LABELS)
    H = replace(H, variance=np.abs(H.values), coherence=np.ones(H.values.shape))
    part = H.sel(outputs=["5:+Z"], inputs=["5:+Z", "2:+Z"], band=(20, 50))
    assert part.outputs == ("5:+Z",)
    assert part.frequency[0] >= 20
    assert part.frequency[-1] <= 50
    k = np.searchsorted(F, part.frequency[0])
    np.testing.assert_array_equal(part.values[0], H.values[k][np.ix_([1], [1, 0])])
    np.testing.assert_array_equal(part.variance, np.abs(part.values))
    assert part.coherence.shape == part.values.shape


def test_misuse_is_named(chain):
    modal = normal_modes(chain)
    says(r"99:\+Z", modal.at, ["99:+Z"])
    says(r"99:\+Z.*2:\+Z", superposed(modal.with_damping(0.01)).sel, ["99:+Z"])
    says(r"\(3, 1, 1\).*\(3, 2, 1\)", FRF, np.ones((3, 1, 1), complex), F[:3], LABELS, ("1:+Z",))
    one = np.ones((1, 1, 1), complex), F[:1], ("a",), ("b",)
    says("variance", FRF, *one, variance=np.ones((1, 1)))
    says("must increase", FRF, np.ones((2, 1, 1), complex), np.array([2.0, 1.0]), ("a",), ("b",))
    says("no quantity 'admittance'", FRF, *one, "admittance")


def test_values_cannot_be_overwritten(chain):
    H = superposed(normal_modes(chain).with_damping(0.01))
    with pytest.raises(ValueError, match="read-only"):
        H.values[0] = 0
