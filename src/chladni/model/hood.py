"""A hood: outer skin, ribbed inner panel, hinge and striker plates, hem and mastic spots.

Made of the tailgate's building blocks, to see whether what works there works elsewhere. Its rim
is hemmed all round, but the distributed soft joint (mastic) matters more than the rim.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ModelError
from .assembly import Assembly
from .connections import Joined, Joint, adhesive_bead, spot_welds
from .connections_bolts import along_line, grip
from .mesher import fill, strip
from .mesher_curves import Loop, rectangle, resampled, rounded, stadium
from .mesher_sheets import BASE, MAIN, Patches, Sheet, fold
from .mesher_surface import CrownedSurface, ramp
from .properties import Isotropic, Part, ShellSection
from .tailgate import Specimen, of_sheets
from .tailgate_design import STEEL, WELD

OUTER, INNER, HINGES, STRIKER = "outer", "inner", "hinge plates", "striker plate"
Rib = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class HoodDesign:
    """The hood's numbers (SI); planform y across, s from the front edge along the centre line."""

    size: float = 0.020  # mesh size
    length: float = 0.950
    front: float = 0.640  # half width at the front
    rear: float = 0.700
    slope: tuple[float, float] = (75.0, 88.0)  # from the vertical [degrees], front and rear
    radius: float = 3.5  # across
    crest: tuple[float, float, float] = (0.350, 0.006, 0.060)  # |y|, height, half width
    gap: float = 0.001
    hem_width: float = 0.012
    hem_clearance: float = 0.002
    flange: tuple[float, float] = (0.018, 0.020)  # hem flange, then wall
    depth: float = 0.004  # of the inner panel's field
    rib: tuple[float, float, float] = (0.026, 0.030, 0.012)  # depth, half width, wall
    openings: tuple[tuple[float, float, float, float], ...] = (  # y, s, half sizes
        (0.450, 0.300, 0.060, 0.080),
        (-0.450, 0.300, 0.060, 0.080),
        (0.460, 0.650, 0.070, 0.090),
        (-0.460, 0.650, 0.070, 0.090),
        (0.0, 0.260, 0.090, 0.050),
        (0.0, 0.720, 0.090, 0.050),
    )
    hinge: tuple[float, float, float, float] = (0.560, 0.070, 0.050, 0.040)
    striker: tuple[float, float, float, float] = (0.0, 0.880, 0.070, 0.035)
    t_outer: float = 0.7e-3
    t_inner: float = 0.6e-3
    t_plate: float = 1.5e-3
    string: tuple[float, float] = (0.010, 0.15e-3)  # hem adhesive: width, height
    adhesive: float = 6e6  # [Pa]
    adhesive_nu: float = 0.4
    mastic: float = 2e6  # [Pa]
    mastic_pitch: float = 0.120
    mastic_spot: tuple[float, float] = (0.014, 0.003)  # side, height
    missing_mastic: tuple[int, ...] = ()  # numbers from 1
    hem: str = "modelled"
    hem_grip: float = 1e10  # [N/m²]

    def __post_init__(self) -> None:
        if not 0.006 <= self.size <= 0.032:
            raise ModelError(f"mesh size {self.size * 1e3:g} mm is not within 6 to 32 mm")
        if self.hem not in ("modelled", "real"):
            raise ModelError(f"hem is {self.hem!r}; it may be modelled, real")

    @property
    def ribs(self) -> tuple[Rib, ...]:
        """Centre lines of the hat ribs: two along, a cross, a ring."""
        ring = ((0.540, 0.110), (0.590, 0.850), (-0.590, 0.850), (-0.540, 0.110))
        return (
            ((0.330, 0.150), (0.330, 0.860)),
            ((-0.330, 0.150), (-0.330, 0.860)),
            ((0.330, 0.180), (-0.330, 0.800)),
            ((-0.330, 0.180), (0.330, 0.800)),
            *((ring[k], ring[(k + 1) % 4]) for k in range(4)),
        )


