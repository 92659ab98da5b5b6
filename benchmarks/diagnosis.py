"""Memory and time of a diagnosis, stage by stage.

    python benchmarks/diagnosis.py CASE [--candidates] [--profile FILE]

A row a stage: seconds on the clock, processor seconds, the highest resident memory within it and
what is left after it, all of the process, with the pictures and the page of the command. As many
threads as a user has; OMP_NUM_THREADS says otherwise. ``--candidates`` gives every family a row
of its own, ``--profile`` writes what cProfile sees (of the thread that asks: run it on one). Peaks
are those that Linux keeps in /proc/self. A tailgate: ``chladni blind make --set tailgate --seeds
560 --kinds nothing --out runs/tailgate``, its cases/case-1.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # identification and modes are begun on one as well

import argparse
import cProfile
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, process_time

from chladni import load_case
from chladni.report.diagnosis_folder import write_diagnosis
from chladni.workflows.diagnose import diagnose

STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def megabytes(name):
    """VmHWM (the peak since it was reset) or VmRSS of this process."""
    line = next(x for x in STATUS.read_text().splitlines() if x.startswith(f"{name}:"))
    return int(line.split()[1]) / 1024


class Stages:
    """A progress callback that prints a row for every stage that ended."""

    def __init__(self, candidates):
        self.candidates, self.stage = candidates, "reading the case"
        self.begun, self.highest = (monotonic(), process_time()), 0.0

    def __call__(self, what, fraction=0.0):
        """The stage before this one has ended, unless it is the same."""
        if what.startswith(("trying ", "tried ")) and not self.candidates:
            what = "candidates fitted"
        if what == self.stage:
            return
        now, peak = (monotonic(), process_time()), megabytes("VmHWM")
        self.highest = max(self.highest, peak)
        clock, busy = (b - a for a, b in zip(self.begun, now, strict=True))
        row = f"{clock:.1f} | {busy:.1f} | {peak:.0f} | {megabytes('VmRSS'):.0f}"
        print(f"| {self.stage[:60]} | {row} |", flush=True)
        CLEAR.write_text("5")  # proc(5): the peak is what is resident now
        self.stage, self.begun = what, now


def main():
    """The table of one case."""
    parser = argparse.ArgumentParser()
    parser.add_argument("case", type=Path)
    parser.add_argument("--candidates", action="store_true")
    parser.add_argument("--profile", type=Path)
    asked = parser.parse_args()
    profile = cProfile.Profile(process_time)
    print("| stage | clock [s] | CPU [s] | peak MB | left MB |\n|---|---|---|---|---|")
    stages, began = Stages(asked.candidates), monotonic()
    if asked.profile:
        profile.enable()
    case = load_case(asked.case)
    found = diagnose(case, progress=stages)
    with TemporaryDirectory() as folder:
        write_diagnosis(Path(folder), case, found, "", stages)
    stages("the end")
    profile.disable()
    if asked.profile:
        profile.dump_stats(asked.profile)
    print(f"| all | {monotonic() - began:.1f} | {process_time():.1f} | {stages.highest:.0f} | |")


if __name__ == "__main__":
    main()
