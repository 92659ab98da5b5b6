import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.dynamics.damping import DampingTable, with_table
from chladni.dynamics.eigen import normal_modes
from chladni.errors import ShapeError


def table(frequency, value, kind="g"):
    return DampingTable(np.array(frequency, float), np.array(value, float), kind)


def test_the_three_kinds_say_the_same():
    """ζ = g/2 = 1/2Q; without TYPE a table is g."""
    f = np.array([1.0, 50.0])
    for ratio in (DampingTable(f, f * 0 + 0.04).ratio(f), table(f, [25, 25], "q").ratio(f)):
        np.testing.assert_allclose(ratio, 0.02)
    np.testing.assert_allclose(table(f, [0.02, 0.02], "crit").ratio(f), 0.02)


def test_lines_between_and_beyond_the_points():
    t = table([10, 20, 40], [0.0, 0.1, 0.1], "crit")
    np.testing.assert_allclose(
        t.ratio(np.array([5, 10, 15, 20, 30, 100])), [-0.05, 0, 0.05, 0.1, 0.1, 0.1]
    )


def test_a_jump_counts_its_mean():
    t = table([0, 10, 10, 20], [0.02, 0.02, 0.06, 0.06], "crit")
    np.testing.assert_allclose(t.ratio(np.array([9.99, 10, 10.01])), [0.02, 0.04, 0.06])


def test_one_point_is_a_constant():
    np.testing.assert_allclose(table([5], [0.03], "crit").ratio(np.array([1.0, 9])), 0.03)


def test_table_lands_on_the_modes(chain):
    modal = with_table(normal_modes(chain), table([0, 100], [0, 0.1]))
    np.testing.assert_allclose(modal.damping, modal.frequency / 100 * 0.05)


def test_bad_tables_are_refused():
    with pytest.raises(ShapeError):
        table([1, 2], [0.1])
    says("must not fall", table, [2, 1], [0.1, 0.1])
