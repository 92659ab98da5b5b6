"""Thickness as forming leaves it: thin where the sheet was bent and stretched.

Stands in for a forming simulation. The pressing's curvature κ and its stretch against the plain
skin give an indicator, t = t₀ (1 - min(a i, 0.38)) with i = 0.95 (κ/(κ+40))^1.35 + 0.05 ε/0.35;
the strength a of each part is set so that the nodal mean on the forming mesh is the one the
thesis prints (Table 11).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from .mesher_formed import FormedMesh
from .mesher_graded import graded, loops
from .mesher_pairing import paired
from .mesher_sheets import MAIN, Sheet
from .tailgate_design import TailgateDesign
from .tailgate_parts import (
    BRACKET,
    INNER,
    LATCH,
    LOWER,
    OUTER_LOWER,
    OUTER_UPPER,
    UPPER,
    pressings,
    without_side,
)
from .tailgate_shape import Skin

STEP = 2.5e-3  # of the grid on which curvature is taken [m]
BENT, STRETCHED = 40.0, 0.35  # κ [1/m] and stretch that count as much
COARSEST = 22e-3  # size of the forming mesh where the sheet is flat [m]
MOST = 0.38  # thinning no sheet survives
STRENGTH = {  # a, per part
    INNER: 0.33,
    OUTER_UPPER: 0.21,
    OUTER_LOWER: 0.24,
    UPPER: 0.09,
    LOWER: 0.0,
    LATCH: 0.19,
    BRACKET: 0.03,
}


@dataclass(frozen=True, eq=False)
class Field:
    """Values on a regular planform grid.

    Attributes
    ----------
    low : (2,)          y and s of the first value [m]
    values : (n, m)
    """

    low: np.ndarray
    values: np.ndarray

    def at(self, plan: np.ndarray) -> np.ndarray:
        """Bilinear interpolation at planform points (k, 2); the rim's value beyond it."""
        at = (plan[:, :2] - self.low).T / STEP
        return np.asarray(map_coordinates(self.values, at, order=1, mode="nearest"))


def depth_field(skin: Skin, name: str) -> Callable[[np.ndarray], np.ndarray]:
    """Depth of a sheet's pressing over the planform."""
    return {
        INNER: skin.inner,
        OUTER_UPPER: skin.outer_upper,
        OUTER_LOWER: skin.outer_lower,
        UPPER: skin.upper,
        LOWER: skin.lower,
        LATCH: skin.latch,
        BRACKET: skin.bracket,
    }[without_side(name)]


def curvature(skin: Skin, name: str) -> tuple[Field, Field]:
    """Curvature κ = √(|n,y|²/|P,y|² + |n,s|²/|P,s|²) [1/m] and stretch 1 - A₀/A of a pressing."""
    low, high = _box(skin, name)
    y, s = (np.arange(a, b + STEP, STEP) for a, b in zip(low, high, strict=True))
    plan = np.stack(np.meshgrid(y, s, indexing="ij"), axis=-1).reshape(-1, 2)
    shape = (len(y), len(s), 3)
    P = skin.at(np.column_stack([plan, depth_field(skin, name)(plan)])).reshape(shape)
    P0 = skin.at(np.column_stack([plan, np.zeros(len(plan))])).reshape(shape)
    n, area, P_y, P_s = _normal(P)
    plain = _normal(P0)[1]
    n_y, n_s = np.gradient(n, STEP, axis=(0, 1))
    kappa = np.sqrt(_square(n_y) / _square(P_y) + _square(n_s) / _square(P_s))
    stretch = np.clip(1 - plain / area, 0, 0.6)
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


