"""Forms of sheet metal: bolted bracket, box with lid, ribbed plate, curved shell, bonded plates."""

from collections.abc import Mapping

import numpy as np

from chladni.geometry.nearest import ShellSurface
from chladni.model.assembly import Assembly
from chladni.model.properties import Isotropic

from ..joints.bolts import screw
from ..joints.builders import hexahedra, spot_welds
from .mesh_pieces import Piece, of_pieces, rectangle, stops

STEEL = Isotropic(210e9, 0.3, 7850.0, id=1)
ALUMINIUM = Isotropic(70e9, 0.33, 2700.0, id=2)
EPOXY = Isotropic(1.5e9, 0.38, 1200.0, id=3)

Numbers = Mapping[str, float]


def bolted_bracket(d: Numbers, h: float) -> Assembly:
    """A plate and an angle bracket, with its lower leg over the plate's end and four screws."""
    L, W, leg, rise, gap = (d[k] for k in ("length", "width", "leg", "rise", "gap"))
    y = stops([0.0, W], h)
    pieces = [
        rectangle("plate", (0, 0, 0), stops([0.0, L], h), y),
        rectangle("angle", (L - leg, 0, gap), stops([0.0, leg], h), y),
        rectangle("angle", (L, 0, gap), y, stops([0.0, rise], h), "yz"),
    ]
    a = of_pieces(pieces, {"plate": (d["t plate"], STEEL), "angle": (d["t angle"], STEEL)})
    for x in (L - 0.75 * leg, L - 0.25 * leg):
        for y_k in (0.2 * W, 0.8 * W):
            a = screw(a, np.array([x, y_k, gap / 2]), ("plate", "angle"))[0]
    return a


def lidded_box(d: Numbers, h: float) -> Assembly:
    """An open box of steel with a rim turned outwards and a lid spot-welded on the rim."""
    L, W, H, rim, gap = (d[k] for k in ("length", "width", "height", "rim", "gap"))
    x, y, z = (stops([0.0, s], h) for s in (L, W, H))
    wide_x, wide_y = (stops([-rim, 0.0, s, s + rim], h) for s in (L, W))
    box = [
        rectangle("box", (0, 0, 0), x, y),
        *(rectangle("box", (0, at, 0), x, z, "xz") for at in (0.0, W)),
        *(rectangle("box", (at, 0, 0), y, z, "yz") for at in (0.0, L)),
    ]
    outer = rectangle("box", (0, 0, H), wide_x, wide_y)
    middle = outer.points[outer.cells].mean(axis=1)
    hole = (middle[:, 0] > 0) & (middle[:, 0] < L) & (middle[:, 1] > 0) & (middle[:, 1] < W)
    flange = Piece("box", outer.points, outer.cells[~hole])
    lid_x, lid_y = (stops([0.0, s + 2 * rim], h) for s in (L, W))
    lid = rectangle("lid", (-rim, -rim, H + gap), lid_x, lid_y)
    a = of_pieces([*box, flange, lid], {"box": (d["t box"], STEEL), "lid": (d["t lid"], STEEL)})
    return spot_welds(a, _round_the_rim(d), ("box", "lid"))[0]


def _round_the_rim(d: Numbers) -> np.ndarray:
    """Places of the welds: along the middle of the rim, about every 90 mm."""
    L, W, r, z = d["length"], d["width"], d["rim"] / 2, d["height"] + d["gap"] / 2
    places = []
    for s, far, swap in ((L, W, False), (W, L, True)):
        along = np.linspace(0.0, s, max(3, round(s / 0.09)) + 1)
        for across in (-r, far + r):
            rows = np.column_stack([along, np.full(len(along), across), np.full(len(along), z)])
            places.append(rows[:, [1, 0, 2]] if swap else rows)
    return np.concatenate(places)


