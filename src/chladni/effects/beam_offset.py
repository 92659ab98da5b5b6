"""Distance of stiffeners from their sheet, a number of the deck like a thickness.

A stiffener at a distance e from the middle of its sheet adds E A e² to the bending stiffness. Some
measure e from the middle of the sheet, others from its face. A tenth of e is a fifth of that
stiffness, and E of the stiffener, which also bends and twists by itself, is no substitute.
"""

import numpy as np

from ..fem.assemble import Structure, over_all_motions
from ..fem.derivative import Slope
from ..fem.energy import only
from ..fem.sparse_assembly import congruence
from ..geometry.beam_lines import member_beams
from ..model.assembly import Assembly
from ..model.free_parameter import FreeParameter
from .calibration_parameters import LinearScale, linear_scale, with_scaled
from .effect import Within


def offset_of(assembly: Assembly, k: int) -> float:
    """Mean distance of the beams of a part from their grids [m]; 0 without beams."""
    own = assembly.beams.offset[assembly.beams.part == k]
    return float(np.linalg.norm(own, axis=-1).mean()) if len(own) else 0.0


def offset_sd(assembly: Assembly, k: int) -> float | None:
    """Prior standard deviation of ln(distance / deck's): half the thickness of the sheet over it.

    None where the beams of the part have no distance, or some of them no sheet.
    """
    beams, shells = assembly.beams, assembly.shells
    t = np.zeros(len(assembly.points))
    np.maximum.at(t, shells.nodes, shells.thickness[:, : shells.nodes.shape[1]])
    of_sheet, away = t[beams.nodes[beams.part == k]], offset_of(assembly, k)
    if not away or not of_sheet.all():
        return None
    return float(of_sheet.mean() / 2 / away)


def stiffener_offsets(assembly: Assembly) -> list[FreeParameter]:
    """The distance of every part of beams along sheets."""
    own = np.unique(assembly.beams.part[member_beams(assembly)]).tolist()
    return [
        FreeParameter("offset", "offset", positions=(k,), sd=sd)
        for k in own
        if (sd := offset_sd(assembly, k)) is not None
    ]


def offset_scale(built: Structure, k: int) -> LinearScale:
    """One factor on the offsets of the beams of a part, in which K and M are quadratic."""
    made, name = built.assembly, built.assembly.parts[k].name

    def write(assembly: Assembly, factor: float) -> Assembly:
        return with_scaled(assembly, factor, "offset", (k,))

    none, own, twice = (over_all_motions(only(write(made, factor), k)) for factor in (0, 1, 2))
    slope, bent = (
        Slope(*(congruence(built.T, A) for A in change))
        for change in (
            [(c - a) / 2 for a, c in zip(none[:3], twice, strict=False)],
            [a - 2 * b + c for a, b, c in zip(none[:3], own, twice, strict=False)],
        )
    )
    rows = len(made.shells) + np.flatnonzero(made.beams.part[member_beams(made)] == k)
    within = Within(shells=rows) if len(rows) else None
    return linear_scale(
        f"offset of {name}", "offset", "-", 1.0, slope, write, bent=bent, within=within
    )