def _box(skin: Skin, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Planform box of a sheet, the left one of a pair, with a margin of 20 mm."""
    d = skin.design
    low, high = skin.outline.points.min(axis=0), skin.outline.points.max(axis=0)
    part = without_side(name)
    if part == UPPER:
        low, high = np.array([d.upper[0] - 0.02, d.upper[1]]), high
    elif part == LOWER:
        low, high = np.array(d.lower[::2]), np.array(d.lower[1::2])
    elif part in (LATCH, BRACKET):
        half, s0, s1 = d.latch if part == LATCH else d.bracket
        low, high = np.array([-half, s0]), np.array([half, s1])
    elif part == OUTER_UPPER:
        low = np.array([low[0], d.split - d.tongue[0]])
    elif part == OUTER_LOWER:
        high = np.array([high[0], d.split])
    return np.asarray(low - 0.02), np.asarray(high + 0.02)


@dataclass(frozen=True, eq=False)
class Forming:
    """What forming did to one part, over the planform; pairs are stored once, for y > 0.

    Attributes
    ----------
    gauge : float          of the blank [m]
    strength : float       a of this part
    kappa : Field          curvature [1/m]
    indicator : Field
    paired : bool          left and right parts share the fields
    """

    gauge: float
    strength: float
    kappa: Field
    indicator: Field
    paired: bool

    def _stored(self, plan: np.ndarray) -> np.ndarray:
        return np.column_stack([np.abs(plan[:, 0]), plan[:, 1]]) if self.paired else plan[:, :2]

    def thickness(self, plan: np.ndarray) -> np.ndarray:
        """t(y, s) = t₀ (1 - min(a i, 0.38)) [m] at planform points (n, 2 or 3)."""
        thinning = self.strength * self.indicator.at(self._stored(plan))
        return np.asarray(self.gauge * (1 - np.minimum(thinning, MOST)))

    def size(self, plan: np.ndarray, finest: float) -> np.ndarray:
        """Size of the forming mesh [m]: 22 mm where flat, down to `finest` where κ > 30 1/m."""
        bent = np.minimum(1, self.kappa.at(self._stored(plan)) / 30)
        return COARSEST - (COARSEST - finest) * bent


def forming(skin: Skin, part: str) -> Forming:
    """What forming does to a part; a folded flange has its rim's thickness."""
    kappa, stretch = curvature(skin, part)
    bent = (kappa.values / (kappa.values + BENT)) ** 1.35
    indicator = replace(kappa, values=0.95 * bent + 0.05 * stretch.values / STRETCHED)
    gauge = nominal(skin.design)[part]
    return Forming(gauge, STRENGTH[part], kappa, indicator, part in (UPPER, LOWER))


def nominal(d: TailgateDesign) -> dict[str, float]:
    """Gauge of each part [m]."""
    return {
        INNER: d.t_inner,
        OUTER_UPPER: d.t_outer_upper,
        OUTER_LOWER: d.t_outer_lower,
        UPPER: d.t_upper,
        LOWER: d.t_lower,
        LATCH: d.t_latch,
        BRACKET: d.t_bracket,
    }


def corner_thickness(field: Callable[[np.ndarray], np.ndarray], cells: np.ndarray) -> np.ndarray:
    """Thickness (n, 4) of cells given by planform corners (n, 4, 2 or 3).

    Each corner takes the value of the Gauss point next to it, so that the bilinear thickness has
    the field's integral; the value at the corner itself, on a fold, would be too thin.
    """
    near, far = 0.5 + np.array([1, -1]) / np.sqrt(12)
    weight = np.array([near**2, near * far, far**2, near * far])
    places = np.stack([np.einsum("c,nci->ni", np.roll(weight, k), cells) for k in range(4)], axis=1)
    return field(places.reshape(-1, cells.shape[-1])).reshape(len(cells), 4)


def forming_mesh(skin: Skin, finest: float = 5.5e-3) -> FormedMesh:
    """All pressings, hems unfolded, on a graded mesh of their own with formed thickness."""
    fine = skin.at_size(0.010)
    made = {part: forming(skin, part) for part in STRENGTH}
    sheets = [
        _formed_sheet(skin, sheet, made[without_side(name)], finest)
        for name, sheet in pressings(fine).items()
    ]
    parts = list(STRENGTH)
    ids = [parts.index(without_side(name)) + 1 for name in pressings(fine)]
    start = np.cumsum([0] + [len(x) for x, _, _ in sheets])
    return FormedMesh(
        np.arange(1, start[-1] + 1),
        np.vstack([x for x, _, _ in sheets]),
        np.vstack([cells + n for (_, cells, _), n in zip(sheets, start[:-1], strict=True)]),
        np.concatenate([np.full(len(c), k) for (_, c, _), k in zip(sheets, ids, strict=True)]),
        np.vstack([t for _, _, t in sheets]),
        dict(enumerate(parts, start=1)),
    )


def _formed_sheet(
    skin: Skin, sheet: Sheet, made: Forming, finest: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3), cells (m, 4) and corner thickness (m, 4) of one pressing."""
    border = loops(sheet.quads[sheet.zone == MAIN], sheet.plan[:, :2])
    plan, T = graded(border, lambda at: made.size(at, finest), COARSEST, finest)
    points = skin.at(np.column_stack([plan, depth_field(skin, sheet.name)(plan)]))
    cells = paired(plan, T, set())
    return points, cells, made.thickness(plan)[cells]
