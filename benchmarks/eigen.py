"""Sixty modes of a free shell box: this package against its peers, as ratios within one run.

    python benchmarks/eigen.py                # 35 and 140 thousand dofs
    python benchmarks/eigen.py 35 140 360 --without eigsh ccx

Every figure is the processor time of one thread in a process of its own, from matrices in memory to
modes in memory; the peak is that process's resident set. Peers that are not installed are left out.
"""

import argparse
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

COUNT = 60
EDGE = {35: 0.0231, 140: 0.0115, 360: 0.00718}  # element size [m] for thousands of dofs
BASELINE = "scipy eigsh(sigma=)"
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def specimen(edge, turned=True):
    """A closed steel box 1.0 x 0.7 x 0.5 m of 1 mm sheet: assembly, system.

    It is turned out of the axes, so that a row of the stiffness has 54 entries as in any curved
    shell; parallel to the axes, membrane and bending of flat walls part and leave 26.
    """
    from chladni.fem.assemble import structure
    from chladni_specimens.plates import box

    assembly = box(1.0, 0.7, 0.5, h=edge)
    if turned:
        R = Rotation.from_rotvec([0.3, 0.5, 0.7]).as_matrix().T
        shells = replace(assembly.shells, axis=assembly.shells.axis @ R)
        assembly = replace(assembly, points=assembly.points @ R, shells=shells)
    return assembly, structure(assembly).system


def ours(system, count, sigma):
    """Block Lanczos, own multifrontal Cholesky, Sturm count."""
    from chladni.dynamics.eigen import normal_modes

    return normal_modes(system, count).frequency


def ours_unproved(system, count, sigma):
    """The same without the Sturm count, which no peer offers."""
    from chladni.dynamics.eigen import normal_modes

    return normal_modes(system, count, proof=False).frequency


def bare(system, count, sigma):
    """Block Lanczos on CHOLMOD with METIS, nothing checked."""
    from chladni.sparse.factor import factorise
    from chladni.sparse.lanczos import block_lanczos

    factor = factorise(system.K - sigma * system.M, backend="cholmod")
    ritz = block_lanczos(factor.solve, system.M, count)
    ritz.vectors(count)
    return np.sqrt(np.maximum(sigma + 1 / ritz.theta[:count], 0)) / (2 * np.pi)


def superlu(system, count, sigma):
    """Block Lanczos on SuperLU with minimum degree and diagonal pivots, nothing proved."""
    from chladni.dynamics.eigen import normal_modes

    return normal_modes(system, count, backend="superlu", proof=False).frequency


def eigsh(system, count, sigma):
    """scipy.sparse.linalg.eigsh as documented: shift-invert with its own factorisation."""
    from scipy.sparse.linalg import eigsh

    K, M = (sp.csc_matrix(A) for A in (system.K, system.M))
    lam, _ = eigsh(K, count, M, sigma=sigma)
    return np.sort(np.sqrt(np.maximum(lam, 0))) / (2 * np.pi)


METHODS = {
    "chladni": ours,
    "chladni, no proof": ours_unproved,
    "block Lanczos + CHOLMOD": bare,
    "block Lanczos + SuperLU": superlu,
    BASELINE: eigsh,
}


def run_here(name, folder):
    """One method in this process, imports done before the clock starts; prints a line of JSON.

    The shift is σ = -(2π f/2)², f the first elastic frequency: kind to every peer.
    """
    import scipy.sparse.linalg  # noqa: F401

    import chladni.dynamics.eigen  # noqa: F401
    from chladni.dynamics.system import System

    K, M = (sp.csr_array(sp.load_npz(folder / f"{part}.npz")) for part in "KM")
    system = System(M, sp.csr_array(M.shape), K, np.load(folder / "dofs.npy"))
    count, first = json.loads((folder / "wanted.json").read_text())
    begin = time.process_time()
    frequency = METHODS[name](system, count, -((np.pi * first) ** 2))
    seconds = time.process_time() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"seconds": seconds, "peak": peak, "f": np.asarray(frequency).tolist()}))


def run_apart(name, folder):
    """One method in a process of its own; None where a library is missing."""
    command = [sys.executable, __file__, "--run", name, "--folder", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | ONE_THREAD)
    if done.returncode:
        print(f"  {name}: {done.stderr.strip().splitlines()[-1]}")
        return None
    return json.loads(done.stdout)


