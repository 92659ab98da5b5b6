"""Responses, modes and state spaces to and from the objects of other packages.

Each function needs the package it is called after, and that one alone: xarray, SDynPy,
pandas (for pyFBS) or python-control. Numbers are SI throughout.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast, get_args

import numpy as np

from ..arguments import checked
from ..dofs import COMPONENTS, label, parse
from ..dynamics.frf import FRF, UNIT, Quantity
from ..dynamics.modes import ModalModel
from ..dynamics.statespace import StateSpace
from ..ema.setup import Role, Sensor
from ..errors import ArgumentError, LabelError, named
from ..extensions import optional_package
from .tables.write_tables import write_csv as write_csv
from .tables.write_tables import write_npz as write_npz
from .uff.write_shapes import write_shapes as write_shapes
from .uff.write_uff import write_uff as write_uff
from .vtu import write_vtu as write_vtu

if TYPE_CHECKING:
    import pandas
    import xarray

__all__ = [
    "from_control",
    "from_pyfbs",
    "from_sdynpy",
    "from_xarray",
    "to_control",
    "to_pyfbs",
    "to_sdynpy",
    "to_xarray",
    "write_csv",
    "write_npz",
    "write_shapes",
    "write_uff",
    "write_vtu",
]

_DIMS = ("frequency", "output", "input")
_MORE = ("variance", "coherence")
_MODES = ("shapes", "dof", "mode", "frequency", "damping")
_GIVE = f"give quantity, one of {named(UNIT)}"
_AXES = {name: [f"{name}_{k}" for k in (1, 2, 3)] for name in ("Position", "Direction")}  # pyFBS


@checked
def to_xarray(data: FRF | ModalModel) -> "xarray.Dataset":
    """Convert responses or modes to a data set.

    Parameters
    ----------
    data : FRF gives ``H`` (frequency [Hz], output, input) with its variance and coherence;
        ModalModel gives ``shapes`` (dof, mode) [1/√kg] with ``frequency`` [Hz] and ``damping``

    Raises
    ------
    FileError
        If xarray is not installed.
    """
    Dataset = optional_package("xarray", "'chladni[xarray]'").Dataset
    if isinstance(data, ModalModel):
        return Dataset(
            {
                "shapes": (("dof", "mode"), data.shapes, {"units": "1/sqrt(kg)"}),
                "frequency": ("mode", data.frequency, {"units": "Hz"}),
                "damping": ("mode", data.damping, {"units": "of critical"}),
            },
            coords={
                "dof": [label(int(p), int(c)) for p, c in data.dofs],
                "mode": np.arange(1, len(data) + 1),
            },
        )
    held = {name: (_DIMS, value) for name in _MORE if (value := getattr(data, name)) is not None}
    unit = {"units": UNIT[data.quantity]}
    return Dataset(
        {"H": (_DIMS, data.values, unit), **held},
        coords={
            "frequency": ("frequency", data.frequency, {"units": "Hz"}),
            "output": list(data.outputs),
            "input": list(data.inputs),
        },
        attrs={"quantity": data.quantity},
    )


@checked
def from_xarray(data: "xarray.Dataset", quantity: Quantity | None = None) -> FRF | ModalModel:
    """Convert a data set of :func:`to_xarray` back, its dimensions in any order.

    Parameters
    ----------
    data : with ``H`` over frequency [Hz], output and input, or ``shapes`` over dof and mode
    quantity : of the responses, where the attribute ``quantity`` does not say it

    Returns
    -------
    ModalModel where the data set holds ``shapes``, else FRF.

    Raises
    ------
    LabelError
        If a dimension or H is missing, or nothing says what the responses are.
    """
    if not hasattr(data, "data_vars"):
        raise ArgumentError(f"from_xarray() takes an xarray.Dataset, no {type(data).__name__}")
    names = [*map(str, data.data_vars), *map(str, data.coords)]
    if "shapes" in names:
        return _modes(data, names)
    if missing := [name for name in ("H", *_DIMS) if name not in names]:
        raise LabelError(f"the data set has no {', '.join(missing)}; it has {', '.join(names)}")
    said = quantity or data.attrs.get("quantity")
    if said is None:
        raise LabelError(f"nothing says what H is; {_GIVE}")
    arrays = {
        name: np.asarray(data[name].transpose(*_DIMS).values)
        for name in ("H", *_MORE)
        if name in names
    }
    outputs, inputs = (tuple(map(str, data[side].values.tolist())) for side in _DIMS[1:])
    frequency = np.asarray(data["frequency"].values, dtype=float)
    return FRF(
        arrays["H"], frequency, outputs, inputs, cast(Quantity, said),
        arrays.get("variance"), arrays.get("coherence"),
    )  # fmt: skip


def _modes(data: "xarray.Dataset", names: Sequence[str]) -> ModalModel:
    if missing := [name for name in _MODES if name not in names]:
        raise LabelError(f"the data set has no {', '.join(missing)}; it has {', '.join(names)}")
    rows = np.array([parse(str(text)) for text in data["dof"].values.tolist()]).reshape(-1, 3)
    shapes = np.asarray(data["shapes"].transpose("dof", "mode").values)
    frequency, damping = (np.asarray(data[n].values, float) for n in ("frequency", "damping"))
    return ModalModel(frequency, damping, rows[:, 2:] * shapes, rows[:, :2])


@checked
def to_sdynpy(data: FRF | ModalModel) -> Any:
    """Convert responses or modes to a SDynPy array.

    Parameters
    ----------
    data : FRF gives a ``TransferFunctionArray`` (n_out, n_in), ModalModel a ``ShapeArray`` (r) with
        modal mass 1; labels are single components as 412:+Z

    Raises
    ------
    FileError
        If SDynPy is not installed.
    LabelError
        If a label is no single component (412:n).
    """
    sdynpy = optional_package("sdynpy", "sdynpy")
    if isinstance(data, ModalModel):
        at = sdynpy.coordinate_array(data.dofs[:, 0], data.dofs[:, 1])
        return sdynpy.shape_array(at, data.shapes.T, data.frequency, data.damping)
    sides = [
        sdynpy.coordinate_array([p for p, _, _ in side], [sign * c for _, c, sign in side])
        for side in ([parse(text) for text in labels] for labels in (data.outputs, data.inputs))
    ]
    at = sdynpy.coordinate.outer_product(*sides)
    kind = sdynpy.data.FunctionTypes.FREQUENCY_RESPONSE_FUNCTION
    ordinate = np.moveaxis(data.values, 0, -1)
    return sdynpy.data_array(kind, data.frequency, ordinate, at, comment1=data.quantity)


@checked
def from_sdynpy(data: Any, quantity: Quantity | None = None) -> FRF | ModalModel:
    """Convert a SDynPy ``TransferFunctionArray`` or ``ShapeArray``; SDynPy itself is not needed.

    Parameters
    ----------
    data : functions over frequency [Hz] in any order and shape, or shapes over one set of
        coordinates
    quantity : of the responses, where ``comment1`` of the array does not say it

    Raises
    ------
    LabelError
        If the functions fill no matrix of outputs and inputs, have lines of their own, or nothing
        says what they are.
    """
    fields = data.dtype.names or ()
    if "shape_matrix" in fields:
        return _sdynpy_shapes(np.asarray(data).ravel())
    if missing := [name for name in ("abscissa", "ordinate", "coordinate") if name not in fields]:
        raise LabelError(f"the array has no {', '.join(missing)}; it has {named(fields)}")
    flat = np.asarray(data).ravel()
    comments = np.unique(flat["comment1"]) if "comment1" in fields else np.zeros(0, str)
    said = quantity or (str(comments[0]) if len(comments) == 1 else "")
    if said not in get_args(Quantity):
        raise LabelError(
            f"nothing says what the functions are; give quantity, one of {named(UNIT)}"
        )
    if not (flat["abscissa"] == flat["abscissa"][0]).all():
        raise LabelError("the functions have lines of their own; an FRF has one set of lines")
    ends = [tuple(_coordinate(c) for c in pair) for pair in flat["coordinate"]]
    outputs, inputs = (tuple(dict.fromkeys(e[k] for e in ends)) for k in (0, 1))
    if len(set(ends)) != len(ends) or len(ends) != len(outputs) * len(inputs):
        raise LabelError(
            f"{len(ends)} functions fill no matrix of {len(outputs)} outputs and {len(inputs)} "
            "inputs"
        )
    values = np.zeros((flat["ordinate"].shape[1], len(outputs), len(inputs)), complex)
    for (output, input), function in zip(ends, flat["ordinate"], strict=True):
        values[:, outputs.index(output), inputs.index(input)] = function
    frequency = np.asarray(flat["abscissa"][0], float)
    return FRF(values, frequency, outputs, inputs, cast(Quantity, said))


def _coordinate(at: Any) -> str:
    """The label of a coordinate of SDynPy: a node, and a signed component 1-6."""
    way = int(at["direction"])
    if not 1 <= abs(way) <= len(COMPONENTS):
        raise LabelError(f"a function at node {int(at['node'])} has no direction")
    return label(int(at["node"]), abs(way), way)


def _sdynpy_shapes(flat: np.ndarray) -> ModalModel:
    """Mass-normalised modes of shapes over one set of coordinates."""
    at = flat["coordinate"][0]
    if not (flat["coordinate"] == at).all():
        raise LabelError("the shapes are over coordinates of their own; modes share theirs")
    if np.iscomplexobj(flat["shape_matrix"]):
        raise LabelError("the shapes are complex; normal modes are real (to_real in SDynPy)")
    rows = np.array([parse(_coordinate(c)) for c in at])
    phi = flat["shape_matrix"].T / np.sqrt(flat["modal_mass"])
    order = np.argsort(flat["frequency"], kind="stable")
    return ModalModel(
        flat["frequency"][order], flat["damping"][order], (rows[:, 2:] * phi)[:, order], rows[:, :2]
    )


@checked
def to_pyfbs(
    frf: FRF, sensors: Sequence[Sensor] = ()
) -> tuple[np.ndarray, np.ndarray, "pandas.DataFrame", "pandas.DataFrame"]:
    """Convert responses to what pyFBS works on.

    Parameters
    ----------
    sensors : with places and directions of the labels; a label as 412:+Z has a direction itself

    Returns
    -------
    Y : (n_f, n_out, n_in) complex
    frequency : (n_f,) [Hz]
    channels, impacts : tables with Name, Quantity, Position_1 to 3 [m], Direction_1 to 3

    Raises
    ------
    FileError
        If pandas is not installed.
    """
    frame = optional_package("pandas", "pandas").DataFrame
    quantity = {"receptance": "Displacement", "mobility": "Velocity"}.get(
        frf.quantity, "Acceleration"
    )
    sides: tuple[tuple[Role, Sequence[str], str], ...] = (
        ("output", frf.outputs, quantity),
        ("input", frf.inputs, "Force"),
    )
    tables = []
    for role, labels, what in sides:
        known = {s.label: s for s in sensors if s.role == role}
        tables.append(frame([_pyfbs_row(text, what, known.get(text)) for text in labels]))
    return frf.values, frf.frequency, tables[0], tables[1]


def _pyfbs_row(text: str, quantity: str, sensor: Sensor | None) -> Mapping[str, Any]:
    place = np.full(3, np.nan) if sensor is None or sensor.place is None else sensor.place
    way = np.full(3, np.nan) if sensor is None or sensor.direction is None else sensor.direction
    if np.isnan(way).any():
        try:
            _, component, sign = parse(text)
            way = 0.0 + sign * np.eye(3)[component - 1] if component <= 3 else way
        except LabelError:
            pass
    cells: dict[str, Any] = {}
    for axes, x in zip(_AXES.values(), (place, way), strict=True):
        cells |= dict(zip(axes, map(float, x), strict=True))
    head = {"Name": text, "Description": text, "Quantity": quantity, "Grouping": 1}
    return {**head, **cells}


@checked
def from_pyfbs(
    Y: np.ndarray,
    frequency: np.ndarray,
    channels: "pandas.DataFrame",
    impacts: "pandas.DataFrame",
    quantity: Quantity | None = None,
) -> tuple[FRF, tuple[Sensor, ...]]:
    """Convert a matrix of responses and the two tables of pyFBS; pyFBS itself is not needed.

    Parameters
    ----------
    Y : (n_f, n_out, n_in)
    frequency : (n_f,) [Hz]
    channels, impacts : tables with Name, Position_1 to 3 [m] and Direction_1 to 3
    quantity : of the responses, where the column Quantity of the channels does not say it

    Returns
    -------
    The responses, and a sensor for every row that has a place, for ``sensors=`` of a diagnosis.

    Raises
    ------
    LabelError
        If a column is missing, two rows have one name, or nothing says what the responses are.
    ShapeError
        If the tables and the matrix are of other sizes.
    """
    outputs, of_outputs = _pyfbs_side(channels, "output")
    inputs, of_inputs = _pyfbs_side(impacts, "input")
    said = quantity or _pyfbs_quantity(channels)
    frf = FRF(np.asarray(Y), np.asarray(frequency, float), outputs, inputs, said)
    return frf, (*of_outputs, *of_inputs)


def _pyfbs_side(table: "pandas.DataFrame", role: Role) -> tuple[tuple[str, ...], list[Sensor]]:
    """Names of a table of pyFBS, and a sensor for every row that has a place."""
    columns = [str(name) for name in table.columns]
    if missing := [
        n for n in ["Name", *_AXES["Position"], *_AXES["Direction"]] if n not in columns
    ]:
        raise LabelError(
            f"the table of {role}s has no {named(missing)}; it has {named(columns, 12)}"
        )
    names = [str(name) for name in table["Name"]]
    if twice := [name for k, name in enumerate(names) if name in names[:k]]:
        raise LabelError(f"the table of {role}s has two rows with the name {twice[0]!r}")
    place, way = (table[axes].to_numpy(float) for axes in _AXES.values())
    unit = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    rows = zip(names, place, unit, strict=True)
    return tuple(names), [
        Sensor(name, place=x, direction=d, role=role) for name, x, d in rows if np.isfinite(x).all()
    ]


def _pyfbs_quantity(channels: "pandas.DataFrame") -> Quantity:
    kinds: dict[str, Quantity] = {
        "acceleration": "accelerance", "velocity": "mobility", "displacement": "receptance",
    }  # fmt: skip
    said = {str(x).lower() for x in channels["Quantity"]} if "Quantity" in channels else set()
    if len(said) != 1 or not said <= set(kinds):
        raise LabelError(
            f"nothing says what the responses are; give quantity, one of {named(UNIT)}"
        )
    return kinds[said.pop()]


@checked
def to_control(system: StateSpace) -> Any:
    """Convert x' = A x + B u, y = C x + D u to a ``control.StateSpace`` with named signals.

    Raises
    ------
    FileError
        If python-control is not installed.
    """
    control = optional_package("control", "control")
    names = [[text.replace(":", " ") for text in side] for side in (system.inputs, system.outputs)]
    matrices = (np.array(m) for m in (system.A, system.B, system.C, system.D))
    return control.ss(*matrices, inputs=names[0], outputs=names[1])


@checked
def from_control(system: Any, quantity: Quantity = "receptance") -> StateSpace:
    """Convert a continuous ``control.StateSpace``; its signals are named 412 +Z, or as they are.

    Parameters
    ----------
    quantity : of the outputs

    Raises
    ------
    LabelError
        If the system is sampled.
    """
    if getattr(system, "dt", 0):
        raise LabelError(f"the system is sampled (dt = {system.dt:g} s); give a continuous one")
    outputs, inputs = (
        tuple(str(text).replace(" ", ":") for text in side)
        for side in (system.output_labels, system.input_labels)
    )
    A, B, C, D = (np.asarray(m, float) for m in (system.A, system.B, system.C, system.D))
    return StateSpace(A, B, C, D, outputs, inputs, quantity)
