"""Two plates with joints between them: welds, a screw, sealant, a rigid element, bushes."""

from dataclasses import replace

import numpy as np

from chladni.model.added_points import next_id, with_points
from chladni.model.assembly import Assembly, RigidBody, appended
from chladni.model.properties import Isotropic

from .forms.mesh_pieces import of_pieces, rectangle, stops
from .joints.bolts import screw
from .joints.builders import adhesive_bead, spot_welds
from .plates import STEEL

SEALANT = Isotropic(6e6, 0.4, 1000.0, id=2)
HIGH = 1.2e-3  # of the upper plate above the lower one [m]
BEAD = 0.15e-3  # height of the sealant [m]
TIED = (0.27, 0.16, HIGH / 2)  # place of the rigid element [m]


def jointed_plates(h: float = 0.05) -> Assembly:
    """A plate over another: three welds, a screw and a sealed edge hold them; they almost touch.

    400 x 300 mm of 1.5 mm below, 360 x 260 mm of 1 mm above, with six flexible modes below 300 Hz.

    Parameters
    ----------
    h : element size [m]
    """
    pieces = [
        rectangle("lower", (0, 0, 0), stops([0.0, 0.4], h), stops([0.0, 0.3], h)),
        rectangle("upper", (0.02, 0.02, HIGH), stops([0.0, 0.36], h), stops([0.0, 0.26], h)),
    ]
    made = of_pieces(pieces, {"lower": (1.5e-3, STEEL), "upper": (1e-3, STEEL)})
    places = np.array([(0.05, y, HIGH / 2) for y in (0.06, 0.15, 0.24)])
    made = spot_welds(made, places, ("lower", "upper"))[0]
    made = screw(made, np.array([0.2, 0.05, HIGH / 2]), ("lower", "upper"))[0]
    line = np.array([(0.12, 0.27, HIGH / 2), (0.37, 0.27, HIGH / 2), (0.37, 0.03, HIGH / 2)])
    return adhesive_bead(
        made, line, ("lower", "upper"), height=BEAD, pitch=0.97 * h, material=SEALANT
    )[0]


def tied_plates(h: float = 0.05) -> Assembly:
    """The jointed plates with a rigid element: four grids of either follow a point between them.

    Parameters
    ----------
    h : element size [m]
    """
    made, at = with_points(jointed_plates(h), np.array([TIED]))
    rows: list[int] = []
    for part in (0, 1):
        own = np.unique(made.shells.nodes[made.shells.part == part])
        rows += own[np.argsort(np.linalg.norm(made.points[own] - TIED, axis=1))[:4]].tolist()
    body = RigidBody(next_id(made), int(at[0]), tuple(rows), ((1, 2, 3, 4, 5, 6),) * len(rows))
    return replace(made, rigid=(*made.rigid, body))


def bushed_plates(times: int = 1) -> Assembly:
    """Two plates of 300 x 200 x 1.2 mm, 4 mm apart on six bushes.

    Parameters
    ----------
    times : number by which 8 x 6 elements of each plate are divided in both directions
    """
    u, v = np.linspace(0, 0.3, 8 * times + 1), np.linspace(0, 0.2, 6 * times + 1)
    pieces = [rectangle(name, (0, 0, z), u, v) for name, z in (("lower", 0.0), ("upper", 4e-3))]
    made = of_pieces(pieces, dict.fromkeys(("lower", "upper"), (1.2e-3, STEEL)))
    places = [(x, y) for x in (0.0, 0.15, 0.3) for y in (0.0, 0.2)]
    nodes = [
        [np.linalg.norm(made.points - (x, y, z), axis=1).argmin() for z in (0.0, 4e-3)]
        for x, y in places
    ]
    frame = np.tile(np.eye(3)[[2, 0, 1]], (len(nodes), 1, 1))
    bushes = appended(
        made.bushes, ids=1000000 + np.arange(len(nodes)), nodes=np.array(nodes), frame=frame,
        place=made.points[np.array(nodes)].mean(axis=1),
        stiffness=np.tile([1e7, 1e6, 1e6, 1e2, 1e2, 1e2], (len(nodes), 1)),
    )  # fmt: skip
    return replace(made, bushes=bushes)
