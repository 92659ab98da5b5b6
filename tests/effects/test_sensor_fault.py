"""What a sensor fault reports is the factor on the recording."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from chladni.effects.channels import candidates, sensor_fault
from chladni.inference.likelihood import Responses
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate


@pytest.mark.parametrize("factor", [0.5, 1.4, -1.0, -1.3])
def test_the_reported_factor_explains_the_recording(factor: float) -> None:
    """Two channels of a plate, the second recorded ``factor`` times too high: nothing is left."""
    reduced = reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), 150.0)
    up = np.tile([0.0, 0.0, 1.0], (2, 1))
    rows = sp.csr_array(reduced.structure.along(np.array([1, 30]), up))
    s = 2 * np.pi * np.array([20.0, 45.0, 90.0]) * (0.08 + 1j)
    use = np.ones((3, 2), bool)
    data = Responses(np.ones((3, 2, 1), complex), s, rows, rows[[0]], use).rebased(reduced.model)
    exact = data.model(evaluate(reduced.model, [], np.zeros(0), False))
    wrong = exact * np.array([[1.0], [factor]])
    off = Responses(wrong, s, rows, rows[[0]], use).rebased(reduced.model)
    x = np.array([np.log(abs(factor))])
    fault = sensor_fault("30:+Z", 1, 2, int(np.sign(factor)), 0.0)
    assert fault.reported(x, np.array([0.1]))[0].value == pytest.approx(factor)
    assert off.deviation(evaluate(reduced.model, [fault], x, False)) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("channels", "turned", "found"), [(1, False, 0), (1, True, 2), (2, False, 4)]
)
def test_the_level_of_the_only_channel_is_nobodys_fault(
    channels: int, turned: bool, found: int
) -> None:
    """No other channel shows it to be odd; a reversed sign is seen all the same."""
    delta = np.full((30, channels, 1), 0.2 + 1j * np.pi / np.log(10) * turned)
    null = np.zeros(1)
    context = SimpleNamespace(
        scan=SimpleNamespace(deviation=delta), labels=("1:+Z", "2:+Z"), null=null, bases=(null,)
    )
    assert len(candidates(context)) == found
