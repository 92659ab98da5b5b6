"""Places on a structure where the residual of a fit lies, and places where the test is blind.

Round every group of shells, or beams, stiffness and density are changed a little, smoothly over a
tenth of the sheet. To first order the best amount of such a change lowers -2 ln p by
(cᵀC⁻¹r)² / cᵀC⁻¹c (Rao's score test, 1948). Here r is the residual of the fit, c its slope along
the change and C the covariance with all free parameters of the fit marginalised. The term cᵀC⁻¹c is
the information of the sensors on the change: where 1/√(cᵀC⁻¹c) is large, a place is blind.
"""

from dataclasses import dataclass

import numpy as np

from ..effects.element_groups import ElementGroups
from .hypothesis_fit import HypothesisFit
from .likelihood import Responses
from .map_fit import MassMeasurement
from .scan import baseline, direction_scores, field_slopes

RADIUS = 0.1  # of a sheet's size, the square root of its area
BLIND = 0.5  # relative change of stiffness and of mass that the data would not detect
NEAR_BEST = 0.5  # of the best gain: parts that reach it are named too


@dataclass(frozen=True, eq=False)
class ResidualLocalisation:
    """Gain of a small local change of stiffness or mass, by place."""

    # (m,) in -2 ln evidence, of each shell of the assembly; NaN where the test is blind
    gain: np.ndarray
    on_beams: np.ndarray  # (k,) the same of each member beam
    parts: tuple[str, ...]  # names of the parts that gain most, best first
    # grid, point_m: where the best change sits [m]
    grid: int
    point_m: tuple[float, float, float]
    best: float  # its gain

    @property
    def blind(self) -> float:
        """Share of elements where the test would not detect half the stiffness or mass."""
        return float(np.isnan(np.concatenate([self.gain, self.on_beams])).mean())


def residual_localisation(
    hypothesis: HypothesisFit, mass_measurement: MassMeasurement | None
) -> ResidualLocalisation | None:
    """The map of one hypothesis; None where frequencies were compared or all places are blind."""
    data, fit, groups = hypothesis.data, hypothesis.fit, hypothesis.model.groups.undivided
    if not isinstance(data, Responses) or data.error is None or not len(groups):
        return None
    base = baseline(hypothesis.model, fit.effects, data, mass_measurement, fit.x)
    local = bumps(groups)
    gain = np.full(len(groups), np.nan)
    for field in ("E", "rho"):
        columns = field_slopes(base, hypothesis.model, data, field) @ local
        score = direction_scores(base, columns)[1]
        gained = base.score(base.residual[:, None])[0] - score
        gained[base.score(columns) < 1 / BLIND**2] = np.nan
        gain = np.fmax(gain, gained)
    if np.isnan(gain).all():
        return None
    return _localised(groups, gain)


def bumps(groups: ElementGroups) -> np.ndarray:
    """Smooth changes (g, g), one column each: round one group, on its own sheet."""
    sheet = groups.connected
    area = np.bincount(sheet, groups.area)[sheet]
    d2 = ((groups.centre[:, None] - groups.centre[None]) ** 2).sum(axis=2)
    near = np.exp(-d2 / (2 * RADIUS**2 * area[None]))
    return np.where(sheet[:, None] == sheet[None], near, 0.0)


def _localised(groups: ElementGroups, gain: np.ndarray) -> ResidualLocalisation:
    assembly = groups.structure.assembly
    best = int(np.nanargmax(gain))
    known = np.where(np.isnan(gain), -np.inf, gain)
    order = [k for k in np.argsort(-known) if known[k] >= NEAR_BEST * known[best]]
    parts = tuple(dict.fromkeys(assembly.parts[int(groups.part[k])].name for k in order))
    rows = np.unique(groups.nodes[groups.group == best])
    d = np.linalg.norm(assembly.points[rows] - groups.centre[best], axis=1)
    row = int(rows[np.argmin(d)])
    x, y, z = (float(v) for v in assembly.points[row])
    of_shells, of_beams = np.split(gain[groups.group], [len(assembly.shells)])
    return ResidualLocalisation(
        of_shells, of_beams, parts, int(assembly.ids[row]), (x, y, z), float(gain[best])
    )
