"""A rigid tie of the model that gives in reality.

An RBE2 holds what follows it without any give; a clip, a screwed flange or a bearing does not. What
the tie forbids, a motion δ of its followers against its independent point, is six degrees of
freedom of its own here: with springs of stiffness k the structure has q and η = √k δ, and

    K: ηᵀη + 2 k^-½ ηᵀT'ᵀKT q + k⁻¹ ηᵀT'ᵀKT' η,    M likewise without the first,

which is the rigid model itself where 1/k is nothing.
"""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
import scipy.sparse as sp

from ..dynamics.eigen import normal_modes
from ..dynamics.reduction import attachments, shifted
from ..errors import ModelError
from ..fem.assemble import Structure, structure
from ..geometry.sampling import farthest_point_sample
from ..model.assembly import Assembly
from .effect import Effect, Parameter, PointTerm
from .family import Article, Family
from .rigid_ties import Release, RigidTie, releases, rigid_ties, sprung
from .search_context import Candidate, SearchContext, best_places

SD = 2.0  # of ln k about what the sheets give where the tie holds them
STARTS = (-2.0, 0.0, 2.0)
RIGID = 60.0  # ln of k over its median that is no give at all
HIGHEST = 1e13  # [rad²/s²] where η swings by itself, so that it has mass where 1/k is nothing
MOST, FOLLOWED = 16, 2  # ties that are tried, spread over the structure; that are fitted


@dataclass(frozen=True, eq=False)
class OverConstraint(Effect):
    """Springs k all ways and k reach² all turns in place of a rigid tie."""

    name = "over-constraint"
    claim = "what the model ties rigidly gives in reality"
    own_dofs: ClassVar[int] = 6

    tie: RigidTie | None = None
    release: Release | None = None
    nothing: sp.csr_array = field(default_factory=lambda: sp.csr_array((6, 0)))

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """2 a ηᵀ G q = a/2 (G q + η)² - a/2 (G q - η)², a = k^-½, and what η has by itself."""
        assert self.release is not None
        a = float(self.parameters[0].value(x[0])) ** -0.5
        r = self.release
        return self._term("K", r.K, r.own_K, a, 1.0), self._term("M", r.M, r.own_M, a, 1 / HIGHEST)

    def _term(
        self, matrix: str, G: sp.csr_array, own: np.ndarray, a: float, alone: float
    ) -> PointTerm:
        w, V = np.linalg.eigh(own)
        root, one = (V * np.sqrt(np.maximum(w, 0))).T, np.eye(6)
        coefficient = np.repeat([a / 2, -a / 2, a**2, alone], 6)
        slope = np.repeat([-a / 4, a / 4, -(a**2), 0.0], 6)
        rows = sp.csr_array(sp.vstack([G, G, self.nothing, self.nothing]))
        return PointTerm(
            "K" if matrix == "K" else "M", rows, coefficient, slope[:, None],
            own=np.concatenate([one, -one, root, one]),
        )  # fmt: skip

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array:
        """What the tie's followers pull at when they move by themselves."""
        assert self.release is not None
        return sp.csr_array(sp.vstack([self.release.K, self.release.M]))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """A CBUSH between the tie's independent grid and one that leads its followers."""
        assert self.tie is not None
        return sprung(assembly, self.tie, self.parameters[0].value(x[0]))


def seat(release: Release, static: np.ndarray, sigma: float) -> float:
    """Stiffness the sheets set against δ [N/m]: the geometric mean of its six.

    S - G (K + σM)⁻¹ Gᵀ over what is free to move; ``static`` (n, 6) is (K + σM)⁻¹ Gᵀ.
    """
    G = release.K + sigma * release.M
    Z = release.own_K + sigma * release.own_M - G @ static
    w = np.linalg.eigvalsh((Z + Z.T) / 2)
    return float(np.exp(np.log(np.maximum(w, 1e-9 * w[-1])).mean()))


def over_constraint(
    built: Structure, tie: RigidTie, release: Release, k: float, tried: int
) -> OverConstraint:
    """The tie with a spring of about k [N/m]."""
    a = built.assembly
    _, body = tie.within(a)
    on = np.isin(a.shells.nodes, tie.rows).any(axis=1)
    parts = tuple(a.parts[p].name for p in np.unique(a.shells.part[on]))
    unknown = Parameter("K", "N/m", 0.0, SD, k, step=1.0, starts=STARTS, nominal=RIGID)
    x, y, z = a.points[tie.lead].tolist()
    at = ", ".join(f"{1e3 * v:.0f}" for v in (x, y, z))
    held = f" on {parts[0]}" if parts else ""
    return OverConstraint(
        (unknown,), f"rigid element {body.id}{held} at ({at} mm)", parts,
        tuple(a.ids[list(tie.rows)].tolist()), point=(x, y, z), trials_factor=tried,
        tie=tie, release=release, nothing=sp.csr_array((6, release.K.shape[1])),
    )  # fmt: skip


def candidates(context: SearchContext) -> list[Candidate]:
    """The rigid ties whose give explains most."""
    built = context.where.groups.structure
    ties = rigid_ties(built.assembly)
    points = built.assembly.points[[tie.lead for tie in ties]]
    some = farthest_point_sample(points, MOST) if len(ties) > MOST else np.arange(len(ties))
    found = []
    chosen = [ties[k] for k in some]
    for tie, release in zip(chosen, releases(built, chosen), strict=True):
        static, sigma = context.static(release.K, release.M)
        k = seat(release, static, sigma)
        found.append(over_constraint(built, tie, release, k, len(ties)))
    return best_places(context, found, points[some], FOLLOWED, -1.0, carried=True) if found else []


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """A rigid tie of the article gives: 0.1 to 1 of what its sheets set against it."""
    built = structure(article.assembly)
    ties = rigid_ties(built.assembly)
    if not ties:
        raise ModelError("the structure has no rigid element beside those of its fasteners")
    tie = ties[int(rng.integers(len(ties)))]
    (release,) = releases(built, [tie])
    hertz = 0.5 * float(normal_modes(built.system, 7).frequency[-1])
    sigma = (2 * np.pi * hertz) ** 2
    loads = sp.csr_array(release.K + sigma * release.M)
    k = seat(release, attachments(shifted(built.system, hertz), loads), sigma)
    k *= float(10 ** rng.uniform(-1, 0))
    truth = {
        "point_m": built.assembly.points[tie.lead].tolist(),
        "value": k,
        "parameters": {"K": k},
    }
    return replace(article, assembly=sprung(article.assembly, tie, k), truth=truth)


FAMILY = Family(
    OverConstraint,
    conceal,
    candidates=candidates,
    cards=("GRID", "RBE2", "CBUSH", "PBUSH"),
    settled_by="tap on either side of the tie with a small hammer: do its sides move alike?",
    needs="rigid elements (RBE2, RBAR) beside those at fasteners",
)
