"""Where the dofs of a recording are on a deck: by the grid's number, by place, by the nearest."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..case.node_numbers import (
    OFF,
    number_channels,
    numbers_agree,
    off_its_grid,
    on_structure,
    scaled,
    size_of,
)
from ..case.sensor_places import ROLES, recorded_labels
from ..ema.setup import Recording, Role, Sensor
from ..errors import named
from ..geometry.nearest import ShellSurface
from ..io.tables.sensor_table import direction
from ..model.assembly import Assembly

SAME_PLACE = 0.002  # of the structure's size: a place this near to a grid is that grid
MatchedBy = Literal["grid", "place", "nearest", "base", "table", "missing"]


@dataclass(frozen=True, eq=False)
class MatchedDof:
    """One output or input, and how it was found."""

    label: str
    role: Role
    # "grid" (its number is a grid of the deck), "place" (a grid is at its place in the recording),
    # "nearest" (on the nearest shell or grid), "base", "table" (a row of the given table), or
    # "missing"
    matched_by: MatchedBy
    # grid, place: one of them, [m]; neither where it is missing or the base
    grid: int | None = None
    place: np.ndarray | None = None
    # between the recording's place and the deck's [m], nan where one is unknown
    distance: float = np.nan
    axis: np.ndarray | None = None  # (3,) unit vector, basic frame; None: the surface's normal
    mass: float = 0.0  # of the sensor, where a table says so [kg]


@dataclass(frozen=True, eq=False)
class NodesOnDeck:
    """Nodes of a recording on a deck."""

    row: np.ndarray  # (n,) int; of the grid, -1 where none is at the node
    place: np.ndarray  # (n, 3) of the recording [m], nan where it has none
    unit: str  # in which the places fit the deck
    by_place: int  # number of nodes that were found at a grid of another number


def matched(
    made: Assembly, recording: Recording | None, table: Sequence[Sensor] = ()
) -> tuple[list[MatchedDof], list[str]]:
    """Every dof of a recording's FRFs or shapes on the deck, and sentences on what was assumed.

    Without them (of a test that is still to come) those of the table.

    Parameters
    ----------
    made : the deck in SI
    table : rows of a table of sensors (of ``chladni plan``, say), which go before all else
    """
    if recording is None or (recording.frf is None and recording.modal is None):
        return [_of_table(s) for s in table], []
    size = size_of(made)
    unit, nodes = scaled(made, recording.nodes)
    notes = []
    if unit != "m":
        notes.append(
            f"the places of {recording.name} were read in {unit}, because they fit the deck in "
            "this unit; the file states another unit or none"
        )
    own = {(s.label, s.role): s for s in table}
    by_number = numbers_agree(made, nodes)
    if nodes and not by_number and set(nodes) & set(made.ids.tolist()):
        notes.append(
            f"nodes of {recording.name} have the numbers of grids at other places: places are "
            "used, numbers are not"
        )
    outputs, inputs = (recorded_labels(recording, role) for role in ROLES)
    sides: tuple[tuple[Role, Sequence[str]], ...] = (("output", outputs), ("input", inputs))
    rest = [label for role, labels in sides for label in labels if (label, role) not in own]
    counted = number_channels(outputs, inputs, made.ids.tolist())
    channels = bool(rest) and counted and not on_structure(made, nodes)
    if channels:
        notes.append(
            f"labels {named(rest, 3)} of {recording.name} are taken as channel numbers: no "
            "coordinates show that they are grids"
        )
    found = [
        _of_table(own[label, role])
        if (label, role) in own
        else MatchedDof(label, role, "missing", axis=direction(label, label))
        if channels and not label.startswith("base")
        else _one(made, recording, nodes, by_number, size, label, role)
        for role, labels in sides
        for label in labels
    ]
    unproved = dict.fromkeys(
        d.label for d in found if d.matched_by == "grid" and np.isnan(d.distance)
    )
    if unproved:
        notes.append(
            f"labels {named(unproved, 3)} of {recording.name} are taken as grid numbers of the "
            "deck: the recording has no coordinates that confirm it; if they number channels, "
            "give their places in sensors.csv"
        )
    matched_labels = {(d.label, d.role) for d in found}
    idle = [s.label for s in table if (s.label, s.role) not in matched_labels]
    if idle:
        notes.append(f"rows of the given table that are not in {recording.name}: {named(idle)}")
    return found, notes


def matched_nodes(made: Assembly, recording: Recording, ids: np.ndarray) -> NodesOnDeck:
    """Nodes of a recording on the deck as its dofs are: by number, by place, else at their place.

    Numbers count where no place contradicts them.

    Parameters
    ----------
    ids : (n,) int, of the nodes
    """
    size, (unit, nodes) = size_of(made), scaled(made, recording.nodes)
    by_number = numbers_agree(made, nodes)
    place = np.array([nodes.get(n, _NOWHERE) for n in ids.tolist()]).reshape(-1, 3)
    placed = np.isfinite(place).all(axis=1)
    at = np.minimum(np.searchsorted(made.ids, ids), len(made.ids) - 1)
    away = np.linalg.norm(made.points[at] - place, axis=1)
    row = np.where((made.ids[at] == ids) & by_number & ~(away > OFF * size), at, -1)
    rest = np.flatnonzero((row < 0) & placed)
    if len(rest):
        from scipy.spatial import cKDTree

        away, near = cKDTree(made.points).query(place[rest])
        row[rest] = np.where(away <= SAME_PLACE * size, near, -1)
    return NodesOnDeck(row, place, unit, int((row[rest] >= 0).sum()))


_NOWHERE = np.full(3, np.nan)


def _of_table(s: Sensor) -> MatchedDof:
    return MatchedDof(s.label, s.role, "table", s.grid, s.place, np.nan, s.direction, s.mass)


def _one(
    made: Assembly, recording: Recording, nodes: dict[int, np.ndarray], by_number: bool,
    size: float, label: str, role: Role,
) -> MatchedDof:  # fmt: skip
    """One label: its number, its place, the nearest; else missing."""
    node = label.partition(":")[0].strip()
    axis = direction(label, label)
    if node == "base":
        return MatchedDof(label, role, "base", axis=axis)
    id = int(node) if node.isdecimal() and node.isascii() else 0
    row = int(np.searchsorted(made.ids, id))
    is_grid = row < len(made.ids) and made.ids[row] == id
    if axis is not None and id in recording.axes:
        axis = axis @ recording.axes[id]
    elif axis is not None and is_grid and by_number and made.axes is not None:
        axis = axis @ made.axes[row]
    if id not in nodes and nodes and not by_number:  # its number proves nothing here
        return MatchedDof(label, role, "missing", axis=axis)
    if is_grid and by_number and not off_its_grid(made, id, nodes):
        away = float(np.linalg.norm(made.points[row] - nodes[id])) if id in nodes else np.nan
        return MatchedDof(label, role, "grid", id, distance=away, axis=axis)
    if id not in nodes:
        return MatchedDof(label, role, "missing", axis=axis)
    return _by_place(made, nodes[id], size, label, role, axis)


def _by_place(
    made: Assembly, place: np.ndarray, size: float, label: str, role: Role, axis: np.ndarray | None
) -> MatchedDof:
    away = np.linalg.norm(made.points - place, axis=1)
    near = int(away.argmin())
    surface = ShellSurface.whole(made)
    if away[near] <= SAME_PLACE * size or not len(surface.nodes):
        matched_by: MatchedBy = "place" if away[near] <= SAME_PLACE * size else "nearest"
        grid = int(made.ids[near])
        return MatchedDof(label, role, matched_by, grid, distance=float(away[near]), axis=axis)
    off = float(surface.closest_points(place).distance[0])
    return MatchedDof(label, role, "nearest", None, place, off, axis)
