"""A parameter study on one worker and on several: samples a second, and the efficiency.

    python benchmarks/study.py [WORKERS ...]        # 1 and 2

A folded panel, ten modes of every sample. "alone" computes the samples in one process without
Dask; efficiency is its time over workers times their time, from the first sample that is back, so
that the start of the workers, given beside it, is not in it.
"""

import os

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import sys
import time
from pathlib import Path

import numpy as np

from chladni.studies import StudySettings
from chladni.studies.parameter_study import study
from chladni.workflows.loaded_model import Model
from chladni_specimens.plates import folded_panel

RANGES = ("t=90%:110%", "E=95%:105%", "rho=95%:105%")
SAMPLES = 120


def timed(model, workers):
    """(seconds until the first sample, seconds for each that follows) by the clock on the wall."""
    ticks = []
    begin = time.perf_counter()
    settings = StudySettings(samples=SAMPLES)
    study(
        model, RANGES, settings, workers=workers,
        progress=lambda what, share: ticks.append(time.perf_counter() - begin),
    )  # fmt: skip
    back = np.array(ticks[2:])  # the first two are said before anything is back
    return back[0], (back[-1] - back[0]) / (len(back) - 1)


def main():
    """Print the table."""
    model = Model(Path("panel"), folded_panel(0.6, 0.3, 0.04, 0.01, 0.02, 1e-3))
    print(f"{len(model.structure.system.dofs)} degrees of freedom, {SAMPLES} samples\n")
    print("| workers | first sample after [s] | samples a second | efficiency |")
    print("|---|---|---|---|")
    first, alone = timed(model, 1)
    print(f"| alone | {first:.1f} | {1 / alone:.2f} | 1 |", flush=True)
    for workers in map(int, sys.argv[1:] or ("2",)):
        first, each = timed(model, workers)
        print(f"| {workers} | {first:.1f} | {1 / each:.2f} | {alone / (workers * each):.2f} |")


if __name__ == "__main__":
    main()
