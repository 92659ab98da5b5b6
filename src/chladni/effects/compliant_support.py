"""A compliant clamp: the fixture holds as springs where the deck has rigid supports.

Connected supports form one clamp. As a rigid body it moves along one direction and turns about one
axis, those of the largest modal reactions: the root of a beam shears and turns. A fixture is as
stiff as its foundation; for a bolted root the rotation matters most (Gorman 1975, Free Vibration
Analysis of Beams and Shafts, ch. 1). A clamp that is softer than the part that it holds gives at
every grid by itself (held_stretches.py). With base excitation the springs are between the base and
the clamp.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..dynamics.eigen import normal_modes
from ..errors import ModelError
from ..fem.assemble import Structure, structure
from ..fem.energy import mass_properties
from ..fem.released import Clamp, Release, Supports, clamps, rigid_moves
from ..geometry.facets import tangents
from ..model.assembly import Assembly
from ..model.clamp_springs import AN_AXIS, with_clamp_on_springs
from .effect import Effect, Parameter, PointTerm, Traits
from .estimate import in_mm
from .family import Article, Family
from .held_stretches import HeldStretch, stretches
from .search_context import Candidate, SearchContext, best_starts

RIGID = 2e4  # times the spring on which all mass resonates at the highest line: as good as rigid
SD = 2.0  # of its prior: fixtures differ as much as foundations do
STARTS = (-4.0, -2.0, 0.0)
BY_GRID = (-3.0, 0.0, 3.0)  # of a clamp that gives by each grid: often only turns, or only moves
SEEN = 1e-11  # of a rigid spring: smaller modal reactions are rounding
TYPICAL = 0.01  # prior median: share of stiffness lost by the mode with the largest reaction
NEAR_AXIS = 0.999  # cosine from which a direction counts as an axis of the basic frame
TOGETHER = 0.01  # correlation of moment and force below which they come from different modes
MOST_DIRECTIONS = 12  # ways tried: those with the largest loss of stiffness
FOLLOWED = 1  # ways of each kind, as a rigid body, by each grid or by some, that are fitted
MOST_CLAMPS = 2  # clamps tried that give by each grid: those with the largest loss of stiffness
DRAWN = 8  # modes of an article that set the reactions at its clamp
TAKEN = 0.05, 0.25  # share of stiffness lost by that mode, for each spring of a concealed clamp


@dataclass(frozen=True, eq=False)
class SupportDirection:
    """One compliance of a clamp: along the first axis of a frame, and about the second."""

    clamp: Clamp
    position: int  # among the clamps of the structure
    frame: np.ndarray  # (3, 3) rows are unit vectors in the basic frame
    components: tuple[int, ...]  # 1, or 1 and 5: along and about these axes
    rigid: np.ndarray  # (k,) springs that are as good as rigid [N/m, N m/rad]
    # (k, r) f²/λ of each mode: a spring k reduces its stiffness by the share pull/k
    pull: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its stiffnesses."""
        return tuple("K" if c == 1 else "K_rot" for c in self.components)

    @property
    def grids(self) -> np.ndarray:
        """Ids of the held grids (k,)."""
        return self.clamp.grids

    @property
    def centre(self) -> np.ndarray:
        """Middle of the clamp (3,) [m]."""
        return self.clamp.centre

    @property
    def text(self) -> str:
        """The place of the clamp and the direction of its compliance, in words."""
        n = len(self.grids)
        grids = f"grid {self.grids[0]}" if n == 1 else f"{n} grids from {self.grids[0]} on"
        how = [
            f"along {_named(self.frame[0])}" if c == 1 else f"about {_named(self.frame[1])}"
            for c in self.components
        ]
        return f"the supports of {grids} near ({in_mm(self.centre)} mm), {' and '.join(how)}"

    def motions(self) -> np.ndarray:
        """Unit motions of the clamp in the basic frame, displacement then rotation (k, 6)."""
        along = np.r_[self.frame[0], np.zeros(3)]
        about = np.r_[np.zeros(3), self.frame[1]]
        return np.array([along if c == 1 else about for c in self.components])

    def on_springs(self, assembly: Assembly, k: np.ndarray) -> Assembly:
        """The assembly with the clamp on springs k."""
        return on_springs(assembly, self.clamp, self, k)


def scale_of(pull: np.ndarray) -> np.ndarray:
    """Springs (k,) that cost the mode of the largest pull (k, r) ``TYPICAL`` of its stiffness."""
    return np.asarray(pull.max(axis=1) / TYPICAL)