def calculix(assembly, folder):
    """CalculiX on the same nodes and quadrilaterals (S4): the whole run, reading to writing."""
    program = shutil.which("ccx")
    if program is None:
        return None
    steel = assembly.parts[0].section.membrane
    nodes = "\n".join(
        f"{i}, {x:.9e}, {y:.9e}, {z:.9e}"
        for i, (x, y, z) in zip(assembly.ids, assembly.points, strict=True)
    )
    cells = "\n".join(
        f"{e}, " + ", ".join(map(str, assembly.ids[n]))
        for e, n in zip(assembly.shells.ids, assembly.shells.nodes, strict=True)
    )
    (folder / "box.inp").write_text(
        f"*NODE\n{nodes}\n*ELEMENT, TYPE=S4, ELSET=all\n{cells}\n"
        f"*MATERIAL, NAME=steel\n*ELASTIC\n{steel.E}, {steel.nu}\n*DENSITY\n{steel.rho}\n"
        f"*SHELL SECTION, ELSET=all, MATERIAL=steel\n{assembly.thickness()[0]}\n"
        f"*STEP\n*FREQUENCY\n{COUNT}\n*END STEP\n"
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | ONE_THREAD
    subprocess.run([program, "box"], cwd=folder, capture_output=True, env=environment, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    rows = re.findall(
        r"^\s+\d+\s+\S+\s+\S+\s+(\S+)\s+\S+\s*$", (folder / "box.dat").read_text(), re.M
    )
    return {"seconds": seconds, "peak": float("nan"), "f": [float(x) for x in rows[:COUNT]]}


def compare(system, count, first, without, more=None):
    """Run all methods and print their lines, and those of ``more``, a function of the folder.

    Parameters
    ----------
    first : the first elastic frequency, about [Hz]
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in "KM":
            sp.save_npz(folder / f"{part}.npz", sp.csr_array(getattr(system, part)))
        np.save(folder / "dofs.npy", np.array(system.dofs))
        (folder / "wanted.json").write_text(json.dumps([count, first]))
        results = {m: run_apart(m, folder) for m in METHODS if not skipped(m, without)}
        if more:
            results |= more(folder)
    fill = system.K.nnz / len(system.dofs)
    print(f"\n{len(system.dofs)} degrees of freedom, {fill:.0f} entries a row, {count} modes\n")
    show({name: r for name, r in results.items() if r})


def table(thousands, without, turned):
    """Run all methods on one size of box and print their lines."""
    assembly, system = specimen(EDGE[thousands], turned)

    def solved(folder):
        return {} if "ccx" in without else {"CalculiX, whole run": calculix(assembly, folder)}

    compare(system, COUNT, 10.0, without, solved)


def skipped(method, without):
    """Whether the user left a method out by any part of its name."""
    return any(word.lower() in method.lower() for word in without)


def show(results):
    """A table in Markdown; ratios are times ours."""
    due = np.array(results["chladni"]["f"])
    last = f"f{len(due)}"
    print(
        f"| route | seconds | times ours | peak MB | f7 [Hz] | {last} [Hz] | largest difference |"
    )
    print("|---|---|---|---|---|---|---|")
    for name, r in results.items():
        f = np.array(r["f"])
        far = np.abs(f[6:] / due[6:] - 1).max() if len(f) == len(due) else np.nan
        ratio = r["seconds"] / results["chladni"]["seconds"]
        print(
            f"| {name} | {r['seconds']:.1f} | {ratio:.1f} | {r['peak']:.0f} "
            f"| {f[6]:.3f} | {f[-1]:.3f} | {far:.0e} |",
            flush=True,
        )


def main():
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sizes", nargs="*", type=int, default=[35, 140], help="35, 140 or 360")
    parser.add_argument("--without", nargs="*", default=[], help="parts of names to leave out")
    parser.add_argument("--parallel", action="store_true", help="walls parallel to the axes")
    parser.add_argument("--run", help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.run:
        run_here(arguments.run, arguments.folder)
        return
    for thousands in arguments.sizes or [35, 140]:
        table(thousands, arguments.without, not arguments.parallel)


if __name__ == "__main__":
    main()
