"""A large deck from file to page: `chladni modes` of a flat steel plate, processor time and memory.

    python benchmarks/large.py [SHELLS ...]      # 200000

Every run is a process of its own with one thread; the peak is that of its resident set.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
HEAD = """SOL 103
CEND
BEGIN BULK
MAT1,1,210000.,,0.3,7.85E-9
PSHELL,1,1,1.0,1,,1
"""


def deck(path, n):
    """A free plate of 1 m x 1 m x 1 mm, n x n shells, in mm, t, s."""
    grids, step = n + 1, 1000.0 / n
    with path.open("w") as out:
        out.write(HEAD)
        for k in range(grids**2):
            row, column = divmod(k, grids)
            out.write(f"GRID,{k + 1},,{column * step:.5f},{row * step:.5f},0.0\n")
        for k in range(n**2):
            a = k // n * grids + k % n + 1
            out.write(f"CQUAD4,{k + 1},1,{a},{a + 1},{a + grids + 1},{a + grids}\n")
        out.write("ENDDATA\n")


def run(n):
    """Processor seconds and peak [GB] of twenty modes with the page."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        deck(folder / "plate.bdf", n)
        command = [sys.executable, "-m", "chladni", "modes", "plate.bdf", "--units", "mm-t-s"]
        process = subprocess.Popen(
            [*command, "--out", "modes"], cwd=folder, env=os.environ | ONE_THREAD,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"chladni modes failed on {n**2} shells")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024**2


def main():
    """A row for each number of shells."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("shells", nargs="*", type=int, default=[200_000])
    print("| shells | dofs | seconds | peak GB |\n|---|---|---|---|")
    for shells in parser.parse_args().shells:
        n = round(shells**0.5)
        seconds, peak = run(n)
        print(f"| {n**2} | {6 * (n + 1) ** 2} | {seconds:.1f} | {peak:.2f} |", flush=True)


if __name__ == "__main__":
    main()
