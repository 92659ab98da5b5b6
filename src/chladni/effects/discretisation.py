"""What the mesh of the deck, and the formulation of its elements, hide."""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from scipy.optimize import linear_sum_assignment

from ..dynamics.modes import ModalModel
from ..fem.assemble import Structure
from ..fem.modelled import Modelled, modelled
from ..geometry.refine import refined
from .effect import Effect, Parameter, PointTerm

MOST = 60_000  # dofs of a structure that is still refined: four times as many take half a minute
LARGE = 20_000  # dofs from which the refined modes are solved for no farther than they are compared
ABOVE, ABOVE_LARGE = (1.4, 1.6), (1.1, 1.25)  # times f_max, on the mesh and on the refined one
LIMIT = 4 / 3  # Richardson: errors fall as h², so the limit lies a third beyond the refined mesh


@dataclass(frozen=True, eq=False)
class MeshError(Effect):
    """Modal stiffness moves by x times the change that a mesh twice as fine brings."""

    name = "mesh-error"
    claim = "the mesh is not infinitely fine"
    kind = "nuisance"

    rows: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    change: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """x ΔK over the modes."""
        return (PointTerm("K", self.rows, x[0] * self.change, self.change[:, None]),)


@dataclass(frozen=True, eq=False)
class ModalDiscrepancy(Effect):
    """Every mode's stiffness may be off a little on its own."""

    name = "jitter"
    claim = "elements of another formulation give slightly other frequencies"
    kind = "nuisance"
    writable = False

    rows: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    lam: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """λ_r x_r on the diagonal of the modal stiffness."""
        return (PointTerm("K", self.rows, self.lam * x, np.diag(self.lam)),)


def mesh_error(model: Modelled, f_max: float) -> MeshError | None:
    """The mesh error of a structure up to somewhat above ``f_max``; None if it is too large.

    With Ψ the refined modes at the old points, each the partner of one of Φ, B = polar(ΦᵀMΨ) and
    ΔK = B Λ_ref Bᵀ - Λ.  B is square, so that x = 1 gives the refined frequencies exactly.
    """
    built = model.structure
    if len(built.system.dofs) > MOST or not len(built.assembly.shells):
        return None
    above = ABOVE if len(built.system.dofs) < LARGE else ABOVE_LARGE
    coarse = _flexible(model.up_to(above[0] * f_max), f_max)
    finer = modelled(refined(built.assembly), above[1] * f_max)
    fine = _flexible(finer.modes, f_max)
    rows = _rows_of(finer.structure, built)
    M_phi = built.system.M @ coarse.shapes
    overlap = M_phi.T @ (rows @ fine.shapes)
    own, partner = linear_sum_assignment(-(overlap**2))
    M_phi = M_phi[:, own]
    U, _, Vt = np.linalg.svd(overlap[np.ix_(own, partner)])
    B = U @ Vt
    omega2 = (2 * np.pi * fine.frequency[partner]) ** 2
    delta = (B * omega2) @ B.T - np.diag((2 * np.pi * coarse.frequency[own]) ** 2)
    change, V = np.linalg.eigh((delta + delta.T) / 2)
    unknown = Parameter("mesh", "-", LIMIT - 0.17, 0.3, kind="linear", step=0.5)
    return MeshError((unknown,), "every mode", rows=sp.csr_array((M_phi @ V).T), change=change)


def modal_discrepancy(
    model: Modelled, f_max: float, mesh: MeshError | None, sd: float = 0.0015
) -> ModalDiscrepancy:
    """Independent scatter of each modal frequency up to ``f_max``.

    Standard deviation of ln f: ``sd``, and half of what the finer mesh changes in that mode.
    """
    modes = _flexible(model.up_to(1.1 * f_max), f_max)
    lam = (2 * np.pi * modes.frequency) ** 2
    own = np.zeros(len(lam))
    if mesh is not None:
        b = mesh.rows @ modes.shapes
        own = 0.5 * np.abs((b.T * mesh.change) @ b).diagonal() / (2 * lam)
    unknown = tuple(
        Parameter(f"mode {r + 1}", "-", 0.0, 2 * float(std), kind="linear", step=0.02)
        for r, std in enumerate(np.hypot(sd, own))
    )
    rows = sp.csr_array((model.structure.system.M @ modes.shapes).T)
    return ModalDiscrepancy(unknown, "every mode", rows=rows, lam=lam)


def _flexible(modes: ModalModel, f_max: float) -> ModalModel:
    keep = modes.frequency > 1e-3 * f_max
    return ModalModel(modes.frequency[keep], modes.damping[keep], modes.shapes[:, keep], modes.dofs)


def _rows_of(finer: Structure, coarse: Structure) -> sp.csr_array:
    """Rows of the finer structure at the free dofs of the coarse one."""
    return finer.rows(coarse.system.dofs)
