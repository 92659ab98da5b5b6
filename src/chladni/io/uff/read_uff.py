"""Universal files in: datasets 58 and 58b, 15, 2411, 2412, 82, 55, 151, 164, 2420 (through pyuff).

pyuff does the parsing of fields; what the fields mean, units, signs, completeness and the
sentences about what is wrong are ours. Source of the format: SDRC universal file datasets.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...dofs import label
from ...dynamics.frf import FRF
from ...ema.setup import Function, Recording, Shapes
from ...errors import ChladniError, FileError
from .uff_source import readable
from .uff_units import FileUnits, Meaning, file_units, meaning
from .write_uff import write_uff as write_uff

_KINDS = {1: "time", 2: "auto spectrum", 3: "cross spectrum", 9: "psd", 12: "spectrum"}
_SAME_LINE = 1e-5  # single precision abscissas: relative


@dataclass
class _Pile:
    """What has been read so far; filled dataset by dataset."""

    path: Path
    units: FileUnits = field(default_factory=FileUnits)
    frf: dict = field(default_factory=dict)  # (output, input) -> (number, x, values, Meaning)
    coherence: dict = field(default_factory=dict)  # (output, input or "") -> values
    functions: list = field(default_factory=list)
    nodes: dict = field(default_factory=dict)
    systems: dict = field(default_factory=dict)
    turned: dict = field(default_factory=dict)  # node -> system
    elements: list = field(default_factory=list)
    shapes: list = field(default_factory=list)
    notes: list = field(default_factory=list)
    name: str = ""


def read_uff(path: str | Path, quantity: str | None = None) -> Recording:
    """Everything a universal file holds, in SI.

    Parameters
    ----------
    path : file
    quantity : of the FRFs (receptance, mobility, accelerance, transmissibility) where the file
        does not say it, or says it wrongly.

    Raises
    ------
    FileError
        One sentence with file and dataset number: missing, truncated or empty file, not-a-number,
        frequency axes that differ, records that repeat each other.
    """
    path = Path(path)
    pile = _Pile(path)
    datasets = list(_datasets(path))
    for _, dataset in datasets:  # units first: 164 need not be at the top
        if dataset.get("type") == 164 and "units_code" in dataset:
            pile.units = file_units(dataset)
    for number, dataset in datasets:
        if take := _TAKE.get(int(dataset["type"])):
            _taken(take, pile, number, dataset, quantity)
    return Recording(
        name=path.name,
        frf=_frf(pile, quantity),
        shapes=_shapes(pile),
        nodes=pile.nodes,
        axes=_axes(pile),
        elements=tuple(pile.elements),
        functions=tuple(pile.functions),
        notes=tuple(pile.notes),
    )


_BROKEN = (ValueError, IndexError, KeyError, TypeError, OverflowError, ZeroDivisionError)


def _taken(
    take: Callable[..., None], pile: _Pile, number: int, d: dict, quantity: str | None
) -> None:
    """One dataset taken in; one whose lines do not fit together is damaged."""
    try:
        take(pile, number, d, quantity)
    except ChladniError:
        raise
    except _BROKEN as error:
        raise FileError(
            f"{pile.path.name}, dataset {number} (type {int(d['type'])}) is damaged: its lines do "
            f"not fit together ({type(error).__name__}: {error})"
        ) from error


def _datasets(path: Path) -> Iterator[tuple[int, dict]]:
    """(number from 1, dataset) of every dataset pyuff knows."""
    import pyuff

    with readable(path) as source:
        file = pyuff.UFF(str(source))
        for k, kind in enumerate(file.get_set_types()):
            where = f"{path.name}, dataset {k + 1} (type {int(kind)})"
            try:
                dataset: dict[str, Any] = file.read_sets(k)
            except Exception as error:  # pyuff raises nothing narrower
                raise FileError(f"{where}: cannot be read ({_why(error)})") from error
            yield k + 1, dataset


def _why(error: BaseException) -> str:
    """The deepest cause in words."""
    while error.__context__ is not None:
        error = error.__context__
    return str(error) or type(error).__name__


def _dof(node: int, direction: int) -> str:
    """Label of a node and a direction code; 0 (scalar) is read as the normal."""
    if abs(direction) > 6:
        raise FileError(f"direction {direction} of node {node} is not one of -6 to 6")
    return f"{node}:n" if direction == 0 else label(node, abs(direction), direction)


def _take_function(pile: _Pile, number: int, d: dict, quantity: str | None) -> None:
    where = f"{pile.path.name}, dataset {number} (type 58)"
    _check_points(d, where)
    try:
        output, input = _dof(d["rsp_node"], d["rsp_dir"]), _dof(d["ref_node"], d["ref_dir"])
    except FileError as error:
        raise FileError(f"{where}: {error}") from error
    kind = int(d["func_type"])
    if kind in (4, 5, 6) and d["ref_node"] == 0 and d["ref_dir"] != 0:
        input = label(0, abs(d["ref_dir"]), d["ref_dir"]).replace("0:", "base:")
    if kind in (4, 5) or (kind == 0 and np.iscomplexobj(d["data"]) and d["ref_node"]):
        _take_frf(pile, number, d, (output, input), quantity)
    elif kind in (6, 26):
        pile.coherence[output, input if kind == 6 else ""] = np.real(d["data"])
    else:
        named = _KINDS.get(kind, f"function type {kind}")
        reference = input if d["ref_node"] else ""
        unit = d["ordinate_axis_units_lab"]
        pile.functions.append(Function(named, output, reference, d["x"], d["data"], unit))


def _check_points(d: dict, where: str) -> None:
    """Every number there, every number finite."""
    data, x, due = d["data"], d["x"], int(d["num_pts"])
    if due < 0:
        raise FileError(f"{where}: it says it holds {due} values")
    if len(data) < due or len(x) < due:
        raise FileError(f"{where}: {len(data)} of {due} values are there; the file is truncated")
    d["data"], d["x"] = data[:due], x[:due]
    if due == 0:
        raise FileError(f"{where}: the record is empty (0 values)")
    if not (np.isfinite(data).all() and np.isfinite(x).all()):
        bad = np.flatnonzero(~(np.isfinite(d["data"]) & np.isfinite(d["x"])))
        raise FileError(f"{where}: {len(bad)} values are not numbers, the first in line {bad[0]}")


def _take_frf(
    pile: _Pile, number: int, d: dict, dofs: tuple[str, str], quantity: str | None
) -> None:
    where = f"{pile.path.name}, dataset {number} (type 58)"
    if not np.iscomplexobj(d["data"]):
        raise FileError(f"{where}: a frequency response without phase (real values) is of no use")
    if dofs in pile.frf:
        raise FileError(
            f"{where}: repeats {dofs[0]} / {dofs[1]} of dataset {pile.frf[dofs][0]}; "
            "put each run into a file of its own"
        )
    try:
        said = meaning(d, pile.units, where)
    except FileError:
        if quantity is None:
            raise
        said = Meaning(quantity, pile.units.length / pile.units.force)
    if quantity is None and said.quantity is None:
        raise FileError(
            f"{where}: neither data type nor unit label says what was measured; "
            "state quantity = receptance, mobility, accelerance or transmissibility"
        )
    pile.frf[dofs] = (number, _hertz(d), d["data"] * said.factor, said.quantity)


def _hertz(d: dict) -> np.ndarray:
    unit = str(d["abscissa_axis_units_lab"]).strip().lower()
    factor = {"rad/s": 1 / (2 * np.pi), "khz": 1e3}.get(unit, 1.0)
    f = np.asarray(d["x"], float) * factor
    if np.any(f < 0):
        raise FileError(f"a frequency of {f.min():g} Hz is negative")
    return f


def _take_nodes(pile: _Pile, number: int, d: dict, _: str | None) -> None:
    xyz = np.column_stack([d["x"], d["y"], d["z"]]) * pile.units.length
    if not np.isfinite(xyz).all():
        raise FileError(
            f"{pile.path.name}, dataset {number} (type {d['type']}): a coordinate is not a number"
        )
    for node, place, system in zip(d["node_nums"], xyz, d["disp_cs"], strict=True):
        pile.nodes[int(node)] = place
        pile.turned[int(node)] = int(system)


def _take_elements(pile: _Pile, number: int, d: dict, _: str | None) -> None:
    for family, elements in d.items():
        if isinstance(family, int):
            pile.elements += [tuple(int(n) for n in e["nodes_nums"]) for e in elements]


def _take_lines(pile: _Pile, number: int, d: dict, _: str | None) -> None:
    """Trace lines; a zero lifts the pen."""
    line: list[int] = []
    for node in [*map(int, d["nodes"]), 0]:
        if node:
            line.append(node)
        elif line:
            pile.elements.append(tuple(line))
            line = []


def _take_systems(pile: _Pile, number: int, d: dict, _: str | None) -> None:
    for system, kind, matrix in zip(
        d["CS_sys_labels"], d["CS_types"], d["CS_matrices"], strict=True
    ):
        if kind == 0:
            pile.systems[int(system)] = np.asarray(matrix)[:3]
        else:
            pile.notes.append(f"coordinate system {system} is not Cartesian: read as global")


def _take_shape(pile: _Pile, number: int, d: dict, _: str | None) -> None:
    if d["analysis_type"] == 2:
        f, zeta = d["freq"], d.get("modal_damp_vis", 0.0) or d.get("modal_damp_his", 0.0) / 2
    elif d["analysis_type"] in (3, 7):
        f, zeta = abs(d["eig"]) / (2 * np.pi), -d["eig"].real / max(abs(d["eig"]), 1e-300)
    else:
        return
    components = [d[f"r{k}"] for k in range(1, 7) if f"r{k}" in d]
    values = {
        label(int(node), k + 1): component[i]
        for i, node in enumerate(d["node_nums"])
        for k, component in enumerate(components)
    }
    pile.shapes.append((f, zeta, values))


_TAKE = {
    15: _take_nodes,
    2411: _take_nodes,
    2412: _take_elements,
    82: _take_lines,
    2420: _take_systems,
    55: _take_shape,
    58: _take_function,
}


def _axes(pile: _Pile) -> dict[int, np.ndarray]:
    """The nodes whose directions are not those of the global axes."""
    turned = {n: pile.systems[s] for n, s in pile.turned.items() if s in pile.systems}
    return {n: A for n, A in turned.items() if not np.allclose(A, np.eye(3), atol=1e-6)}


def _shapes(pile: _Pile) -> Shapes | None:
    if not pile.shapes:
        return None
    dofs = tuple(dict.fromkeys(dof for _, _, values in pile.shapes for dof in values))
    table = np.array([[values.get(dof, 0.0) for _, _, values in pile.shapes] for dof in dofs])
    f, zeta = (np.array([s[k] for s in pile.shapes], float) for k in (0, 1))
    return Shapes(f, zeta, table, dofs)


def _one_sign(pile: _Pile) -> dict[tuple[str, str], tuple[str, str]]:
    """Each pair -> the pair it is called by, where a dof occurs with both signs."""
    bare = lambda dof: re.sub(r":[+-]", ":", dof)  # noqa: E731
    first: dict[tuple[int, str], str] = {}
    for pair in pile.frf:
        for role, dof in enumerate(pair):
            first.setdefault((role, bare(dof)), dof)
    return {(i, j): (first[0, bare(i)], first[1, bare(j)]) for i, j in pile.frf}


def _frf(pile: _Pile, quantity: str | None) -> FRF | None:
    """The FRF matrix of all records, or None where the file holds none."""
    if not pile.frf:
        return None
    called = _one_sign(pile)
    records: dict[tuple[str, str], tuple] = {}
    for pair, (number, x, values, said) in pile.frf.items():
        flips = sum(a != b for a, b in zip(pair, called[pair], strict=True))
        if called[pair] in records:
            raise FileError(
                f"{pile.path.name}, dataset {number}: repeats {called[pair][0]} / "
                f"{called[pair][1]} of dataset {records[called[pair]][0]} with the other sign"
            )
        records[called[pair]] = (number, x, (-1) ** flips * values, said)
    outputs, inputs = _rectangle(pile, list(records))
    kept = {(i, j): records[i, j] for j in inputs for i in outputs}
    frequency = _axis(pile, kept)
    kind = _quantity(pile, kept, quantity)
    values = np.array([[kept[i, j][2] for j in inputs] for i in outputs]).transpose(2, 0, 1)
    if not values.any():
        raise FileError(f"{pile.path.name}: the FRFs are empty (every value is zero)")
    order = slice(None, None, -1) if frequency[0] > frequency[-1] else slice(None)
    if np.any(np.diff(frequency[order]) <= 0):
        k = int(np.argmin(np.diff(frequency[order])))
        raise FileError(
            f"{pile.path.name}: the frequencies do not increase near {frequency[order][k]:g} Hz"
        )
    coherence = _coherence(pile, {v: k for k, v in called.items()}, outputs, inputs, len(frequency))
    try:
        return FRF(
            values[order],
            frequency[order],
            outputs,
            inputs,
            quantity=kind,  # type: ignore[arg-type]
            coherence=None if coherence is None else coherence[order],
        )
    except ChladniError as error:
        raise FileError(f"{pile.path.name}: {error}") from error


def _rectangle(
    pile: _Pile, pairs: list[tuple[str, str]]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Outputs measured for every input, in the order of the file; the rest goes into a note."""
    inputs = tuple(dict.fromkeys(j for _, j in pairs))
    everyone = tuple(dict.fromkeys(i for i, _ in pairs))
    outputs = tuple(i for i in everyone if all((i, j) in pairs for j in inputs))
    if not outputs:
        raise FileError(
            f"{pile.path.name}: no output was measured for all of the inputs {list(inputs)}; "
            "put each reference into a file of its own"
        )
    if left := [i for i in everyone if i not in outputs]:
        pile.notes.append(f"{len(left)} outputs not measured for every input left out: {left[:6]}")
    return outputs, inputs


