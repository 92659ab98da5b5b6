"""A form of beams: a frame of steel tubes with rails, cross members and diagonals."""

from collections.abc import Mapping

import numpy as np

from chladni.model.assembly import Assembly, Beams
from chladni.model.properties import BeamSection, Isotropic, Part

STEEL = Isotropic(210e9, 0.3, 7850.0, id=1)
COARSE = 0.06  # elements of the coarsest mesh [m]


def pipe(outer: float, t: float, material: Isotropic = STEEL) -> BeamSection:
    """Round tube: A = π (R² - r²), I = π (R⁴ - r⁴)/4, J = 2 I.

    Parameters
    ----------
    outer, t : outer diameter and wall [m]
    """
    R, r = outer / 2, outer / 2 - t
    I = np.pi * (R**4 - r**4) / 4
    return BeamSection(material, np.pi * (R**2 - r**2), I, I, 0.0, 2 * I, shear=(0.5, 0.5))


def tube_frame(d: Mapping[str, float], h: float) -> Assembly:
    """A flat ladder of two rails and three cross members, a bow over one end, two struts.

    A finer mesh splits the elements of the coarse one, so all meshes have its grids.
    """
    split = max(1, round(COARSE / h))
    L, W, H, bay = d["length"], d["width"], d["height"], d["bay"]
    corners = np.array(
        [(x, y, 0.0) for x in (0.0, bay * L, L) for y in (0.0, W)]
        + [(0.0, 0.0, H), (0.0, d["narrow"] * W, H)]
    )
    rails = [(0, 2), (2, 4), (1, 3), (3, 5), (0, 6), (1, 7), (6, 7)]
    braces = [(0, 1), (2, 3), (4, 5), (6, 2), (7, 3)]
    points, bars, part = [*corners], [], []
    for k, members in enumerate((rails, braces)):
        for a, b in members:
            n = split * max(2, round(float(np.linalg.norm(corners[b] - corners[a])) / COARSE))
            inner = len(points) + np.arange(n - 1)
            points += list(corners[a] + np.arange(1, n)[:, None] / n * (corners[b] - corners[a]))
            chain = np.r_[a, inner, b]
            bars.append(np.column_stack([chain[:-1], chain[1:]]))
            part.append(np.full(n, k))
    nodes, places = np.concatenate(bars), np.array(points)
    m = len(nodes)
    along = places[nodes[:, 1]] - places[nodes[:, 0]]
    up = np.eye(3)[np.abs(along).argmin(axis=1)]
    beams = Beams(
        np.arange(1, m + 1),
        nodes,
        np.concatenate(part),
        up,
        np.zeros((m, 2, 3)),
        np.zeros((m, 2, 6), bool),
    )
    parts = (
        Part(1, "rails", pipe(d["rail"], d["t rail"])),
        Part(2, "braces", pipe(d["brace"], d["t brace"])),
    )
    return Assembly(np.arange(1, len(places) + 1), places, parts, beams=beams)
