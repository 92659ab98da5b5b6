"""Thickness of the hood's parts after forming."""

import numpy as np

from .hood import HINGES, INNER, OUTER, STRIKER, HoodDesign, hood_skin, pressings
from .mesher_formed import FormedMesh
from .mesher_forming import Forming, formed_mesh, formed_sheet, pressed
from .tailgate_parts import without_side

STRENGTH = {OUTER: 0.20, INNER: 0.30, HINGES: 0.05, STRIKER: 0.05}


def hood_forming_mesh(design: HoodDesign | None = None, finest: float = 5.5e-3) -> FormedMesh:
    """All pressings, hem unfolded, on a graded mesh of their own with formed thickness."""
    d = design or HoodDesign()
    skin = hood_skin(d)
    gauges = {OUTER: d.t_outer, INNER: d.t_inner, HINGES: d.t_plate, STRIKER: d.t_plate}
    depths = {OUTER: skin.outer, INNER: skin.inner, HINGES: skin.plate, STRIKER: skin.plate}
    sheets = []
    for name, sheet in pressings(skin).items():
        part = without_side(name)
        low, high = (f(sheet.plan[:, :2], axis=0) for f in (np.min, np.max))
        fields = pressed(skin.at, depths[part], low - 0.02, high + 0.02)
        made = Forming.of(fields, gauges[part], STRENGTH[part])
        sheets.append(formed_sheet(skin.at, depths[part], sheet, part, made, finest))
    return formed_mesh(sheets, list(STRENGTH))
