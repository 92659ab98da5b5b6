"""Memory and time of a diagnosis, stage by stage.

    python benchmarks/diagnosis.py CASE [--candidates] [--profile FILE]

A row a stage: processor seconds, the highest resident memory within it and what is left after it,
all of the process, with the pictures and the page of the command. ``--candidates`` gives every
candidate a row of its own, ``--profile`` writes what cProfile sees. Peaks are those that Linux
keeps in /proc/self. A tailgate: ``chladni blind make --set tailgate --seeds 560 --kinds nothing
--out runs/tailgate``, its cases/case-1.
"""

import os

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import argparse
import cProfile
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

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
        self.candidates, self.stage, self.begun = candidates, "reading the case", process_time()
        self.highest = 0.0

    def __call__(self, what, fraction=0.0):
        """The stage before this one has ended, unless it is the same."""
        if what.startswith("trying ") and not self.candidates:
            what = "candidates fitted"
        if what == self.stage:
            return
        now, peak = process_time(), megabytes("VmHWM")
        self.highest = max(self.highest, peak)
        seconds, left = now - self.begun, megabytes("VmRSS")
        print(f"| {self.stage[:60]} | {seconds:.1f} | {peak:.0f} | {left:.0f} |", flush=True)
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
    print("| stage | seconds | peak MB | left MB |\n|---|---|---|---|")
    stages = Stages(asked.candidates)
    if asked.profile:
        profile.enable()
    case = load_case(asked.case)
    found = diagnose(case, stages)
    with TemporaryDirectory() as folder:
        write_diagnosis(Path(folder), case, found, "", stages)
    stages("the end")
    profile.disable()
    if asked.profile:
        profile.dump_stats(asked.profile)
    print(f"| all | {process_time():.1f} | {stages.highest:.0f} | |")


if __name__ == "__main__":
    main()
