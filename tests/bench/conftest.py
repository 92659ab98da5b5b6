"""A small article, and a bench without noise and without errors of sensors."""

import numpy as np
import pytest
from tests.builders.quick_runs import unrendered_pictures

from chladni_bench.accelerometers import AccelerometerType
from chladni_bench.bench_article import BenchArticle
from chladni_bench.bench_rig import BenchSetup
from chladni_bench.front_end import FrontEnd
from chladni_bench.shaker import ForceGauge, Shaker

R = 16  # modes, six of them rigid


@pytest.fixture(scope="module", autouse=True)
def _unrendered_pictures():
    with unrendered_pictures():
        yield


@pytest.fixture
def small():
    """An article of 4 kg with ten elastic modes between 28 and 190 Hz and three sensors."""

    def made(laws=(), damping=0.01, rotations=1.0, **changes):
        rng = np.random.default_rng(3)
        f = np.r_[np.zeros(6), 28 * np.arange(1, R - 5) ** 0.85]
        drive = rng.normal(size=(6, R)) / 2
        drive[0] = np.sign(drive[0]) * (0.3 + np.abs(drive[0]))
        drive[1:3] *= 0.1
        drive[3:] *= rotations
        parts = {
            "name": "A",
            "weight": 4.0,
            "frequency": f,
            "damping": np.where(f > 0, damping, 0.0),
            "outputs": rng.normal(size=(3, R)) / 2,
            "mounts": rng.normal(size=(3, 3, R)) / 2,
            "drive": drive,
            "hangers": rng.normal(size=(2, 3, R)) / 2,
            "output_labels": ("1:+Z", "2:+Z", "3:+Z"),
            "input_label": "9:+Z",
            "sites": rng.normal(size=(len(laws), R)) / 2,
            "laws": tuple(laws),
        }
        return BenchArticle(**{**parts, **changes})

    return made


@pytest.fixture
def ideal():
    """Sensors without noise and errors, a front end of 52 bits."""

    def made(**changes):
        perfect = {"noise": 0.0, "gain_sd": 0.0}
        return BenchSetup(
            **{
                "accelerometer": AccelerometerType(**perfect),
                "shaker": Shaker(gauge=ForceGauge(noise=0.0)),
                "front_end": FrontEnd(bits=52, noise=0.0, volts=1e6),
                **changes,
            }
        )

    return made
