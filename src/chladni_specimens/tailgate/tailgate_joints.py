"""Places of the tailgate's joints, and the joints themselves on its assembly."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.errors import ModelError
from chladni.geometry.nearest import ShellSurface
from chladni.model.assembly import Assembly

from ..joints.bolts import along_line, grip, screw, tied_hole
from ..joints.builders import Joined, Joint, hexahedra, spot_welds
from ..mesher.plane_curves import resampled
from ..mesher.pressed_sheets import BASE, FOLD, MAIN, PressedSheet
from .design import SCREW, SEALANT, WELD
from .formed_thickness import depth_field
from .pressings import (
    BRACKET,
    INNER,
    LATCH,
    LEFT,
    LOWER,
    OUTER_LOWER,
    OUTER_UPPER,
    RIGHT,
    UPPER,
    cut,
    seam_half,
    upper_edges,
)
from .skin import Skin

Pair = tuple[str, str]
OFF_STEP = 0.97  # pitch of the strings in mesh sizes, so that it differs from the shells'


@dataclass(frozen=True, eq=False)
class TailgateFrame:
    """The assembly under construction, with the sheets that the joints connect."""

    skin: Skin
    assembly: Assembly
    sheets: dict[str, PressedSheet]
    rows: dict[str, np.ndarray]  # (n,) int; rows of ``assembly.shells`` of each sheet

    def surface(self, name: str, zone: int = MAIN) -> ShellSurface:
        """The shells of one zone of a sheet."""
        found = ShellSurface.of(self.assembly, self.rows[name][self.sheets[name].zone == zone])
        return replace(found, name=name)


def weld_places(skin: Skin) -> dict[Pair, np.ndarray]:
    """Planform places (n, 2) of the spot welds between each pair of sheets."""
    d = skin.design
    flange = resampled(skin.window.points, d.pitch_window)
    out: dict[Pair, np.ndarray] = {
        (INNER, OUTER_UPPER): skin.window.offset(flange, -0.0065),
        (OUTER_UPPER, OUTER_LOWER): _seam(skin),
    }
    upper, lower = _upper_rows(skin), _lower_rows(skin)
    for side, sign in ((LEFT, 1), (RIGHT, -1)):
        out[INNER, UPPER + side] = upper * (sign, 1)
        out[INNER, LOWER + side] = lower * (sign, 1)
    out[INNER, LATCH] = _lattice(np.linspace(-0.080, 0.080, 4), (0.054, 0.100))
    out[INNER, BRACKET] = _lattice((-0.098, 0.098), (0.356, 0.400, 0.458))
    return out


def _lattice(y: np.ndarray | tuple, s: np.ndarray | tuple) -> np.ndarray:
    return np.array([(a, b) for a in y for b in s], dtype=float)


def _hem_row(skin: Skin) -> np.ndarray:
    """Foot of the hem on the outer upper panel where the seam begins."""
    arc = cut(skin.outline.points, skin.design.split)[0]
    return skin.outline.offset(arc[[0, -1]], 2 * (skin.design.hem_width + 0.001))


def _seam(skin: Skin) -> np.ndarray:
    half = seam_half(skin, _hem_row(skin)) - 0.005
    y = np.linspace(-half, half, max(2, round(2 * half / skin.design.pitch_seam)))
    return np.column_stack([y, np.full(len(y), skin.design.split - 0.006)])


def _upper_rows(skin: Skin) -> np.ndarray:
    """Two rows along the left upper reinforcement, clear of the hinge, close to both ends."""
    d = skin.design
    a, b = upper_edges(skin.at_size(0.008))  # the same places on every mesh
    hem = skin.outline.offset(a, sum(d.flange) + 0.001)
    window = skin.window.offset(b, -(sum(d.window_flange) + 0.001))
    rows = []
    for t in (0.12, 0.88):
        line = hem * (1 - t) + window * t
        ends = [p + 0.008 * (q - p) / np.linalg.norm(q - p) for p, q in (line[:2], line[:-3:-1])]
        rows.append(
            np.vstack([ends[0], resampled(line, d.pitch_upper, closed=False)[1:-1], ends[1]])
        )
    places = np.vstack(rows)
    y, s, radius, wall, _ = d.hinge
    return places[np.hypot(places[:, 0] - y, places[:, 1] - s) > radius + wall + 0.004]


def _lower_rows(skin: Skin) -> np.ndarray:
    y0, y1, s0, s1 = skin.design.lower
    return _lattice((y0 + 0.014, y1 - 0.022), np.linspace(s0 + 0.016, s1 - 0.016, 3))


def middle(skin: Skin, plan: np.ndarray, pair: Pair) -> np.ndarray:
    """Places (n, 3) half way between two sheets."""
    a, b = (depth_field(skin, name)(plan) for name in pair)
    return skin.at(np.column_stack([plan, (a + b) / 2]))


def welded(frame: TailgateFrame) -> Joined:
    """All spot welds except the missing ones, numbered from 1 in the order of the pairs."""
    d, assembly = frame.skin.design, frame.assembly
    report: list[Joint] = []
    number = 0
    for pair, plan in weld_places(frame.skin).items():
        numbers = number + 1 + np.arange(len(plan))
        number += len(plan)
        plan = plan[~np.isin(numbers, d.missing_welds)]
        if not len(plan):
            continue
        rows = tuple(_main(frame, name) for name in pair)
        assembly, joints = spot_welds(
            assembly,
            middle(frame.skin, plan, pair),
            (rows[0], rows[1]),
            side=d.weld,
            material=WELD,
            patch=d.weld_patch,
        )
        report += joints
    if beyond := [k for k in d.missing_welds if not 1 <= k <= number]:
        raise ModelError(f"missing_welds names {beyond}; the tailgate has welds 1 to {number}")
    return assembly, tuple(report)


def _main(frame: TailgateFrame, name: str) -> np.ndarray:
    return frame.rows[name][frame.sheets[name].zone == MAIN]


def _arcs(skin: Skin) -> dict[str, np.ndarray]:
    """The hem's fold line of both outer panels at the pitch of the strings (n, 2)."""
    over, under = cut(skin.outline.points, skin.design.split)
    step = OFF_STEP * skin.design.size
    return {
        OUTER_UPPER: resampled(over, step, closed=False),
        OUTER_LOWER: resampled(under, step, closed=False),
    }


