"""FRFs to and from xarray, where it is installed (``pip install 'chladni[xarray]'``)."""

from typing import TYPE_CHECKING, cast

import numpy as np

from ..dynamics.frf import FRF, UNIT, Quantity
from ..errors import FileError, LabelError

if TYPE_CHECKING:
    import xarray

_DIMS = ("frequency", "output", "input")
_MORE = ("variance", "coherence")


def to_xarray(frf: FRF) -> "xarray.Dataset":
    """A data set with H over frequency [Hz], output and input, its variance and coherence.

    Raises
    ------
    FileError
        If xarray is not installed.
    """
    try:
        from xarray import Dataset
    except ImportError:
        raise FileError("xarray is not installed: pip install 'chladni[xarray]'") from None
    held = {name: (_DIMS, value) for name in _MORE if (value := getattr(frf, name)) is not None}
    unit = {"units": UNIT[frf.quantity]}
    return Dataset(
        {"H": (_DIMS, frf.values, unit), **held},
        coords={
            "frequency": ("frequency", frf.frequency, {"units": "Hz"}),
            "output": list(frf.outputs),
            "input": list(frf.inputs),
        },
        attrs={"quantity": frf.quantity},
    )


def from_xarray(data: "xarray.Dataset", quantity: Quantity | None = None) -> FRF:
    """The FRF of such a data set, its dimensions in any order.

    Raises
    ------
    LabelError
        If a dimension or H is missing, or nothing says what the responses are.
    """
    names = [*map(str, data.data_vars), *map(str, data.coords)]
    if missing := [name for name in ("H", *_DIMS) if name not in names]:
        raise LabelError(f"the data set has no {', '.join(missing)}; it has {', '.join(names)}")
    said = quantity or data.attrs.get("quantity")
    if said is None:
        raise LabelError(
            f"the quantity of H is not stated; give quantity, one of {', '.join(UNIT)}"
        )
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
