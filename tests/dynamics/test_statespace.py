from dataclasses import replace

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import synthesise
from chladni.dynamics.statespace import StateSpace, state_space

F = np.linspace(3, 120, 50)
OUT, IN = ("2:+Z", "5:-Z", "9:+Z"), ("5:-Z", "7:+Z")
QUANTITIES = ("receptance", "mobility", "accelerance")


@pytest.fixture
def modal(chain):
    return normal_modes(chain).with_damping(np.linspace(0.01, 0.04, 10))


def spaced(modal, quantity="receptance"):
    return state_space(
        modal, modal.at(OUT), modal.at(IN), outputs=OUT, inputs=IN, quantity=quantity
    )


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_state_space_is_superposition(modal, quantity):
    due = synthesise(
        modal, modal.at(OUT), modal.at(IN), F, outputs=OUT, inputs=IN, quantity=quantity
    )
    found = spaced(modal, quantity).frf(F)
    np.testing.assert_allclose(found.values, due.values, rtol=1e-9)
    assert found.quantity == quantity


def test_poles_are_the_modes(modal):
    p = spaced(modal).poles()
    due = 2 * np.pi * modal.frequency * (-modal.damping + 1j * np.sqrt(1 - modal.damping**2))
    np.testing.assert_allclose(p[1::2], due)
    np.testing.assert_allclose(p[::2], np.conj(due))


def test_basis_of_the_states_does_not_matter(modal):
    """The response is blind to x -> T x."""
    ss = spaced(modal)
    T = np.random.default_rng(0).standard_normal(ss.A.shape) + 5 * np.eye(len(ss.A))
    other = replace(ss, A=T @ ss.A @ np.linalg.inv(T), B=T @ ss.B, C=ss.C @ np.linalg.inv(T))
    np.testing.assert_allclose(other.frf(F).values, ss.frf(F).values, rtol=1e-6)


def test_what_cannot_be_said_is_said(modal):
    says("transmissibility", spaced, modal, "transmissibility")
    matrices = np.eye(2), np.ones((2, 1)), np.ones((1, 2)), np.ones((1, 2))
    says(r"B is \(2, 1\).*\(2, 2\)", StateSpace, *matrices, ("a",), ("b", "c"))
