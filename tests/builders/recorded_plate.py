"""Fixtures: a plate made ready, with a recording of a slightly different one."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.reduction import attachments
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.inference.likelihood import Responses
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

TOP = 200.0


@pytest.fixture(scope="session")
def reduced():
    return reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), TOP)


@pytest.fixture(scope="session")
def responses(reduced):
    """Two shakers and four sensors on a plate 4 % stiffer than the model, level up to 200 Hz."""
    outputs, inputs = reduced.grids.rows[[0, 6, 20, 45]], reduced.grids.rows[[0, 33]]
    s = 2 * np.pi * np.linspace(25, TOP, 40) * (0.03 + 1j)
    use = np.ones((40, 4), bool)
    use[5:9, 1] = False
    empty = Responses(np.ones((40, 4, 2), complex), s, outputs, inputs, use).rebased(reduced.model)
    stiffer = evaluate(
        reduced.model, [calibration_parameter(reduced.groups, "E", [0])], np.array([0.04])
    )
    return replace(empty, values=empty.model(stiffer))


@pytest.fixture(scope="session")
def damped(reduced, responses):
    """The places of the recording at 24 lines, 8 % damping; E and rho free."""
    s = 2 * np.pi * np.linspace(25, TOP, 24) * (0.08 + 1j)
    empty = replace(responses, s=s, use=np.ones((24, 4), bool), values=np.ones((24, 4, 2), complex))
    return empty, [calibration_parameter(reduced.groups, q, [0]) for q in ("E", "rho")]


def with_attachments(reduced, rows):
    """The reduced model over a basis with the static responses to loads on these rows."""
    return reduced.model.extended(attachments(reduced.factor, rows))
