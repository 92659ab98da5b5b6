"""Thickness after forming: thin where the sheet was bent and stretched.

This replaces a forming simulation. The thickness is t = t₀ (1 - min(a i, 0.38)) with the strength a
of the part and the indicator i = 0.95 (κ/(κ+40))^1.35 + 0.05 ε/0.35. The pressing has the curvature
κ and the stretch ε against the plain skin. Values are kept on a regular grid of the planform.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.geometry.formed_mesh import FormedMesh

from .graded import graded, loops
from .pressed_sheets import MAIN, Depth, PressedSheet
from .quads_from_triangles import paired

Places = Callable[[np.ndarray], np.ndarray]  # planform and depth (n, 3) -> places (n, 3) [m]

STEP = 2.5e-3  # of the grid on which curvature is taken [m]
BENT, STRETCHED = 40.0, 0.35  # scales of κ [1/m] and of stretch in the indicator
COARSEST = 22e-3  # size of the forming mesh where the sheet is flat [m]
FINE_AT = 30.0  # curvature at which the forming mesh has its finest size [1/m]
MOST_THINNING = 0.38  # thinning at which a sheet would tear


@dataclass(frozen=True, eq=False)
class Field:
    """Values on a regular planform grid."""

    low: np.ndarray  # (2,) y and s of the first value [m]
    values: np.ndarray  # (n, m)

    def at(self, plan: np.ndarray) -> np.ndarray:
        """Bilinear interpolation at planform points (k, 2); the value at the rim beyond it."""
        from scipy.ndimage import map_coordinates

        at = (plan[:, :2] - self.low).T / STEP
        return map_coordinates(self.values, at, order=1, mode="nearest")


def pressed(places: Places, depth: Depth, low: np.ndarray, high: np.ndarray) -> tuple[Field, Field]:
    """Curvature κ = √(|n,y|²/|P,y|² + |n,s|²/|P,s|²) [1/m] and stretch 1 - A₀/A over a box."""
    from scipy.ndimage import gaussian_filter

    y, s = (np.arange(a, b + STEP, STEP) for a, b in zip(low, high, strict=True))
    plan = np.stack(np.meshgrid(y, s, indexing="ij"), axis=-1).reshape(-1, 2)
    shape = (len(y), len(s), 3)
    P = places(np.column_stack([plan, depth(plan)])).reshape(shape)
    P0 = places(np.column_stack([plan, np.zeros(len(plan))])).reshape(shape)
    n, area, P_y, P_s = _normal(P)
    n_y, n_s = np.gradient(n, STEP, axis=(0, 1))
    kappa = np.sqrt(_square(n_y) / _square(P_y) + _square(n_s) / _square(P_s))
    stretch = np.clip(1 - _normal(P0)[1] / area, 0, 0.6)
    smooth = [gaussian_filter(a, w / STEP) for a, w in ((kappa, 4.2e-3), (stretch, 20e-3))]
    return Field(low, smooth[0]), Field(low, smooth[1])


def _square(v: np.ndarray) -> np.ndarray:
    return np.maximum((v**2).sum(axis=-1), 1e-12)


def _normal(P: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Unit normal, area per planform area and tangents of a gridded surface."""
    P_y, P_s = np.gradient(P, STEP, axis=(0, 1))
    n = np.cross(P_y, P_s)
    area = np.linalg.norm(n, axis=-1)
    return n / np.maximum(area, 1e-12)[..., None], area, P_y, P_s


@dataclass(frozen=True, eq=False)
class Forming:
    """Effect of forming on one part, over the planform."""

    gauge: float  # of the blank [m]
    strength: float  # a of this part
    kappa: Field  # curvature [1/m]
    indicator: Field
    paired: bool = False  # left and right parts share the fields of y > 0

    @classmethod
    def of(
        cls,
        fields: tuple[Field, Field],
        gauge: float,
        strength: float,
        paired: bool = False,
    ) -> "Forming":
        """Forming of a part from its curvature and stretch."""
        kappa, stretch = fields
        bent = (kappa.values / (kappa.values + BENT)) ** 1.35
        indicator = replace(kappa, values=0.95 * bent + 0.05 * stretch.values / STRETCHED)
        return cls(gauge, strength, kappa, indicator, paired)

    def _stored(self, plan: np.ndarray) -> np.ndarray:
        return np.column_stack([np.abs(plan[:, 0]), plan[:, 1]]) if self.paired else plan[:, :2]

    def thickness(self, plan: np.ndarray) -> np.ndarray:
        """Thickness t(y, s) = t₀ (1 - min(a i, 0.38)) [m] at planform points (n, 2 or 3)."""
        thinning = self.strength * self.indicator.at(self._stored(plan))
        return self.gauge * (1 - np.minimum(thinning, MOST_THINNING))

    def size(self, plan: np.ndarray, finest: float) -> np.ndarray:
        """Size of the forming mesh [m]: 22 mm where flat, down to `finest` where κ > 30 1/m."""
        bent = np.minimum(1, self.kappa.at(self._stored(plan)) / FINE_AT)
        return COARSEST - (COARSEST - finest) * bent


def corner_thickness(field: Depth, cells: np.ndarray) -> np.ndarray:
    """Thickness (n, 4) of cells given by planform corners (n, 4, 2 or 3).

    Each corner takes the value of its nearest Gauss point, so that the bilinear thickness has the
    integral of the field. The value at the corner itself, on a fold, would be too thin.
    """
    near, far = 0.5 + np.array([1, -1]) / np.sqrt(12)
    weight = np.array([near**2, near * far, far**2, near * far])
    places = np.stack([np.einsum("c,nci->ni", np.roll(weight, k), cells) for k in range(4)], axis=1)
    return field(places.reshape(-1, cells.shape[-1])).reshape(len(cells), 4)


@dataclass(frozen=True, eq=False)
class FormedSheet:
    """One pressing on its forming mesh: (n, 3) points, (m, 4) cells and corner thickness."""

    part: str
    points: np.ndarray
    cells: np.ndarray
    thickness: np.ndarray


def formed_sheet(
    places: Places, depth: Depth, sheet: PressedSheet, part: str, made: Forming, finest: float
) -> FormedSheet:
    """A pressing, its hem unfolded, on a graded mesh within the borders of a meshed sheet."""
    border = loops(sheet.quads[sheet.zone == MAIN], sheet.plan[:, :2])
    plan, T = graded(border, lambda at: made.size(at, finest), COARSEST, finest)
    cells = paired(plan, T, set())
    points = places(np.column_stack([plan, depth(plan)]))
    return FormedSheet(part, points, cells, made.thickness(plan)[cells])


def formed_mesh(sheets: Sequence[FormedSheet], parts: Sequence[str]) -> FormedMesh:
    """The sheets as one mesh; a part's id is its place in the list, from 1."""
    start = np.cumsum([0] + [len(s.points) for s in sheets])
    cells = [s.cells + n for s, n in zip(sheets, start[:-1], strict=True)]
    return FormedMesh(
        np.arange(1, start[-1] + 1),
        np.vstack([s.points for s in sheets]),
        np.vstack(cells),
        np.concatenate([np.full(len(s.cells), parts.index(s.part) + 1) for s in sheets]),
        np.vstack([s.thickness for s in sheets]),
        dict(enumerate(parts, start=1)),
    )
