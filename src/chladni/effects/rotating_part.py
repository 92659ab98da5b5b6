"""A spinning part that the model lacks: a fan, a motor, a flywheel, in the state of the test.

Its angular momentum h turns with the structure, which feels the moment h x θ' at its grid. The term
is skew: it takes no energy, makes modes complex and breaks reciprocity. The mass of the part is
another effect.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..dynamics.eigen import normal_modes
from ..fem.assemble import structure
from ..geometry.facets import point_normals, tangents
from ..model.assembly import Assembly, appended
from .attachments import MovableAttachment, around, closer
from .effect import Parameter, SpinTerm, Traits
from .effect_context import EffectContext
from .estimate import Estimate, Location
from .family import Article, Family
from .search_context import Candidate, SearchContext, valleys

# a typical wheel: shares of the structure's mass and size, turns in a period of the highest line
MASS, RADIUS, SPEED = 0.03, 0.1, 0.5
WIDE = 3.0  # times a typical wheel: prior sd along each axis
TRACES = 2  # places followed about each baseline
MOMENTA = [0, 3, 4]  # positions of h along x, y, z
AT_REST = "no bulk data entry that is read or written holds a rotor"


@dataclass(frozen=True, eq=False)
class RotatingPart(MovableAttachment):
    """V - Rᵀ [h]× R at the rotations R of a place; x = (h along x, place, h along y and z)."""

    name = "rotating-part"
    claim = "a part of the structure spins"
    traits = Traits(writable=False, lone=True)
    turning = True

    @classmethod
    def near(cls, where: EffectContext, k: int) -> Self:
        """A spinning part near the k-th grid."""
        first, *others = (
            Parameter(f"h{a}", "kg m²/s", 0.0, 1.0, _wide(where), kind="linear") for a in "xyz"
        )
        return cls.at_grid(where, k, first, np.eye(3), others, direction=where.grids.normal[k])

    def momentum(self, x: np.ndarray) -> np.ndarray:
        """Angular momentum h (3,) in the basic frame [kg m²/s]."""
        return np.array([self.parameters[k].value(x[k]) for k in MOMENTA])

    def terms(self, x: np.ndarray) -> tuple[SpinTerm, ...]:
        """The skew term at the place."""
        rows, moving = self.placed(x)
        slopes = np.zeros((3, 5))
        slopes[range(3), MOMENTA] = [self.parameters[k].slope(x[k]) for k in MOMENTA]
        return (SpinTerm(rows, self.momentum(x), slopes, self.nearest(x), moving),)

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """Rotations by which the sheet bends; about its normal it is nearly rigid."""
        near = np.argsort((self.patch.flat**2).sum(axis=1))[:7]
        each = zip(np.stack(tangents(self.direction)).T, self.patch.rows, strict=True)
        return sp.csr_array(sum(sp.kron(t[:, None], rows[near]) for t, rows in each))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """The size of h; ``location`` holds place and axis."""
        h, wide = self.momentum(x), self.widened(sd)
        slopes = np.array([self.parameters[k].slope(x[k]) for k in MOMENTA])
        size = float(np.linalg.norm(h))
        along = h / size if size else np.ones(3)
        spread = 1.96 * float(np.linalg.norm(along * slopes * wide[MOMENTA]))
        return (Estimate("h", size, "kg m²/s", max(size - spread, 0.0), size + spread),)

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The fitted place, and the axis about which the part spins."""
        found, h = super().location(x, sd), self.momentum(x)
        axis = h / max(float(np.linalg.norm(h)), 1e-300)
        return replace(found, text=f"{found.text}, about ({', '.join(f'{v:.2f}' for v in axis)})")

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """The deck as it is: a spinning part is in no card."""
        return assembly


def _wide(where: EffectContext) -> float:
    """Prior standard deviation of h along each axis [kg m²/s]."""
    size = float(np.linalg.norm(np.ptp(where.grids.point, axis=0)))
    return WIDE * momentum_of_wheel(where.setup.weight, size, where.setup.f_max)


def momentum_of_wheel(weight: float, size: float, f_max: float) -> float:
    """½ m r² Ω of a typical wheel on a structure [kg m²/s]; [kg], [m], [Hz]."""
    return 0.5 * MASS * weight * (RADIUS * size) ** 2 * 2 * np.pi * SPEED * f_max


def spinning(context: SearchContext) -> list[Candidate]:
    """Spinning parts at the places where they explain most, linear in h; none from poles alone.

    Natural frequencies move only to the second order of h.
    """
    where, scan = context.where, context.scan
    turns = np.diff(where.rotations(where.grids.grids).indptr).reshape(-1, 3).all(axis=1)
    able = set(where.grids.grids[turns].tolist())
    places = where.places.only(np.isin(where.places.grids, list(able)))
    if scan is None or not len(places):
        return []
    sd, out, taken = _wide(where), list[Candidate](), list[int]()
    for about in range(len(context.bases)):
        _, score = scan.spin_scores(about, places, sd)
        for k in valleys(score, places.point, taken, TRACES):
            taken.append(k)
            near = around(where.grids.only(turns), places, k)
            h, finer = scan.spin_scores(about, near, sd)
            best = int(np.argmin(finer))
            at = where.grids.position(near.grids[best], near.normal[best])
            start = np.array([h[best, 0], 0.0, 0.0, *h[best, 1:]]) / np.array([sd, 1, 1, sd, sd])
            out.append(Candidate(RotatingPart.near(where, at), start, context.bases[about]))
    return out


def with_rotor(assembly: Assembly, grid: int, momentum: np.ndarray) -> Assembly:
    """Add a spinning part of angular momentum (3,) [kg m²/s] at a grid."""
    rotors = appended(
        assembly.rotors, ids=[int(assembly.rotors.ids.max(initial=0)) + 1],
        node=assembly.rows([grid]), momentum=[momentum],
    )  # fmt: skip
    return replace(assembly, rotors=rotors)


def _spin(article: Article, rng: np.random.Generator) -> Article:
    """Add a wheel of 2 to 6 times the typical momentum, about the normal at a grid."""
    grid, deck = article.shell_grid(rng), article.deck
    (at,) = article.grids_at(np.array([grid]))
    made, size = article.assembly, float(np.linalg.norm(np.ptp(deck.points, axis=0)))
    normal = point_normals(made.points, made.shells.nodes)[made.rows([at])[0]]
    f_max = float(normal_modes(structure(deck).system, 12).frequency[-1])
    h = float(rng.uniform(2, 6)) * momentum_of_wheel(article.weight, size, f_max)
    made = with_rotor(made, at, float(rng.choice([-1.0, 1.0])) * h * normal)
    return article.with_hidden(made, {"h": h}, article.place_of(grid))


FAMILY = Family(
    RotatingPart,
    _spin,
    candidates=spinning,
    closer=closer,
    no_cards=AT_REST,
    settled_by="measure again with the part at rest and at another speed, each as a state of its "
    "own",
)
