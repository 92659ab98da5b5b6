"""What sensors show wrongly by themselves: slopes against sensors turned, moved and scaled."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.ema.setup import SensorAccuracy
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.inference.likelihood import Responses
from chladni.inference.sensor_errors import gauge_errors, sensor_errors
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

S = 2 * np.pi * np.linspace(25, 180, 30) * (0.08 + 1j)
USUAL = SensorAccuracy()
GAIN, TILT, PLACE = USUAL.gain, USUAL.direction, USUAL.position
SMALL = 1e-3  # of an error's standard deviation: what is left of a secant is of second order


def dofs(points, directions, sd=0.0):
    k = len(points)
    return MeasuredDofs(
        tuple(map(str, range(k))), np.zeros(k, int), np.asarray(points, float),
        np.asarray(directions, float), np.full(k, sd), np.zeros(k),
    )  # fmt: skip


# askew, so that what lies along the sheet is felt
OUTPUTS = dofs(
    [[0.0625, 0.0625, 0], [0.2375, 0.1125, 0], [0.3375, 0.2125, 0]],
    [[0.6, 0, 0.8], [0, 0.28, 0.96], [0, 0, 1]],
)
INPUTS = dofs([[0.1125, 0.1625, 0], [0.3625, 0.0375, 0]], [[0, 0, 1], [0, 0.6, 0.8]])


@pytest.fixture(scope="module")
def made():
    return reduced_problem(plate(0.4, 0.3, 16, 12, 1.5e-3), 200.0)


@pytest.fixture(scope="module")
def state(made):
    return evaluate(made.model, [calibration_parameter(made.groups, "E", [0])], np.zeros(1))


def recorded(made, state, use=None):
    """What these sensors and shakers would record of the plate, some samples not in use."""
    built = made.groups.structure
    if use is None:
        use = np.ones((len(S), 3), bool)
        use[5:9, 1] = False
    shape = (len(S), 3, 2)
    empty = Responses(
        np.ones(shape, complex), S, OUTPUTS.rows(built), INPUTS.rows(built), use,
        noise=np.full(shape, 0.002), sensors=sensor_errors(OUTPUTS, INPUTS, built, USUAL),
    ).rebased(made.model)  # fmt: skip
    return replace(empty, values=empty.model(state))


def moved(side, way):
    """Directions turned or places moved by ``SMALL`` deviations."""
    u, v = (d.directions for d in side.across())
    turn = SMALL * TILT * np.array([u, v, 0 * u, 0 * u])[way]
    shift = SMALL * PLACE * np.array([0 * u, 0 * u, u, v])[way]
    return replace(side, points=side.points + shift, directions=side.directions + turn)


@pytest.mark.parametrize(("way", "near"), [(0, 1e-9), (1, 1e-9), (2, 0.2), (3, 0.2)])
def test_what_is_mixed_in_is_what_turned_and_moved_sensors_show(made, state, way, near):
    """A moved place follows the facets of the shells, the slope is that of their rotations."""
    built = made.groups.structure
    side = OUTPUTS if way < 2 else replace(OUTPUTS, directions=np.tile([0.0, 0.0, 1.0], (3, 1)))
    omega2 = (2 * np.pi * np.array([10.0, 200.0])) ** 2
    modes = (state.lam > omega2[0]) & (state.lam < omega2[1])
    shapes = made.model.basis @ state.phi[:, modes]
    seen = (moved(side, way).rows(built) - side.rows(built)) @ shapes / SMALL
    told = sensor_errors(side, INPUTS, built, USUAL).rows[way] @ shapes
    sign = np.sign((seen * told).sum())
    assert np.linalg.norm(seen - sign * told) < near * np.linalg.norm(seen)


def spread(data, state):
    """Columns of one deviation of every error: sensors with a little of it in them (n, k)."""
    out = []
    for name, modal in (("a", data.sensors.modal), ("b", ())):
        rows = getattr(data, name)
        one = np.eye(len(rows))
        for k in range(len(rows)):
            changes = [(1 + SMALL * GAIN * one[k])[:, None] * rows]
            changes += [rows + SMALL * one[k][:, None] * mixed for mixed in modal]
            out += [
                np.log10(replace(data, **{name: c}).model(state) / data.values) for c in changes
            ]
    return data.stacked(np.stack(out) / SMALL / data.std())


def test_what_is_whitened_is_what_every_error_does(made, state):
    data = recorded(made, state).allowing_errors(state)
    V = spread(replace(data, known=None), state)
    assert V.shape[1] == 5 * 3 + 2
    inverse = np.linalg.inv(data.known.whitened(np.eye(len(V))))
    told = inverse @ inverse.T - np.eye(len(V))
    assert_allclose(told, V @ V.T, atol=1e-3 * np.abs(told).max())


def test_the_covariance_is_the_identity_after_whitening(made, state):
    data = recorded(made, state).allowing_errors(state)
    W = data.known.whitened(np.eye(2 * int(data.use.sum()) * 2))
    C = np.linalg.inv(W) @ np.linalg.inv(W).T
    assert_allclose(W @ C @ W.T, np.eye(len(W)), atol=1e-9)
    assert np.linalg.eigvalsh(C).min() > 1 - 1e-9  # errors only ever add to the noise


@pytest.mark.parametrize(("way", "amount"), [(0, 3.0), (1, -2.0), (2, 40.0), (3, -40.0)])
def test_a_gauge_turned_or_moved_by_any_amount_is_exact(made, state, way, amount):
    """H is linear in the motion of the gauge, however much of it an error adds."""
    data, effects = (
        recorded(made, state),
        gauge_errors(OUTPUTS, INPUTS, made.groups.structure, USUAL),
    )
    modal = made.model.rows(effects[1].rows[way])
    b = data.b + np.array([[0.0], [amount]]) * modal
    due = replace(data, values=replace(data, b=b).model(state))
    x = np.zeros(8)
    x[4 + way] = amount
    found = evaluate(made.model, effects, x)
    assert np.abs(due.deviation(found)).max() < 1e-9
    assert np.abs(due.deviation(state)).max() > 1e-3


def test_slopes_by_the_errors_of_a_gauge_are_those_of_differences(made, state):
    data, effects = (
        recorded(made, state),
        gauge_errors(OUTPUTS, INPUTS, made.groups.structure, USUAL),
    )
    x, step = np.linspace(-1, 1, 8), 1e-5
    J = data.slopes(evaluate(made.model, effects, x))
    for k, unit in enumerate(step * np.eye(8)):
        ends = [data.deviation(evaluate(made.model, effects, x + s * unit)) for s in (1, -1)]
        assert_allclose(J[k], (ends[0] - ends[1]) / (2 * step), atol=1e-6 * np.abs(J).max())


def test_a_gauge_near_a_node_line_takes_no_data_away(made, state):
    """Its errors are several times the response, on all lines and channels: two unknowns."""
    data = recorded(made, state)
    far = replace(data, b=1e-3 * data.b)  # as little as a gauge at a node line drives
    plain, near = (
        d.allowing_errors(state).std() for d in (data, replace(far, values=far.model(state)))
    )
    assert_allclose(near, plain, rtol=1e-6)


def test_a_moving_base_has_no_gauge(made):
    moved = replace(INPUTS, points=np.full((2, 3), np.nan))
    assert not gauge_errors(OUTPUTS, moved, made.groups.structure, USUAL)


def test_a_wrong_sensor_costs_as_much_as_its_error_is_likely(made, state):
    """A gain off by one deviation costs one at most, where it would cost its whole square."""
    data = recorded(made, state).allowing_errors(state)
    wrong = data.values.copy()
    wrong[:, 0] *= 1 + GAIN
    off = replace(data, values=wrong)
    r, plain = (replace(off, known=k).scaled(state, False)[0] for k in (off.known, None))
    assert plain @ plain > 10
    assert 0 < r @ r < 1.01


def test_errors_of_an_uncertain_place_are_as_large_as_is_stated(made):
    built = made.groups.structure
    stated = sensor_errors(replace(OUTPUTS, sd=np.full(3, 2 * PLACE)), INPUTS, built, USUAL)
    usual = sensor_errors(OUTPUTS, INPUTS, built, USUAL)
    for way, factor in ((0, 1), (1, 1), (2, 2), (3, 2)):
        assert_allclose(stated.rows[way].toarray(), factor * usual.rows[way].toarray())


def test_their_variance_is_the_sum_of_what_each_does(made, state):
    data = recorded(made, state, use=np.ones((len(S), 3), bool))
    told = data.wrong(state)
    V = spread(data, state)
    seen = (V.reshape(2, *data.values.shape, -1) ** 2).sum(axis=(0, 4))
    assert_allclose(told, seen * (data.std() * np.log(10)) ** 2, rtol=0.01)


def test_a_test_without_faults_is_what_plain_calibration_assumes(made, state):
    data = recorded(made, state).allowing_errors(state)
    assert data.exactly().known is None
    half = np.zeros_like(data.use)
    half[:10] = True
    assert len(data.using(half).known.whitened(np.zeros(2 * 2 * 30))) == 120
