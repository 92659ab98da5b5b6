"""Errors of the model: the mesh of the deck, the formulation of its elements, its folds.

Bending stiffness at folds differs between meshes, codes and tools. A radius of 5 mm is a sharp edge
between shells of 20 mm. One solver makes solids of shells and ties their ends at an edge rigidly;
another lets them rotate. A bead smaller than a shell is missing from the deck. Membrane and mass
are the same in all of them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..dynamics.modes import ModalModel
from ..dynamics.reduction import iterated
from ..fem.assemble import Structure, structure
from ..fem.modelled import Modelled, solved
from ..geometry.beam_lines import member_beams
from ..geometry.facets import cell_areas
from ..geometry.folds import share_at_folds
from ..geometry.footprints import on_smaller_shells, on_whole_shells, regions_of_joints
from ..geometry.refine import refined
from ..model.assembly import Assembly
from .beam_theory import as_deep_beams, bending_members, theory_prior
from .calibration_parameters import LogField
from .effect import Effect, ModalFactor, Parameter, ShapeChange, Term, Traits
from .element_groups import ElementGroups

MOST_DOFS = 60_000  # dofs up to which a structure is refined: four times as many take half a minute
LARGE = 20_000  # dofs from which refined modes are solved only up to the comparison limit
ABOVE, ABOVE_LARGE = (1.4, 1.6), (1.1, 1.25)  # times f_max, on the mesh and on the refined one
FAR = 0.1  # largest change of a frequency for which modes of one mesh are near those of another
LIMIT = 4 / 3  # Richardson: errors fall as h², so the limit lies a third beyond the refined mesh
LEFT = 0.17 / LIMIT  # share of an error of h² that meshes of other tools still have
MESH_SD = 0.3  # of the prior of the mesh error
FOOTPRINT = 0.5, 0.7  # prior of the footprint error: as in the deck, half or a quarter as wide
REGIONS = 4  # regions of joints with their own footprints; each needs one refined solution
FOLDS = 0.4  # prior sd of ln of the bending stiffness of a shell with folds at all corners
LEAST_SHARE = 0.02  # share at folds, in groups that have folds, below which a part has no factor


@dataclass(frozen=True, eq=False)
class MeshError(Effect):
    """Modal stiffness Λ^½ e^{x L} Λ^½: that of a mesh twice as fine at x = 1.

    Relative errors are extrapolated, not differences, so no mode loses all of its stiffness.
    """

    name = "mesh-error"
    claim = "the mesh is not infinitely fine"
    kind = "nuisance"
    traits = Traits(writable=False)

    # (k, n) coordinates of the modes of the deck
    rows: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    omega: np.ndarray = field(default_factory=lambda: np.zeros(0))  # (k,) [rad/s]
    log: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # (k, k) L
    # (p, k) change of motion at the measured places by each coordinate
    shapes: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    order: int = 2  # p: errors fall as h^p
    file: "MeshError | None" = None  # the deck with halved shells, if its joints are others

    @property
    def limit(self) -> np.ndarray:
        """Natural frequencies of the modes on an infinitely fine mesh (k,) [Hz], increasing."""
        return self._frequency(limit_of(self.order))

    def largest(self, x: float) -> float:
        """Largest relative change of a natural frequency at x."""
        return float(np.abs(self._frequency(x) / np.sort(self.omega / (2 * np.pi)) - 1).max())

    def _frequency(self, x: float) -> np.ndarray:
        """Natural frequencies at x (k,) [Hz], increasing."""
        w, V = np.linalg.eigh(x * self.log)
        lam = np.linalg.eigvalsh(self.omega[:, None] * ((V * np.exp(w)) @ V.T) * self.omega)
        return np.asarray(np.sqrt(np.maximum(lam, 0.0)) / (2 * np.pi))

    def terms(self, x: np.ndarray) -> tuple[Term, ...]:
        """x L over the modes, and x times the change of their shapes at sensors and shaker."""
        own = ModalFactor(self.rows, self.omega, x[0] * self.log, self.log[None])
        if not len(self.shapes):
            return (own,)
        return own, ShapeChange(self.rows, self.shapes, float(x[0]), np.ones(1))

    @property
    def halved(self) -> "HalvedMesh":
        """The finer mesh itself."""
        of = self.file or self
        return HalvedMesh((), of.text, rows=of.rows, omega=of.omega, log=of.log, shapes=of.shapes)


@dataclass(frozen=True, eq=False)
class HalvedMesh(MeshError):
    """The mesh twice as fine, which a deck can have: a mesh error of x = 1, no parameter."""

    name = "halved-mesh"
    claim = "every shell is halved"

    def terms(self, x: np.ndarray) -> tuple[Term, ...]:
        """L over the modes, and the change of their shapes at sensors and shaker."""
        own = ModalFactor(self.rows, self.omega, self.log, np.zeros((0, *self.log.shape)))
        if not len(self.shapes):
            return (own,)
        return own, ShapeChange(self.rows, self.shapes, 1.0, np.zeros(0))


@dataclass(frozen=True, eq=False)
class ModalDiscrepancy(Effect):
    """Independent small errors x_r of the logarithm of the stiffness of each mode."""

    name = "jitter"
    claim = "another element formulation gives slightly different frequencies"
    kind = "nuisance"
    traits = Traits(writable=False)

    rows: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    omega: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def terms(self, x: np.ndarray) -> tuple[ModalFactor, ...]:
        """λ_r e^{x_r} of each mode."""
        each = np.eye(len(x))
        return (ModalFactor(self.rows, self.omega, np.diag(x), each[:, :, None] * each[:, None]),)


@dataclass(frozen=True, eq=False)
class JointFootprint(MeshError):
    """Relative change of modal stiffness: x times that of joints on shells half as wide."""

    name = "joint-footprint"
    claim = "a joint acts over the width of one shell of the mesh, not over its real width"


@dataclass(frozen=True, eq=False)
class BeamTheory(MeshError):
    """Relative change of modal stiffness: x times that of shear and rotary inertia of beams."""

    name = "beam-theory"
    claim = "bars of the deck lack rotary inertia, and their shear flexibility is rough"


Places = Callable[[Structure], sp.csr_array]  # rows of the measured dofs, on any mesh


def mesh_errors(model: Modelled, f_max: float, places: Places | None = None) -> list[MeshError]:
    """Mesh errors of a structure up to somewhat above ``f_max``.

    A large structure has none. Errors of shells with nodes on their edges fall as h⁴, of others as
    h².

    The list holds the error of the elements. Joints on whole shells add the error of their
    footprints: one common to all, and one for each region, because two meshers attach one joint to
    different shells. Fasteners from grid to grid add one common to all of them. Beams of frames and
    stringers add the error of their theory.

    The refined modes Ψ at the old points are paired with the modes Φ. B = ΦᵀMΨ is made orthogonal,
    softest modes first, and Λ^½ e^L Λ^½ = B Λ_ref Bᵀ. B is square, so that x = 1 gives the refined
    frequencies exactly.

    Ψ begins with Φ, that of other footprints with Ψ. :func:`.iterated` leaves the square of what
    changes, times (λ_r/λ_m)² a step, λ_m that of the last mode it begins with. No count proves Ψ
    complete.
    """
    built = model.structure
    made = built.assembly
    if len(built.system.dofs) > MOST_DOFS or not len(made.shells) + len(made.beams):
        return []
    above = ABOVE if len(built.system.dofs) < LARGE else ABOVE_LARGE
    band = above[1] * f_max
    coarse = _CoarseModes.of(
        built, _flexible(model.up_to(above[0] * f_max), f_max), places or _nowhere
    )
    begun = _Begun(built, built.system.M @ model.up_to(min(band, model.band)).shapes)
    lowest = float(coarse.omega.min(initial=2 * np.pi * f_max)) / (2 * np.pi)

    def change(finer: Assembly, begun: _Begun) -> tuple[_ModalChange, _Begun]:
        """The change by a mesh, and what another begins with whose modes are near."""
        made = structure(finer)
        loads = made.rows(begun.built.system.dofs).T @ begun.loads
        modes = iterated(made.system, loads, lowest / 2)
        near = coarse.changed_to(made, _flexible(modes.sel(modes.frequency < band), f_max))
        if (near if begun.change is None else near - begun.change).largest(f_max) >= FAR:
            modes = solved(made, band).modes
            near = coarse.changed_to(made, _flexible(modes, f_max))
        return near, _Begun(made, made.system.M @ modes.shapes, near)

    fine = refined(built.assembly)
    whole = on_whole_shells(built.assembly, fine)
    of_shells, begun = change(whole, begun)
    order = order_of(made)
    prior = limit_of(order) * (1 - LEFT ** (order / 2)), MESH_SD
    errors = [of_shells.error(MeshError, prior, order)]
    if whole is not fine:
        of_file, _ = change(fine, begun)
        file = of_file.error(MeshError, prior, order)
        errors = [replace(errors[0], file=file)]
        errors.append((of_file - of_shells).error(JointFootprint, FOOTPRINT))
    if len(bending_members(built.assembly)):
        deep, _ = change(as_deep_beams(whole), begun)
        errors.append((deep - of_shells).error(BeamTheory, theory_prior(built.assembly)))
    smaller = on_smaller_shells(built.assembly, fine)
    moved = [k for k, (new, old) in enumerate(zip(smaller, fine.rigid, strict=True)) if new != old]

    def footprints(bodies: Sequence[int], mean: float, sd: float) -> MeshError:
        rigid = [smaller[k] if k in bodies else old for k, old in enumerate(fine.rigid)]
        rigid += whole.rigid[len(rigid) :]
        on_less, _ = change(replace(whole, rigid=tuple(rigid)), begun)
        return (on_less - of_shells).error(JointFootprint, (mean, sd))

    if moved:
        errors.append(footprints(moved, *FOOTPRINT))
        regions = regions_of_joints(built.assembly, moved, REGIONS)
        if len(regions) > 1 and len(built.system.dofs) < LARGE:
            errors += [footprints(at.tolist(), 0.0, FOOTPRINT[1] / np.sqrt(n)) for at, n in regions]
    return errors


def limit_of(order: int) -> float:
    """Share of the change to h/2 that leads to h = 0 where errors fall as h^p: 1 / (1 - 2^-p)."""
    return 1 / (1 - 0.5**order)


def order_of(assembly: Assembly) -> int:
    """Order p of the error of a mesh, that of its worst elements."""
    quadratic = assembly.shells.curved.all() and not len(member_beams(assembly))
    return 4 if len(assembly.shells) and quadratic else 2


def _nowhere(built: Structure) -> sp.csr_array:
    return sp.csr_array((0, len(built.system.dofs)))


@dataclass(frozen=True, eq=False)
class _ModalChange:
    """Changes by another mesh, over the modes of the deck: their coordinates ΦᵀM (r, n), ω (r,).

    ``log`` (r, r) is the logarithm of the relative change of modal stiffness, ``seen`` (p, r) the
    change of the mode shapes at the measured places.
    """

    rows: sp.csr_array
    omega: np.ndarray
    log: np.ndarray
    seen: np.ndarray

    def __sub__(self, other: Self) -> Self:
        """The difference of two changes."""
        return replace(self, log=self.log - other.log, seen=self.seen - other.seen)

    def largest(self, f_max: float) -> float:
        """Largest relative change of a frequency up to ``f_max`` [Hz]."""
        within = self.omega <= 2 * np.pi * f_max
        return float(np.abs(self.log.diagonal()[within]).max(initial=0.0)) / 2

    def error(self, kind: type[MeshError], prior: tuple[float, float], order: int = 2) -> MeshError:
        """The nuisance effect with this change."""
        unknown = Parameter("mesh", "-", *prior, kind="linear", step=0.5)
        return kind(
            (unknown,), "every mode", rows=self.rows, omega=self.omega, log=self.log,
            shapes=self.seen, order=order,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Begun:
    """Loads M Φ (n, k) of known modes of a structure, and its change if it is not the deck's."""

    built: Structure
    loads: np.ndarray
    change: _ModalChange | None = None