@dataclass(frozen=True, eq=False)
class HoodSkin:
    """Outline, base surface and depth fields."""

    design: HoodDesign
    outline: Loop
    base: CrownedSurface

    def at(self, plan: np.ndarray) -> np.ndarray:
        """Places (n, 3) of planform points (y, s, depth)."""
        return self.base.at(plan)

    def outer(self, plan: np.ndarray) -> np.ndarray:
        """Depth of the outer sheet (n,): two crests."""
        y, height, half = self.design.crest
        fade = ramp((self.outline.distance(plan) - 0.02) / 0.06)
        return -height * ramp(1 - np.abs(np.abs(plan[:, 0]) - y) / half) * fade

    def inner(self, plan: np.ndarray) -> np.ndarray:
        """Depth of the inner sheet (n,): hem flange, wall, field, ribs away from the skin."""
        d = self.design
        wall = ramp((self.outline.distance(plan) - d.flange[0]) / d.flange[1])
        return d.gap + (d.depth - d.gap + (d.rib[0] - d.depth) * self.on_rib(plan)) * wall

    def on_rib(self, plan: np.ndarray, margin: float = 0.0) -> np.ndarray:
        """1 on the ribs, 0 on the field, between on their walls (n,)."""
        _, half, wall = self.design.rib
        away = np.min([_to_line(plan, *r) for r in self.design.ribs], axis=0)
        return ramp((half + wall + margin - away) / wall)

    def plate(self, plan: np.ndarray) -> np.ndarray:
        """Depth of hinge and striker plates (n,), flat on the inner sheet."""
        return self.inner(plan) - (self.design.t_inner + self.design.t_plate) / 2


def _to_line(plan: np.ndarray, a: tuple[float, float], b: tuple[float, float]) -> np.ndarray:
    start, along = np.array(a), np.subtract(b, a)
    t = ramp((plan - start) @ along / (along @ along))
    return np.asarray(np.linalg.norm(plan - start - t[:, None] * along, axis=1))


def hood_skin(d: HoodDesign) -> HoodSkin:
    """The skin of this design."""
    corners = [
        (-d.front, 0.0, 0.080),
        (d.front, 0.0, 0.080),
        (d.rear, d.length, 0.120),
        (-d.rear, d.length, 0.120),
    ]
    s = np.linspace(-0.05, d.length + 0.05, 2001)
    slope = np.interp(s, [0, d.length], np.deg2rad(d.slope))
    base = CrownedSurface.of(s, slope, (d.radius, d.radius), d.length)
    return HoodSkin(d, Loop.through(rounded(corners), 0.5e-3), base)


def _outer(skin: HoodSkin) -> Sheet:
    d, h = skin.design, skin.design.size
    edge = resampled(skin.outline.points, h)
    rows = [skin.outline.offset(edge, x) for x in (0.0, d.hem_width + 1e-3, 2 * d.hem_width)]
    y, _, half = d.crest
    s = np.arange(0.04, d.length - 0.04, h)
    lines = [
        np.column_stack([np.full(len(s), side * (y + k * half)), s])
        for side in (1, -1)
        for k in (-1, 0, 1)
    ]
    out = Patches()
    fold(out, edge, skin.outline.offset(edge, d.hem_width), d.gap, closed=True)
    out.add(strip(rows, closed=True), skin.outer)
    out.add(fill(rows[-1], h, (), lines), skin.outer)
    return out.sheet(OUTER, skin.at)


def _inner(skin: HoodSkin) -> Sheet:
    d, h = skin.design, skin.design.size
    edge = resampled(skin.outline.points, h)
    offsets = np.r_[d.hem_clearance, d.flange[0], d.flange[0] + d.flange[1]]
    rows = [skin.outline.offset(edge, x) for x in offsets]
    _, half, wall = d.rib
    lines = [resampled(stadium(a, b, half + w), h) for a, b in d.ribs for w in (wall, 0.0)]
    holes = [resampled(rectangle(y - a, s - b, y + a, s + b, 0.03), h) for y, s, a, b in d.openings]
    out = Patches()
    out.add(strip(rows, closed=True), skin.inner)
    out.add(fill(rows[-1], h, holes, lines, closest=0.009), skin.inner)
    return out.sheet(INNER, skin.at)


def _plates(skin: HoodSkin) -> list[Sheet]:
    d, h = skin.design, min(skin.design.size, 0.015)
    y, s, a, b = d.hinge
    sheets = []
    for name, y0, s0, u, v in (
        (HINGES + " left", y, s, a, b),
        (HINGES + " right", -y, s, a, b),
        (STRIKER, *d.striker),
    ):
        out = Patches()
        loop = resampled(rectangle(y0 - u, s0 - v, y0 + u, s0 + v, 0.012), h)
        out.add(fill(loop, h), skin.plate)
        sheets.append(out.sheet(name, skin.at))
    return sheets


def pressings(skin: HoodSkin) -> dict[str, Sheet]:
    """All sheets by name."""
    return {s.name: s for s in (_outer(skin), _inner(skin), *_plates(skin))}


def hood(design: HoodDesign | None = None) -> Assembly:
    """The assembly of this design."""
    return hood_specimen(design).assembly


