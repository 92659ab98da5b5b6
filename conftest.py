"""The suite's own ground: one BLAS thread, one way to print, on any machine."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"  # set before numpy loads: threads fight for the cores

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def _plain_printing():
    """Doctests print as numpy does by default, whatever a library has set."""
    with np.printoptions(legacy=False):
        yield