@dataclass(frozen=True, eq=False)
class CompliantSupport(Effect):
    """A clamp on springs, x = ln of stiffness over scale: of its translation and its rotation."""

    name = "compliant-support"
    claim = "a clamp is compliant where the deck is rigid"
    traits = Traits(rounds=1)

    direction: SupportDirection | HeldStretch = field(kw_only=True)
    rows: sp.csr_array = field(kw_only=True)  # motions of the clamp over the dofs with it released
    owner: np.ndarray = field(kw_only=True)  # stiffness of each row

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """(k - k_rigid) gᵀg for each compliant motion g of the clamp."""
        k = self.springs(x)
        slope = np.diag(k)[self.owner]
        return (PointTerm("K", self.rows, (k - self.direction.rigid)[self.owner], slope),)

    def springs(self, x: np.ndarray) -> np.ndarray:
        """Spring stiffness [N/m] and [N m/rad] of each parameter."""
        return np.array([p.value(v) for p, v in zip(self.parameters, x, strict=True)])

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Replace the supports by CELAS2 at each grid, or by GRID, RBE2 and CELAS2 to ground."""
        return self.direction.on_springs(assembly, self.springs(x))


def on_springs(
    assembly: Assembly, clamp: Clamp, direction: SupportDirection, k: np.ndarray
) -> Assembly:
    """The assembly with a clamp on springs k."""
    springs = dict(zip(direction.components, k.tolist(), strict=True))
    return with_clamp_on_springs(
        assembly, clamp.grids, clamp.held, clamp.centre, direction.frame, springs
    )


def ways_of(
    every: tuple[Clamp, ...], reactions: np.ndarray, stiff: np.ndarray
) -> list[SupportDirection]:
    """Up to three compliances of each clamp, those with the largest loss of stiffness first.

    To first order a spring k reduces the stiffness of a mode with reaction f by f²/(k λ). A clamp
    moves along the principal axes of the forces of all modes. With each, it turns about the axis of
    the moment that comes with that force.

    Parameters
    ----------
    reactions : (6 clamps, r)   of each mode on the clamps, over ω
    stiff : (clamps, 2)    of :func:`rigid_springs`
    """
    out = []
    for k, (clamp, rigid) in enumerate(zip(every, stiff, strict=True)):
        force, moment = reactions[6 * k : 6 * k + 3], reactions[6 * k + 3 : 6 * k + 6]
        for d in np.linalg.eigh(force @ force.T)[1].T:
            x = _axis(d)
            y = _turning(x, force, moment)
            pull = np.stack([x @ force, y @ moment]) ** 2
            seen = np.flatnonzero(pull.sum(axis=1) > SEEN * rigid)
            if 0 in seen:
                components = tuple((1, 5)[j] for j in seen)
                frame = np.stack([x, y, np.cross(x, y)])
                out.append(SupportDirection(clamp, k, frame, components, rigid[seen], pull[seen]))
    return sorted(out, key=_loss, reverse=True)


def _loss(direction: SupportDirection | HeldStretch) -> float:
    """Sum of the shares of stiffness that springs as good as rigid cost the modes."""
    return float((direction.pull / direction.rigid[:, None]).sum())


def modal_supports(built: Structure, frequency: np.ndarray, shapes: np.ndarray) -> Supports:
    """The supports, and the forces over ω of modes (r,) [Hz], (n, r), M-orthonormal, on them."""
    return Supports.of(built, shapes / (2 * np.pi * frequency))


def _turning(x: np.ndarray, force: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """Axis across x of the moment that comes with a force along x, else of the largest moment."""
    across = np.stack(tangents(x))
    turn = across @ moment
    with_x = turn @ (x @ force)
    sizes = np.linalg.norm(turn), np.linalg.norm(x @ force)
    if np.linalg.norm(with_x) <= TOGETHER * sizes[0] * sizes[1]:
        with_x = np.linalg.eigh(turn @ turn.T)[1][:, -1]
    return _axis(with_x / np.linalg.norm(with_x) @ across)


def rigid_springs(
    assembly: Assembly, every: tuple[Clamp, ...], weight: float, f_max: float
) -> np.ndarray:
    """Springs of each clamp on which all mass resonates far above the highest spectral line.

    Along [N/m], and about its centre [N m/rad]: (clamps, 2).
    """
    k = RIGID * weight * (2 * np.pi * f_max) ** 2
    arms = [((assembly.points - c.centre) ** 2).sum(axis=1).mean() for c in every]
    return np.array([(k, k * float(arm)) for arm in arms])


def _axis(v: np.ndarray) -> np.ndarray:
    """A unit vector with its largest component positive, an axis of the basic frame where near."""
    k = int(np.abs(v).argmax())
    v = v * np.sign(v[k])
    return np.eye(3)[k] if v[k] > NEAR_AXIS else v


def candidates(context: SearchContext) -> list[Candidate]:
    """The compliance of each kind that explains most, from the nominal and the calibrated model.

    Calibration may have put the compliance into E and t, and a fit from there would not return.
    """
    where = context.where
    built = where.groups.structure
    every = clamps(built.assembly)
    elastic = where.frequency > 0
    if not every or not elastic.any():
        return []
    stiff = rigid_springs(built.assembly, every, where.setup.weight, where.setup.f_max)
    supports = modal_supports(built, where.frequency[elastic], where.shapes[:, elastic])
    out = []
    rigid, by_grid = _effects(built, every, supports, stiff)
    whole = [e for e in by_grid if isinstance(e.direction, HeldStretch) and e.direction.whole]
    some = [e for e in by_grid if e not in whole]
    for effects in (rigid, whole, some):
        best = sorted(
            best_starts(context, effects), key=lambda c: context.scores(c.effect, [c.start]).min()
        )
        out += [replace(c, base=base) for c in best[:FOLLOWED] for base in context.bases]
    return out


def _effects(
    built: Structure, every: tuple[Clamp, ...], supports: Supports, stiff: np.ndarray
) -> tuple[list[CompliantSupport], list[CompliantSupport]]:
    """Clamps that give as rigid bodies, and clamps that give by each grid, over one release."""
    assembly = built.assembly
    rigid = rigid_moves(assembly, supports, every)
    ways = ways_of(every, rigid.T @ supports.force, stiff)[:MOST_DIRECTIONS]
    of_clamp = [
        list(stretches(assembly, supports, clamp, supports.force, k))
        for clamp, k in zip(every, stiff, strict=True)
    ]
    of_clamp.sort(key=lambda found: _loss(found[0][0]) if found else 0.0, reverse=True)
    held = [one for found in of_clamp[:MOST_CLAMPS] for one in found]
    moves = np.hstack([rigid, *(own for _, every_own in held for own in every_own)])
    labels = [(int(clamp.grids[0]), c) for clamp in every for c in range(1, 7)]
    springs = list(np.repeat(stiff, 3))
    first, n = [], len(built.system.dofs)
    for stretch, own in held:
        first.append(len(labels))
        count = [each.shape[1] for each in own]
        labels += [(int(stretch.grids[0]), 1)] * sum(count)
        springs += np.repeat(stretch.rigid, count).tolist()
    motions = sp.csr_array(supports.motions @ sp.csr_array(moves))
    release = Release(motions, np.array(labels).reshape(-1, 2), np.array(springs))
    width, tried = n + len(labels), len(ways) + len(held)
    whole = []
    for way in ways:
        rows = sp.lil_array((len(way.components), width))
        at = n + 6 * way.position
        rows[:, at : at + 6] = way.motions()
        whole.append(_effect(way, release, rows, np.arange(len(way.components)), tried))
    parts = []
    for (stretch, own), at in zip(held, first, strict=True):
        owner = np.repeat(np.arange(len(own)), [each.shape[1] for each in own])
        rows = sp.lil_array((len(owner), width))
        rows[np.arange(len(owner)), n + at + np.arange(len(owner))] = 1.0
        parts.append(_effect(stretch, release, rows, owner, tried))
    return whole, parts


def _effect(
    direction: SupportDirection | HeldStretch, release: Release, rows: sp.lil_array,
    owner: np.ndarray, tried: int,
) -> CompliantSupport:  # fmt: skip
    units = {"K": "N/m", "K_rot": "N m/rad"}
    starts = BY_GRID if isinstance(direction, HeldStretch) else STARTS
    unknown = tuple(
        Parameter(
            name, units[name], 0.0, SD, k, step=1.0, starts=starts, nominal=float(np.log(most / k))
        )
        for name, k, most in zip(
            direction.names, scale_of(direction.pull).tolist(), direction.rigid, strict=True
        )
    )
    x, y, z = direction.centre.tolist()
    return CompliantSupport(
        unknown, direction.text, grids=tuple(int(g) for g in direction.grids), point=(x, y, z),
        trials_factor=tried, release=release, direction=direction, rows=sp.csr_array(rows),
        owner=owner,
    )  # fmt: skip


def _named(axis: np.ndarray) -> str:
    k = int(np.abs(axis).argmax())
    return "xyz"[k] if axis[k] > AN_AXIS else f"({', '.join(f'{v:.2f}' for v in axis)})"


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """Make one clamp compliant: each of its springs costs a mode 5 to 25 % of its stiffness."""
    assembly = article.assembly
    every = clamps(assembly)
    if not every:
        raise ModelError("the structure has no supports, so it has no clamp")
    built = structure(assembly)
    modes = normal_modes(built.system, DRAWN)
    elastic = modes.frequency > 0
    f = modes.frequency[elastic]
    stiff = rigid_springs(assembly, every, mass_properties(assembly)[0], float(f[-1]))
    supports = modal_supports(built, f, modes.shapes[:, elastic])
    reactions = rigid_moves(assembly, supports, every).T @ supports.force
    chosen = int(rng.integers(len(every)))
    direction = max(
        (w for w in ways_of(every, reactions, stiff) if w.position == chosen),
        key=lambda w: float((w.pull[:, 0] / scale_of(w.pull)).sum()),
    )
    springs = direction.pull.max(axis=1) / rng.uniform(*TAKEN)
    known = dict(zip(direction.names, springs.tolist(), strict=True))
    loose = direction.on_springs(assembly, springs)
    return article.with_hidden(loose, known, direction.centre)


FAMILY = Family(
    CompliantSupport,
    conceal,
    candidates=candidates,
    cards=("GRID", "RBE2", "CELAS2", "SPC", "SPC1", "CORD2R"),
    settled_by="measure the motion of the fixture itself, with a sensor on the clamp",
    needs="supports",
)
