"""The table of sensors and exciters: where each sits, which way it points, what it weighs (SI)."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ...dofs import COMPONENTS
from ...ema.setup import Role, Sensor
from ...errors import FileError, named
from .csv_table import CsvTable, csv_text, read_table

_OPTIONAL = (
    *("grid", "x", "y", "z", "direction", "nx", "ny", "nz"),
    *("role", "mass", "position_sd", "gain", "use"),
)


BASE = "base"  # in place of a grid: the motion of all supports


def read_sensors(path: str | Path) -> tuple[Sensor, ...]:
    """Sensors and exciters from CSV; the grammar is that of DESIGN §7.

    A row without grid and place sits at the node of its label; one without direction points as
    its label says.
    """
    table = read_table(Path(path), ("label",), _OPTIONAL)
    sensors = tuple(_sensor(table, k) for k in range(len(table.line)))
    seen: dict[tuple[str, str], int] = {}
    for k, sensor in enumerate(sensors):
        if (key := (sensor.label, sensor.role)) in seen:
            raise FileError(
                f"{table.path.name}, line {table.line[k]}: {sensor.role} {sensor.label} is "
                f"already in line {seen[key]}"
            )
        seen[key] = table.line[k]
    return sensors


def read_layout(path: Path, driven: Sequence[Sensor] = ()) -> tuple[Sensor, ...]:
    """Sensors and exciters of a table, or of ``plan.json``: its sensors and its shakers.

    ``driven`` takes the place of the exciters.
    """
    found = _planned(path) if path.suffix.lower() == ".json" else read_sensors(path)
    if driven:
        found = (*(s for s in found if s.role == "output"), *driven)
    for role in get_args(Role):
        if not any(s.role == role for s in found):
            raise FileError(f"{path} names no {role}; a layout needs outputs and inputs")
    return found


def exciter(label: str, where: str) -> Sensor:
    """What drives, by its label alone: 12:+Z, 12:n or base:+Z.

    Raises
    ------
    FileError
        If the label is of another form.
    """
    node = _node(label, where)
    axis_word = direction(label, where)
    return Sensor(label, None if np.isnan(node) else int(node), None, axis_word, "input")


def with_input(path: Path, label: str) -> str:
    """The text of a table of sensors that names nothing that drives, and a row that does."""
    if named_already := [s.label for s in read_sensors(path) if s.role == "input"]:
        raise FileError(
            f"{path} already names inputs ({', '.join(named_already)}); remove them, or leave out "
            f"--input {label}"
        )
    held = read_table(path, ("label",), _OPTIONAL).columns
    columns = list(dict.fromkeys([*held, "role"]))
    rows = [dict(zip(held, row, strict=True)) for row in zip(*held.values(), strict=True)]
    rows.append({"label": label, "role": "input"})
    return csv_text([columns, *([row.get(name, "") for name in columns] for row in rows)])


def _planned(path: Path) -> tuple[Sensor, ...]:
    try:
        plan = json.loads(path.read_text(encoding="utf-8"))
        shakers = plan["actuators_together"] or plan["actuators"][:1]
        outputs = [_of_plan(at, "output") for at in plan["sensors"]]
        return (*outputs, *(_of_plan(at, "input") for at in shakers))
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise FileError(f"{path} is not a plan.json of chladni plan ({error})") from error


def _of_plan(at: dict[str, Any], role: Role) -> Sensor:
    """A place of a plan; where it is no grid its point counts."""
    label, grid, mass = str(at["label"]), at["grid"], float(at.get("mass_kg", 0.0))
    axis_word = direction(np.array(at["direction"], dtype=float).reshape(3), label)
    if grid is not None:
        return Sensor(label, int(grid), None, axis_word, role, mass)
    return Sensor(
        label, None, np.array(at["point_m"], dtype=float).reshape(3), axis_word, role, mass
    )


def _sensor(table: CsvTable, k: int) -> Sensor:
    where = f"{table.path.name}, line {table.line[k]}"
    cell = {name: column[k] for name, column in table.columns.items()}
    number = lambda name, empty: table.number(name, k, empty) if name in table else empty  # noqa: E731
    label = cell["label"]
    role = cell.get("role", "").lower() or "output"
    if role not in get_args(Role):
        raise FileError(f"{where}: role {role!r}; there are output and input")
    xyz = np.array([number(c, np.nan) for c in "xyz"])
    normal = np.array([number(c, np.nan) for c in ("nx", "ny", "nz")])
    moved = cell.get("grid", "") == BASE
    grid = np.nan if moved else number("grid", np.nan)
    if np.isnan(xyz).any() and not np.isnan(xyz).all():
        raise FileError(f"{where}: a place needs x, y and z")
    if np.isfinite(grid) and np.isfinite(xyz).all():
        raise FileError(f"{where}: both a grid and a place x, y, z; give only one of them")
    mass, sd = number("mass", 0.0), number("position_sd", 0.0)
    if mass < 0 or sd < 0:
        raise FileError(f"{where}: mass {mass:g} kg and position_sd {sd:g} m cannot be negative")
    gain = number("gain", 1.0)
    if gain == 0:
        raise FileError(
            f"{where}: a gain of 0 is not possible; to exclude a channel write use = no"
        )
    use = cell.get("use", "").lower() or "yes"
    if use not in ("yes", "no") or (use == "no" and role == "input"):
        raise FileError(f"{where}: use {use!r} of an {role}; only outputs have use: yes or no")
    given = normal if np.isfinite(normal).any() else cell.get("direction", "")
    place = xyz if np.isfinite(xyz).all() else None
    if moved and (place is not None or mass > 0):
        raise FileError(
            f"{where}: the base is all supports together and has neither place nor mass"
        )
    if np.isnan(grid) and place is None and not moved:
        grid = _node(label, where)
    if np.isfinite(grid) and grid != int(grid):
        raise FileError(f"{where}: grid {grid:g} is not a whole number")
    return Sensor(
        label=label,
        grid=int(grid) if np.isfinite(grid) else None,
        place=place,
        direction=direction(given if isinstance(given, np.ndarray) else given or label, where),
        role=role,  # type: ignore[arg-type]
        mass=mass,
        position_sd=sd,
        gain=gain,
        use=use == "yes",
        source=where,
    )


def _node(label: str, where: str) -> float:
    node = label.partition(":")[0]
    if node == BASE:
        return np.nan
    if not (node.isdecimal() and node.isascii()):
        raise FileError(f"{where}: {label!r} names no node; give a grid or x, y, z")
    return float(node)


def direction(text: str | np.ndarray, where: str) -> np.ndarray | None:
    """Unit vector of '+Z', '-X', '412:+Z' or of three numbers; None for 'n', the normal.

    >>> direction("3:-X", "here")
    array([-1.,  0.,  0.])
    """
    if isinstance(text, np.ndarray):
        length = float(np.linalg.norm(text))
        if not np.isfinite(length) or length == 0:
            raise FileError(f"{where}: nx, ny, nz = {named(text.tolist())} is not a direction")
        return text / length
    axis_word = text.rpartition(":")[2].strip().upper()
    if axis_word == "N":
        return None
    sign = -1.0 if axis_word.startswith("-") else 1.0
    axis = axis_word.lstrip("+-")
    if axis not in COMPONENTS[:3]:
        raise FileError(f"{where}: direction {text!r}; write +X, -X, +Y, -Y, +Z, -Z or n")
    return sign * np.eye(3)[COMPONENTS.index(axis)]