@dataclass(frozen=True, eq=False)
class _CoarseModes:
    """The modes of the deck: ω (r,), ΦᵀM (r, n), Φ at the measured places (p, r)."""

    dofs: np.ndarray
    omega: np.ndarray
    rows: sp.csr_array
    at_places: np.ndarray
    places: Places

    @classmethod
    def of(cls, built: Structure, modes: ModalModel, places: Places) -> Self:
        """Collect the modes of the deck's structure."""
        rows, phi = sp.csr_array((built.system.M @ modes.shapes).T), modes.shapes
        return cls(
            built.system.dofs, 2 * np.pi * modes.frequency, rows, places(built) @ phi, places
        )

    def changed_to(self, finer: Structure, modes: ModalModel) -> _ModalChange:
        """The change by a finer structure with modes Ψ."""
        from scipy.optimize import linear_sum_assignment

        overlap = self.rows @ (finer.rows(self.dofs) @ modes.shapes)
        own, partner = linear_sum_assignment(-(overlap**2))
        soft = np.argsort(self.omega[own], kind="stable")
        own, partner = own[soft], partner[soft]
        B = _orthogonal(overlap[np.ix_(own, partner)])
        half = B * (2 * np.pi * modes.frequency[partner]) / self.omega[own, None]
        log, seen = np.zeros((len(self.omega),) * 2), np.zeros_like(self.at_places)
        log[np.ix_(own, own)] = _log(half @ half.T)
        seen[:, own] = self.places(finer) @ modes.shapes[:, partner] @ B.T - self.at_places[:, own]
        return _ModalChange(self.rows, self.omega, log, seen)


