"""Discretisation errors: the mesh of the deck and the formulation of its elements."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..dynamics.modes import ModalModel
from ..fem.assemble import Structure
from ..fem.modelled import Modelled, modelled
from ..geometry.footprints import on_smaller_shells, regions_of_joints
from ..geometry.refine import refined
from ..model.assembly import Assembly
from .effect import Effect, Parameter, PointTerm, ShapeChange, Term, Traits

MOST_DOFS = 60_000  # dofs up to which a structure is refined: four times as many take half a minute
LARGE = 20_000  # dofs from which refined modes are solved only up to the comparison limit
ABOVE, ABOVE_LARGE = (1.4, 1.6), (1.1, 1.25)  # times f_max, on the mesh and on the refined one
LIMIT = 4 / 3  # Richardson: errors fall as h², so the limit lies a third beyond the refined mesh
MESH = LIMIT - 0.17, 0.3  # prior of the mesh error: mean and standard deviation
SOFTEST = 0.45  # largest loss of modal stiffness by a finer mesh: twice as much leaves a rest
FOOTPRINT = 0.5, 0.7  # prior of the footprint error: as in the deck, half or a quarter as wide
REGIONS = 4  # regions of joints with their own footprints; each needs one refined solution


@dataclass(frozen=True, eq=False)
class MeshError(Effect):
    """Change of modal stiffness: x times that of a mesh twice as fine.

    ``change`` (k,) [rad²/s²] is its diagonal over coordinates ``rows`` (k, n). ``shapes`` (p, k) is
    the change of motion at the measured places for each of these coordinates.
    """

    name = "mesh-error"
    claim = "the mesh is not infinitely fine"
    kind = "nuisance"

    rows: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    change: np.ndarray = field(default_factory=lambda: np.zeros(0))
    shapes: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    def terms(self, x: np.ndarray) -> tuple[Term, ...]:
        """x ΔK over the modes, and x times the change of their shapes at sensors and shaker."""
        own = PointTerm("K", self.rows, x[0] * self.change, self.change[:, None], strained=True)
        if not len(self.shapes):
            return (own,)
        return own, ShapeChange(self.rows, self.shapes, float(x[0]), np.ones(1))


@dataclass(frozen=True, eq=False)
class ModalDiscrepancy(Effect):
    """Independent small errors of the stiffness of each mode."""

    name = "jitter"
    claim = "another element formulation gives slightly different frequencies"
    kind = "nuisance"
    traits = Traits(writable=False)

    rows: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    lam: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """λ_r x_r on the diagonal of the modal stiffness."""
        return (PointTerm("K", self.rows, self.lam * x, np.diag(self.lam), strained=True),)


@dataclass(frozen=True, eq=False)
class JointFootprint(MeshError):
    """Change of modal stiffness: x times that of joints on shells half as wide."""

    name = "joint-footprint"
    claim = "a joint acts over the width of one shell of the mesh, not over its real width"


Places = Callable[[Structure], sp.csr_array]  # rows of the measured dofs, on any mesh


def mesh_errors(model: Modelled, f_max: float, places: Places | None = None) -> list[MeshError]:
    """Mesh errors of a structure up to somewhat above ``f_max``; none for a large structure.

    The list holds the error of the elements. Joints on whole shells add the error of their
    footprints: one common to all, and one for each region, because two meshers attach one joint to
    different shells.

    The refined modes Ψ at the old points are paired with the modes Φ. B = ΦᵀMΨ is made orthogonal,
    softest modes first, and ΔK = B Λ_ref Bᵀ - Λ. B is square, so that x = 1 gives the refined
    frequencies exactly.
    """
    built = model.structure
    made = built.assembly
    if len(built.system.dofs) > MOST_DOFS or not len(made.shells) + len(made.beams):
        return []
    above = ABOVE if len(built.system.dofs) < LARGE else ABOVE_LARGE
    coarse = _CoarseModes.of(
        built, _flexible(model.up_to(above[0] * f_max), f_max), places or _nowhere
    )

    def change(finer: Assembly) -> _ModalChange:
        solved = modelled(finer, above[1] * f_max)
        return coarse.changed_to(solved.structure, _flexible(solved.modes, f_max))

    fine = refined(built.assembly)
    of_shells = change(fine)
    errors = [of_shells.error(MeshError, MESH)]
    smaller = on_smaller_shells(built.assembly, fine)
    moved = [k for k, (new, old) in enumerate(zip(smaller, fine.rigid, strict=True)) if new != old]

    def footprints(bodies: Sequence[int], mean: float, sd: float) -> MeshError:
        rigid = [smaller[k] if k in bodies else old for k, old in enumerate(fine.rigid)]
        on_less = change(replace(fine, rigid=tuple(rigid)))
        return (on_less - of_shells).error(JointFootprint, (mean, sd))

    if moved:
        errors.append(footprints(moved, *FOOTPRINT))
        regions = regions_of_joints(built.assembly, moved, REGIONS)
        if len(regions) > 1 and len(built.system.dofs) < LARGE:
            errors += [footprints(at.tolist(), 0.0, FOOTPRINT[1] / np.sqrt(n)) for at, n in regions]
    return errors


def _nowhere(built: Structure) -> sp.csr_array:
    return sp.csr_array((0, len(built.system.dofs)))


@dataclass(frozen=True, eq=False)
class _ModalChange:
    """Changes by another mesh, over the modes of the deck MΦ (n, r).

    ``stiffness`` (r, r) is the change of the modal stiffness λ (r,), ``seen`` (p, r) that of the
    mode shapes at the measured places.
    """

    M_phi: np.ndarray
    lam: np.ndarray
    stiffness: np.ndarray
    seen: np.ndarray

    def __sub__(self, other: Self) -> Self:
        """The difference of two changes."""
        left = self.stiffness - other.stiffness
        return replace(self, stiffness=left, seen=self.seen - other.seen)

    def error(self, kind: type[MeshError], prior: tuple[float, float]) -> MeshError:
        """The nuisance effect with this change."""
        change, V = np.linalg.eigh(self._within_reach())
        unknown = Parameter("mesh", "-", *prior, kind="linear", step=0.5)
        rows = sp.csr_array((self.M_phi @ V).T)
        return kind((unknown,), "every mode", rows=rows, change=change, shapes=self.seen @ V)

    def _within_reach(self) -> np.ndarray:
        """The change of stiffness, limited on a coarse mesh so that twice the loss leaves a rest.

        The change is linear in x, and a mode with five shells a wave would lose more than it has.
        """
        root = np.sqrt(self.lam)
        share, V = np.linalg.eigh(self.stiffness / np.outer(root, root))
        if share.min(initial=0.0) > -SOFTEST:
            return self.stiffness
        W = root[:, None] * V
        return (W * np.maximum(share, -SOFTEST)) @ W.T


@dataclass(frozen=True, eq=False)
class _CoarseModes:
    """The modes of the deck: λ (r,), MΦ (n, r), Φ at the measured places (p, r)."""

    dofs: np.ndarray
    lam: np.ndarray
    M_phi: np.ndarray
    at_places: np.ndarray
    places: Places

    @classmethod
    def of(cls, built: Structure, modes: ModalModel, places: Places) -> Self:
        """Collect the modes of the deck's structure."""
        lam, phi = (2 * np.pi * modes.frequency) ** 2, modes.shapes
        return cls(built.system.dofs, lam, built.system.M @ phi, places(built) @ phi, places)

    def changed_to(self, finer: Structure, modes: ModalModel) -> _ModalChange:
        """The change by a finer structure with modes Ψ."""
        from scipy.optimize import linear_sum_assignment

        overlap = self.M_phi.T @ (finer.rows(self.dofs) @ modes.shapes)
        own, partner = linear_sum_assignment(-(overlap**2))
        soft = np.argsort(self.lam[own], kind="stable")
        own, partner = own[soft], partner[soft]
        B = _orthogonal(overlap[np.ix_(own, partner)])
        lam = (2 * np.pi * modes.frequency[partner]) ** 2
        stiffness, seen = np.zeros((len(self.lam),) * 2), np.zeros_like(self.at_places)
        stiffness[np.ix_(own, own)] = (B * lam) @ B.T - np.diag(self.lam[own])
        seen[:, own] = self.places(finer) @ modes.shapes[:, partner] @ B.T - self.at_places[:, own]
        return _ModalChange(self.M_phi, self.lam, (stiffness + stiffness.T) / 2, seen)


def _orthogonal(overlap: np.ndarray) -> np.ndarray:
    """Make the columns (n, n) of a mode overlap orthogonal in their order, the softest first.

    Another mass matrix puts δM_ij of a soft mode i into a stiff one j, and only λ_i/λ_j as much of
    j into i. The polar factor would share both evenly and turn the soft mode towards the stiff one.
    For x beyond 1 this acts as a loss of x(x - 1) λ_j δM_ij²/4, which can exceed λ_i.
    """
    Q, R = np.linalg.qr(overlap)
    return np.asarray(Q * np.where(np.diag(R) < 0, -1.0, 1.0))


def modal_discrepancy(
    model: Modelled, f_max: float, mesh: MeshError | None = None, sd: float = 0.0015
) -> ModalDiscrepancy:
    """Independent scatter of each modal frequency up to ``f_max``.

    The standard deviation of ln f combines ``sd`` with half the change of that mode on the finer
    mesh.
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
