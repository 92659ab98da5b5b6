"""One evaluation of the reduced model with its gradient against one full solve, as ratios.

    python benchmarks/reduced.py                # panels of 4, 33 and 140 thousand dofs
    python benchmarks/reduced.py large

Ten parameters: E and rho of each of two parts, a mass, a spring, and a thinning (size, width and
place). A full solve is assembly and modes up to the same frequency; finite differences need eleven
of them for the same gradient. Shortest processor time of several runs, one thread.
"""

import os

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import sys
import time

import numpy as np

from chladni.dynamics.eigen import normal_modes
from chladni.effects.attachments import strength
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import count
from chladni.effects.masses import MassEffect
from chladni.effects.sheets import ThicknessDistribution
from chladni.effects.springs import Suspension
from chladni.fem.assemble import structure
from chladni.reduced.accuracy import accuracy
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import REACH, reduced_problem
from chladni_specimens.plates import folded_panel
from timing import timed

TOP = 380.0  # Hz
SIZES = {"demonstration": 0.02, "fine": 0.0065, "large": 0.00314}


def effects(reduced):
    """Ten parameters, none of which leaves the model as it is."""
    places = reduced.candidates
    one, other = (places.rows[k : k + 1] for k in (3, 7))
    grids = tuple(int(places.grids[k]) for k in (3, 7))
    mass = strength("m", "kg", 0.05, 1.0, (0.0,))
    spring = strength("k", "N/m", 5e3, 1.0, (0.0,))
    thin = ThicknessDistribution.on(reduced.groups, 0, 1)
    return [
        *(calibration_parameter(reduced.groups, q, (k,)) for k in (0, 1) for q in ("E", "rho")),
        MassEffect((mass,), "", grids=grids[:1], rows=one),
        Suspension((spring,), "", grids=grids[1:], rows=other, directions=np.eye(3)[2:]),
        thin,
    ]


def row(name, edge):
    """One line of the table."""
    assembly = folded_panel(0.6, 0.3, 0.04, 0.01, edge, 1e-3)
    begin = time.process_time()
    reduced = reduced_problem(assembly, TOP)
    ready = time.process_time() - begin
    chosen = effects(reduced)
    x = np.full(count(chosen), 0.05)
    plain = timed(lambda: evaluate(reduced.model, chosen, x, gradient=False), 10)[0]
    full_gradient = timed(lambda: evaluate(reduced.model, chosen, x), 10)[0]

    def solve():
        normal_modes(structure(assembly).system, band=TOP)

    full = timed(solve, 2 if len(assembly.points) < 10_000 else 1)[0]
    error = timed(lambda: accuracy(reduced, reduced.model, chosen, x, TOP), 1)[0]
    n, r = reduced.model.basis.shape
    ratios = f"{full / full_gradient:.0f} | {(1 + count(chosen)) * full / full_gradient:.0f}"
    times = (
        f"{1e3 * plain:.1f} | {1e3 * full_gradient:.1f} | {full:.2f} | {error:.2f} | {ready:.1f}"
    )
    return f"| {name} | {n} | {r} | {count(chosen)} | {times} | {ratios} |"


def main():
    """Print the table."""
    print(f"Modes up to {TOP:g} Hz; the basis holds those up to {REACH * TOP:g} Hz.\n")
    print(
        "| panel | dofs | basis | parameters | value [ms] | with gradient [ms] | full solve [s] "
        "| error estimate [s] | made ready once [s] | full / gradient | 11 full / gradient |"
    )
    print("|" + "---|" * 11)
    for name in sys.argv[1:] or SIZES:
        print(row(name, SIZES[name]), flush=True)


if __name__ == "__main__":
    main()
