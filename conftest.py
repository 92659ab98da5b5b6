"""The suite's own ground: one BLAS thread, one way to print, on any machine."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"  # set before numpy loads: threads fight for the cores

import numpy as np
import pytest

LONG = ("tests/evidence/", "tests/workflows/", "tests/effects/", "tests/search/", "tests/cli/")


def pytest_configure(config):
    """Processes take files in the order below, and not those with the most tests first."""
    config.option.loadscopereorder = False


def pytest_collection_modifyitems(items):
    """Rooms whose files take longest come first: no process waits for one of them at the end."""

    def place(item):
        return next((k for k, room in enumerate(LONG) if item.nodeid.startswith(room)), len(LONG))

    items.sort(key=place)


@pytest.fixture(autouse=True)
def _plain_printing():
    """Doctests print as numpy does by default, whatever a library has set."""
    with np.printoptions(legacy=False):
        yield
