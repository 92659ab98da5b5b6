"""The small case of all workflows, and what they find in it, made once for all processes."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.cases import SENSORS, write_case
from tests.builders.quick_runs import quick_runs
from tests.builders.shared_results import folder_of_run, shared_folder, shared_result

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.fem import modelled as fem_modelled


@pytest.fixture(scope="module", autouse=True)
def _quick():
    with quick_runs():
        yield


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """The folder of what all processes of this run share."""
    return folder_of_run(tmp_path_factory)


@pytest.fixture(scope="session")
def folder(shared):
    """Nothing is written here."""
    lines = np.linspace(15, 200, 900)
    return shared_folder(shared, "case", lambda place: write_case(place, 6, SENSORS, lines, 170.0))


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
            return chladni.diagnose(case), solved

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
