"""The small case of all workflows, and what they find in it, made once for all processes."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.cases import NINE, SENSORS, write_case
from tests.builders.quick_runs import quick_runs
from tests.builders.shared_results import shared_folder, shared_result

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.fem import modelled as fem_modelled

TRIED = (  # by the diagnosis that is shared: rivals of every kind
    "point-mass", "local-resonator", "stiffness-patch", "extra-support", "crack", "sensor-mass"
)  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def _quick():
    with quick_runs():
        yield


@pytest.fixture(scope="session")
def folder(shared):
    """Nothing is written here."""
    lines = np.linspace(15, 200, 450)
    return shared_folder(shared, "case", lambda place: write_case(place, 6, SENSORS, lines, 170.0))


@pytest.fixture(scope="session")
def place(shared):
    """The folder of a plate that weighs a tenth less than its article; nine sensors."""
    lines = np.linspace(15, 250, 300)
    return shared_folder(shared, "nine", lambda place: write_case(place, 6, NINE, lines, 240.0))


@pytest.fixture(scope="session")
def sound(place):
    return chladni.load_case(place)


@pytest.fixture(scope="session")
def case(folder):
    return chladni.load_case(folder)


@pytest.fixture(scope="session")
def diagnosis(case, shared):
    """The result, and every system whose modes were solved on the way."""

    def made():
        solved = []

        def counted(system, *given, **named):
            solved.append(system)
            return normal_modes(system, *given, **named)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(fem_modelled, "normal_modes", counted)
            return chladni.diagnose(replace(case, effects=TRIED)), solved

    return shared_result(shared, "diagnosis", made)


@pytest.fixture(scope="session")
def diagnosed(diagnosis):
    return diagnosis[0]


@pytest.fixture(scope="session")
def calibrated(case, shared):
    return shared_result(shared, "calibration", lambda: chladni.calibrate(case))


@pytest.fixture
def without_mass(case):
    """The case, nothing weighed."""
    return replace(case, setup=replace(case.setup, mass=None))
