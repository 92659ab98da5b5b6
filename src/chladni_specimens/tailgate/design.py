"""Numbers of the open tailgate: dimensions, gauges, joints and variants (SI).

Materials, gauges and kinds of joint are those of Echaniz Granado (2015), table 1. It gives no
dimensions, so the shape is ours; its mass and modes are near those of the nominal model there.
Planform coordinates are y (left-right) and s (up along the centre line of the outer skin).
"""

from dataclasses import dataclass, fields

from chladni.errors import ModelError
from chladni.model.properties import Isotropic

Corner = tuple[float, float, float]  # y, s, radius of rounding
Bar = tuple[tuple[float, float], tuple[float, float], float, int]  # ends, half width, +1: outward

STEEL = Isotropic(210e9, 0.3, 7850.0, id=1)
ADHESIVE = Isotropic(6e6, 0.4, 1000.0, id=2)
WELD = Isotropic(210e9, 0.3, 0.0, id=3)
SCREW = Isotropic(210e9, 0.3, 7850.0, id=4)
SEALANT = Isotropic(6e6, 0.499, 1000.0, id=5)

HEMS = ("modelled", "sealed", "real")
STRETCHES = ("all", "left", "right", "above", "below")


def _mirrored(bars: tuple[Bar, ...]) -> tuple[Bar, ...]:
    flipped = tuple(((-a[0], a[1]), (-b[0], b[1]), w, side) for a, b, w, side in bars)
    return bars + flipped


