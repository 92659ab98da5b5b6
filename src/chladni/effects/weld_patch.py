"""Patches about joints: the sheet around them has another modulus, over a free radius.

The joints are welds of solids, or the spiders of RBE2 and RBE3, whose radius a deck can only guess.
E of a shell is multiplied by e^{x q}, q = R²/s exp(-d²/2s), s = R² + v.  q is a bell of radius R
about the nearest joint at distance d.  It is averaged over a shell of variance v = area/12.  It is
smooth in R, also where R is smaller than a shell.  Shells are collected in rings of nearly equal q,
which a deck holds as properties of their own.  The patch stands for nugget, heat-affected zone and
the mesh of the joint (Echaniz Granado 2015, section 5.4: shells that touch weld solids get a
material).
"""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..fem.assemble import Structure
from ..fem.sparse_assembly import blocks, congruence
from ..geometry.sampling import nearest_points
from ..model.assembly import Assembly, Average, RigidBody, Shells
from ..model.free_parameter import FreeParameter
from .effect import Effect, MatrixTerm, Parameter, Traits, Within
from .element_groups import ElementGroups, shear_matrices
from .joint_stiffness import within_shear
from .joints import fasteners
from .sheet_patch import in_bands
from .sheets import softened

FIELD, SPIDERS = "weld-patch", "rigid-patch"
PATCHES = FIELD, SPIDERS
SD_E, SD_R = 0.3, 0.4  # prior sd of ln of the factor on E and of ln R
RINGS = 5  # of shells about the joints
LEAST = 0.05  # of the bell's height: shells with less of it are outside


