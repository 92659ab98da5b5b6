"""The sets of a universal file as types: what each holds, in the units of the file.

Source of the format: SDRC universal file datasets. pyuff's dictionaries end and begin here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False, kw_only=True)
class UffSet:
    """One dataset: its number in the file, from 1, and the number of its format."""

    number: int = 0
    code: int = 0


@dataclass(frozen=True, eq=False, kw_only=True)
class HeaderSet(UffSet):
    """151: the name of the model and the program that wrote the file."""

    model: str = "NONE"
    program: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class UnitsSet(UffSet):
    """164: code of a unit system; units of the file in one metre and in one newton."""

    system: int = 1
    length: float = 1.0
    force: float = 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class NodeSet(UffSet):
    """15 and 2411: nodes (n,), places (n, 3), the coordinate system each is measured in (n,)."""

    nodes: np.ndarray
    places: np.ndarray
    systems: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class ElementSet(UffSet):
    """2412: the nodes of every element."""

    elements: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class TraceSet(UffSet):
    """82: nodes in the order of the pen; a zero lifts it."""

    nodes: tuple[int, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class SystemSet(UffSet):
    """2420: label, kind (0: Cartesian) and axes (3, 3) of every coordinate system."""

    systems: tuple[tuple[int, int, np.ndarray], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class ShapeSet(UffSet):
    """55: data at nodes; a mode has a frequency and damping, or a complex pole.

    Attributes
    ----------
    analysis : 2 normal mode, 3 and 7 complex mode, others are no modes
    nodes : (n,)
    components : up to six of (n,)   X, Y, Z, RX, RY, RZ
    """

    analysis: int
    frequency: float
    viscous: float
    hysteretic: float
    pole: complex
    nodes: np.ndarray
    components: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class Axis:
    """Specific data type (0: unknown, 18: frequency, ...) and unit label of an axis."""

    kind: int = 0
    unit: str = "NONE"


@dataclass(frozen=True, eq=False, kw_only=True)
class FunctionSet(UffSet):
    """58: a function of a response dof and a reference dof.

    Attributes
    ----------
    function : 1 time, 4 FRF, 5 transmissibility, 6 coherence, ...
    response, reference : (node, direction -6 to 6)
    due : how many values the head says there are
    x, y : (n,)
    abscissa, ordinate, denominator : Axis
    title : first line of its head
    """

    function: int
    response: tuple[int, int]
    reference: tuple[int, int]
    due: int
    x: np.ndarray
    y: np.ndarray
    abscissa: Axis
    ordinate: Axis
    denominator: Axis
    title: str = ""


def typed(number: int, d: Mapping[str, Any]) -> UffSet:
    """One of pyuff's dictionaries as a type."""
    code = int(d["type"])
    return _MAKE[code](d, {"number": number, "code": code})


def _units(d: Mapping[str, Any], at: dict[str, int]) -> UnitsSet:
    return UnitsSet(system=int(d["units_code"]), length=d["length"], force=d["force"], **at)


def _nodes(d: Mapping[str, Any], at: dict[str, int]) -> NodeSet:
    nodes, systems = (np.array([int(n) for n in d[k]]) for k in ("node_nums", "disp_cs"))
    places = np.column_stack([d["x"], d["y"], d["z"]])
    if not len(nodes) == len(systems) == len(places):
        raise ValueError(f"{len(nodes)} nodes, {len(systems)} systems, {len(places)} places")
    return NodeSet(nodes=nodes, places=places, systems=systems, **at)


def _elements(d: Mapping[Any, Any], at: dict[str, int]) -> ElementSet:
    families = [elements for family, elements in d.items() if isinstance(family, int)]
    every = (tuple(int(n) for n in e["nodes_nums"]) for elements in families for e in elements)
    return ElementSet(elements=tuple(every), **at)


def _trace(d: Mapping[str, Any], at: dict[str, int]) -> TraceSet:
    return TraceSet(nodes=tuple(int(n) for n in d["nodes"]), **at)


def _systems(d: Mapping[str, Any], at: dict[str, int]) -> SystemSet:
    rows = zip(d["CS_sys_labels"], d["CS_types"], d["CS_matrices"], strict=True)
    systems = tuple((int(label), int(kind), np.asarray(A)[:3]) for label, kind, A in rows)
    return SystemSet(systems=systems, **at)


def _shape(d: Mapping[str, Any], at: dict[str, int]) -> ShapeSet:
    return ShapeSet(
        analysis=int(d["analysis_type"]),
        frequency=d.get("freq", 0.0),
        viscous=d.get("modal_damp_vis", 0.0),
        hysteretic=d.get("modal_damp_his", 0.0),
        pole=d.get("eig", 0j),
        nodes=d["node_nums"],
        components=tuple(d[f"r{k}"] for k in range(1, 7) if f"r{k}" in d),
        **at,
    )


def _function(d: Mapping[str, Any], at: dict[str, int]) -> FunctionSet:
    abscissa, ordinate, denominator = (
        Axis(int(d[f"{axis}_spec_data_type"]), str(d[f"{axis}_axis_units_lab"]))
        for axis in ("abscissa", "ordinate", "orddenom")
    )
    return FunctionSet(
        function=int(d["func_type"]),
        response=(int(d["rsp_node"]), int(d["rsp_dir"])),
        reference=(int(d["ref_node"]), int(d["ref_dir"])),
        due=int(d["num_pts"]),
        x=d["x"],
        y=d["data"],
        abscissa=abscissa,
        ordinate=ordinate,
        denominator=denominator,
        title=str(d.get("id1", "")),
        **at,
    )


_MAKE = {
    15: _nodes,
    55: _shape,
    58: _function,
    82: _trace,
    164: _units,
    2411: _nodes,
    2412: _elements,
    2420: _systems,
}
USED = frozenset(_MAKE)
SILENT = frozenset({151, 1858})  # header; channel settings that come with every function


def for_pyuff(one: HeaderSet | UnitsSet | NodeSet) -> dict[str, Any]:
    """A header, units or nodes as pyuff's writer wants them."""
    if isinstance(one, HeaderSet):
        named = {"model_name": one.model, "description": "NONE"}
        return {"type": 151, **named, "db_app": one.program, "program": one.program}
    if isinstance(one, UnitsSet):
        factors = {"units_code": one.system, "length": one.length, "force": one.force}
        rest = {"units_description": "SI", "temp_mode": 1, "temp": 1.0, "temp_offset": 273.15}
        return {"type": 164, **factors, **rest}
    x, y, z = one.places.T
    zero = np.zeros(len(one.nodes), int)
    frame = {"def_cs": zero, "disp_cs": one.systems, "color": zero + 1}
    return {"type": 2411, "node_nums": one.nodes, "x": x, "y": y, "z": z, **frame}
