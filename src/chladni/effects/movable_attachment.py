"""A mass or a spring at an unknown place, which a fit may move about.

Between grids the motion of the sheet is interpolated by moving least squares with quadratic
polynomials (Lancaster and Salkauskas 1981, Math. Comp. 37, 141-158), so that a fit can follow its
slope.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly
from .effect import Effect, Parameter, PointTerm
from .points import with_masses, with_springs

NEIGHBOURS = 14  # grids that take part in the interpolation
STEP = 1e-4  # of the local mesh size, for the slope of the interpolation weights


@dataclass(frozen=True, eq=False)
class Patch:
    """Grids round a start, in the tangent plane.

    Attributes
    ----------
    grids : (k,) int          ids
    flat : (k, 2)             places in the tangent plane, the start is the origin [m]
    plane : (2, 3)            its axes
    origin : (3,) [m]
    rows : d lists            rows of the structure at these grids, one (k, n) per direction
    size : float              typical distance of neighbours [m]
    """

    grids: np.ndarray
    flat: np.ndarray
    plane: np.ndarray
    origin: np.ndarray
    rows: tuple[sp.csr_array, ...]
    size: float

    def weights(self, at: np.ndarray) -> np.ndarray:
        """Interpolation weights of the grids at a place of the plane (k,)."""
        d = (self.flat - at) / self.size
        w = np.exp(-(d**2).sum(axis=1) / 1.8)
        P = np.stack(
            [np.ones(len(d)), d[:, 0], d[:, 1], d[:, 0] ** 2, d[:, 0] * d[:, 1], d[:, 1] ** 2], 1
        )
        A = (P.T * w) @ P + 1e-9 * np.eye(6)
        return np.asarray(np.linalg.solve(A, (P.T * w))[0])

    def at(self, at: np.ndarray) -> sp.csr_array:
        """Rows at a place of the plane, one per direction (d, n)."""
        w = sp.csr_array(self.weights(at)[None])
        return sp.csr_array(sp.vstack([w @ rows for rows in self.rows]))

    def slope(self, at: np.ndarray, axis: int) -> sp.csr_array:
        """Change of those rows along an axis of the plane (d, n)."""
        e = STEP * self.size * np.eye(2)[axis]
        return sp.csr_array((self.at(at + e) - self.at(at - e)) / (2 * STEP * self.size))


@dataclass(frozen=True, eq=False)
class Somewhere(Effect):
    """x = (ln strength, place along both axes of the patch in units of its size)."""

    patch: Patch | None = None
    direction: np.ndarray = field(default_factory=lambda: np.zeros(3))
    matrix = "K"

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """One strength on every direction, at the place."""
        assert self.patch is not None
        at = self.patch.size * x[1:3]
        rows = self.patch.at(at)
        c = np.full(rows.shape[0], self.parameters[0].value(x[0]))
        gradient = np.zeros((len(c), 3))
        gradient[:, 0] = c
        moving = {1 + k: self.patch.slope(at, k) * self.patch.size for k in range(2)}
        return (PointTerm("M" if self.matrix == "M" else "K", rows, c, gradient, moving),)

    def carried(self) -> sp.csr_array:
        """Rows a basis must carry so that the place may move."""
        assert self.patch is not None
        nearest = np.argsort((self.patch.flat**2).sum(axis=1))[:7]
        return sp.csr_array(sp.vstack([rows[nearest] for rows in self.patch.rows]))

    def at(self, x: np.ndarray) -> np.ndarray:
        """The place in the basic frame (3,) [m]."""
        assert self.patch is not None
        return np.asarray(self.patch.origin + self.patch.size * x[1:3] @ self.patch.plane)

    def reported(self, x: np.ndarray, sd: np.ndarray) -> list[dict[str, Any]]:
        """The strength; the place stands in ``settled``."""
        return super().reported(x, sd)[:1]

    def settled(self, x: np.ndarray) -> dict[str, Any]:
        """The place a fit moved it to."""
        assert self.patch is not None
        point, grid = [float(v) for v in self.at(x)], self.nearest(x)
        text = f"near grid {grid} ({', '.join(f'{1e3 * v:.0f}' for v in point)} mm)"
        own = {"text": text, "grids": [grid], "point_m": point, "radius_m": self.patch.size}
        return {**self.where(), **own}

    def nearest(self, x: np.ndarray) -> int:
        """Id of the grid nearest to the place."""
        assert self.patch is not None
        d = self.patch.flat - self.patch.size * x[1:3]
        return int(self.patch.grids[np.argmin((d**2).sum(axis=1))])


@dataclass(frozen=True, eq=False)
class PointMass(Somewhere):
    """A mass sits at a place the model does not know of."""

    name = "point-mass"
    claim = "something sits on the structure that the model does not have"
    matrix = "M"

    def weight(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """The mass itself."""
        m = self.parameters[0].value(x[0])
        return m, np.array([m, 0.0, 0.0])

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """CONM2 at the nearest grid, offset to the place."""
        m, grid = self.parameters[0].value(x[0]), self.nearest(x)
        offset = self.at(x) - assembly.points[assembly.rows([grid])[0]]
        return with_masses(assembly, (grid,), m, offset)


@dataclass(frozen=True, eq=False)
class ExtraSupport(Somewhere):
    """A spring to ground at an unknown place."""

    name = "extra-support"
    claim = "the structure touches something stiff that the model does not have"

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """CELAS2 to ground shared by the grids round the place."""
        assert self.patch is not None
        k, at = self.parameters[0].value(x[0]), self.patch.size * x[1:3]
        share = self.shares(at)
        for grid, part in share:
            assembly = with_springs(assembly, (grid,), self.direction[None], k * part)
        return assembly

    def shares(self, at: np.ndarray) -> list[tuple[int, float]]:
        """The nearest grids and their shares of the spring, linear in the distance."""
        assert self.patch is not None
        d = np.linalg.norm(self.patch.flat - at, axis=1)
        near = np.argsort(d)[:3]
        if d[near[0]] < 0.15 * self.patch.size:
            return [(int(self.patch.grids[near[0]]), 1.0)]
        A = np.vstack([self.patch.flat[near].T, np.ones(3)])
        w = np.clip(np.linalg.lstsq(A, np.append(at, 1.0), rcond=None)[0], 0.0, None)
        return [
            (int(self.patch.grids[k]), float(v / w.sum())) for k, v in zip(near, w, strict=True)
        ]


def moved(strength: Parameter) -> tuple[Parameter, ...]:
    """Strength and place of a thing that a fit may move by about a mesh size at a time."""
    place = [Parameter(n, "m", 0.0, 1.5, kind="linear", step=0.7) for n in ("along", "across")]
    return (replace(strength), *place)
