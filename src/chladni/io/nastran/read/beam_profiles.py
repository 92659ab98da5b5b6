"""Standard beam cross-sections (PBARL, PBEAML) from their dimensions.

y is up (plane 1), z to the right; open profiles twist as Σ b t³/3, closed ones after Bredt
(Young & Budynas, Roark's Formulas, table 10.1). Where Nastran's own closed forms differ they do
so by the thin-wall approximation of J and of the shear factors. Dimensions that no section has
raise a :class:`~chladni.errors.ModelError`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from ....errors import ModelError

_ROUNDING = 1e-9  # of the section's size: walls that meet so far apart touch


@dataclass(frozen=True)
class Profile:
    """Area, moments about the centroid, torsion constant and shear factors of a cross-section."""

    area: float
    I1: float  # ∫ y² dA
    I2: float  # ∫ z² dA
    I12: float
    J: float
    shear: tuple[float, float]


Rectangle = tuple[float, float, float, float]  # centre z, centre y, width along z, height along y


def _built_up(rectangles: list[Rectangle], J: float | None = None) -> Profile:
    """A, I and J of a section made of rectangles, about its centroid (Steiner)."""
    z, y, b, h = np.array(rectangles).T
    _refuse_overlap(z, y, b, h)
    a = b * h
    z, y = z - a @ z / a.sum(), y - a @ y / a.sum()
    thin, long = np.minimum(b, h), np.maximum(b, h)
    twist = (long * thin**3 / 3).sum() if J is None else J
    upright = a[h >= b].sum() / a.sum()
    return Profile(
        float(a.sum()),
        float((b * h**3 / 12 + a * y**2).sum()),
        float((h * b**3 / 12 + a * z**2).sum()),
        float((a * y * z).sum()),
        float(twist),
        (float(upright) * 5 / 6, float(1 - upright) * 5 / 6),
    )


def _refuse_overlap(z: np.ndarray, y: np.ndarray, b: np.ndarray, h: np.ndarray) -> None:
    """Refuse rectangles of negative size, and two that share more than an edge."""
    least = _ROUNDING * max(b.max(), h.max())
    if min(b.min(), h.min()) < -least:
        raise ModelError("its walls are thicker than the section")
    i, j = np.triu_indices(len(z), 1)
    deep = np.minimum((b[i] + b[j]) / 2 - np.abs(z[i] - z[j]), np.minimum(b[i], b[j]))
    high = np.minimum((h[i] + h[j]) / 2 - np.abs(y[i] - y[j]), np.minimum(h[i], h[j]))
    if np.any((deep > least) & (high > least)):
        raise ModelError("its walls overlap")


def _bar(b: float, h: float) -> Profile:
    long, thin = max(b, h), min(b, h)
    r = thin / long
    J = long * thin**3 * (1 / 3 - 0.21 * r * (1 - r**4 / 12))  # Roark, table 10.1, case 4
    return Profile(b * h, b * h**3 / 12, h * b**3 / 12, 0.0, J, (5 / 6, 5 / 6))


def _rod(r: float) -> Profile:
    return Profile(
        np.pi * r**2, np.pi * r**4 / 4, np.pi * r**4 / 4, 0.0, np.pi * r**4 / 2, (0.9, 0.9)
    )


def tube(ro: float, ri: float) -> Profile:
    """Round tube of outer and inner radius."""
    if not 0 <= ri < ro:
        raise ModelError(f"a bore of radius {ri:g} does not fit a tube of radius {ro:g}")
    I = np.pi * (ro**4 - ri**4) / 4
    return Profile(np.pi * (ro**2 - ri**2), I, I, 0.0, 2 * I, (0.5, 0.5))


def _box(b: float, h: float, t1: float, t2: float) -> Profile:
    return _box1(b, h, t1, t1, t2, t2)


def _box1(b: float, h: float, top: float, bottom: float, left: float, right: float) -> Profile:
    """Bredt: J = 4 A_m² / ∮ ds/t."""
    bm, hm = b - (left + right) / 2, h - (top + bottom) / 2
    if not min(top, bottom, left, right) > 0:
        raise ModelError("a box without one of its walls is not a closed section; give it as CHAN")
    J = 4 * (bm * hm) ** 2 / (bm / top + bm / bottom + hm / left + hm / right)
    inner = h - top - bottom
    if not min(inner, b - left - right) > 0:
        raise ModelError("its walls leave no hollow")
    walls = [
        (0.0, (h - top) / 2, b, top),
        (0.0, (bottom - h) / 2, b, bottom),
        ((left - b) / 2, (bottom - top) / 2, left, inner),
        ((b - right) / 2, (bottom - top) / 2, right, inner),
    ]
    made = _built_up(walls, J)
    area = made.area
    shear = ((left + right) * inner / area, (top + bottom) * b / area)
    return Profile(area, made.I1, made.I2, made.I12, J, shear)


def _i(h: float, bb: float, bt: float, tw: float, tb: float, tt: float) -> Profile:
    web = h - tb - tt
    return _built_up([(0, tb / 2, bb, tb), (0, tb + web / 2, tw, web), (0, h - tt / 2, bt, tt)])


def _i1(over: float, tw: float, inner: float, h: float) -> Profile:
    t, b = (h - inner) / 2, over + tw
    return _i(h, b, b, tw, t, t)


def _h(gap: float, legs: float, h: float, t: float) -> Profile:
    z = (gap + legs / 2) / 2
    return _built_up([(-z, 0, legs / 2, h), (0, 0, gap, t), (z, 0, legs / 2, h)])


def _chan(b: float, h: float, tw: float, tf: float) -> Profile:
    over = b - tw
    z, y = tw + over / 2, (h - tf) / 2
    return _built_up([(tw / 2, 0, tw, h), (z, y, over, tf), (z, -y, over, tf)])


def _chan1(over: float, tw: float, inner: float, h: float) -> Profile:
    return _chan(over + tw, h, tw, (h - inner) / 2)


def _chan2(tl: float, tw: float, h: float, b: float) -> Profile:
    z, y = (b - tl) / 2, tw + (h - tw) / 2
    return _built_up([(0, tw / 2, b, tw), (-z, y, tl, h - tw), (z, y, tl, h - tw)])


def _t(b: float, h: float, tf: float, tw: float) -> Profile:
    return _built_up([(0, h - tf / 2, b, tf), (0, (h - tf) / 2, tw, h - tf)])


def _t1(h: float, length: float, tf: float, tw: float) -> Profile:
    return _built_up([(tf / 2, 0, tf, h), (-length / 2, 0, length, tw)])


def _l(b: float, h: float, tb: float, tl: float) -> Profile:
    return _built_up([(b / 2, tb / 2, b, tb), (tl / 2, tb + (h - tb) / 2, tl, h - tb)])


def _z(over: float, tw: float, inner: float, h: float) -> Profile:
    t = (h - inner) / 2
    z, y = (tw + over) / 2, (h - t) / 2
    return _built_up([(0, 0, tw, h), (-z, y, over, t), (z, -y, over, t)])


def _cross(over: float, tw: float, h: float, t: float) -> Profile:
    z = (tw + over / 2) / 2
    return _built_up([(0, 0, tw, h), (-z, 0, over / 2, t), (z, 0, over / 2, t)])


def _hat(h: float, t: float, top: float, brim: float) -> Profile:
    z, side = (top - t) / 2, h - 2 * t
    foot = top / 2 + brim / 2 - t / 2
    return _built_up(
        [
            (0, h - t / 2, top, t),
            (-z, h / 2, t, side),
            (z, h / 2, t, side),
            (-foot, t / 2, brim + t, t),
            (foot, t / 2, brim + t, t),
        ]
    )


def _hat1(plate: float, h: float, top: float, t: float, t_plate: float) -> Profile:
    """A hat closed by a plate below; Bredt."""
    z, side, brim = (top - t) / 2, h - t - t_plate, (plate - top) / 2
    foot = (plate + top) / 4
    bm, hm = top - t, h - (t + t_plate) / 2
    if not min(t, t_plate) > 0:
        raise ModelError("a closed hat without one of its walls is not a closed section")
    walls = [
        (0, t_plate / 2, plate, t_plate),
        (0, h - t / 2, top, t),
        (-z, t_plate + side / 2, t, side),
        (z, t_plate + side / 2, t, side),
        (-foot, t_plate + t / 2, brim, t),
        (foot, t_plate + t / 2, brim, t),
    ]
    return _built_up(walls, 4 * (bm * hm) ** 2 / (bm / t + 2 * hm / t + bm / t_plate))


def _dbox(b: float, h: float, middle: float, *t: float) -> Profile:
    """Two cells; t: upright left, middle, right, then top and bottom of the left and right cell.

    The shear flows q of unit G θ' solve ∮ q/t ds = 2 A_i over each cell, and J = 2 Σ q_i A_i.
    """
    left, web, right, *plates = t
    if not min(t) > 0:
        raise ModelError("a box without one of its walls is not a closed section")
    clear = (middle - left - web / 2, b - middle - right - web / 2)
    at = (left + clear[0] / 2, b - right - clear[1] / 2)
    walls = [(x, 0.0, w, h) for x, w in ((left / 2, left), (middle, web), (b - right / 2, right))]
    area, around = np.zeros(2), np.zeros(2)
    for k, (upright, wide) in enumerate(zip((left, right), clear, strict=True)):
        top, bottom = plates[2 * k : 2 * k + 2]
        walls += [(at[k], (h - top) / 2, wide, top), (at[k], (bottom - h) / 2, wide, bottom)]
        bm, hm = wide + (upright + web) / 2, h - (top + bottom) / 2
        area[k], around[k] = bm * hm, bm / top + bm / bottom + hm / upright + hm / web
    shared = (h - sum(plates) / 4) / web
    q = np.linalg.solve([[around[0], -shared], [-shared, around[1]]], 2 * area)
    return _built_up(walls, float(2 * q @ area))


def _hexa(a: float, b: float, h: float) -> Profile:
    """Hexagon of width b and height h with corners a outside its flats; J = A⁴/40 I_p (Roark)."""
    flat = b - 2 * a
    if not flat >= 0:
        raise ModelError("its sloped sides overlap")
    area, I1 = h * (b - a), b * h**3 / 12 - a * h**3 / 8
    I2 = (b + flat) * (b**2 + flat**2) * h / 48
    return Profile(area, I1, I2, 0.0, area**4 / (40 * (I1 + I2)), (5 / 6, 5 / 6))


def _tube2(ro: float, t: float) -> Profile:
    return tube(ro, ro - t)


SHAPES: Final[dict[str, tuple[Callable[..., Profile], int]]] = {
    "ROD": (_rod, 1), "TUBE": (tube, 2), "TUBE2": (_tube2, 2), "BAR": (_bar, 2),
    "BOX": (_box, 4), "BOX1": (_box1, 6), "I": (_i, 6), "I1": (_i1, 4), "H": (_h, 4),
    "CHAN": (_chan, 4), "CHAN1": (_chan1, 4), "CHAN2": (_chan2, 4), "T": (_t, 4), "T2": (_t, 4),
    "T1": (_t1, 4), "L": (_l, 4), "Z": (_z, 4), "CROSS": (_cross, 4), "HAT": (_hat, 4),
    "HAT1": (_hat1, 5), "DBOX": (_dbox, 10), "HEXA": (_hexa, 3),
}  # fmt: skip
