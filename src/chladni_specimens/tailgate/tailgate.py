"""The open tailgate: nine pressings, their welds, adhesive and screws, as one assembly.

Parts and their values are from Echaniz Granado (2015), table 1; the shape is ours (see ``design``).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from chladni.model.assembly import Assembly, Shells
from chladni.model.properties import Part, ShellSection

from ..joints.bolts import accelerometers
from ..joints.builders import Joined, Joint
from ..mesher.forming import corner_thickness
from ..mesher.pressed_sheets import PressedSheet
from .design import STEEL, TailgateDesign
from .formed_thickness import forming, nominal
from .pressings import pressings, without_side
from .skin import Skin
from .tailgate_joints import TailgateFrame, hem_strings, middle_string, screwed, tied_holes, welded


@dataclass(frozen=True, eq=False)
class FormedSpecimen:
    """A generated structure with its sheets and joints.

    Attributes
    ----------
    assembly : Assembly
    sheets : dict of PressedSheet    by name
    rows : dict of (n,) int   rows of ``assembly.shells`` of each sheet
    joints : tuple of Joint   connections made by the builders
    """

    assembly: Assembly
    sheets: dict[str, PressedSheet]
    rows: dict[str, np.ndarray]
    joints: tuple[Joint, ...]


def tailgate(design: TailgateDesign | None = None) -> Assembly:
    """The assembly of this design (default: the nominal one at 16 mm)."""
    return tailgate_specimen(design).assembly


def tailgate_specimen(design: TailgateDesign | None = None) -> FormedSpecimen:
    """The assembly with its sheets and a report of its joints."""
    d = design or TailgateDesign()
    skin = Skin.of(d)
    sheets = pressings(skin)
    assembly, rows = of_sheets(sheets, parts(d))
    frame = TailgateFrame(skin, with_formed(assembly, sheets, rows, skin), sheets, rows)
    steps: list[Callable[[TailgateFrame], Joined]] = [hem_strings, middle_string, welded]
    steps += [screwed] if d.screws else []
    steps += [tied_holes] if d.tied_holes else []
    report: list[Joint] = []
    for step in steps:
        assembly, joints = step(frame)
        frame = replace(frame, assembly=assembly)
        report += joints
    assembly = frame.assembly
    if d.accelerometers:
        assembly = accelerometers(assembly, sensor_grids(assembly, d.accelerometers))
    return FormedSpecimen(assembly, sheets, rows, tuple(report))


def parts(d: TailgateDesign) -> tuple[Part, ...]:
    """The seven shell parts of Table 1."""
    return tuple(
        Part(k, name, ShellSection(gauge, STEEL, STEEL))
        for k, (name, gauge) in enumerate(nominal(d).items(), start=1)
    )


def of_sheets(
    sheets: dict[str, PressedSheet], parts: tuple[Part, ...]
) -> tuple[Assembly, dict[str, np.ndarray]]:
    """An assembly of unconnected sheets at their gauge, and each sheet's rows of shells."""
    names = [p.name for p in parts]
    points, nodes, part, rows = [], [], [], {}
    n = m = 0
    for name, sheet in sheets.items():
        points.append(sheet.points)
        nodes.append(sheet.quads + n)
        part.append(np.full(len(sheet.quads), names.index(without_side(name))))
        rows[name] = m + np.arange(len(sheet.quads))
        n, m = n + len(sheet.points), m + len(sheet.quads)
    places, cells, which = np.vstack(points), np.vstack(nodes), np.concatenate(part)
    gauge = np.array([_gauge(p) for p in parts])[which]
    side = places[cells[:, 1]] - places[cells[:, 0]]
    shells = Shells(
        np.arange(1, m + 1),
        cells,
        which,
        np.repeat(gauge[:, None], 4, axis=1),
        side / np.linalg.norm(side, axis=1, keepdims=True),
        np.zeros(m),
    )
    return Assembly(np.arange(1, n + 1), places, parts, shells), rows


def _gauge(part: Part) -> float:
    assert isinstance(part.section, ShellSection)
    return part.section.thickness


def with_formed(
    assembly: Assembly, sheets: dict[str, PressedSheet], rows: dict[str, np.ndarray], skin: Skin
) -> Assembly:
    """The assembly with the thickness after forming, if the design requests it."""
    if not skin.design.formed:
        return assembly
    t = assembly.shells.thickness.copy()
    made = {p.name: forming(skin, p.name) for p in assembly.parts}
    for name, sheet in sheets.items():
        field = made[without_side(name)].thickness
        t[rows[name]] = corner_thickness(field, sheet.plan[sheet.quads])
    return replace(assembly, shells=replace(assembly.shells, thickness=t))


def sensor_grids(assembly: Assembly, count: int) -> list[int]:
    """Ids of `count` grids spread over the sheets, each farthest from the earlier ones."""
    rows = np.unique(assembly.shells.nodes)
    x = assembly.points[rows]
    chosen = [int(np.argmax(x[:, 2]))]
    far = np.linalg.norm(x - x[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(far.argmax()))
        far = np.minimum(far, np.linalg.norm(x - x[chosen[-1]], axis=1))
    return assembly.ids[rows[chosen]].tolist()
