"""Structures unlike our specimens, for articles by Kratos: each deck, and each finer article.

Dimensions are drawn at random. A deck is what an engineer writes: few elements a wave, stringers as
bars on the skin. In the article the stringers are sheets, and tubes have more shear.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from chladni.model.assembly import Assembly, Beams, appended
from chladni.model.properties import BeamSection, Isotropic, Part
from chladni_specimens import DrawnForm, Piece, of_pieces, rectangle, stops

STEEL = Isotropic(210e9, 0.3, 7850.0, id=1)
ALUMINIUM = Isotropic(70e9, 0.33, 2700.0, id=2)
SPOT = 0.006  # diameter of a spot weld [m]
UP = np.array([0.0, 0.0, 1.0])
# shear factors of a thin square tube: by the area of its webs, as a deck has it, and by Cowper
# (1966), J. Applied Mechanics 33, 335-340
WEBS, COWPER = 0.54, 0.44

Numbers = Mapping[str, float]


def half_cylinder(d: Numbers, h: float) -> Assembly:
    """Half of a thin cylinder, open at both ends."""
    R = d["radius"]
    flat = rectangle("shell", (0, 0, 0), stops([0.0, d["length"]], h), stops([0.0, np.pi * R], h))
    return of_pieces([_rolled(flat, R)], {"shell": (d["t"], STEEL)})


def _rolled(flat: Piece, R: float) -> Piece:
    """A flat piece rolled about the x-axis of a cylinder, from its y."""
    x, s, _ = flat.points.T
    points = np.column_stack([x, R * np.sin(s / R), R * np.cos(s / R)])
    return Piece(flat.part, points, flat.cells)


def stringer_plate(d: Numbers, h: float, bars: bool) -> Assembly:
    """A skin with three blade stringers along it: bars with an offset, or sheets."""
    L, W, H, t, b = (d[k] for k in ("length", "width", "height", "t", "t blade"))
    lines = [W / 6, W / 2, 5 * W / 6]
    x, y = stops([0.0, L], h), stops([0.0, *lines, W], h)
    skin = rectangle("skin", (0, 0, 0), x, y)
    if not bars:
        z = stops([0.0, H], min(h, H / 2))
        blades = [rectangle("stringers", (0, at, 0), x, z, "xz") for at in lines]
        return of_pieces([skin, *blades], {"skin": (t, ALUMINIUM), "stringers": (b, ALUMINIUM)})
    a = of_pieces([skin], {"skin": (t, ALUMINIUM)})
    chains = [np.flatnonzero(np.isclose(a.points[:, 1], at)) for at in lines]
    ends = np.concatenate([_chain(a.points, rows) for rows in chains])
    blade = BeamSection(ALUMINIUM, b * H, b * H**3 / 12, H * b**3 / 12, 0.0, H * b**3 / 3)
    return _with_beams(a, ends, Part(2, "stringers", blade), UP, UP * (H + t) / 2)


def _chain(points: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Pairs (k - 1, 2) of neighbours along x."""
    rows = rows[np.argsort(points[rows, 0])]
    return np.column_stack([rows[:-1], rows[1:]])


def _with_beams(
    a: Assembly, ends: np.ndarray, part: Part, up: np.ndarray, offset: np.ndarray
) -> Assembly:
    """Beams between rows of points (k, 2), of a new part."""
    n, first = len(ends), int(a.shells.ids.max(initial=0)) + 1
    beams = appended(
        Beams(), ids=first + np.arange(n), nodes=ends, part=np.full(n, len(a.parts)),
        up=np.tile(up, (n, 1)), offset=np.tile(offset, (n, 2, 1)),
    )  # fmt: skip
    return replace(a, parts=(*a.parts, part), beams=beams)


def held_plate(d: Numbers, h: float) -> Assembly:
    """A plate in a frame that clamps all its edges."""
    x, y = (stops([0.0, d[k]], h) for k in ("length", "width"))
    a = of_pieces([rectangle("plate", (0, 0, 0), x, y)], {"plate": (d["t"], STEEL)})
    low, high = a.points.min(axis=0), a.points.max(axis=0)
    inside = ((a.points > low + 1e-9) & (a.points < high - 1e-9))[:, :2].all(axis=1)
    return _held(a, ~inside)


