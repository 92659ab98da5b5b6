"""What a case says of its recordings is done to them, and noted: what screening offers mends."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.case.mended_recordings import mended, with_frf
from chladni.dynamics.frf import FRF
from chladni.ema.setup import Recording, Sensor
from chladni.ema.time_record import TimeRecord
from chladni.errors import FileError
from chladni.io.tables.read_tables import read_recordings
from chladni.io.uff.estimate_stamp import stamp
from chladni.io.uff.write_uff import write_uff

F = np.linspace(10.0, 50.0, 41)
TRUE = FRF(
    np.random.default_rng(0).normal(size=(41, 3, 1)) + 1j,
    F, ("1:+Z", "2:+Z", "3:+Z"), ("9:+Z",), "accelerance", variance=np.full((41, 3, 1), 1e-4),
)  # fmt: skip


def test_each_repair_undoes_its_fault():
    late = np.exp(-2j * np.pi * F * 1e-3)[:, None, None]
    wrong = replace(TRUE, values=TRUE.values / 9.81 * late * [[1.0], [-0.5], [1.0]])
    sensors = [Sensor("2:+Z", gain=-0.5), Sensor("3:+Z", use=False)]
    found = mended(Recording("a", wrong), 9.81, 1e-3, sensors)
    assert found.frf.outputs == ("1:+Z", "2:+Z")
    np.testing.assert_allclose(found.frf.values, TRUE.values[:, :2])
    np.testing.assert_allclose(found.frf.variance[:, 1, 0], 1e-4 * (9.81 / 0.5) ** 2)
    said = " ".join(found.notes)
    for word in ("3:+Z excluded", "2:+Z by -0.5", "factor = 9.81", "delay = 0.001 s"):
        assert word in said


def test_nothing_is_mended_in_silence_or_unasked():
    untouched = Recording("a", TRUE)
    assert mended(untouched, 1.0, 0.0, []).frf is TRUE
    assert mended(untouched, 1.0, 0.0, []).notes == ()
    with pytest.raises(FileError, match="excludes every output"):
        mended(untouched, 1.0, 0.0, [Sensor(o, use=False) for o in TRUE.outputs])


def test_time_data_that_hold_no_test_name_the_command_that_takes_settings():
    silent = TimeRecord(np.zeros((1, 1, 600)), np.ones((1, 1, 600)), 100.0, ("1:n",), ("2:n",))
    with pytest.raises(FileError, match=r"a\.npz: .*nothing was excited.*chladni test a\.npz"):
        with_frf(Recording("a.npz", time=silent))


def test_averages_and_window_survive_the_universal_file(tmp_path):
    """(1 - γ²)/γ² |H|²/(n - 1): the variance that H1 had is found again, and the window's share."""
    gamma = np.full(TRUE.values.shape, 0.9)
    frf = replace(TRUE, variance=None, coherence=gamma)
    write_uff(tmp_path / "a.uff", frf, title=stamp(11.0, 2.5))
    (found,) = read_recordings(tmp_path / "a.uff")
    assert found.added_damping == 2.5
    due = 0.1 / 0.9 * np.abs(TRUE.values) ** 2 / 10
    np.testing.assert_allclose(found.frf.variance, due, rtol=1e-6)
    write_uff(tmp_path / "b.uff", frf)
    (plain,) = read_recordings(tmp_path / "b.uff")
    assert plain.frf.variance is None
    assert plain.added_damping == 0.0
