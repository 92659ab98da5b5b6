"""Speed of identification against sdypy-EMA, in one run: python benchmarks/identification.py.

Accelerances of known modes on an even grid with 2 % of noise, channels x lines as asked for. The
peer's least-squares complex frequency method runs to order 60; of its last order the poles nearest
to the true ones are taken, which helps it. Ours finds, selects and weighs alone, residues too.
Every run is a process of its own, recording and all; a library that is missing, runs out of memory
or over the limit has a line that says so.
"""

import argparse
import contextlib
import io
import json
import os
import resource
import subprocess
import sys
from time import monotonic

import numpy as np
from threadpoolctl import threadpool_limits

from chladni.dynamics.frf import FRF
from chladni.ema.identification import identify
from chladni_evidence.identification_evidence import BAND, NOISE, structure
from timing import timed

ORDER = 60


def responses(channels: int, lines: int, modes: int) -> tuple[FRF, np.ndarray]:
    """A recording, and its poles within the band."""
    known, rng = structure(0, modes, channels), np.random.default_rng(0)
    f = np.linspace(0, BAND[1], lines + 1)[1:]  # the peer wants an even grid from zero
    H = known.accelerance(f)[:, :, None]
    sd = NOISE * np.abs(H)
    noise = rng.normal(size=(2, *H.shape)) / np.sqrt(2)
    labels = tuple(f"{k + 1}:+Z" for k in range(channels))
    values = H + sd * (noise[0] + 1j * noise[1])
    return FRF(values, f, labels, labels[:1], "accelerance", variance=sd**2), known.inside


def peer(frf: FRF) -> np.ndarray:
    """Poles [rad/s] of sdypy-EMA's LSCF at order 60."""
    from sdypy import EMA

    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        model = EMA.Model(
            frf=frf.values[:, :, 0].T, freq=frf.frequency, lower=BAND[0], upper=BAND[1],
            pol_order_high=ORDER, frf_form="accelerance",
        )  # fmt: skip
        model.get_poles(show_progress=False)
    poles = np.asarray(model.all_poles[-1], complex)
    return poles[poles.imag > 0]


def error(poles: np.ndarray, due: np.ndarray) -> tuple[float, float]:
    """Worst error of frequency and of damping of the nearest poles, in per cent."""
    p = poles[np.abs(poles[:, None] - due).argmin(axis=0)]
    f = np.abs(np.abs(p) / np.abs(due) - 1).max()
    z = np.abs((p.real / np.abs(p)) / (due.real / np.abs(due)) - 1).max()
    return 100 * float(f), 100 * float(z)


METHODS = {"chladni": lambda frf: identify(frf, BAND).poles, "sdypy-EMA": peer}


def run_here(name: str, channels: int, lines: int, modes: int) -> None:
    """One method in this process; prints a line of JSON."""
    frf, due = responses(channels, lines, modes)
    begin = monotonic()
    with threadpool_limits(1):
        seconds, poles = timed(lambda: METHODS[name](frf), 1)
    clock = monotonic() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    found = {"seconds": seconds, "clock": clock, "peak": peak, "error": error(poles, due)}
    print(json.dumps(found))


def run_apart(name: str, size: str, modes: int, limit: float) -> dict | str:
    """One method in a process of its own; in words why there is no result."""
    command = [sys.executable, __file__, "--run", name, "--sizes", size, "--modes", str(modes)]
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=limit, env=os.environ | one_thread
        )
    except subprocess.TimeoutExpired:
        return f"not done after {limit:g} s"
    if done.returncode:
        return (done.stderr.strip().splitlines() or [f"ended by signal {-done.returncode}"])[-1]
    return json.loads(done.stdout)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", default="30x900,100x5000,500x20000", help="channels x lines")
    parser.add_argument("--modes", type=int, default=15)
    parser.add_argument("--limit", type=float, default=900, help="seconds on the clock for one run")
    parser.add_argument("--run", choices=METHODS, help=argparse.SUPPRESS)
    args = parser.parse_args()
    sizes = [tuple(map(int, size.split("x"))) for size in args.sizes.split(",")]
    if args.run:
        run_here(args.run, *sizes[0], args.modes)
        return
    heads = f"{'CPU [s]':>10}{'x ours':>8}{'clock [s]':>11}{'x ours':>8}"
    heads += f"{'peak MB':>9}{'df [%]':>10}{'dzeta [%]':>11}"
    print(f"{'size':>12}{'':>12}{heads}")
    for channels, lines in sizes:
        size, ours = f"{channels}x{lines}", (float("nan"), float("nan"))
        for name in METHODS:
            found = run_apart(name, size, args.modes, args.limit)
            if isinstance(found, str):
                print(f"{size:>12}{name:>12}  {found}")
                continue
            (cpu, clock), (f, z) = (found["seconds"], found["clock"]), found["error"]
            ours = (cpu, clock) if name == "chladni" else ours
            print(f"{size:>12}{name:>12}{cpu:10.2f}{cpu / ours[0]:8.2f}"
                  f"{clock:11.2f}{clock / ours[1]:8.2f}"
                  f"{found['peak']:9.0f}{f:10.4f}{z:11.3f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
