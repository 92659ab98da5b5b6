"""Thickness of the folded panel after forming: thin at its two folds, slightly at the bulge."""

import numpy as np

from chladni.geometry.formed_mesh import FormedMesh

from .mesher.forming import COARSEST, FormedSheet, Forming, formed_mesh, pressed
from .plates import bulge, grid

STRENGTH = 0.21  # equal to the tailgate's outer upper panel
FINEST = 5.5e-3  # size of the forming mesh across the folds [m]


def formed_panel(
    length: float = 0.6,
    width: float = 0.3,
    depth: float = 0.03,
    rise: float = 0.01,
    t: float = 1e-3,
) -> FormedMesh:
    """The parts of :func:`.plates.folded_panel`, with the same ids, on a forming mesh of their own.

    Parameters
    ----------
    length, width, depth, rise : [m]
    t : gauge of the blank [m]
    """

    def places(plan: np.ndarray) -> np.ndarray:
        """Places (n, 3) from x, the developed width s and the height above the plane (n, 3)."""
        x, s, z = plan.T
        y = np.clip(s, 0, width)
        return np.column_stack([x, y, z - np.abs(s - y)])

    def height(plan: np.ndarray) -> np.ndarray:
        return bulge(plan[:, 0] / length, np.clip(plan[:, 1] / width, 0, 1), rise)

    fields = pressed(places, height, np.array([0.0, -depth]), np.array([length, width + depth]))
    made = Forming.of(fields, t, STRENGTH)
    sheets = []
    for part, low, high in (
        *[("panel", 0.0, width), ("flanges", -depth, 0.0)],
        ("flanges", width, width + depth),
    ):
        nx, ns = (max(2, round(a / h)) for a, h in ((length, COARSEST), (high - low, FINEST)))
        points, cells = grid(np.linspace(0, length, nx + 1), np.linspace(low, high, ns + 1))
        plan = points[:, :2]
        at = places(np.column_stack([plan, height(plan)]))
        sheets.append(FormedSheet(part, at, cells, made.thickness(plan)[cells]))
    return formed_mesh(sheets, ["panel", "flanges"])