@dataclass(frozen=True, eq=False)
class WeldPatch(Effect):
    """K + Σ_rings (e^{x q_j(R)} - 1) K_j, parameters x and ln R.

    The transverse shear is separate, for it has a factor of its own in every fit.
    """

    name = "weld-patch"
    claim = "the sheet around welds is stiffer or softer than the part"
    kind = "calibration"
    traits = Traits(elastic=True)

    operators: tuple[tuple[sp.csr_array, sp.csr_array], ...] = ()  # shear, and the rest of K_j
    within: tuple[tuple[Within, Within], ...] = ()
    ring: np.ndarray = field(default_factory=lambda: np.zeros(0, int))  # of each shell, -1 outside
    distance: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of each ring [m]
    variance: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of its shells [m²]
    called: str = ""

    def bell(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """q and ∂q/∂ln R of every ring."""
        return bell(self.parameters[1].value(x[1]), self.distance, self.variance)

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The operators of the rings times the change of their factor."""
        q, dq = self.bell(x)
        return tuple(
            MatrixTerm(
                "K", A, np.expm1(x[0] * a), np.exp(x[0] * a) * np.array([a, x[0] * b]),
                within=within,
            )
            for both, of_both, a, b in zip(self.operators, self.within, q, dq, strict=True)
            for A, within in zip(both, of_both, strict=True)
        )  # fmt: skip

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """A φ of the patch as a whole, and of its innermost ring alone."""
        q, _ = self.bell(x)
        rings = [sum(both) @ shapes for both in self.operators]
        whole = sum(a * loads for a, loads in zip(q, rings, strict=True))
        return sp.csr_array(np.hstack([whole, rings[0]]).T)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Give every ring of every part a property of its own."""
        q, _ = self.bell(x)
        logs = x[0] * q
        return in_bands(assembly, self.ring + 1, lambda part, n: softened(part, logs[n - 1]))


@dataclass(frozen=True, eq=False)
class RigidPatch(WeldPatch):
    """A patch about the spiders of rigid elements, whose reach in the sheet is a parameter."""

    name = SPIDERS
    claim = "a rigid element holds more or less of the sheet than its grids"


def bell(R: float, distance: np.ndarray, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """q = R²/s exp(-d²/2s) with s = R² + v, and ∂q/∂ln R."""
    s = R**2 + variance
    q = R**2 / s * np.exp(-(distance**2) / (2 * s))
    return q, q * (2 - 2 * R**2 / s + (distance * R / s) ** 2)


def weld_patch(groups: ElementGroups, free: FreeParameter) -> WeldPatch:
    """Return the patch about all welds or spiders of the structure, or of the named parts."""
    built = groups.structure
    assembly, shells = built.assembly, built.assembly.shells
    kind, what, each = (
        (RigidPatch, "spiders of RBE2 and RBE3", spiders(assembly))
        if free.field == SPIDERS
        else (WeldPatch, "welds of solids", _welds(built))
    )
    part = np.isin(shells.part, free.positions) if free.positions else np.ones(len(shells), bool)
    held = np.concatenate([rows for _, rows in each]) if each else np.zeros(0, int)
    touching = part & np.isin(shells.nodes, held).any(axis=1)
    if not touching.any():
        raise ModelError(f"the deck has no shells that touch {what}; leave {kind.name} out")
    part &= np.isin(shells.part, shells.part[touching])
    X = assembly.points[shells.nodes]  # of a quadrilateral half the product of its diagonals
    area = np.linalg.norm(np.cross(X[:, 2] - X[:, 0], X[:, 3] - X[:, 1]), axis=1) / 2
    R = float(np.sqrt(area[touching].mean()) / 2)
    middle = assembly.points[shells.nodes].mean(axis=1)
    points = np.array([point for point, _ in each])
    distance = np.linalg.norm(middle - points[nearest_points(points, middle)], axis=1)
    wide = R * np.exp(2 * SD_R)
    inside = part & (bell(wide, distance, area / 12)[0] > LEAST)
    ring = _rings(inside, touching, distance)
    count = range(ring.max() + 1)
    unknown = (
        Parameter("E", "of the deck's", 0.0, SD_E, step=0.3),
        Parameter("R", "m", 0.0, SD_R, R, step=0.3),
    )
    names = tuple(assembly.parts[k].name for k in np.unique(shells.part[touching]))
    mean = [np.average(np.stack([distance, area / 12])[:, ring == k], axis=1,
                       weights=area[ring == k]) for k in count]  # fmt: skip
    return kind(
        unknown, f"the patch about {len(each)} {what.split()[0]}", names, called=free.name,
        operators=tuple(_stiffness(built, groups, np.flatnonzero(ring == k)) for k in count),
        within=tuple(_within(shells, np.flatnonzero(ring == k)) for k in count),
        ring=ring, distance=np.array([m[0] for m in mean]),
        variance=np.array([m[1] for m in mean]),
    )  # fmt: skip


def _welds(built: Structure) -> list[tuple[np.ndarray, np.ndarray]]:
    """Middle [m] and rows of the grids of every weld of solids."""
    found = [j for j in fasteners(built) if j.kind == "solids"]
    return [(np.asarray(j.point), built.assembly.rows(list(j.grids))) for j in found]


def spiders(assembly: Assembly) -> list[tuple[np.ndarray, np.ndarray]]:
    """Middle [m] and rows of the feet on shells of every RBE2 and RBE3 with two or more.

    Spiders that tie a grid of a solid are left out: they belong to welds and adhesive.
    """
    out, solids = [], [np.unique(group.nodes) for group in assembly.solids]
    tied = np.concatenate([np.zeros(0, int), *solids])
    for body in assembly.rigid:
        if isinstance(body, RigidBody):
            middle, feet = body.independent, np.array(body.dependent, dtype=int)
        elif isinstance(body, Average):
            middle, feet = body.reference, np.array([row for row, _, _ in body.terms], dtype=int)
        else:
            continue
        feet = feet[np.isin(feet, assembly.shells.nodes)]
        if len(feet) > 1 and middle not in tied:
            out.append((assembly.points[feet].mean(axis=0), feet))
    return out


def _rings(inside: np.ndarray, touching: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Ring of each shell: those that touch a weld first, the rest by distance; -1 outside."""
    ring = np.where(touching, 0, -1)
    rest = np.flatnonzero(inside & ~touching)
    if len(rest):
        edges = np.quantile(distance[rest], np.linspace(0, 1, RINGS)[1:-1])
        ring[rest] = 1 + np.searchsorted(np.unique(edges), distance[rest])
        _, ring[ring >= 0] = np.unique(ring[ring >= 0], return_inverse=True)
    return ring


def _stiffness(
    built: Structure, groups: ElementGroups, rows: np.ndarray
) -> tuple[sp.csr_array, sp.csr_array]:
    """Stiffness of some shells over the free dofs: that of shear, and the rest."""
    shear = shear_matrices(built.assembly, rows).sum(axis=0)
    rest = groups.linear[rows] + groups.cubic[rows] - shear
    n, nodes = len(built.assembly.points), groups.nodes[rows]
    first, second = (congruence(built.T, blocks(A, nodes, n)) for A in (shear, rest))
    return first, second


def _within(shells: Shells, rows: np.ndarray) -> tuple[Within, Within]:
    """The wholes of which both of them are shares."""
    pieces = frozenset(("bending", int(i)) for i in shells.ids[rows])
    return within_shear(shells, rows), Within(pieces, shells=rows)