def cantilever(d: Numbers, h: float) -> Assembly:
    """A plate with one short side in a clamp."""
    x, y = (stops([0.0, d[k]], h) for k in ("length", "width"))
    a = of_pieces([rectangle("plate", (0, 0, 0), x, y)], {"plate": (d["t"], STEEL)})
    return _held(a, a.points[:, 0] < 1e-9)


def curved_blade(d: Numbers, h: float) -> Assembly:
    """A blade of sheet, curved across, with one end in a clamp."""
    x, y = (stops([0.0, d[k]], h) for k in ("length", "width"))
    flat = rectangle("blade", (0, 0, 0), x, y)
    a = of_pieces([_rolled(flat, d["radius"])], {"blade": (d["t"], STEEL)})
    return _held(a, a.points[:, 0] < 1e-9)


def _held(a: Assembly, rows: np.ndarray) -> Assembly:
    held = [(row, c) for row in np.flatnonzero(rows) for c in range(1, 7)]
    return replace(a, supports=np.array(held))


def covered_trough(d: Numbers, h: float) -> Assembly:
    """A trough with rims turned outwards, and a cover spot-welded on both rims."""
    L, W, H, rim, t = (d[k] for k in ("length", "width", "height", "rim", "t"))
    welds = np.linspace(0.03, L - 0.03, round((L - 0.06) / 0.07) + 1)
    x, y, z = stops([0.0, *welds, L], h), stops([0.0, W], h), stops([0.0, H], h)
    edge = stops([0.0, rim / 2, rim], h)
    rims = [(-rim, -rim / 2), (W + rim, W + rim / 2)]
    cover_y = stops([-rim, -rim / 2, 0.0, W, W + rim / 2, W + rim], h) + rim
    pieces = [
        rectangle("trough", (0, 0, 0), x, y),
        *(rectangle("trough", (0, at, 0), x, z, "xz") for at in (0.0, W)),
        *(rectangle("trough", (0, at, H), x, edge) for at in (-rim, W)),
        rectangle("cover", (0, -rim, H + t), x, cover_y),
    ]
    a = of_pieces(pieces, {"trough": (t, STEEL), "cover": (d["t cover"], STEEL)})
    ends = [
        [_at(a, (s, at, level)) for level in (H, H + t)] for _, at in rims for s in welds.tolist()
    ]
    area, I = np.pi * SPOT**2 / 4, np.pi * SPOT**4 / 64
    spot = BeamSection(STEEL, area, I, I, 0.0, 2 * I)
    return _with_beams(a, np.array(ends), Part(3, "spots", spot), np.eye(3)[0], np.zeros(3))


def _at(a: Assembly, place: tuple[float, float, float]) -> int:
    return int(np.linalg.norm(a.points - place, axis=1).argmin())


def ladder(d: Numbers, h: float, k: float) -> Assembly:
    """Two rails and three rungs of square tube as bars, with shear factor k, across the x-axis."""
    L, W, side, t = (d[name] for name in ("length", "width", "side", "t"))
    at = (0.0, d["bay"] * L, L)
    corners = np.array([(0.0, y, z) for y in at for z in (0.0, W)])
    points, ends = list(corners), []
    for a, b in ((0, 2), (2, 4), (1, 3), (3, 5), (0, 1), (2, 3), (4, 5)):
        n = max(2, round(float(np.linalg.norm(corners[b] - corners[a])) / h))
        inner = len(points) + np.arange(n - 1)
        points += list(corners[a] + np.arange(1, n)[:, None] / n * (corners[b] - corners[a]))
        chain = np.r_[a, inner, b]
        ends.append(np.column_stack([chain[:-1], chain[1:]]))
    area, I = side**2 - (side - 2 * t) ** 2, (side**4 - (side - 2 * t) ** 4) / 12
    tube = BeamSection(STEEL, area, I, I, 0.0, (side - t) ** 3 * t, shear=(k, k))
    bare = Assembly(np.arange(1, len(points) + 1), np.array(points), ())
    return _with_beams(
        bare, np.concatenate(ends), Part(1, "tubes", tube), np.eye(3)[0], np.zeros(3)
    )