def _string(
    skin: Skin, lines: tuple[np.ndarray, np.ndarray], depths: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Hexahedra (n, 8, 3) between two planform lines and two depths along them (2, k)."""
    corners = []
    for depth in depths:
        a, b = (skin.at(np.column_stack([p, d])) for p, d in zip(lines, depth, strict=True))
        corners += [a[:-1], a[1:], b[1:], b[:-1]]
    return np.stack(corners, axis=1)


def hem_strings(frame: TailgateFrame) -> Joined:
    """Soft adhesive between inner and outer sheets all round, and the additions of a real hem."""
    d, skin, assembly = frame.skin.design, frame.skin, frame.assembly
    width, height = d.string
    e = (d.gap - height) / 2
    steel = replace(SOFT, E=d.adhesive, nu=d.adhesive_nu)
    report: list[Joint] = []
    for name, arc in _arcs(skin).items():
        a, b = (skin.outline.offset(arc, d.hem_clearance + 0.3e-3 + x) for x in (0.0, width))
        deep, high = np.full((2, len(arc)), d.gap - e), np.full((2, len(arc)), e)
        assembly, joints = hexahedra(
            assembly,
            _string(skin, (a, b), (deep, high)),
            (frame.surface(INNER), frame.surface(name)),
            material=steel,
            name="hem adhesive",
            kind="hem",
        )
        report += joints
        if d.hem != "modelled":
            assembly, joints = _all_round(replace(frame, assembly=assembly), name, arc)
            report += joints
    return assembly, tuple(report)


SOFT = replace(SEALANT, nu=0.4, id=2)


def _all_round(frame: TailgateFrame, name: str, arc: np.ndarray) -> Joined:
    """Sealant behind the inner sheet and round its edge, and the grip along the hem."""
    d, skin, assembly = frame.skin.design, frame.skin, frame.assembly
    start, e = d.hem_clearance + 0.3e-3, (d.gap - d.string[1]) / 2
    n = len(arc)
    a, b = (skin.outline.offset(arc, x) for x in (start, d.hem_width - 0.3e-3))
    behind = _string(skin, (a, b), (np.full((2, n), 2 * d.gap - e), np.full((2, n), d.gap + e)))
    edge, base = skin.outline.offset(arc, d.hem_clearance), skin.outline.offset(arc, 0.3e-3)
    low, high = np.full((1, n), 1.8 * d.gap), np.full((1, n), 0.2 * d.gap)
    lines = (edge, base)
    inner, outer = (
        skin.at(np.column_stack([np.vstack([p, p]), np.r_[low[0], high[0]]])) for p in lines
    )
    round_ = np.stack(
        [x[rows] for x in (inner, outer) for rows in _belt(n)],
        axis=1,
    )
    report: list[Joint] = []
    for corners, zone in ((behind, FOLD), (round_, BASE)):
        sheets = (frame.surface(INNER), frame.surface(name, zone))
        pair = sheets if zone == BASE else sheets[::-1]
        assembly, joints = hexahedra(
            assembly, corners, pair, material=SEALANT, name="hem sealant", kind="hem"
        )
        report += joints
    if d.hem == "real":
        assembly, joints = _gripped(replace(frame, assembly=assembly), name, arc)
        report += joints
    return assembly, tuple(report)


def _belt(n: int) -> tuple[np.ndarray, ...]:
    """Rows of the four corners of each piece of a belt of n lower and n upper points."""
    i = np.arange(n - 1)
    return i, i + 1, i + 1 + n, i + n


def _gripped(frame: TailgateFrame, name: str, arc: np.ndarray) -> Joined:
    """Springs against sliding along the hem between the inner edge and the base of the U."""
    d, skin = frame.skin.design, frame.skin
    middles = skin.outline.offset(arc, d.hem_clearance / 2)
    places = skin.at(np.column_stack([middles, np.full(len(arc), d.gap)]))
    direction, k = along_line(places, d.hem_grip)
    on = stretch(arc, d.hem_stretch, d.split)
    rows = frame.rows[name][frame.sheets[name].zone == BASE]
    if not on.any():
        return frame.assembly, ()
    return grip(frame.assembly, places[on], direction[on], k[on], (_main(frame, INNER), rows))


def stretch(arc: np.ndarray, which: str, waist: float) -> np.ndarray:
    """Mask of points (n,) of a planform line that lie on the named stretch of the hem."""
    y, s = arc.T
    return {
        "all": np.ones(len(arc), bool),
        "left": y >= 0,
        "right": y <= 0,
        "above": s >= waist,
        "below": s <= waist,
    }[which]


def middle_string(frame: TailgateFrame) -> Joined:
    """Adhesive 8 mm wide across the middle, between the tongue and the lower skin."""
    d, skin = frame.skin.design, frame.skin
    half = seam_half(skin, _hem_row(skin))
    y = np.linspace(-half, half, round(2 * half / d.size) + 1)
    lines = tuple(np.column_stack([y, np.full(len(y), d.split - x)]) for x in (0.019, 0.011))
    upper, lower = (np.stack([f(p) for p in lines]) for f in (skin.outer_upper, skin.outer_lower))
    return hexahedra(
        frame.assembly,
        _string(skin, (lines[0], lines[1]), (upper, lower)),
        (frame.surface(OUTER_UPPER), frame.surface(OUTER_LOWER)),
        material=replace(SOFT, E=d.adhesive, nu=d.adhesive_nu),
        name="middle adhesive",
        kind="adhesive",
    )


SCREWS = ((0.518, 0.700), (0.500, 0.840))  # on the left; mirrored on the right


def screwed(frame: TailgateFrame) -> Joined:
    """The four screws between inner sheet and upper reinforcements."""
    assembly = frame.assembly
    report: list[Joint] = []
    for side, sign in ((LEFT, 1), (RIGHT, -1)):
        for y, s in SCREWS:
            plan = np.array([(sign * y, s)])
            place = middle(frame.skin, plan, (INNER, UPPER + side))[0]
            rows = (_main(frame, INNER), _main(frame, UPPER + side))
            assembly, joints = screw(assembly, place, rows, material=SCREW)
            report += joints
    return assembly, tuple(report)


def holes(skin: Skin) -> list[tuple[np.ndarray, Pair]]:
    """Places (3,) of the empty bolt holes and the sheets they go through."""
    out = []
    for y, s, name, both in skin.design.holes:
        for sign, side in ((1, LEFT), (-1, RIGHT)) if both else ((1, ""),):
            pair = (INNER, name + side)
            out.append((middle(skin, np.array([(sign * y, s)]), pair)[0], pair))
    return out


def tied_holes(frame: TailgateFrame) -> Joined:
    """RBE2 over the rims of the empty bolt holes, as in a model whose screws were removed."""
    assembly = frame.assembly
    report: list[Joint] = []
    for place, pair in holes(frame.skin):
        rows = [_main(frame, name) for name in pair]
        assembly, joints = tied_hole(assembly, place, rows)
        report += joints
    return assembly, tuple(report)
