"""Thickness that is not what the deck says, here and there."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..model.assembly import Assembly
from .effect import Effect, FieldChange, Parameter
from .sheet import Sheet


@dataclass(frozen=True, eq=False)
class ThicknessDistribution(Effect):
    """t(x) = t0 (1 - α q(x)), q = exp(-|x - c|² / 2R²): a smooth local thinning.

    x = (logit of α / 0.6, ln R, c in the two principal directions of the part [length scale]).
    """

    name = "thickness-distribution"
    claim = "the sheet is thinner here than the deck says"

    position: int = 0
    inside: np.ndarray = field(default_factory=lambda: np.zeros(0))
    centre: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  # of the groups
    plane: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    size: float = 1.0
    variance: np.ndarray = field(default_factory=lambda: np.zeros(0))  # spread of a group itself
    structure_points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    structure_ids: np.ndarray = field(default_factory=lambda: np.zeros(0, int))

    def _bump(self, x: np.ndarray, X: np.ndarray, blur: np.ndarray | float = 0.0) -> np.ndarray:
        """Q at points X (n,), averaged over a group of variance ``blur``."""
        flat = (X - self.origin) @ self.plane.T - self.size * x[2:4]
        R2 = (self.size * np.exp(x[1])) ** 2
        return np.asarray(R2 / (R2 + blur) * np.exp(-(flat**2).sum(axis=1) / (2 * (R2 + blur))))

    def _log(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(
            np.log1p(-thinning(x[0]) * self._bump(x, self.centre, self.variance)) * self.inside
        )

    def fields(self, x: np.ndarray) -> tuple[FieldChange, ...]:
        """ln(1 - α q) over the groups; the slope by central differences of that scalar formula."""
        h = 1e-5
        slope = np.stack(
            [(self._log(x + h * e) - self._log(x - h * e)) / (2 * h) for e in np.eye(4)], 1
        )
        return (FieldChange("t", self._log(x), slope),)

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Thickness at the corners of the part's shells."""
        shells = assembly.shells
        chosen = shells.part == self.position
        q = self._bump(x, assembly.points)[shells.nodes]
        factor = np.where(chosen[:, None], 1 - thinning(x[0]) * q, 1.0)
        return replace(assembly, shells=replace(shells, thickness=shells.thickness * factor))

    def reported(self, x: np.ndarray, sd: np.ndarray) -> list[dict[str, Any]]:
        """Thinning α and radius R; the place stands in ``settled``."""
        rows = super().reported(x, sd)
        low, high = (thinning(x[0] + s * 1.96 * 2 * sd[0]) for s in (-1, 1))
        return [{**rows[0], "value": thinning(x[0]), "low": low, "high": high}, rows[1]]

    def settled(self, x: np.ndarray) -> dict[str, Any]:
        """The place a fit moved it to."""
        point = [float(v) for v in self.at(x)]
        text = f"on {self.parts[0]} round ({', '.join(f'{1e3 * v:.0f}' for v in point)} mm)"
        d2 = ((self.structure_points - self.at(x)) ** 2).sum(axis=1)
        grid = int(self.structure_ids[np.argmin(d2)])
        radius = float(self.size * np.exp(x[1]))
        own = {"text": text, "point_m": point, "radius_m": radius, "grids": [grid]}
        return {**self.where(), **own}

    def at(self, x: np.ndarray) -> np.ndarray:
        """The centre in the basic frame (3,) [m]."""
        return np.asarray(self.origin + self.size * x[2:4] @ self.plane)


def thinning(x: float) -> float:
    """α = 0.6 / (1 + e^-x), from 0 to 0.6."""
    return float(0.6 / (1 + np.exp(-x)))


def thickness_distribution(
    sheet: Sheet, position: int, start: np.ndarray, places: int
) -> ThicknessDistribution:
    """A thinning of one part, searched from ``start`` (x of the effect)."""
    groups = np.flatnonzero(sheet.part == position)
    X, area = sheet.centre[groups], sheet.area[groups]
    origin = np.average(X, axis=0, weights=area)
    plane = np.linalg.svd(X - origin, full_matrices=False)[2][:2]
    size = float(np.sqrt(area.sum()))
    name = sheet.structure.assembly.parts[position].name
    unknown = (
        Parameter("thinning", "-", -1.6, 1.2, kind="linear", step=0.8, starts=(start[0],)),
        Parameter("R", "m", np.log(0.15), 0.5, size, step=0.3, starts=(start[1],)),
        Parameter("along", "m", 0.0, 0.4, size, "linear", step=0.1, starts=(start[2],)),
        Parameter("across", "m", 0.0, 0.3, size, "linear", step=0.1, starts=(start[3],)),
    )
    return ThicknessDistribution(
        unknown, f"on {name}", (name,), places=places,
        position=position, inside=(sheet.part == position).astype(float), centre=sheet.centre,
        plane=plane, origin=origin, size=size, variance=sheet.area / 12,
        structure_points=sheet.structure.assembly.points,
        structure_ids=sheet.structure.assembly.ids,
    )  # fmt: skip
