"""A parameter study on one worker and on several: samples a second, and the efficiency.

    python benchmarks/study.py [tailgate] [WORKERS ...]        # a panel; 1 and 2

A folded panel, or the tailgate at 32 mm; ten modes of every sample. "alone" computes the samples in
one process; efficiency is its time over workers times their time, from the first
sample that is back, so that the start of the workers, given beside it, is not in it. "work" is the
processor time of a sample alone over that of all processes with workers: what the efficiency could
be at most, and on a machine that has other things to do the only one of the two that says anything.
"""

import os

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import sys
import time
from pathlib import Path

import psutil

from chladni.workflows.loaded_model import Model
from chladni_specimens.plates import folded_panel
from chladni_specimens.tailgate.design import TailgateDesign
from chladni_specimens.tailgate.tailgate import tailgate
from chladni_studies import StudySettings
from chladni_studies.parameter_study import study

PANEL = ("t=90%:110%", "E=95%:105%", "rho=95%:105%"), 120
TAILGATE = ("t of inner=90%:110%", "E of hem adhesive=50%:200%"), 24


def worked():
    """Processor time of this process and all it started so far, which are still there [s]."""
    me = psutil.Process()
    times = [p.cpu_times() for p in (me, *me.children(recursive=True))]
    return sum(t.user + t.system for t in times)


def timed(model, ranges, samples, workers):
    """Seconds until the first sample; of each that follows, by the clock and of the processors."""
    ticks = []
    begin = time.perf_counter()

    def told(what, share):
        if len(ticks) in (1 + workers, samples):
            ticks.append((time.perf_counter() - begin, worked()))
        else:
            ticks.append((time.perf_counter() - begin, 0.0))

    settings = StudySettings(samples=samples)
    study(model, ranges, settings, workers=workers, progress=told)
    first, last = 1 + workers, samples  # two are said before any is back; not each worker's first
    count = last - first
    return ticks[2][0], *((b - a) / count for a, b in zip(ticks[first], ticks[last], strict=True))


def main():
    """Print the table."""
    words = sys.argv[1:]
    if "tailgate" in words:
        made, (ranges, samples) = tailgate(TailgateDesign(size=0.032)), TAILGATE
    else:
        made, (ranges, samples) = folded_panel(0.6, 0.3, 0.04, 0.01, 0.02, 1e-3), PANEL
    model = Model(Path("specimen"), made)
    print(f"{len(model.structure.system.dofs)} degrees of freedom, {samples} samples\n")
    print("| workers | first sample after [s] | samples a second | efficiency | work |")
    print("|---|---|---|---|---|")
    first, alone, own = timed(model, ranges, samples, 1)
    print(f"| alone | {first:.1f} | {1 / alone:.2f} | 1 | 1 |", flush=True)
    for workers in map(int, [w for w in words if w != "tailgate"] or ("2",)):
        first, each, work = timed(model, ranges, samples, workers)
        share = alone / (workers * each)
        print(f"| {workers} | {first:.1f} | {1 / each:.2f} | {share:.2f} | {own / work:.2f} |")


if __name__ == "__main__":
    main()