def ribbed_plate(d: Numbers, h: float) -> Assembly:
    """A plate with three upright ribs along it and one across, in one piece."""
    L, W, H = d["length"], d["width"], d["rib"]
    across, along = d["along"] * L, [f * W for f in (d["first"], 0.5, d["last"])]
    x, y = stops([0.0, across, L], h), stops([0.0, *along, W], h)
    z = stops([0.0, H], h)
    pieces = [
        rectangle("plate", (0, 0, 0), x, y),
        *(rectangle("ribs", (0, at, 0), x, z, "xz") for at in along),
        rectangle("ribs", (across, 0, 0), y, z, "yz"),
    ]
    return of_pieces(pieces, {"plate": (d["t plate"], ALUMINIUM), "ribs": (d["t rib"], ALUMINIUM)})


def curved_shell(d: Numbers, h: float) -> Assembly:
    """A piece of a cylinder with two windows and turned-in edges at both straight sides."""
    L, R, arc, lip = d["length"], d["radius"], d["arc"], d["lip"]
    S = R * arc  # developed width
    holes = [  # x and s, from-to
        (d["x1"] * L, (d["x1"] + d["w1"]) * L, 0.15 * S, (0.15 + d["s1"]) * S),
        (d["x2"] * L, (d["x2"] + d["w2"]) * L, (0.85 - d["s2"]) * S, 0.85 * S),
    ]
    x = stops(sorted({0.0, L, *(v for a in holes for v in a[:2])}), h)
    s = stops(sorted({0.0, S, *(v for a in holes for v in a[2:])}), h)
    flat = rectangle("shell", (0, 0, 0), x, s)
    middle = flat.points[flat.cells].mean(axis=1)
    cut = np.zeros(len(flat.cells), bool)
    for x0, x1, s0, s1 in holes:
        cut |= (middle[:, 0] > x0) & (middle[:, 0] < x1) & (middle[:, 1] > s0) & (middle[:, 1] < s1)
    theta = flat.points[:, 1] / R - arc / 2
    round_ = np.column_stack([flat.points[:, 0], R * np.sin(theta), R * np.cos(theta)])
    pieces = [Piece("shell", round_, flat.cells[~cut])]
    for sign in (-1, 1):
        edge = np.array([0.0, sign * R * np.sin(arc / 2), R * np.cos(arc / 2)])
        inward = np.array([0.0, -sign * np.sin(arc / 2), -np.cos(arc / 2)])
        strip = rectangle("lips", (0, 0, 0), x, stops([0.0, lip], h))
        flatly = edge + strip.points[:, :1] * [1, 0, 0] + strip.points[:, 1:2] * inward
        pieces.append(Piece("lips", flatly, strip.cells))
    return of_pieces(pieces, {"shell": (d["t shell"], STEEL), "lips": (d["t lip"], STEEL)})


def bonded_plates(d: Numbers, h: float) -> Assembly:
    """Two overlapping plates with a layer of adhesive solids between them."""
    L1, L2, W1, W2, lap = (d[k] for k in ("length 1", "length 2", "width 1", "width 2", "lap"))
    t1, t2, glue = d["t 1"], d["t 2"], d["glue"]
    z = (t1 + t2) / 2 + glue
    side = (W1 - W2) / 2
    pieces = [
        rectangle("lower", (0, 0, 0), stops([0.0, L1], h), stops([0.0, W1], h)),
        rectangle("upper", (L1 - lap, side, z), stops([0.0, L2], h), stops([0.0, W2], h)),
    ]
    a = of_pieces(pieces, {"lower": (t1, STEEL), "upper": (t2, ALUMINIUM)})
    edge = 0.004  # the layer ends a little inside
    x = stops([L1 - lap + edge, L1 - edge], 1.2 * h)
    y = stops([side + edge, side + W2 - edge], 1.2 * h)
    base = rectangle("", (0, 0, t1 / 2), x, y)
    lower = base.points[base.cells]
    corners = np.concatenate([lower, lower + np.array([0, 0, glue])], axis=1)
    sheets = (ShellSurface.of(a, "lower"), ShellSurface.of(a, "upper"))
    return hexahedra(
        a, corners, sheets, material=EPOXY, name="adhesive", kind="adhesive", reach=0.01
    )[0]