def hood_specimen(design: HoodDesign | None = None) -> Specimen:
    """The assembly with its sheets and a report of its joints."""
    d = design or HoodDesign()
    skin = hood_skin(d)
    sheets = pressings(skin)
    gauges = {OUTER: d.t_outer, INNER: d.t_inner, HINGES: d.t_plate, STRIKER: d.t_plate}
    parts = tuple(
        Part(k, name, ShellSection(t, STEEL, STEEL))
        for k, (name, t) in enumerate(gauges.items(), start=1)
    )
    assembly, rows = of_sheets(sheets, parts)
    made = Specimen(assembly, sheets, rows, ())
    steps: list[Callable[[HoodSkin, Specimen], Joined]] = [_hem, _mastic, _welds]
    for step in steps:
        assembly, joints = step(skin, made)
        made = replace(made, assembly=assembly, joints=made.joints + joints)
    return made


def _main(made: Specimen, name: str) -> np.ndarray:
    return made.rows[name][made.sheets[name].zone == MAIN]


def _hem(skin: HoodSkin, made: Specimen) -> Joined:
    """Adhesive all round, and the grip along the hem where it is real."""
    d = skin.design
    line = _closed(resampled(skin.outline.points, 0.97 * d.size, even=False))
    sheets = (_main(made, INNER), _main(made, OUTER))

    def on(inboard: float, depth: float) -> np.ndarray:
        plan = skin.outline.offset(line, inboard)
        return skin.at(np.column_stack([plan, np.full(len(plan), depth)]))

    assembly, joints = adhesive_bead(
        made.assembly,
        on(d.hem_clearance + 0.3e-3 + d.string[0] / 2, d.gap / 2),
        sheets,
        width=d.string[0],
        height=d.string[1],
        material=Isotropic(d.adhesive, d.adhesive_nu, 1000.0, id=2),
        name="hem adhesive",
    )
    if d.hem == "modelled":
        return assembly, joints
    places = on(d.hem_clearance / 2, d.gap)[:-1]
    direction, k = along_line(_closed(places), d.hem_grip)
    base = made.rows[OUTER][made.sheets[OUTER].zone == BASE]
    assembly, grips = grip(assembly, places, direction[:-1], k[:-1], (sheets[0], base))
    return assembly, joints + grips


def _closed(line: np.ndarray) -> np.ndarray:
    return np.vstack([line, line[:1]])


def mastic_places(skin: HoodSkin) -> np.ndarray:
    """Planform places (n, 2) on a square grid where the inner field is flat and free."""
    d = skin.design
    count = round(2 * d.rear / d.mastic_pitch) + 1
    y = (np.arange(count) - (count - 1) / 2) * d.mastic_pitch
    s = np.arange(d.mastic_pitch / 2, d.length, d.mastic_pitch)
    plan = np.stack(np.meshgrid(y, s, indexing="ij"), axis=-1).reshape(-1, 2)
    plan = plan[skin.outline.inside(plan)]
    margin = d.mastic_spot[0]
    ok = (skin.outline.distance(plan) > sum(d.flange) + margin) & (skin.on_rib(plan, margin) == 0)
    for y0, s0, a, b in d.openings:
        ok &= (np.abs(plan[:, 0] - y0) > a + margin / 2) | (
            np.abs(plan[:, 1] - s0) > b + margin / 2
        )
    return plan[ok]


def _mastic(skin: HoodSkin, made: Specimen) -> Joined:
    d = skin.design
    plan = mastic_places(skin)
    number = np.arange(1, len(plan) + 1)
    plan = plan[~np.isin(number, d.missing_mastic)]
    depth = (skin.outer(plan) + skin.inner(plan)) / 2
    return spot_welds(
        made.assembly,
        skin.at(np.column_stack([plan, depth])),
        (_main(made, INNER), _main(made, OUTER)),
        side=d.mastic_spot[0],
        height=d.mastic_spot[1],
        material=Isotropic(d.mastic, 0.45, 1200.0, id=6),
        name="mastic",
        reach=0.012,
    )


def _welds(skin: HoodSkin, made: Specimen) -> Joined:
    """Six spot welds on each plate."""
    assembly, report = made.assembly, list[Joint]()
    d = skin.design
    y, s, a, b = d.hinge
    for name, y0, s0, u, v in (
        (HINGES + " left", y, s, a, b),
        (HINGES + " right", -y, s, a, b),
        (STRIKER, *d.striker),
    ):
        plan = np.array(
            [(y0 + j * (u - 0.014), s0 + k * (v - 0.014)) for j in (-1, 0, 1) for k in (-1, 1)]
        )
        depth = (skin.inner(plan) + skin.plate(plan)) / 2
        places = skin.at(np.column_stack([plan, depth]))
        surfaces = (_main(made, INNER), made.rows[name])
        assembly, joints = spot_welds(assembly, places, surfaces, material=WELD)
        report += joints
    return assembly, tuple(report)
