"""A calibration: value and gradient of its residual as ratios, and the whole with twenty starts.

    python benchmarks/calibration.py                # both tables; panels of 4 and 33 thousand dofs
    python benchmarks/calibration.py residual
    python benchmarks/calibration.py whole demonstration fine tailgate

The residual: ten parameters, 40 channels, 900 lines, a basis of about 100 modes, against plain
synthesis of 100 modes by one product of numpy, and against assembly and modes of the whole model.
The whole: E, rho and t of the parts of a deck to a recording of 30 channels with 1 % of noise, from
reading the deck to the result. Processor time, one thread.
"""

import os

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import count
from chladni.fem.assemble import structure
from chladni.inference.likelihood import Responses
from chladni.io.nastran import write_assembly
from chladni.io.package_files import mesh_path
from chladni.io.tables.write_tables import write_npz
from chladni.progress import silent
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.search.calibration import CalibrationSettings
from chladni.workflows.states import diagnose_states
from chladni_specimens.plates import folded_panel
from reduced import SIZES, effects
from timing import timed

TOP, LINES, CHANNELS, MODES = 560.0, 900, 40, 100
STARTS = 20
CASE = """[model]
deck = "deck.bdf"
units = "{units}"
[test]
recordings = ["recording.npz"]
mass = {mass:.6g}
[band]
fit = [{low:g}, {high:g}]
"""
BANDS = {"tailgate": (15.0, 120.0)}  # Hz; panels 20 to 300


def residual(name):
    """One line: value and gradient against synthesis and a full solve."""
    assembly = folded_panel(0.6, 0.3, 0.04, 0.01, SIZES[name], 1e-3)
    reduced = reduced_problem(assembly, TOP)
    model, chosen = reduced.model, effects(reduced)
    x = np.full(count(chosen), 0.05)
    places = reduced.candidates.rows
    rows = places[np.linspace(0, places.shape[0] - 1, CHANNELS).astype(int)]
    s = 2 * np.pi * np.linspace(20, TOP, LINES) * (0.02 + 1j)
    one = np.ones((LINES, CHANNELS, 1), complex)
    data = Responses(one, s, rows, rows[:1], np.ones((LINES, CHANNELS), bool)).rebased(model)
    data = replace(data, values=data.model(evaluate(model, chosen, 0 * x)))

    def value(gradient):
        return data.residual(evaluate(model, chosen, x, gradient), gradient)

    rng = np.random.default_rng(0)
    phi, lam = rng.normal(size=(CHANNELS, MODES)), np.linspace(1e2, 1e7, MODES)

    def synthesis():
        return (1 / (lam + s[:, None] ** 2)) @ (phi * phi[0]).T

    plain, slopes, numpy = (
        timed(run, 10)[0] for run in (lambda: value(False), lambda: value(True), synthesis)
    )
    full = timed(lambda: normal_modes(structure(assembly).system, band=TOP), 1)[0]
    n, r = model.basis.shape
    return (
        f"| {name} | {n} | {r} | {1e3 * numpy:.1f} | {1e3 * plain:.0f} | {1e3 * slopes:.0f} "
        f"| {slopes / numpy:.0f} | {full:.2f} | {full / slopes:.1f} "
        f"| {(1 + count(chosen)) * full / slopes:.0f} |"
    )


def deck(name):
    """The assembly of a case and its unit system."""
    if name == "tailgate":
        return chladni.load(mesh_path("tailgate_30mm.bdf"), "mm-t-s").assembly, "mm-t-s"
    return folded_panel(0.6, 0.3, 0.04, 0.01, SIZES[name], 1e-3), "SI"


def made(folder, name):
    """A case: the deck, and a recording of the same mesh with E of every part 3 % higher."""
    assembly, units = deck(name)
    groups = reduced_problem(assembly, 1.0).groups
    parts = range(len(assembly.parts))
    stiffer = calibration_parameter(groups, "E", list(parts)).apply(assembly, np.array([0.03]))
    write_assembly(assembly, folder / "deck.bdf", units)
    model = chladni.load(write_assembly(stiffer, folder / "article.bdf", units), units)
    low, high = BANDS.get(name, (20.0, 300.0))
    nodes = np.unique(assembly.shells.nodes)
    chosen = assembly.ids[nodes[np.linspace(0, len(nodes) - 1, 30).astype(int)]]
    outputs = [f"{g}:n" for g in chosen]
    frequency = np.linspace(0.5 * low, 1.2 * high, LINES)
    H = chladni.frf(model, outputs, outputs[:1], frequency).frfs[0].to("accelerance")
    z = np.random.default_rng(0).normal(size=(2, *H.values.shape))
    noisy = replace(H, values=H.values * (1 + 0.01 * (z[0] + 1j * z[1]) / np.sqrt(2)))
    write_npz(folder / "recording.npz", noisy)
    mass = chladni.modes(model, 7).mass
    text = CASE.format(units=units, mass=mass, low=low, high=high)
    (folder / "case.toml").write_text(text, encoding="utf-8")


def whole(name):
    """One line: a calibration with twenty starts."""
    with tempfile.TemporaryDirectory() as scratch:
        made(Path(scratch), name)
        settings = CalibrationSettings(starts=STARTS)

        def run():
            case = chladni.load_case(Path(scratch))
            return case, diagnose_states(case, False, silent, settings)

        seconds, (case, found) = timed(run, 1)
        quick = timed(
            lambda: diagnose_states(case, False, silent, CalibrationSettings(quick=True)), 1
        )[0]
    dofs, best = 6 * len(case.assembly.points), found.study.basins[0]
    return (
        f"| {name} | {dofs} | {len(found.study.names)} | {STARTS} | {seconds:.0f} "
        f"| {quick:.0f} | {best.starts} |"
    )


def main():
    """Print the tables."""
    asked = sys.argv[1:]
    if "whole" not in asked:
        print(
            "| panel | dofs | basis | synthesis [ms] | value [ms] | with gradient [ms] | gradient "
            "/ synthesis | full solve [s] | full / gradient | 11 full / gradient |"
        )
        print("|" + "---|" * 10)
        for name in ("demonstration", "fine"):
            print(residual(name), flush=True)
    if "residual" not in asked:
        print(
            "\n| deck | dofs | free parameters | starts | calibration [s] | from one start [s] "
            "| starts in the best basin |"
        )
        print("|" + "---|" * 7)
        for name in [a for a in asked if a != "whole"] or ("demonstration", "fine"):
            print(whole(name), flush=True)


if __name__ == "__main__":
    main()
