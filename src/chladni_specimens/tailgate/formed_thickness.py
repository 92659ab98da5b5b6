"""Thickness of the tailgate's parts after forming, on their own mesh and on that of the model.

The strengths reproduce the parts' mean thickness and the loss of mass of Echaniz Granado (2015),
table 11 and section 5.3.1. The two only agree if the means there are over the *nodes* of a forming
mesh that is finest where the sheet is thin.
"""

from collections.abc import Callable

import numpy as np

from chladni.geometry.formed_mesh import FormedMesh

from ..mesher.forming import Forming, formed_mesh, formed_sheet, pressed
from .design import TailgateDesign
from .pressings import (
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
from .skin import Skin

STRENGTH = {  # a, per part
    INNER: 0.33,
    OUTER_UPPER: 0.21,
    OUTER_LOWER: 0.24,
    UPPER: 0.09,
    LOWER: 0.0,
    LATCH: 0.19,
    BRACKET: 0.03,
}


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


def _box(skin: Skin, part: str) -> tuple[np.ndarray, np.ndarray]:
    """Planform box of a part, the left one of a pair, with a margin of 20 mm."""
    d = skin.design
    low, high = skin.outline.points.min(axis=0), skin.outline.points.max(axis=0)
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


def forming(skin: Skin, part: str) -> Forming:
    """Effect of forming on a part; a folded flange has the thickness of its rim."""
    fields = pressed(skin.at, depth_field(skin, part), *_box(skin, part))
    return Forming.of(fields, nominal(skin.design)[part], STRENGTH[part], part in (UPPER, LOWER))


def forming_mesh(skin: Skin, finest: float = 5.5e-3) -> FormedMesh:
    """All pressings, hems unfolded, on a graded mesh of their own with formed thickness."""
    made = {part: forming(skin, part) for part in STRENGTH}
    sheets = []
    for name, sheet in pressings(skin.at_size(0.010), holes=False).items():
        part = without_side(name)
        depth = depth_field(skin, part)
        sheets.append(formed_sheet(skin.at, depth, sheet, part, made[part], finest))
    return formed_mesh(sheets, list(STRENGTH))
