"""Shape of the tailgate: the outer skin and the depth field of every pressing under it.

A point of a pressing is P(y, s, d) = skin(y, s) - d n(y, s).  It lies the depth d below the skin
against its outward normal n, into the car. x points rearward, y to the left, z up.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..mesher.base_surface import CrownedSurface, ramp
from ..mesher.plane_curves import Loop, resampled, rounded
from .design import TailgateDesign

_SPACING = 0.5e-3  # points of outline and window for measuring distances


def _bowed(y: np.ndarray, half: float) -> np.ndarray:
    return 1 - (y / half) ** 2


def _outline(d: TailgateDesign) -> np.ndarray:
    loop = resampled(rounded(d.outline), _SPACING)
    y, s = loop.T
    down = ramp(1 - s / 0.25) * d.arch[0] * _bowed(y, 0.6)
    up = ramp((s - d.height + 0.25) / 0.25) * d.arch[1] * _bowed(y, 0.56)
    return np.column_stack([y, s - down + up])


def _window(d: TailgateDesign) -> np.ndarray:
    loop = resampled(rounded(d.window), _SPACING)
    y, s = loop.T
    middle = (d.window[0][1] + d.window[2][1]) / 2
    side = np.clip((s - middle + 0.024) / 0.2, -1, 1)
    return np.column_stack([y, s + side * d.window_arch * _bowed(y, 0.43)])


@dataclass(frozen=True, eq=False)
class Skin:
    """The outer skin with its loops, ready to be evaluated.

    Attributes
    ----------
    design : TailgateDesign
    outline, window, plateau : Loop
    base : CrownedSurface
    """

    design: TailgateDesign
    outline: Loop
    window: Loop
    plateau: Loop
    base: CrownedSurface

    @classmethod
    def of(cls, design: TailgateDesign) -> Self:
        """The skin of this design."""
        return cls(
            design,
            Loop.through(_outline(design), _SPACING),
            Loop.through(_window(design), _SPACING),
            Loop.through(rounded(design.plateau), _SPACING),
            _base(design),
        )

    def at_size(self, size: float) -> Self:
        """The skin for a mesh of another size."""
        return replace(self, design=replace(self.design, size=size))

    def at(self, plan: np.ndarray) -> np.ndarray:
        """Places (n, 3) of the planform points (y, s, depth)."""
        return self.base.at(plan)

    def normal(self, plan: np.ndarray) -> np.ndarray:
        """Outward unit normals (n, 3) at (y, s)."""
        return self.base.normal(plan)

    def outer_upper(self, plan: np.ndarray) -> np.ndarray:
        """Depth of the outer upper panel (n,): window rebate, joggle under the lower skin."""
        d, s = self.design, plan[:, 1]
        o, q = self.outline.distance(plan), self.window.distance(plan)
        rebate = d.rebate * (1 - ramp((q - 0.013) / 0.014))
        under = 1 - ramp((s - d.split - 0.003) / 0.012)
        return rebate + d.gap * under * ramp((o - d.hem_width) / 0.012)

    def outer_lower(self, plan: np.ndarray) -> np.ndarray:
        """Depth of the outer lower panel (n,): licence plate recess and crease."""
        y, s = plan.T
        half, s0, s1, depth, wall = self.design.plate
        over = np.minimum(s - s0 + wall, s1 + wall - s)
        recess = ramp(np.minimum(half + wall - np.abs(y), over) / wall)
        at, height, width = self.design.crease
        fade = ramp((self.outline.distance(plan) - 0.010) / 0.060)
        return depth * recess - height * ramp(1 - np.abs(s - at) / width) * fade

    def inner(self, plan: np.ndarray, inset: float = 0.0, lift: float = 0.0) -> np.ndarray:
        """Depth of the inner panel (n,): flanges, walls, box, plateau, beads, frame groove.

        `inset` moves the walls inward and `lift` everything outward, for sheets that lie on it.
        """
        d, s = self.design, plan[:, 1]
        o, q = self.outline.distance(plan), self.window.distance(plan)
        wall = ramp((o - d.flange[0] - inset) / d.flange[1])
        wall = wall * ramp((q - d.window_flange[0] - inset) / d.window_flange[1])
        box = np.interp(s, *np.array(d.depth).T)
        box = box - (box - d.plateau_depth[0]) * self._on_plateau(plan)
        box = box - self._bead(plan) * wall + self._groove(o, q, s) * wall
        rebate = d.rebate * (1 - ramp((q - 0.013) / 0.014)) * (s > d.split)
        return rebate + d.gap - lift + (box - d.gap) * wall

    def _on_plateau(self, plan: np.ndarray) -> np.ndarray:
        away = self.plateau.distance(plan) / self.design.plateau_depth[1]
        return np.where(self.plateau.inside(plan), 1.0, 1 - ramp(away))

    def _bead(self, plan: np.ndarray) -> np.ndarray:
        """Height of the stiffening beads towards the skin."""
        height, wall = self.design.bead_depth
        total = np.zeros(len(plan))
        for a, b, half, side in self.design.beads:
            start, along = np.array(a), np.subtract(b, a)
            t = ramp((plan - start) @ along / (along @ along))
            away = np.linalg.norm(plan - start - t[:, None] * along, axis=1)
            total += side * height * ramp((half + wall - away) / wall)
        return total

    def _groove(self, o: np.ndarray, q: np.ndarray, s: np.ndarray) -> np.ndarray:
        depth, low, high = self.design.groove
        ends = ramp((s - low) / 0.040) * ramp((high - s) / 0.040)
        return depth * ramp((0.028 - np.abs(o - q) / 2) / 0.016) * ends

    def upper(self, plan: np.ndarray) -> np.ndarray:
        """Depth of the upper reinforcements: on the inner sheet, up to the skin at the hinge."""
        y0, s0, radius, wall, gap = self.design.hinge
        away = np.hypot(np.abs(plan[:, 0]) - y0, plan[:, 1] - s0)
        w = ramp((radius + wall - away) / wall)
        lift = (self.design.t_inner + self.design.t_upper) / 2
        return self.inner(plan, 0.001, lift) * (1 - w) + (self.outer_upper(plan) + gap) * w

    def lower(self, plan: np.ndarray) -> np.ndarray:
        """Depth of the lower reinforcements, flat on the inner sheet."""
        return self.inner(plan) - (self.design.t_inner + self.design.t_lower) / 2

    def latch(self, plan: np.ndarray) -> np.ndarray:
        """Depth of the latch reinforcement, on the skin's side of the inner sheet."""
        return self.inner(plan) - (self.design.t_inner + self.design.t_latch) / 2

    def bracket(self, plan: np.ndarray) -> np.ndarray:
        """Depth of the wiper motor bracket: a box on the car's side of the inner sheet."""
        d, (y, s) = self.design, plan.T
        _, s0, s1 = d.bracket
        on = self.inner(plan) + (d.t_inner + d.t_bracket) / 2 + 0.0016 * ramp((s - 0.43) / 0.04)
        w = ramp((0.085 - np.abs(y)) / 0.018)
        w = w * ramp((s - s0 - 0.017) / 0.014) * ramp((s1 - 0.020 - s) / 0.014)
        return on * (1 - w) + w * np.maximum(d.bracket_depth, on)


def _base(d: TailgateDesign) -> CrownedSurface:
    """The skin before any pressing: a steep lower part bent into a flat upper one."""
    s = np.linspace(-0.060, d.height + 0.080, 4001)
    k = ramp((s - d.bend[0] + d.bend[1]) / (2 * d.bend[1]))
    k = k**2 * (3 - 2 * k)
    low = d.slope[0] + (d.slope[1] - d.slope[0]) * np.clip(s / d.bend[0], -0.2, 1)
    up = np.clip((s - d.bend[0]) / (d.height - d.bend[0]), 0, 1.2)
    phi = np.deg2rad(low * (1 - k) + (d.slope[2] + (d.slope[3] - d.slope[2]) * up) * k)
    return CrownedSurface.of(s, phi, d.radius, d.height)
