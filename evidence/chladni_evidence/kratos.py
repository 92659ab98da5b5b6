"""Modes of an assembly by KratosMultiphysics, a third code.

Kratos (StructuralMechanicsApplication 10.4) gives K and M of thin corotational shells, in
quadrilaterals or triangles, and of linear beams. Springs and masses at points are added to them,
held degrees of freedom are taken out, and SciPy solves for the modes: our elements and our
eigensolver have no part in it. Kratos may be installed in a Python of its own, which
``CHLADNI_KRATOS`` names. Anything without counterpart is refused.
"""

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.linalg import block_diag, eigh
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from chladni.errors import AccuracyError, FileError, ModelError
from chladni.model.assembly import Assembly
from chladni.model.properties import BeamSection, Isotropic, Part, ShellSection

from . import kratos_matrices

PYTHON = "CHLADNI_KRATOS"  # environment variable: the Python that has Kratos
RIGID = 0.02  # below it a frequency is rounding [Hz]
LEAST = 1e-12  # of a Gram matrix: directions below it are rounding


@dataclass(frozen=True, eq=False)
class Stretched(Assembly):
    """An assembly in a state of strain, from displacements ``moved`` (n, 3) of its points [m]."""

    moved: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))


@cache
def installed() -> bool:
    """True where a Python has Kratos with its structural application."""
    wanted = "import KratosMultiphysics.StructuralMechanicsApplication"
    try:
        run = subprocess.run([_python(), "-c", wanted], capture_output=True, check=False)
    except OSError:
        return False
    return run.returncode == 0


def needed() -> None:
    """Raise ``FileError`` where no Python has Kratos."""
    if not installed():
        raise FileError(
            f"{_python()} has no KratosMultiphysics with its StructuralMechanicsApplication; "
            f"set {PYTHON} to a Python that has both"
        )


