"""Element matrices of a sheet, split by the power of t and by the component of Q.

Transverse shear in series with residual bending, S = (Z_s + Z_r)⁻¹, is neither linear nor cubic in
t. It is split into S Z_s S and S Z_r S: with the powers t and t³ for these two, the value *and* the
first derivative are exact.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..fem import shell
from ..fem.shell import ShellGeometry
from ..fem.shell_section import SectionArrays, section_arrays
from ..model.assembly import Assembly, picked

COMPONENTS = {"Q11": ((0, 0),), "Q22": ((1, 1),), "Q12": ((0, 1), (1, 0)), "Q66": ((2, 2),)}

Pair = tuple[np.ndarray, np.ndarray]


def thickness_split(
    assembly: Assembly, geo: ShellGeometry, arrays: SectionArrays | None = None
) -> Pair:
    """(A, B) with K = A + B and ∂K/∂ln t = A + 3 B (m, 24, 24) each [N/m]."""
    arrays = section_arrays(assembly, geo) if arrays is None else arrays
    t, reference = assembly.shells.thickness, arrays.Qm
    thin, residual = _shear_split(arrays)
    linear = shell.stiffness(geo, t, Qm=arrays.Qm, S=thin, drill=arrays.drill, reference=reference)
    return linear, shell.stiffness(geo, t, Qb=arrays.Qb, S=residual, reference=reference)


def component_matrices(assembly: Assembly) -> Iterator[tuple[str, Pair]]:
    """(A, B) as above for each component k: ∂K/∂ln Q_k = A_k + B_k, Σ_k A_k + B_k = K.

    Shear flexibility of the material and the drilling stiffness are assigned to Q66.
    """
    geo = shell.geometry(assembly.points, assembly.shells)
    arrays = section_arrays(assembly, geo)
    t, reference = assembly.shells.thickness, arrays.Qm
    thin, _ = _shear_split(arrays)
    for name, entries in COMPONENTS.items():
        Qm, Qb = _only(arrays.Qm, entries), _only(arrays.Qb, entries)
        own = name == "Q66"
        linear = shell.stiffness(
            geo, t, Qm=Qm, S=thin if own else None, drill=arrays.drill if own else None,
            reference=reference,
        )  # fmt: skip
        residual = arrays.shear_by_bending(geo, Qb)
        yield name, (linear, shell.stiffness(geo, t, Qb=Qb, S=residual, reference=reference))


def shear_matrices(assembly: Assembly, rows: np.ndarray) -> np.ndarray:
    """γᵀ S Z_s S γ and γᵀ S Z_r S γ of some shells (2, m, 24, 24), which grow with t and t³."""
    shells = picked(assembly.shells, rows)
    geo = shell.geometry(assembly.points, shells)
    arrays = section_arrays(replace(assembly, shells=shells), geo)
    return np.stack([
        shell.stiffness(geo, shells.thickness, S=S, reference=arrays.Qm)
        for S in _shear_split(arrays)
    ])  # fmt: skip


def _shear_split(arrays: SectionArrays) -> Pair:
    """S Z_s S and S Z_r S (m, 2, 2)."""
    S, Z = arrays.S, arrays.shear_flexibility
    thin = S @ Z @ S
    return thin, S - thin


def _only(Q: np.ndarray, entries: tuple[tuple[int, int], ...]) -> np.ndarray:
    out = np.zeros_like(Q)
    for i, j in entries:
        out[:, i, j] = Q[:, i, j]
    return out