@dataclass(frozen=True)
class TailgateDesign:
    """Numbers of the open tailgate [m, rad unless stated otherwise]; see the comments.

    ``hem``: "modelled" is the one-sided soft string of Echaniz Granado (2015). "sealed" adds
    sealant on the folded side and round the inner edge. "real" also stops the inner sheet's sliding
    along the hem (``hem_grip`` per length) over ``hem_stretch``.
    """

    size: float = 0.016  # mesh size
    inner_size: float = 0.8  # of the inner panel, in mesh sizes: its ribs carry the global modes
    # the skin: centre line, crown, outline, window
    height: float = 1.022
    slope: tuple[float, float, float, float] = (-4.0, 14.0, 52.0, 60.0)  # [degrees] along s
    bend: tuple[float, float] = (0.480, 0.095)  # place and half width of the bend at the waist
    radius: tuple[float, float] = (2.8, 2.2)  # crown across, bottom and top
    outline: tuple[Corner, ...] = (
        (-0.478, 0.0, 0.090),
        (0.478, 0.0, 0.090),
        (0.606, 0.430, 0.250),
        (0.510, 1.022, 0.110),
        (-0.510, 1.022, 0.110),
        (-0.606, 0.430, 0.250),
    )
    arch: tuple[float, float] = (0.018, 0.022)  # bow of bottom and top edge
    window: tuple[Corner, ...] = (
        (-0.513, 0.535, 0.040),
        (0.513, 0.535, 0.040),
        (0.458, 0.947, 0.085),
        (-0.458, 0.947, 0.085),
    )
    window_arch: float = 0.012
    frame: float = 0.585  # above this s the window frame is meshed in strips
    # outer panels
    split: float = 0.470  # seam between outer upper and outer lower
    tongue: tuple[float, float] = (0.022, 0.032)  # reach under the lower skin; start inboard
    rebate: float = 0.008  # of the window
    plate: tuple[float, float, float, float, float] = (0.265, 0.215, 0.345, 0.012, 0.016)
    crease: tuple[float, float, float] = (0.395, 0.005, 0.028)  # s, height, half width
    # hem
    gap: float = 0.001  # between the mid-surfaces
    hem_width: float = 0.012  # of the folded flange
    hem_clearance: float = 0.002  # of the inner edge to the base of the U
    # inner panel
    flange: tuple[float, float] = (0.018, 0.014)  # hem flange, then wall
    window_flange: tuple[float, float] = (0.015, 0.012)
    depth: tuple[tuple[float, float], ...] = (  # box depth over s
        (0.0, 0.033),
        (0.330, 0.033),
        (0.430, 0.072),
        (0.880, 0.072),
        (0.962, 0.014),
    )
    plateau: tuple[Corner, ...] = (
        (-0.395, 0.115, 0.045),
        (0.395, 0.115, 0.045),
        (0.465, 0.415, 0.045),
        (-0.465, 0.415, 0.045),
    )
    plateau_depth: tuple[float, float] = (0.021, 0.024)  # depth, width of its wall
    openings: tuple[tuple[float, float, float, float, float], ...] = (  # y, s, half sizes, radius
        (-0.205, 0.240, 0.169, 0.095, 0.030),
        (0.205, 0.240, 0.169, 0.095, 0.030),
    )
    beads: tuple[Bar, ...] = (
        ((0.0, 0.190), (0.0, 0.290), 0.009, -1),
        *_mirrored(
            (
                ((0.145, 0.376), (0.385, 0.376), 0.011, 1),
                ((0.140, 0.066), (0.330, 0.066), 0.012, 1),
                ((0.462, 0.150), (0.484, 0.238), 0.010, 1),
                ((0.145, 0.474), (0.395, 0.474), 0.011, 1),
            )
        ),
    )
    bead_depth: tuple[float, float] = (0.011, 0.010)  # height, width of the wall
    groove: tuple[float, float, float] = (0.005, 0.540, 0.880)  # in the side frames: depth, s, s
    # reinforcements
    upper: tuple[float, float, float, float] = (0.130, 0.600, 0.008, 0.008)  # |y|, s, insets
    hinge: tuple[float, float, float, float, float] = (0.462, 0.968, 0.012, 0.014, 0.0022)
    lower: tuple[float, float, float, float] = (0.488, 0.546, 0.318, 0.478)  # |y| and s, from-to
    latch: tuple[float, float, float] = (0.095, 0.042, 0.112)  # half width, s from-to
    bracket: tuple[float, float, float] = (0.110, 0.345, 0.482)
    bracket_depth: float = 0.058
    # empty bolt holes: radius (0: none); y, s, sheet behind the inner panel, on both sides
    hole: float = 0.0035
    holes: tuple[tuple[float, float, str, bool], ...] = (
        (0.485, 0.940, "upper reinforcements", True),
        (0.390, 0.995, "upper reinforcements", True),
        (0.518, 0.360, "lower reinforcements", True),
        (0.518, 0.430, "lower reinforcements", True),
        (0.030, 0.077, "latch reinforcement", False),
        (-0.030, 0.077, "latch reinforcement", False),
        (0.098, 0.428, "wiper motor bracket", False),
        (-0.098, 0.428, "wiper motor bracket", False),
    )
    # gauges (Table 1)
    t_inner: float = 0.7e-3
    t_outer_upper: float = 0.7e-3
    t_outer_lower: float = 0.8e-3
    t_upper: float = 1.2e-3
    t_lower: float = 2.0e-3
    t_latch: float = 1.5e-3
    t_bracket: float = 1.5e-3
    formed: bool = False  # thickness after forming instead of the sheet's gauge
    # joints
    string: tuple[float, float] = (0.010, 0.15e-3)  # hem adhesive: width, height
    adhesive: float = ADHESIVE.E  # [Pa], hem and middle string
    adhesive_nu: float = ADHESIVE.nu
    weld: float = 0.005  # side of the nugget
    weld_patch: float = 0.0  # radius over which a weld holds its sheets; 0: nearest shell
    missing_welds: tuple[int, ...] = ()  # numbers from 1
    pitch_window: float = 0.055
    pitch_seam: float = 0.090
    pitch_upper: float = 0.050
    screws: bool = True  # the four that stop the reinforcements' rattling, 12 g each
    # numbers that may differ in reality or be wrong in a model
    hem: str = "modelled"
    hem_grip: float = 1e10  # [N/m²], stiffness against sliding along the hem per length
    hem_stretch: str = "all"
    tied_holes: bool = False  # RBE2 left in empty bolt holes
    accelerometers: int = 0  # number, 5 g each

    def __post_init__(self) -> None:
        if not 0.0048 <= self.size <= 0.032:  # the inner panel's is 0.8 of the model's
            raise ModelError(f"mesh size {self.size * 1e3:g} mm is not within 6 to 32 mm")
        for name, allowed in (("hem", HEMS), ("hem_stretch", STRETCHES)):
            if (value := getattr(self, name)) not in allowed:
                raise ModelError(f"{name} is {value!r}; it may be {', '.join(allowed)}")
        if not 0 <= self.hole <= 0.005:
            raise ModelError(f"hole is {self.hole:g} m; bolt holes have radii up to 5 mm")
        for f in fields(self):
            if f.name.startswith("t_") and not 1e-4 <= getattr(self, f.name) <= 1e-2:
                raise ModelError(f"{f.name} is {getattr(self, f.name):g} m; sheets are 0.1-10 mm")
