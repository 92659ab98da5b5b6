"""Universal files in: datasets 58 and 58b, 15, 2411, 2412, 82, 55, 151, 164, 2420 (through pyuff).

pyuff does the parsing of fields; what the fields mean, units, signs, completeness and the
sentences about what is wrong are ours. Source of the format: SDRC universal file datasets.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import measurable
from ...dofs import label
from ...dynamics.frf import MOTION_OVER_FORCE
from ...ema.response_correlations import responses
from ...ema.setup import Function, Recording, Shapes
from ...ema.shape_setups import merged
from ...errors import ChladniError, FileError, ShapeError, named
from .estimate_stamp import read_stamp, with_variance
from .uff_accumulator import Channel, Pair, Shape, TimeSignal, UffAccumulator
from .uff_frf import frf_matrix
from .uff_function import FunctionSet, function_set
from .uff_source import readable
from .uff_time import time_record
from .uff_units import Meaning, check_calibrated, file_units, hertz, meaning
from .write_uff import write_uff as write_uff

_KINDS = {1: "time", 2: "auto spectrum", 3: "cross spectrum", 9: "psd", 12: "spectrum"}
_SPECTRA = (2, 3, 9, 12)
_SAME_PLACE = 1e-4  # of the largest coordinate: dataset 15 keeps six digits
Dataset = Mapping[Any, Any]  # a dictionary of pyuff
_REAL = {1: "time history", 6: "coherence", 26: "multiple coherence"}


def read_uff(path: str | Path, quantity: str | None = None) -> Recording:
    """Everything a universal file holds, in SI.

    Parameters
    ----------
    path : file
    quantity : of the FRFs (receptance, mobility, accelerance, transmissibility) where the file
        does not say it, or says it wrongly.
    """
    path = Path(path)
    uff, records = UffAccumulator(path), list[FunctionSet]()
    for number, d in sorted(_datasets(uff), key=lambda one: int(one[1]["type"]) != _UNITS):
        where = uff.where(number, int(d["type"]))
        try:
            if int(d["type"]) == _FUNCTION:
                records.append(function_set(d, number))
            else:
                _TAKE[int(d["type"])](uff, d, where)
        except ChladniError:
            raise
        except _BROKEN as error:
            raise FileError(
                f"{where} is damaged: its lines do not fit together "
                f"({type(error).__name__}: {error})"
            ) from error
    parts = _entities(records)
    for record in records:
        _take_function(uff, record, parts, uff.where(record.number, _FUNCTION), quantity)
    asked = MOTION_OVER_FORCE.get(quantity or "", quantity)
    frf, (averages, added) = frf_matrix(uff, asked), read_stamp(uff.title)
    time = time_record(uff) if frf is None else None
    alone = frf is None and time is None
    _name_unused(uff, alone)
    if frf is not None and averages:
        frf = with_variance(frf, averages)
        uff.notes.append(f"{path.name}: its noise is that of the stated {averages:g} averages")
    turned = {n: uff.systems[s] for n, s in uff.turned.items() if s in uff.systems}
    shapes = _shapes(uff)
    modal = alone and not responses(uff.functions) and shapes is not None and any(shapes.frequency)
    return Recording(
        name=path.name,
        frf=frf,
        poles=shapes.poles() if modal and shapes is not None else None,
        shapes=shapes,
        nodes=uff.nodes,
        axes={n: A for n, A in turned.items() if not np.allclose(A, np.eye(3), atol=1e-6)},
        elements=tuple(uff.elements),
        functions=tuple(uff.functions),
        time=time,
        added_damping=added,
        notes=tuple(uff.notes),
    )


_BROKEN = (ValueError, IndexError, KeyError, TypeError, OverflowError, ZeroDivisionError)


def _datasets(uff: UffAccumulator) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """(number from 1, dataset) of every dataset that is of use; others are noted, not read."""
    import pyuff

    path, idle = uff.path, set()
    with readable(path) as source:
        file = pyuff.UFF(str(source))
        for k, kind in enumerate(file.get_set_types()):
            if int(kind) not in (_FUNCTION, *_TAKE):
                idle |= {int(kind)} - _SILENT
                continue
            try:
                dataset: dict[str, Any] = file.read_sets(k)
            except Exception as error:  # pyuff raises nothing narrower
                where = uff.where(k + 1, int(kind))
                raise FileError(f"{where}: cannot be read ({_why(error)})") from error
            yield k + 1, dataset
    if idle:
        uff.notes.append(
            f"{path.name}: datasets {named([str(k) for k in sorted(idle)])} are not used"
        )


def _why(error: BaseException) -> str:
    """The deepest cause in words."""
    while error.__context__ is not None:
        error = error.__context__
    return str(error) or type(error).__name__


Entities = Mapping[tuple[int, int], set[str]]  # (end, node) -> names of entities


def _entities(records: Sequence[FunctionSet]) -> Entities:
    """Names of the entities that each node of either end occurs under: several are several nodes.

    A test system that writes node 0 for every point may name the points in their place.
    """
    found: dict[tuple[int, int], set[str]] = {}
    for record in records:
        for end, (node, _) in enumerate((record.response, record.reference)):
            found.setdefault((end, node), set()).update({record.names[end]} - {""})
    return found


def _dof(record: FunctionSet, end: int, parts: Entities) -> str:
    """Label of the response (end 0) or the reference; direction 0 (scalar) is read as the normal.

    The name of an entity stands before the node where the node is not unique without it, and in
    place of node 0.
    """
    (node, direction), name = (record.response, record.reference)[end], record.names[end]
    if abs(direction) > 6:
        raise FileError(f"direction {direction} of node {node} is not one of -6 to 6")
    dof = f"{node}:n" if direction == 0 else label(node, abs(direction), direction)
    if not name or len(parts[end, node]) < 2:
        return dof
    return f"{name}:{dof.partition(':')[2]}" if node == 0 else f"{name}:{dof}"


def _take_function(
    uff: UffAccumulator, record: FunctionSet, parts: Entities, where: str, quantity: str | None
) -> None:
    kind = record.function
    record = _complete(record, where)
    node = record.reference[0]
    if kind in _REAL and (np.iscomplexobj(record.y) or (kind == 1 and record.abscissa.kind == 18)):
        they_are = "a function of frequency" if kind == 1 else "complex"
        raise FileError(
            f"{where}: function type {kind} is a {_REAL[kind]}, but its values are {they_are}; a "
            "frequency response has function type 4"
        )
    try:
        output, input = (_dof(record, end, parts) for end in (0, 1))
    except FileError as error:
        raise FileError(f"{where}: {error}") from error
    if kind in (4, 5) or (kind == 0 and np.iscomplexobj(record.y) and node):
        _take_frf(uff, record, (output, input), where, quantity)
    elif kind in (6, 26):
        pair = output, input if kind == 6 else ""
        if pair in uff.coherence:
            raise FileError(f"{where}: the coherence of {output} / {input} occurs twice")
        uff.coherence[pair] = np.real(record.y)
    else:
        called = _KINDS.get(kind, f"function type {kind}")
        reference = input if node else ""
        try:
            x = hertz(record, where) if kind in _SPECTRA else record.x
        except FileError as error:  # nothing compares it: the rest of the file is of use
            uff.notes.append(f"left out: {error}")
            return
        found = Function(called, output, reference, x, record.y, record.ordinate.unit)
        uff.functions.append(found)
        if kind == 1:
            uff.time.append(TimeSignal(output, record.ordinate.kind, found))


def _name_unused(uff: UffAccumulator, alone: bool) -> None:
    """Note the records nothing is made of; ``alone``: the file holds neither FRFs nor a test."""
    used = {id(f) for f in responses(uff.functions)} if alone else set()
    left = [
        f"{f.output}{f' / {f.input}' if f.input else ''} ({f.kind})"
        for f in uff.functions
        if id(f) not in used
    ]
    left += [
        f"{i}{f' / {j}' if j else ''} (coherence)"
        for i, j in uff.coherence
        if not any(i == output and j in ("", input) for output, input in uff.frf)
    ]
    if left:
        uff.notes.append(
            f"{uff.path.name}: {len(left)} records are not FRFs and are not used: {named(left)}"
        )


def _complete(record: FunctionSet, where: str) -> FunctionSet:
    """The record with as many values as are due; every number there, every number finite."""
    x, y, due = record.x, record.y, record.due
    if due < 0:
        raise FileError(f"{where}: it states {due} values")
    if len(y) < due or len(x) < due:
        raise FileError(f"{where}: {len(y)} of {due} values are present; the file is truncated")
    if np.any(y[due:] != 0):  # some writers fill up their last line
        raise FileError(
            f"{where}: {len(y)} values are present, but it states {due}; a line is doubled, or "
            "the number is wrong"
        )
    x, y = x[:due], y[:due]
    if due == 0:
        raise FileError(f"{where}: the record is empty (0 values)")
    if len(bad := np.flatnonzero(~(measurable(y) & measurable(x)))):
        raise FileError(f"{where}: {len(bad)} values are not numbers, the first in line {bad[0]}")
    return replace(record, x=x, y=y)


def _take_frf(
    uff: UffAccumulator, record: FunctionSet, dofs: Pair, where: str, quantity: str | None
) -> None:
    if not np.iscomplexobj(record.y):
        raise FileError(f"{where}: a frequency response needs phase, but these values are real")
    force_above = False
    if quantity in MOTION_OVER_FORCE:
        quantity, force_above = MOTION_OVER_FORCE[quantity], True
    if dofs in uff.frf:
        raise FileError(
            f"{where}: repeats {dofs[0]} / {dofs[1]} of dataset {uff.frf[dofs].number}; put each "
            "run into its own file"
        )
    check_calibrated(record, where)
    try:
        said = meaning(record, uff.units, where)
    except FileError as error:
        if quantity is None:
            raise
        said = Meaning(quantity, uff.units.length / uff.units.force)
        why = str(error).partition(";")[0]
        if not any(why.partition(": ")[2] in note for note in uff.notes):
            uff.notes.append(f"{why}: read as {quantity} in the units of the file, as requested")
    if quantity is None and said.quantity is None:
        raise FileError(
            f"{where}: neither data type nor unit label states the measured quantity; state "
            "quantity = receptance, mobility, accelerance or transmissibility"
        )
    f, values, known = hertz(record, where), record.y * said.factor, said.quantity
    if known in MOTION_OVER_FORCE:
        known, force_above, dofs = MOTION_OVER_FORCE[known], True, dofs[::-1]
    if force_above:
        if not values.all():
            raise FileError(f"{where}: force over motion is zero, so it has no reciprocal")
        values = 1 / values
        note = f"{uff.path.name}: force over motion was turned into its reciprocal"
        uff.notes += [note] if note not in uff.notes else []
    uff.title = uff.title or record.title
    uff.frf[dofs] = Channel(record.number, f, values, known)


def _take_units(uff: UffAccumulator, d: Dataset, where: str) -> None:
    uff.units = file_units(int(d["units_code"]), d["length"], d["force"])


def _take_nodes(uff: UffAccumulator, d: Dataset, where: str) -> None:
    nodes, systems = ([int(n) for n in d[k]] for k in ("node_nums", "disp_cs"))
    xyz = np.column_stack([d["x"], d["y"], d["z"]]) * uff.units.length
    if not np.isfinite(xyz).all():
        raise FileError(f"{where}: a coordinate is not a number")
    apart = _SAME_PLACE * np.abs(xyz).max(initial=0.0)
    for node, place, system in zip(nodes, xyz, systems, strict=True):
        other = uff.nodes.get(node, place)
        if np.abs(other - place).max() > apart:
            raise FileError(
                f"{where}: node {node} occurs twice, at {_at(other)} and {_at(place)} m"
            )
        uff.nodes[node] = place
        uff.turned[node] = system


def _at(place: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in place) + ")"


def _take_elements(uff: UffAccumulator, d: Dataset, where: str) -> None:
    families = [elements for family, elements in d.items() if isinstance(family, int)]
    each = [e["nodes_nums"] for elements in families for e in elements]
    uff.elements += [tuple(int(n) for n in nodes) for nodes in each]


def _take_lines(uff: UffAccumulator, d: Dataset, where: str) -> None:
    """Trace lines; a zero lifts the pen."""
    line: list[int] = []
    for node in [*map(int, d["nodes"]), 0]:
        if node:
            line.append(node)
        elif line:
            uff.elements.append(tuple(line))
            line = []


def _take_systems(uff: UffAccumulator, d: Dataset, where: str) -> None:
    rows = zip(d["CS_sys_labels"], d["CS_types"], d["CS_matrices"], strict=True)
    for system, kind, axes in rows:
        if int(kind) == 0:
            uff.systems[int(system)] = np.asarray(axes)[:3]
        else:
            uff.notes.append(f"coordinate system {int(system)} is not Cartesian: read as global")


def _take_shape(uff: UffAccumulator, d: Dataset, where: str) -> None:
    """A normal mode (analysis type 2) or a complex one (3 and 7) as motion; others are no modes.

    Rotations are left out: no sensor measures them.
    """
    analysis = int(d["analysis_type"])
    if int(d["spec_data_type"]) not in _MOTION:
        return
    if analysis == 2:
        f = d.get("freq", 0.0)
        zeta = d.get("modal_damp_vis", 0.0) or d.get("modal_damp_his", 0.0) / 2
    elif analysis in (3, 7):
        pole = d.get("eig", 0j)
        f, zeta = abs(pole) / (2 * np.pi), -pole.real / max(abs(pole), 1e-300)
    else:
        return
    components = [d[f"r{k}"] for k in range(1, 4) if f"r{k}" in d]
    values = {
        label(int(node), k + 1): component[i]
        for i, node in enumerate(d["node_nums"])
        for k, component in enumerate(components)
    }
    uff.shapes.append(Shape(f, zeta, values))


_UNITS, _FUNCTION = 164, 58
_MOTION = (0, 1, 8, 11, 12)  # data types: unknown, general, displacement, velocity, acceleration
_TAKE = {
    15: _take_nodes,
    55: _take_shape,
    82: _take_lines,
    _UNITS: _take_units,
    2411: _take_nodes,
    2412: _take_elements,
    2420: _take_systems,
}
_SILENT = frozenset({151, 1858})  # header; channel settings that come with every function


def _shapes(uff: UffAccumulator) -> Shapes | None:
    """Mode shapes; of several set-ups, merged."""
    setups: dict[frozenset[str], list[Shape]] = {}
    for shape in uff.shapes:
        setups.setdefault(frozenset(shape.values), []).append(shape)
    if not setups:
        return None
    try:
        found = merged([_setup(shapes) for shapes in setups.values()])
    except ShapeError as error:
        raise FileError(f"{uff.path.name}: {error}") from error
    if len(setups) > 1:
        uff.notes.append(f"{uff.path.name}: the shapes of {len(setups)} set-ups are merged")
    return found


def _setup(shapes: Sequence[Shape]) -> Shapes:
    dofs = tuple(shapes[0].values)
    values = np.array([[shape.values[dof] for shape in shapes] for dof in dofs])
    f, zeta = np.array([(shape.frequency, shape.damping or np.nan) for shape in shapes], float).T
    return Shapes(f, zeta, values, dofs)