def kratos_modes(
    assembly: Assembly, rows: np.ndarray, loaded: np.ndarray, top: float, triangles: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (r,) [Hz] up to ``top`` and shapes (k, 3, r) [1/√kg] at rows of points.

    Static responses to forces at the loaded points are added by Rayleigh and Ritz, so that the
    flexibility of higher modes is complete there. Rigid modes have 0 Hz.
    """
    K, M = matrices_of(assembly, triangles)
    n = len(assembly.points)
    free = np.setdiff1d(np.arange(6 * n), 6 * assembly.supports[:, 0] + assembly.supports[:, 1] - 1)
    K, M = (A[free][:, free].tocsc() for A in (K, M))
    shift = (2 * np.pi * top / 8) ** 2
    factor = splu(
        K + shift * M,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    shapes = _modes_below(K, M, factor, shift, top)
    at = np.searchsorted(free, (6 * np.unique(loaded)[:, None] + np.arange(3)).ravel())
    forces = np.zeros((len(free), len(at)))
    forces[at, np.arange(len(at))] = 1.0
    extra = factor.solve(forces)
    extra -= shapes @ (shapes.T @ (M @ extra))
    basis = np.hstack([shapes, extra / np.sqrt(np.einsum("ij,ij->j", extra, M @ extra))])
    size, Q = np.linalg.eigh(basis.T @ (M @ basis))
    basis = basis @ (Q[:, size > LEAST] / np.sqrt(size[size > LEAST]))
    lam, Q = eigh(basis.T @ (K @ basis))
    moving = np.zeros((6 * n, len(lam)))
    moving[free] = basis @ Q
    f = np.sqrt(np.maximum(lam, 0.0)) / (2 * np.pi)
    f[f < RIGID] = 0.0
    return f, moving.reshape(n, 6, -1)[rows, :3]


def _modes_below(
    K: sp.csc_matrix, M: sp.csc_matrix, factor: object, shift: float, top: float
) -> np.ndarray:
    """Mass-normalised shapes (n, r) of all modes up to a frequency, by SciPy."""
    inverse = LinearOperator(K.shape, factor.solve, dtype=float)  # type: ignore[attr-defined]
    count = 40
    while True:
        lam, shapes = eigsh(K, count, M, sigma=-shift, OPinv=inverse, v0=np.ones(K.shape[0]))
        below = lam <= (2 * np.pi * top) ** 2
        if not below.all():
            return np.asarray(shapes[:, below])
        count *= 2


def matrices_of(assembly: Assembly, triangles: bool) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """K and M (6 n, 6 n) of all points by Kratos, with springs and masses at points.

    Raises
    ------
    ModelError
        If a member of the assembly has no counterpart.
    FileError
        If no Python has Kratos.
    AccuracyError
        If Kratos failed; the message quotes the end of its output.
    """
    needed()
    if assembly.rigid or any(map(len, assembly.solids)) or assembly.axes is not None:
        raise ModelError("Kratos is given no rigid elements, solids or displacement frames")
    n = len(assembly.points)
    shells, values = _shells(assembly, triangles)
    beams, sections = _beams(assembly)
    moved = assembly.moved if isinstance(assembly, Stretched) else np.zeros((n, 3))
    with tempfile.TemporaryDirectory() as folder:
        given, out = Path(folder, "given.npz"), Path(folder, "out.npz")
        np.savez(
            given, points=assembly.points, moved=moved, shells=shells, shell_values=values,
            beams=beams, beam_values=sections,
        )  # fmt: skip
        run = subprocess.run(
            [_python(), kratos_matrices.__file__, str(given), str(out)], capture_output=True,
            text=True, check=False, env={**os.environ, "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        if not out.exists():
            raise AccuracyError(f"Kratos gave no matrices: {' '.join(run.stderr.split()[-60:])}")
        with np.load(out, allow_pickle=False) as found:
            K, M = (_matrix(found, name) for name in "KM")
    return K + _springs(assembly), M + _masses(assembly)


def _python() -> str:
    return os.environ.get(PYTHON, sys.executable)


def _matrix(found: "np.lib.npyio.NpzFile", name: str) -> sp.csr_matrix:
    """A matrix in the order of points, six degrees of freedom each, without its rounding."""
    columns, rows, data = (found[f"{name}_{k}"] for k in ("columns", "rows", "data"))
    A = sp.csr_matrix((data, columns, rows))[found["equation"].ravel()]
    A = A[:, found["equation"].ravel()]
    return (A + A.T) / 2


def _shells(a: Assembly, triangles: bool) -> tuple[np.ndarray, np.ndarray]:
    """Cells (m, 4), quadrilaterals cut in two where wanted, and E, nu, rho, t of each."""
    cells, thickness, part = a.shells.nodes, a.thickness(), a.shells.part
    if a.shells.offset.any():
        raise ModelError("Kratos is given no offset shells")
    if triangles:
        quad = ~a.shells.triangle
        cells = np.concatenate([cells[:, [0, 1, 2, 2]], cells[quad][:, [0, 2, 3, 3]]])
        thickness, part = (np.concatenate([v, v[quad]]) for v in (thickness, part))
    materials = {p: _sheet(a.parts[p]) for p in np.unique(part)}
    values = np.array([materials[p] for p in part]).reshape(-1, 3)
    return cells, np.column_stack([values, thickness])


def _sheet(part: Part) -> tuple[float, float, float]:
    """E, nu and rho of a part of sheet."""
    s = part.section
    if isinstance(s, ShellSection) and isinstance(m := s.membrane, Isotropic):
        if m == s.bending and s.coupling is None and (s.bending_ratio, s.nonstructural) == (1, 0):
            return m.E, m.nu, m.rho
    raise ModelError(f"part {part.name} is not a plain isotropic sheet, as Kratos is given")


def _beams(a: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """Ends (k, 2) and E, nu, rho, A, J, I1, I2 and areas in shear of beams alike both ways."""
    values = []
    for p in a.beams.part:
        s = a.parts[p].section
        if not isinstance(s, BeamSection) or not isinstance(s.material, Isotropic) or s.I1 != s.I2:
            raise ModelError(
                f"part {a.parts[p].name} is not of beams alike both ways, as Kratos is given"
            )
        m = s.material
        sheared = [k * s.area for k in s.shear]
        values.append([m.E, m.nu, m.rho, s.area, s.J, s.I1, s.I2, *sheared])
    return a.beams.nodes, np.array(values).reshape(-1, 9)


def _springs(a: Assembly) -> sp.csr_matrix:
    """Bushes to ground at their points, each RᵀkR of its frame R."""
    b = a.bushes
    at_points = np.allclose(b.place, a.points[b.nodes[:, 0]]) and (b.nodes[:, 1:] == -1).all()
    if not at_points or len(a.springs):
        raise ModelError("Kratos is given springs from points to ground, as bushes, and no others")
    frames = [block_diag(R, R) for R in b.frame]
    blocks = [R.T @ np.diag(k) @ R for R, k in zip(frames, b.stiffness, strict=True)]
    return _at_points(a, b.nodes[:, 0], blocks)


def _masses(a: Assembly) -> sp.csr_matrix:
    """Concentrated masses at their points."""
    return _at_points(a, a.masses.node, list(a.masses.matrix))


def _at_points(a: Assembly, rows: np.ndarray, blocks: list[np.ndarray]) -> sp.csr_matrix:
    """Sum of blocks (6, 6) on the diagonal at rows of points."""
    total = np.zeros((len(a.points), 6, 6))
    np.add.at(total, rows, np.array(blocks).reshape(-1, 6, 6))
    return sp.block_diag(list(total), "csr")
