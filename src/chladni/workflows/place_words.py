"""Words for places on a mesh, as masks: where sensors may sit, must sit, what each place costs.

A word is a part (its name or id), a label as ``412:+Z`` or ``412:n``, or a box. ``box x y z x y z``
has two opposite corners [m]. A CSV file with a column ``label`` or ``part`` holds several words. A
cost is a word with ``=`` and a number behind it, or a CSV file that has a column ``cost`` too.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import real_number
from ..case import Case
from ..case.sensor_places import placed
from ..ema.setup import Sensor
from ..errors import LabelError
from ..fem.measured_dofs import MeasuredDofs
from ..io.tables.csv_table import read_table
from ..io.tables.sensor_table import direction, read_sensors
from ..model.assembly import Assembly
from ..search.next_measurement import FurtherPlaces
from ..view.surface import Surface, surface

FILES = (".csv",)
PLACES = ("regions", "fixed", "forbidden", "cost")  # keys of [plan]
ONE_WAY = 0.99  # cosine of two directions that one sensor measures
SAME_PLACE = 1e-3  # [m]


@dataclass(frozen=True, eq=False)
class PlaceRules:
    """Places on a mesh; the masks are over all its points, then all faces of its surface."""

    allowed: np.ndarray  # (n + m,) bool, where sensors and shakers may sit
    named: np.ndarray  # (n + m,) bool, allowed by its label: it need not be flat or off edges
    cost: np.ndarray  # (n + m,) of a sensor there, relative to other places
    fixed: MeasuredDofs  # sensors of every layout, wherever they are


def stated_places(case: Case) -> dict[str, list[str]]:
    """The words on places that [plan] of a case states, with the paths of its files."""
    asked = case.asked
    words: Mapping[str, Any] = asked.said.words
    at = asked.said.places

    def resolved(name: str, text: str) -> str:
        return str(asked.file(text, at[name])) if text.lower().endswith(FILES) else text

    return {name: [resolved(name, text) for text in words[name]]
            for name in PLACES if name in words}  # fmt: skip


def further_places(case: Case) -> FurtherPlaces | None:
    """Where [plan] of a case lets further sensors be, without those that measured already."""
    if not (stated := stated_places(case)):
        return None
    made = case.assembly
    try:
        rules = place_rules(made, surface(made), **stated)
    except LabelError as error:
        raise LabelError(f"{case.path}, [plan]: {error}") from None
    return allowed_places(made, rules, case.outputs)


def allowed_places(
    assembly: Assembly, rules: PlaceRules, measured: MeasuredDofs | None = None
) -> FurtherPlaces:
    """The grids that rules allow, and their fixed sensors that have not measured."""
    n = len(assembly.points)
    free, held = rules.allowed[:n], rules.fixed
    new = np.ones(len(held.labels), bool)
    if measured is not None and len(measured.labels):
        here = np.linalg.norm(held.points[:, None] - measured.points, axis=2) <= SAME_PLACE
        along = np.abs(held.directions @ measured.directions.T) >= ONE_WAY
        new = ~(here & along).any(axis=1)
    return FurtherPlaces(assembly.ids[free], rules.cost[:n][free], held.only(new))


def labels_not_allowed(
    assembly: Assembly, rules: PlaceRules, labels: Iterable[str]
) -> tuple[str, ...]:
    """Labels of grids and of centres of shells at which nothing may be; others are left out."""
    ids = np.concatenate([assembly.ids, centre_ids(assembly)])
    known = len(assembly.points), len(assembly.shells)
    allowed = np.concatenate([rules.allowed[: known[0]], rules.allowed[known[0] :][: known[1]]])
    barred = set(ids[~allowed].tolist())
    number = {label: label.partition(":")[0] for label in labels}
    return tuple(n for n, text in number.items() if text.isdecimal() and int(text) in barred)


@dataclass(frozen=True)
class _Word:
    """One word, or one row of a file of words."""

    where: str  # begins a sentence on it
    text: str
    kind: str  # part, box or label
    cost: float = 1.0


def centre_ids(assembly: Assembly) -> np.ndarray:
    """Numbers for the centres of all shells that no grid has: 47 -> 100047 with grid 12345."""
    longest = max(int(assembly.ids.max(initial=0)), int(assembly.shells.ids.max(initial=0)))
    return assembly.shells.ids + 10 ** len(str(longest))


def place_rules(
    assembly: Assembly,
    seen: Surface,
    regions: Sequence[str] = (),
    fixed: Sequence[str] = (),
    forbidden: Sequence[str] = (),
    cost: Sequence[str] | Mapping[str, float] = (),
) -> PlaceRules:
    """The rules that words state; a place of several costs has the last of them, others cost 1.

    Raises
    ------
    FileError, LabelError
        If a word names no place of the mesh, a cost is not positive, or no place is left.
    """
    count = len(seen.points) + len(seen.faces)
    banned, allowed, named = (np.zeros(count, bool) for _ in range(3))
    for word in _words("forbidden", forbidden):
        banned |= _mask(assembly, seen, word)
    for word in _words("regions", regions):
        here = _mask(assembly, seen, word)
        allowed |= here
        named |= here & (word.kind == "label")
    allowed = (allowed if regions else ~allowed) & ~banned
    if not allowed.any():
        raise LabelError("the regions and the forbidden places leave no place for a sensor")
    price = np.ones(count)
    for word in _costs(cost):
        price[_mask(assembly, seen, word)] = word.cost
    held = placed(assembly, list(_sensors(assembly, fixed)), "fixed")
    if held.base.any():
        raise LabelError("fixed: the base is no place for a sensor of the layout")
    grids = np.flatnonzero(held.grids > 0)
    for k, row in zip(grids, assembly.rows(held.grids[grids]), strict=True):
        if banned[row]:
            raise LabelError(f"the sensor {held.labels[k]} is fixed at a forbidden place")
    return PlaceRules(allowed, named & allowed, price, held)


def _words(what: str, given: Iterable[str], cost: float = 1.0) -> Iterator[_Word]:
    """Every word, and every row of the files among them."""
    for text in given:
        if text.lower().endswith(FILES):
            yield from _rows(Path(text), ())
        else:
            kind = "box" if text.split()[:1] == ["box"] else "label" if ":" in text else "part"
            yield _Word(f"{what} {text!r}", text, kind, cost)


def _rows(path: Path, due: Sequence[str]) -> Iterator[_Word]:
    """Rows of a file: a label, else a part, and the cost where it is ``due``."""
    table = read_table(path, due, None)
    kinds = [name for name in ("label", "part") if name in table]
    if not kinds:
        names = ", ".join(table.columns)
        raise LabelError(f"{path.name}, line 1: no column label or part; there are {names}")
    for k, line in enumerate(table.line):
        kind = next((name for name in kinds if table.columns[name][k]), kinds[0])
        where, cost = f"{path.name}, line {line}", table.number("cost", k, 1.0) if due else 1.0
        yield _priced(_Word(where, table.columns[kind][k], kind, cost))


def _costs(given: Sequence[str] | Mapping[str, float]) -> Iterator[_Word]:
    """Words with their costs."""
    each = [f"{k}={v}" for k, v in given.items()] if isinstance(given, Mapping) else given
    for text in each:
        if text.lower().endswith(FILES):
            yield from _rows(Path(text), ("cost",))
            continue
        name, _, number = text.rpartition("=")
        try:
            yield from map(_priced, _words("cost", [name.strip()], real_number(number)))
        except ValueError:
            raise LabelError(
                f"cost {text!r}: write PLACE=NUMBER, as inner=3, or a CSV file of costs"
            ) from None


def _priced(word: _Word) -> _Word:
    """A word, checked to have a cost by which information can be divided."""
    if not 0 < word.cost < np.inf:
        raise LabelError(f"{word.where}: the cost {word.cost:g} is not positive; forbid the place")
    return word


def _mask(assembly: Assembly, seen: Surface, word: _Word) -> np.ndarray:
    """Points and faces (n + m,) bool that a word names; a label names the faces around it too."""
    if word.kind == "box":
        return _box(seen, word)
    if word.kind == "part":
        return _part(assembly, seen, word)
    number = word.text.partition(":")[0]
    id = int(number) if number.isdecimal() and number.isascii() else -1
    point = assembly.ids == id
    face = np.zeros(len(seen.faces), bool)
    face[: len(assembly.shells)] = centre_ids(assembly) == id
    if not point.any() and not face.any():
        raise LabelError(f"{word.where}: {word.text!r} is no grid and no centre of a shell")
    return np.concatenate([point, face | point[seen.faces].any(axis=1)])


def _box(seen: Surface, word: _Word) -> np.ndarray:
    try:
        ends = np.array([real_number(x) for x in word.text.split()[1:]]).reshape(2, 3)
    except ValueError:
        raise LabelError(f"{word.where}: write box x y z x y z, two corners in metres") from None
    places = np.concatenate([seen.points, seen.points[seen.faces].mean(axis=1)])
    inside = (places >= ends.min(axis=0)) & (places <= ends.max(axis=0))
    if not (mask := inside.all(axis=1)).any():
        used = seen.points[seen.used]
        low, high = (", ".join(f"{x:.4g}" for x in end) for end in (used.min(0), used.max(0)))
        raise LabelError(
            f"{word.where} holds nothing of the structure, which reaches from ({low}) to ({high}) m"
        )
    return mask


def _part(assembly: Assembly, seen: Surface, word: _Word) -> np.ndarray:
    """Faces of a part and all their corners, and the ends of its beams."""
    try:
        k = assembly.part(word.text)
    except LabelError as error:
        raise LabelError(f"{word.where}: {error}; labels have a colon, as 412:n") from None
    face, point = np.asarray(seen.part) == k, np.zeros(len(seen.points), bool)
    point[seen.faces[face]] = True
    point[assembly.beams.nodes[assembly.beams.part == k]] = True
    return np.concatenate([point, face])


def _sensors(assembly: Assembly, given: Iterable[str]) -> Iterator[Sensor]:
    """Sensors by their labels, and those of tables of sensors."""
    for text in given:
        if text.lower().endswith(FILES):
            yield from (s for s in read_sensors(text) if s.role == "output")
            continue
        where = f"fixed {text!r}"
        number, _, along = text.partition(":")
        if not (number.isdecimal() and number.isascii()):
            raise LabelError(f"{where} is no label; write 412:+Z, 412:n or a table of sensors")
        vector, id = direction(along or "n", where), int(number)
        label = text if along else f"{text}:n"
        centre = np.flatnonzero(centre_ids(assembly) == id)
        if len(centre) and id not in assembly.ids:
            corners = np.unique(assembly.shells.nodes[centre[0]])
            yield Sensor(label, None, assembly.points[corners].mean(axis=0), vector)
        else:
            yield Sensor(label, id, direction=vector)
