"""Where the dofs of recordings are on the structure: grids, places on shells, the base."""

from collections.abc import Sequence

import numpy as np

from ..ema.setup import Role, Sensor, TestSetup
from ..errors import LabelError
from ..fem.measured_dofs import MeasuredDofs
from ..geometry.grid_normals import grid_normals
from ..geometry.nearest import ShellSurface
from ..io.tables.sensor_table import direction
from ..model.assembly import Assembly
from .toml_sections import TomlSection

_FAR = 0.1  # of the structure's size: a place farther from it is a mistake of units


def places(
    test: TomlSection, setup: TestSetup, made: Assembly, labels: Sequence[str], role: Role
) -> MeasuredDofs:
    """Every label of the recording on the structure."""
    known = {s.label: s for s in (setup.outputs if role == "output" else setup.inputs)}
    rows = [_place(test, known.get(label), label, made) for label in labels]
    return MeasuredDofs(
        labels=tuple(labels),
        grids=np.array([r[0] for r in rows], dtype=np.int64),
        points=np.array([r[1] for r in rows]).reshape(-1, 3),
        directions=np.array([r[2] for r in rows]).reshape(-1, 3),
        sd=np.array([r[3].position_sd for r in rows]),
        mass=np.array([r[3].mass for r in rows]),
    )


def _spoken(label: str, test: TomlSection) -> Sensor:
    """What a label says by itself: node and direction."""
    where = test.at("recordings")
    node = label.partition(":")[0].strip()
    if node != "base" and not node.isdigit():
        raise LabelError(f"{where}: {label!r} names no grid; give its place in sensors.csv")
    grid = None if node == "base" else int(node)
    return Sensor(label, grid, direction=direction(label, f"{where}: label {label!r}"))


def _place(
    test: TomlSection, given: Sensor | None, label: str, made: Assembly
) -> tuple[int, np.ndarray, np.ndarray, Sensor]:
    """(grid or 0, place, direction, sensor) of one dof; None given: what the label says.

    A label's own +X, +Y, +Z are the axes the deck counts that grid's displacements in; those of
    the table of sensors are the basic ones.
    """
    where = f"{test.at('recordings')}: label {label!r}"
    sensor = given or _spoken(label, test)
    if sensor.grid is None and sensor.place is None:
        return 0, np.full(3, np.nan), _base(made, sensor, where), sensor
    if sensor.grid is None:
        return _free(made, sensor, where)
    row = grid_row(made, sensor.grid, where)
    way = _normal(made, row, where) if sensor.direction is None else sensor.direction
    if given is None and sensor.direction is not None and made.axes is not None:
        way = way @ made.axes[row]
    return sensor.grid, made.points[row], way, sensor


def _base(made: Assembly, sensor: Sensor, where: str) -> np.ndarray:
    if len(made.supports) == 0:
        raise LabelError(f"{where}: the base moves, but the deck holds no grid by SPC")
    if sensor.direction is None:
        raise LabelError(f"{where}: the base has no normal; write base:+X, base:+Y or base:+Z")
    return sensor.direction


def _free(made: Assembly, sensor: Sensor, where: str) -> tuple[int, np.ndarray, np.ndarray, Sensor]:
    """A place on the nearest shell, or where there are no shells at the nearest grid."""
    place = np.asarray(sensor.place)
    size = float(np.linalg.norm(np.ptp(made.points, axis=0)))
    if len(made.shells) == 0:
        row = int(np.linalg.norm(made.points - place, axis=1).argmin())
        away, normal, grid = (
            float(np.linalg.norm(made.points[row] - place)),
            None,
            int(made.ids[row]),
        )
    else:
        found = ShellSurface.whole(made).feet(place)
        away, normal, grid = float(found.distance[0]), found.normal[0], 0
    if away > _FAR * size:
        raise LabelError(
            f"{where}: its place {place.tolist()} m is {away:.3g} m away from the structure, which "
            f"is {size:.3g} m across; places are in metres, basic frame"
        )
    way = sensor.direction if sensor.direction is not None else normal
    if way is None:
        raise LabelError(f"{where}: no shell there, hence no normal; give +X, +Y, +Z or nx, ny, nz")
    return grid, place if grid == 0 else made.points[row], way, sensor


def _normal(made: Assembly, row: int, where: str) -> np.ndarray:
    """Unit normal of the surface at a grid (3,)."""
    normal = grid_normals(made, np.array([row]))[0]
    if not normal.any():
        raise LabelError(f"{where}: the grid is on no shell, so it has no normal; give +X, +Y, +Z")
    return normal


def grid_row(made: Assembly, grid: int, where: str) -> int:
    """Row of a grid; the sentence names the nearest ids."""
    row = int(np.searchsorted(made.ids, grid))
    if row < len(made.ids) and made.ids[row] == grid:
        return row
    near = made.ids[np.argsort(np.abs(made.ids - grid), kind="stable")[:3]].tolist()
    raise LabelError(
        f"{where}: the deck has no grid {grid}, the nearest ids are {near}; "
        "a place that is no grid goes into sensors.csv"
    )
