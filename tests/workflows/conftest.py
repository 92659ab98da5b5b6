"""The small case of all workflows, and what they find in it, once a session."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.cases import SENSORS, write_case
from tests.builders.quick_runs import quick_runs

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.fem import modelled as fem_modelled


@pytest.fixture(scope="module", autouse=True)
def _quick():
    with quick_runs():
        yield


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("case")
    write_case(folder, 6, SENSORS, np.linspace(15, 200, 900), 170.0)
    return folder


@pytest.fixture(scope="session")
def case(folder):
    return chladni.load_case(folder)


@pytest.fixture(scope="session")
def diagnosis(case):
    """The result, and every system whose modes were solved on the way."""
    solved = []

    def counted(system, *given, **named):
        solved.append(system)
        return normal_modes(system, *given, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fem_modelled, "normal_modes", counted)
        return chladni.diagnose(case), solved


@pytest.fixture(scope="session")
def diagnosed(diagnosis):
    return diagnosis[0]


@pytest.fixture(scope="session")
def calibrated(case):
    return chladni.calibrate(case)


@pytest.fixture
def without_mass(case):
    """The case, nothing weighed."""
    return replace(case, setup=replace(case.setup, mass=None))
