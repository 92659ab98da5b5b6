"""Where the dofs of recordings are on the structure: grids, places on shells, the base."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..ema.setup import Recording, Role, Sensor, TestSetup
from ..errors import LabelError, named
from ..fem.locate import shares_of
from ..fem.measured_dofs import MeasuredDofs
from ..geometry.grid_normals import grid_normals
from ..geometry.nearest import ShellSurface
from ..io.tables.sensor_table import direction
from ..model.assembly import Assembly
from ..units import UNITS
from .label_directions import ways_said
from .node_numbers import (
    ENOUGH,
    NO_NODE,
    OFF,
    number_channels,
    numbers_agree,
    on_structure,
    scaled,
    size_of,
)

ROLES: tuple[Role, ...] = ("output", "input")
_FAR = 0.1  # of the structure's size: a place farther from it is a mistake of units


def places(
    where: str,
    setup: TestSetup,
    made: Assembly,
    recordings: Sequence[Recording],
    role: Role,
    notes: list[str],
) -> MeasuredDofs:
    """The dofs of the compared FRFs or shapes on the structure; of poles those of the table.

    The table of sensors says where a dof is, else the recording does.
    """
    table = {s.label: s for s in (setup.outputs if role == "output" else setup.inputs)}
    recorded = recordings[:1]
    frf = recorded[0].frf if recorded else None
    labels = recorded_labels(recorded[0] if recorded else None, role, tuple(table))
    unit, nodes = scaled(made, {n: x for r in recorded for n, x in r.nodes.items()})
    axes = {n: A for r in recorded for n, A in r.axes.items()}
    spoken = [label for label in labels if label not in table]
    seated = on_structure(made, nodes)
    elsewhere = seated and not numbers_agree(made, nodes)
    numbers = [label for label in spoken if not label.startswith("base:")]
    outputs, inputs = (numbers, ()) if frf is None else (frf.outputs, frf.inputs)
    least = 1 if setup.outputs or setup.inputs else ENOUGH
    counted = number_channels(outputs, inputs, made.ids.tolist(), least)
    if not seated and numbers and counted:
        raise LabelError(
            f"{where}: the labels {named(numbers, 3)} are taken as channel numbers, because no "
            "coordinates show that they are grids; give each its grid or place in sensors.csv"
        )
    known = {**table, **{n: _spoken(n, where, made, nodes, axes, elsewhere) for n in spoken}}
    notes += _nodes_said(made, spoken, nodes, axes, elsewhere, unit)
    notes += _off_said(made, role, [x for n in labels if (x := known[n].place) is not None])
    found = placed(made, [known[label] for label in labels], where)
    notes += ways_said(made, found, table)
    return found


def recorded_labels(
    recording: Recording | None, role: Role, table: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """Labels of one end of a recording: of its FRFs, else of its shapes, else of the table."""
    if recording is not None and recording.frf is not None:
        return recording.frf.outputs if role == "output" else recording.frf.inputs
    if recording is not None and recording.modal is not None and role == "output":
        return recording.modal.dofs
    return table


def placed(made: Assembly, sensors: Sequence[Sensor], where: str) -> MeasuredDofs:
    """Sensors (or exciters) on the structure.

    File and line of a sensor, else ``where``, begin the sentence of what is refused.
    """
    rows = [_place(f"{s.source or where}: label {s.label!r}", s, made) for s in sensors]
    return MeasuredDofs(
        labels=tuple(s.label for s in sensors),
        grids=np.array([r[0] for r in rows], dtype=np.int64),
        points=np.array([r[1] for r in rows]).reshape(-1, 3),
        directions=np.array([r[2] for r in rows]).reshape(-1, 3),
        sd=np.array([s.position_sd for s in sensors]),
        mass=np.array([s.mass for s in sensors]),
    )


def _spoken(
    label: str,
    where: str,
    made: Assembly,
    nodes: Mapping[int, np.ndarray],
    axes: Mapping[int, np.ndarray],
    elsewhere: bool,
) -> Sensor:
    """Place and direction of a dof in the basic frame, from its label and the recording's nodes.

    Its +X, +Y, +Z are the axes of the node in the recording, else the displacement axes of the grid
    in the deck. A node that is not a grid, or has the number of another grid (``elsewhere``), is at
    its place in the recording.
    """
    node = label.partition(":")[0].strip()
    if node != "base" and not (node.isdecimal() and node.isascii()):
        raise LabelError(f"{where}: {label!r} names no grid; give its place in sensors.csv")
    vector = direction(label, f"{where}: label {label!r}")
    if node == "base":
        return Sensor(label, None, direction=vector)
    if node == NO_NODE:
        raise LabelError(
            f"{where}: label {label!r} has node 0, so the recording does not say where it is; give "
            "its grid or place in sensors.csv"
        )
    id = int(node)
    at = np.flatnonzero((made.ids == id) & (not elsewhere or id not in nodes))
    if vector is not None and id in axes:
        vector = vector @ axes[id]
    elif vector is not None and len(at) and made.axes is not None:
        vector = vector @ made.axes[at[0]]
    if not len(at) and id in nodes:
        return Sensor(label, None, nodes[id], vector)
    return Sensor(label, id, direction=vector)


def _off_said(made: Assembly, role: Role, given: list[np.ndarray]) -> list[str]:
    """A sentence where places were moved to get onto the structure."""
    if not given:
        return []
    surface = ShellSurface.whole(made)
    if len(surface.nodes):
        off = float(surface.closest_points(np.array(given)).distance.max())
    else:
        off = max(float(np.linalg.norm(made.points - x, axis=1).min()) for x in given)
    if off <= 1e-6 * float(np.linalg.norm(np.ptp(made.points, axis=0))):
        return []
    what = "nearest points of its surface" if len(surface.nodes) else "nearest grids"
    return [f"places of {role}s are up to {1e3 * off:.3g} mm from the mesh: the {what} are used"]


def _nodes_said(
    made: Assembly,
    spoken: Sequence[str],
    nodes: Mapping[int, np.ndarray],
    axes: Mapping[int, np.ndarray],
    elsewhere: bool,
    unit: str,
) -> list[str]:
    """How the geometry of a recording was read.

    Parameters
    ----------
    elsewhere : the numbers are those of other grids
    unit : of the coordinates
    """
    said = [label.partition(":")[0] for label in spoken]
    ids = list(dict.fromkeys(int(n) for n in said if n.isdecimal()))
    row = {int(id): k for k, id in enumerate(made.ids)}
    out = []
    if free := [n for n in ids if n not in row and n in nodes]:
        out.append(
            f"nodes {named(free)} of the recording are not grids of the deck: they are at the "
            "places of the recording, read in the deck's basic frame"
        )
    if turned := [n for n in ids if n in axes]:
        out.append(f"directions at nodes {named(turned)} are along the recording's local axes")
    both = [n for n in ids if n in row and n in nodes]
    if both and unit != "m":
        out.append(f"coordinates of the recording were read in {unit}, which fits the deck")
    away = {n: float(np.linalg.norm(made.points[row[n]] - nodes[n])) for n in both}
    if away and max(away.values()) > OFF * size_of(made):
        worst = max(away, key=lambda n: away[n])
        off = sum(d > OFF * size_of(made) for d in away.values())
        out.append(
            f"node {worst} of the recording is {away[worst]:.3g} m away from grid {worst} of the "
            f"deck ({off} of {len(away)} differ): the {'places' if elsewhere else 'grids'} were "
            "used; rows of sensors.csv can change this"
        )
    return out


def unrecorded(setup: TestSetup, outputs: MeasuredDofs, inputs: MeasuredDofs) -> list[str]:
    """A sentence on rows of the table of sensors that no recording has."""
    rows = unrecorded_rows(setup.outputs, outputs) + unrecorded_rows(setup.inputs, inputs)
    if not rows:
        return []
    n = len(rows)
    what = f"{n} {'row' if n == 1 else 'rows'} of the table of sensors"
    return [f"{what} {'is' if n == 1 else 'are'} in no recording: {', '.join(rows[:6])}"]


def unrecorded_rows(table: Sequence[Sensor], found: MeasuredDofs) -> list[str]:
    """Labels of the rows in use that no recording has."""
    return [s.label for s in table if s.use and s.label not in found.labels]


def sensor_masses(made: Assembly, *places: MeasuredDofs) -> tuple[tuple[int, float], ...]:
    """(grid, kg) of the devices of known mass; rows of one place and role are one device.

    On a shell the mass hangs on the corners by their weights.
    """
    out: dict[int, float] = {}
    for at in places:
        heavy = np.flatnonzero((at.mass > 0) & ~at.base)
        heavy = heavy[np.argsort(-at.mass[heavy], kind="stable")]
        one = heavy[np.unique(at.device[heavy], return_index=True)[1]]
        for k, shares in zip(one, shares_of(made, at.grids[one], at.points[one]), strict=True):
            for grid, share in shares:
                out[grid] = out.get(grid, 0.0) + share * float(at.mass[k])
    return tuple(sorted(out.items()))


def weight_of_sensors(
    made: Assembly, outputs: MeasuredDofs, inputs: MeasuredDofs, table: str
) -> str:
    """State the mass of the sensors and of the devices at the drive points, in words."""
    grams = [1e3 * sum(m for _, m in sensor_masses(made, at)) for at in (outputs, inputs)]
    named = ("sensors of {:.3g} g in all", "{:.3g} g at the drive point")
    said = [text.format(g) for text, g in zip(named, grams, strict=True) if g]
    return f"The model carries {' and '.join(said)} ({table})"


def _place(where: str, sensor: Sensor, made: Assembly) -> tuple[int, np.ndarray, np.ndarray]:
    """(grid or 0, place, direction) of one dof."""
    if sensor.grid is None and sensor.place is None:
        return 0, np.full(3, np.nan), _base(made, sensor, where)
    if sensor.grid is None:
        return _free(made, sensor, where)
    row = grid_row(made, sensor.grid, where)
    vector = _normal(made, row, where) if sensor.direction is None else sensor.direction
    return sensor.grid, made.points[row], vector


def _base(made: Assembly, sensor: Sensor, where: str) -> np.ndarray:
    if len(made.supports) == 0:
        raise LabelError(f"{where}: the base moves, but the deck has no grid with SPC")
    if sensor.direction is None:
        raise LabelError(f"{where}: the base has no normal; write base:+X, base:+Y or base:+Z")
    return sensor.direction


def _free(made: Assembly, sensor: Sensor, where: str) -> tuple[int, np.ndarray, np.ndarray]:
    """A place on the nearest shell or face of a solid; of beams alone, at the nearest grid."""
    place, surface = np.asarray(sensor.place), ShellSurface.whole(made)
    size = float(np.linalg.norm(np.ptp(made.points, axis=0)))
    if not len(surface.nodes):
        row = int(np.linalg.norm(made.points - place, axis=1).argmin())
        away, normal = float(np.linalg.norm(made.points[row] - place)), None
        grid = int(made.ids[row])
    else:
        found = surface.closest_points(place)
        away, normal, grid = float(found.distance[0]), found.normal[0], 0
    if away > _FAR * size:
        raise LabelError(
            f"{where}: its place ({named(place.tolist())}) m is {away:.3g} m from the structure, "
            f"which is {size:.3g} m across; places are in metres, basic frame"
            f"{_of_other_units(made, place, _FAR * size)}"
        )
    vector = sensor.direction if sensor.direction is not None else normal
    if vector is None:
        raise LabelError(
            f"{where}: it is on no shell or solid and has no normal; give +X, +Y, +Z or nx, ny, nz"
        )
    return grid, place if grid == 0 else made.points[row], vector


def _of_other_units(made: Assembly, place: np.ndarray, reach: float) -> str:
    """Advice where a place would lie within the structure in another unit of length; else ""."""
    lengths = {u.length for u in UNITS.values()}
    ends = np.array([made.points.min(axis=0) - reach, made.points.max(axis=0) + reach])
    for ratio in sorted({a / b for a in lengths for b in lengths if a != b}):
        low, high = ratio * ends
        if (low <= place).all() and (place <= high).all():
            return (
                "; it would lie within it in another unit of length, so check the unit of the "
                "place and [model] units"
            )
    return ""


def _normal(made: Assembly, row: int, where: str) -> np.ndarray:
    """Unit normal of the surface at a grid (3,)."""
    normal = grid_normals(made, np.array([row]))[0]
    if not normal.any():
        raise LabelError(f"{where}: the grid is on no shell, so it has no normal; give +X, +Y, +Z")
    return normal


def grid_row(made: Assembly, grid: int, where: str) -> int:
    """Row of a grid; the sentence names the nearest ids."""
    grid = min(grid, 2**62)  # what a deck may number, and far beyond
    row = int(np.searchsorted(made.ids, grid))
    if row < len(made.ids) and made.ids[row] == grid:
        return row
    near = made.ids[np.argsort(np.abs(made.ids - grid), kind="stable")[:3]].tolist()
    raise LabelError(
        f"{where}: the deck has no grid {grid}, the nearest ids are {named(near)}; write other "
        "places into sensors.csv"
    )
