"""Interface of hidden effects: the article before, and the article with the effect."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from chladni.geometry.facets import point_normals, tangents
from chladni.model.assembly import Assembly, Masses

from .mesh_transfer import Spots, nearest_rows, rows_of_part
from .response_of_article import Coupling, Law

FACING = 0.85  # cosine between normals of one face
LEAST_POINTS = 12  # points of a patch

Spoil = Callable[[np.ndarray], np.ndarray]  # recorded values (n_f, n_out, n_in) made worse


@dataclass(frozen=True, eq=False)
class Site:
    """An article before an effect is hidden in it."""

    article: Assembly  # scattered, on a mesh of its own
    outputs: Spots  # measured places
    hangers: np.ndarray  # (k, 3) places of the cords [m]
    drive: Spots  # driven place
    mass: float  # [kg]
    # first, f_max: first elastic mode, highest frequency of the fitted band [Hz]
    first: float
    f_max: float
    sheets: tuple[str, ...]  # parts an effect may sit on
    # material_axis, rolled: direction of rolling, and the parts that may be orthotropic
    material_axis: np.ndarray
    rolled: tuple[str, ...]

    @property
    def size(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(np.ptp(self.article.points, axis=0)))

    @property
    def scale(self) -> float:
        """Stiffness m ω² of a spring under the whole mass at the first elastic frequency [N/m]."""
        return self.mass * (2 * np.pi * self.first) ** 2

    def part(self, rng: np.random.Generator) -> str:
        """Name of a random sheet, larger ones more often."""
        count = np.array([len(self.rows(name)) for name in self.sheets], dtype=float)
        return str(rng.choice(np.array(self.sheets), p=count / count.sum()))

    def rows(self, name: str) -> np.ndarray:
        """Rows of the points of a part."""
        return rows_of_part(self.article, self.article.part(name))

    def row(self, rng: np.random.Generator) -> int:
        """Row of a random point of a sheet."""
        return int(rng.choice(self.rows(self.part(rng))))

    def normal(self, row: int, rng: np.random.Generator | None = None) -> np.ndarray:
        """Unit normal at a point; on a beam a direction across it, random with ``rng``."""
        n = point_normals(self.article.points, self.article.shells.nodes)[row]
        if n.any():
            return np.asarray(n)
        beams = self.article.beams.nodes
        ends = beams[(beams == row).any(axis=1)][0]
        x = np.diff(self.article.points[ends], axis=0)
        u, v = (t[0] for t in tangents(x / np.linalg.norm(x)))
        angle = 0.0 if rng is None else rng.uniform(0, 2 * np.pi)
        return np.cos(angle) * u + np.sin(angle) * v

    def up(self, row: int) -> np.ndarray:
        """Direction of a cord at a point: the normal of a sheet; z for a frame, which lies flat."""
        return self.normal(row) if len(self.article.shells) else np.array([0.0, 0.0, 1.0])


def _same(values: np.ndarray) -> np.ndarray:
    return values


@dataclass(frozen=True, eq=False)
class Hidden:
    """An article with an effect in it."""

    article: Assembly  # with the masses, springs and sections of the effect
    truth: dict[str, Any]  # value, point_m, channel ...: for the seal
    # parts that depend on frequency or have no symmetric matrix
    couplings: tuple[Coupling, ...] = ()
    spoil: Spoil = field(default=_same)  # change of the recording
    unweighed: float = 0.0  # mass that is on the article in the test, not on the balance [kg]
    law: Law | None = None  # E(s)/E - 1 of the parts that have a loss factor (of 1, as a mark)


def with_lumps(assembly: Assembly, rows: np.ndarray, mass: float) -> Assembly:
    """Point masses [kg] at rows of points."""
    old, n = assembly.masses, len(rows)
    first = int(old.ids.max(initial=10**6)) + 1
    matrix = np.tile(np.diag([mass, mass, mass, 0, 0, 0]), (n, 1, 1))
    new = Masses(
        np.append(old.ids, first + np.arange(n)),
        np.append(old.node, rows),
        np.concatenate([old.matrix, matrix]),
    )
    return replace(assembly, masses=new)


def near_outputs(site: Site) -> np.ndarray:
    """Rows of the article nearest to its sensors."""
    a, spots = site.article, site.outputs
    rows = [
        nearest_rows(a, a.part(part), point[None])[0]
        for part, point in zip(spots.parts, spots.points, strict=True)
    ]
    return np.array(rows)


def around(site: Site, row: int, radius: float) -> np.ndarray:
    """Rows of points (a dozen at least) of the same face within a radius of one, itself first."""
    a, n = site.article, point_normals(site.article.points, site.article.shells.nodes)
    part = a.shells.part[(a.shells.nodes == row).any(axis=1)][0]
    rows = rows_of_part(a, int(part))
    rows = rows[np.abs(n[rows] @ n[row]) > FACING]
    d = np.linalg.norm(a.points[rows] - a.points[row], axis=1)
    order = np.argsort(d, kind="stable")
    return np.asarray(rows[order[: max(LEAST_POINTS, int((d <= radius).sum()))]])
