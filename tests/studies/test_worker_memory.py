"""A worker that keeps what it frees is not given the same pages again and again."""

import os
import subprocess
import sys

import pytest

from chladni_studies.worker_memory import keep_freed_memory

CODE = """
import resource, sys
import numpy as np
from chladni_studies.worker_memory import keep_freed_memory

if sys.argv[1] == "kept":
    assert keep_freed_memory()
np.ones(2**17)
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(100):
    np.ones(2**17)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(not keep_freed_memory(), reason="no glibc here")
def test_arrays_of_a_megabyte_cost_their_pages_once():
    """Mapped anew each costs 256 pages of 4 KiB, or one of the huge ones where these are given."""
    environ = {**os.environ, "MALLOC_TRIM_THRESHOLD_": "65536"}  # as Dask starts its workers
    faults = {}
    for way in ("given back", "kept"):
        run = subprocess.run(
            [sys.executable, "-c", CODE, way], capture_output=True, text=True, check=True,
            env=environ,
        )  # fmt: skip
        faults[way] = int(run.stdout)
    assert faults["given back"] >= 100
    assert faults["kept"] < faults["given back"] / 10


def test_it_is_asked_of_the_library_once():
    assert keep_freed_memory() is keep_freed_memory()