def cut_out_plate(d: Numbers, h: float) -> Assembly:
    """A plate with an elliptic cut-out, on rings from its edge to the outline."""
    L, W = d["length"], d["width"]
    sides = [stops([0.0, s], h)[:-1] for s in (L, W, L, W)]
    corners = np.array([(0, 0), (L, 0), (L, W), (0, W)], float)
    along = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)], float)
    outline = np.concatenate(
        [c + s[:, None] * e for c, s, e in zip(corners, sides, along, strict=True)]
    )
    centre, radii = np.array([d["x"] * L, d["y"] * W]), np.array([d["a"], d["b"]])
    theta = np.arctan2(*((outline - centre) / radii).T[::-1])
    ellipse = centre + radii * np.column_stack([np.cos(theta), np.sin(theta)])
    width = np.linalg.norm(outline - ellipse, axis=1).mean()
    share = np.linspace(0.0, 1.0, max(3, round(width / h)) + 1)
    flat = ellipse[:, None] + share[None, :, None] * (outline - ellipse)[:, None]
    n, m = flat.shape[:2]
    at = np.arange(n * m).reshape(n, m)
    turned = np.roll(at, -1, axis=0)
    cells = np.stack([at[:, :-1], at[:, 1:], turned[:, 1:], turned[:, :-1]], axis=-1)
    points = np.column_stack([flat.reshape(-1, 2), np.zeros(n * m)])
    piece = Piece("plate", points, cells.reshape(-1, 4))
    return of_pieces([piece], {"plate": (d["t"], ALUMINIUM)})


_HALF = {"length": (0.35, 0.5), "radius": (0.14, 0.2), "t": (1.2e-3, 1.6e-3)}
_STRINGERS = {
    **{"length": (0.42, 0.55), "width": (0.36, 0.45), "height": (0.010, 0.016)},
    **{"t": (1.2e-3, 1.8e-3), "t blade": (1.8e-3, 2.4e-3)},
}
_PLATE = {"length": (0.34, 0.44), "width": (0.24, 0.32), "t": (1.2e-3, 1.8e-3)}
_BLADE = {
    **{"length": (0.22, 0.3), "width": (0.12, 0.18)},
    "radius": (0.25, 0.5),
    "t": (1.2e-3, 1.8e-3),
}
_TROUGH = {
    **{"length": (0.42, 0.55), "width": (0.14, 0.2), "height": (0.05, 0.08)},
    **{"rim": (0.02, 0.026), "t": (1.0e-3, 1.4e-3), "t cover": (1.0e-3, 1.4e-3)},
}
_LADDER = {
    **{"length": (0.55, 0.75), "width": (0.35, 0.45), "bay": (0.35, 0.65)},
    **{"side": (0.018, 0.025), "t": (1.3e-3, 1.8e-3)},
}
_CUT = {
    **{"length": (0.42, 0.55), "width": (0.34, 0.42), "x": (0.4, 0.6), "y": (0.4, 0.6)},
    **{"a": (0.07, 0.1), "b": (0.04, 0.07), "t": (1.6e-3, 2.2e-3)},
}
DECKS = {
    form.name: form
    for form in (
        DrawnForm("half cylinder", _HALF, half_cylinder, 0.028),
        DrawnForm("stringer plate", _STRINGERS, partial(stringer_plate, bars=True), 0.022),
        DrawnForm("held plate", _PLATE, held_plate, 0.022),
        DrawnForm("cantilever", _PLATE, cantilever, 0.022),
        DrawnForm("curved blade", _BLADE, curved_blade, 0.015),
        DrawnForm("covered trough", _TROUGH, covered_trough, 0.022),
        DrawnForm("cut-out plate", _CUT, cut_out_plate, 0.022),
        DrawnForm("ladder of tubes", _LADDER, partial(ladder, k=WEBS), 0.045),
    )
}
ARTICLES = {  # a spot at one point acts as one of radius h/5, so h is 15 mm for spots of 6 mm
    **DECKS,
    "stringer plate": replace(DECKS["stringer plate"], build=partial(stringer_plate, bars=False)),
    "covered trough": replace(DECKS["covered trough"], size=0.066),
    "ladder of tubes": replace(DECKS["ladder of tubes"], build=partial(ladder, k=COWPER)),
}
FINER = 4.4  # refinement of an article over its deck: its own errors of h² are a 20th
