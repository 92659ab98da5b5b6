"""Time histories that are written are read back, by our reader and by pyuff."""

import numpy as np
import pytest
import pyuff
from tests.builders.refusals import says

from chladni.ema.time_record import TimeRecord
from chladni.io.uff.read_uff import read_uff
from chladni.io.uff.write_time import write_time_uff


def record(**changes):
    x = np.random.default_rng(0).normal(size=(3, 3, 200))
    parts = {
        "force": x[:, :1], "response": x[:, 1:], "rate": 512.0, "inputs": ("9:+Z",),
        "outputs": ("12:n", "3:-Y"), "quantity": "accelerance",
    }  # fmt: skip
    return TimeRecord(**{**parts, **changes})


@pytest.mark.parametrize("quantity", ["accelerance", "mobility", "receptance"])
def test_a_record_comes_back(tmp_path, quantity):
    """Blocks, labels, signs of directions and units; numbers to single precision."""
    made = record(quantity=quantity)
    write_time_uff(tmp_path / "t.uff", made, {9: np.array([0.1, 0.2, 0.3])})
    found = read_uff(tmp_path / "t.uff")
    assert found.time is not None
    assert found.time.quantity == quantity
    assert (found.time.inputs, found.time.outputs) == (made.inputs, made.outputs)
    assert found.time.rate == pytest.approx(512.0, rel=1e-5)
    np.testing.assert_allclose(found.time.force, made.force, rtol=1e-6)
    np.testing.assert_allclose(found.time.response, made.response, rtol=1e-6)
    np.testing.assert_allclose(found.nodes[9], [0.1, 0.2, 0.3])


def test_pyuff_reads_it(tmp_path):
    made = record()
    write_time_uff(tmp_path / "t.uff", made)
    sets = [s for s in pyuff.UFF(str(tmp_path / "t.uff")).read_sets() if s["type"] == 58]
    assert len(sets) == 9
    assert {s["func_type"] for s in sets} == {1}
    np.testing.assert_allclose(sets[0]["data"], made.force[0, 0], rtol=1e-6)
    np.testing.assert_allclose(np.diff(sets[1]["x"]), 1 / 512, rtol=1e-4)


def test_nothing_half_written(tmp_path):
    """A moving base has no force, a label no place: refused, and no file is left."""
    moved, nowhere = record(quantity="transmissibility"), record(outputs=("here", "3:+Y"))
    says("transmissibility", write_time_uff, tmp_path / "t.uff", moved)
    says("no place in a universal file", write_time_uff, tmp_path / "t.uff", nowhere)
    assert not list(tmp_path.iterdir())