def _axis(pile: _Pile, kept: dict) -> np.ndarray:
    """The one frequency axis of all records [Hz]."""
    first, x, *_ = next(iter(kept.values()))
    for number, other, *_ in kept.values():
        if len(other) != len(x) or not np.allclose(other, x, rtol=_SAME_LINE, atol=1e-9):
            raise FileError(
                f"{pile.path.name}, dataset {number}: its {len(other)} frequencies from "
                f"{other[0]:g} to {other[-1]:g} Hz are not the {len(x)} from {x[0]:g} to "
                f"{x[-1]:g} Hz of dataset {first}"
            )
    return x


def _quantity(pile: _Pile, kept: dict, quantity: str | None) -> str:
    """What all records are."""
    if quantity is not None:
        if any(record[3] not in (None, quantity) for record in kept.values()):
            pile.notes.append(f"read as {quantity} as asked, whatever the file says")
        return quantity
    said = {record[3]: record[0] for record in kept.values()}
    if len(said) > 1:
        mixed = " and ".join(f"{q} (dataset {n})" for q, n in said.items())
        raise FileError(f"{pile.path.name}: holds {mixed}; one quantity a file")
    return str(next(iter(said)))


def _coherence(
    pile: _Pile,
    spelt: dict,
    outputs: tuple[str, ...],
    inputs: tuple[str, ...],
    n_lines: int,
) -> np.ndarray | None:
    """(n_f, n_out, n_in) in [0, 1], or None unless every channel has it."""
    if not pile.coherence:
        return None
    gamma = np.empty((n_lines, len(outputs), len(inputs)))
    for i, output in enumerate(outputs):
        for j, input in enumerate(inputs):
            i_said, j_said = spelt[output, input]
            found = pile.coherence.get((i_said, j_said), pile.coherence.get((i_said, "")))
            if found is None or len(found) != n_lines:
                pile.notes.append(f"no coherence for {output} / {input}: none is used")
                return None
            gamma[:, i, j] = found
    return np.clip(gamma, 0.0, 1.0)