def _log(A: np.ndarray) -> np.ndarray:
    """Logarithm of a positive definite matrix."""
    w, V = np.linalg.eigh(A)
    return np.asarray((V * np.log(w)) @ V.T)


def _orthogonal(overlap: np.ndarray) -> np.ndarray:
    """Make the columns (n, n) of a mode overlap orthogonal in their order, the softest first.

    Another mass matrix puts δM_ij of a soft mode i into a stiff one j, and only λ_i/λ_j as much of
    j into i. The polar factor would share both evenly and turn the soft mode towards the stiff one.
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
    own = np.zeros(len(modes.frequency))
    if mesh is not None:
        b = mesh.rows @ modes.shapes
        own = 0.5 * np.abs(b.T @ mesh.log @ b).diagonal() / 2
    unknown = tuple(
        Parameter(f"mode {r + 1}", "-", 0.0, 2 * float(std), kind="linear", step=0.02)
        for r, std in enumerate(np.hypot(sd, own))
    )
    rows = sp.csr_array((model.structure.system.M @ modes.shapes).T)
    omega = 2 * np.pi * modes.frequency
    return ModalDiscrepancy(unknown, "every mode", rows=rows, omega=omega)


def _flexible(modes: ModalModel, f_max: float) -> ModalModel:
    keep = modes.frequency > 1e-3 * f_max
    return ModalModel(modes.frequency[keep], modes.damping[keep], modes.shapes[:, keep], modes.dofs)


class FoldBending(LogField):
    """A factor e^(x s) on the bending stiffness of one part, s the share of a group at folds."""

    name = "fold-bending"
    claim = "a fold is stiffer or softer in bending than shells joined at an angle"
    kind = "nuisance"
    traits = Traits(writable=False)


def fold_bending(groups: ElementGroups) -> list[FoldBending]:
    """One factor for every part of shells that has a fold."""
    assembly = groups.structure.assembly
    cells, points = assembly.shells.nodes, assembly.points
    if not len(cells):
        return []
    area, of = cell_areas(points, cells), groups.group[: len(cells)]
    folded = np.bincount(of, area * share_at_folds(points, cells), len(groups))
    share = folded / np.maximum(np.bincount(of, area, len(groups)), np.finfo(float).tiny)
    out = []
    for k in np.unique(groups.part[groups.sheet]):
        own = np.where((groups.part == k) & groups.sheet, share, 0.0)
        if own @ groups.area > LEAST_SHARE * groups.area[own > 0].sum():
            name = assembly.parts[k].name
            unknown = Parameter("k", "-", 0.0, FOLDS, step=0.3)
            text = f"bending at folds of {name}"
            out.append(FoldBending((unknown,), text, quantity="bending", functions=own[:, None]))
    return out
