"""Shapes of identified modes against the modes the FRF was made of."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.builders.modal_frfs import modal_sum, noisy
from tests.builders.refusals import says

from chladni.dynamics.frf import FRF
from chladni.dynamics.modes import ModalModel
from chladni.ema.correlation import mac
from chladni.ema.identification import DERIVATIVES, Identified, evaluate, identify
from chladni.ema.realisation import realised
from chladni.ema.shapes import collinearity, lines_per_bandwidth, modal_model, shapes

F = np.linspace(20, 200, 500)
OUTPUTS = ("1:+Z", "2:-X", "3:+Z", "4:+Y", "5:+Z")


def modes() -> ModalModel:
    rng = np.random.default_rng(5)
    dofs = np.array([[1, 3], [2, 1], [3, 3], [4, 2], [5, 3]])
    f = np.array([35.0, 60.0, 90.0, 130.0, 170.0])
    return ModalModel(f, np.full(5, 0.01), rng.normal(size=(5, 5)), dofs)


def recorded(inputs: tuple[str, ...], noise: float = 1e-3) -> FRF:
    model = modes()
    ends = model.at(OUTPUTS), model.at(inputs)
    H = modal_sum(2j * np.pi * F, model.frequency, *ends, model.damping)
    return noisy(FRF(H, F, OUTPUTS, inputs, "accelerance"), noise, 1e-15)


@pytest.mark.parametrize("inputs", [("1:+Z",), ("1:-Z",), ("2:+X", "3:+Z")])
def test_shapes_are_mass_normalised_by_the_drive_point(inputs: tuple[str, ...]) -> None:
    """Signs of labels, minus at the exciter too, change nothing but the sign of the shape."""
    found = shapes(identify(recorded(inputs)))
    due = modes().at(OUTPUTS)
    sign = np.sign((found.values.real * due).sum(axis=0))
    assert found.scaled
    np.testing.assert_allclose(found.values.real * sign, due, atol=0.01 * np.abs(due).max())
    np.testing.assert_allclose(found.collinearity, 1, atol=1e-3)
    np.testing.assert_allclose(found.rank, 1, atol=1e-3)
    assert (found.polarity == 1).all()


def test_a_reversed_drive_point_is_noticed() -> None:
    """Φ_d² cannot be negative: the accelerometer (or the gauge) at the drive point is reversed."""
    frf = recorded(("1:+Z",))
    values = frf.values.copy()
    values[:, 0] *= -1
    found = shapes(identify(replace(frf, values=values)))
    assert (found.polarity == -1).all()


def test_without_a_drive_point_shapes_have_no_scale() -> None:
    model = modes()
    frf = recorded(("1:+Z",)).sel(outputs=OUTPUTS[1:])
    identified = identify(frf)
    found = shapes(identified)
    assert not found.scaled
    np.testing.assert_allclose(np.abs(found.values).max(axis=0), 1)
    np.testing.assert_allclose(np.diag(mac(found.values, model.at(OUTPUTS[1:]))), 1, atol=1e-4)
    says("no input is also an output", modal_model, identified)


def test_the_modal_model_gives_the_modes_back() -> None:
    """Labels with a minus are turned to the plus of their dof."""
    back = modal_model(identify(recorded(("1:+Z",))))
    due = modes()
    np.testing.assert_allclose(back.frequency, due.frequency, rtol=1e-4)
    np.testing.assert_allclose(np.diag(mac(back.shapes, due.shapes)), 1, atol=1e-4)
    np.testing.assert_array_equal(back.dofs, due.dofs)


@given(st.floats(0, 6.28), st.floats(-1, 1))
def test_collinearity_is_blind_to_phase_and_falls_with_circulation(turn: float, k: float) -> None:
    """ψ = a + ik a⊥: (1-k²)² / (1+k²)²."""
    psi = np.array([[1.0 + 0j], [1j * k]]) * np.exp(1j * turn)
    np.testing.assert_allclose(collinearity(psi), ((1 - k**2) / (1 + k**2)) ** 2, atol=1e-12)


def test_lines_per_half_bandwidth() -> None:
    """ζ f / Δf: 1 % at 100 Hz with 0.25 Hz lines is four."""
    p = 2 * np.pi * 100 * (-0.01 + 1j * np.sqrt(1 - 1e-4))
    one, none = np.ones(1), np.zeros((1, 1))
    found = Identified(
        one * p, np.ones((1, 1, 1), complex), none, none, one, one, one, 1.0,
        ("1:+Z",), ("1:+Z",), "accelerance", (50.0, 150.0),
    )  # fmt: skip
    f = np.arange(50, 150, 0.25)
    assert lines_per_bandwidth(found, f)[0] == pytest.approx(4, abs=0.51)
    assert lines_per_bandwidth(replace(found, poles=0.5 * found.poles), f)[0] <= 2.01


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_the_first_order_system_is_the_identified_model(quantity: str) -> None:
    """C (iω - A)⁻¹ B + D in the band, in every quantity; D = C B = 0 for the velocity."""
    identified = identify(recorded(("2:+X", "3:+Z"), noise=1e-6))
    system = realised(identified, quantity)  # type: ignore[arg-type]
    due = evaluate(identified, 2j * np.pi * F) / (2j * np.pi * F[:, None, None]) ** 2
    due = due * (2j * np.pi * F[:, None, None]) ** DERIVATIVES[quantity]
    H = system.frf(F).values
    assert np.abs(H - due).max() < 1e-3 * np.abs(due).max()
    assert len(system.A) == 2 * (5 + 2 * 2)
    assert (system.A.real == system.A).all()
    if quantity == "mobility":
        assert np.abs(system.D).max() < 1e-3 * np.abs(H).max()
