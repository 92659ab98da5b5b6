"""Identified modes for other programs: shapes as a table, the state space as NPZ or MAT."""

from pathlib import Path

import numpy as np

from ...ema.identification import Identified
from ...ema.realisation import realised
from ...ema.shapes import shape_sd, shapes
from ...errors import LabelError
from ...output import atomic, write_npz
from .csv_table import write_rows


def write_shape_table(path: str | Path, modes: Identified) -> Path:
    """``label, mode, frequency_hz, real, imag, real_sd, imag_sd`` for every channel and mode.

    Mass-normalised [1/√kg] where a point is both driven and measured, else of largest entry 1,
    which is held: it has no spread of its own.
    """
    found, sd = shapes(modes), shape_sd(modes)

    def write(part: Path) -> None:
        with part.open("w", newline="", encoding="utf-8") as file:
            columns = ("mode", "frequency_hz", "real", "imag", "real_sd", "imag_sd")
            write_rows(file, [("label", *columns)])
            for k, f in enumerate(modes.frequency):
                rows = zip(found.outputs, found.values[:, k], sd[:, k], strict=True)
                for label, value, s in rows:
                    row = map(float, (f, value.real, value.imag, s.real, s.imag))
                    write_rows(file, [(label, k + 1, *row)])

    return atomic(path, write)


def write_state_space(path: str | Path, modes: Identified) -> Path:
    """A, B, C, D and the labels, as NPZ or MATLAB's MAT by the suffix.

    ``control.ss(A, B, C, D)`` of python-control and MATLAB's ``ss(A, B, C, D)`` take them as they
    are; outputs are in the recording's quantity, SI.
    """
    system = realised(modes, modes.quantity)  # type: ignore[arg-type]
    arrays = {
        "A": system.A, "B": system.B, "C": system.C, "D": system.D,
        "outputs": np.array(system.outputs), "inputs": np.array(system.inputs),
        "quantity": np.array(system.quantity),
    }  # fmt: skip
    kind = Path(path).suffix
    if kind == ".npz":
        return write_npz(path, **arrays)
    if kind == ".mat":
        from scipy.io import savemat

        cells = {k: np.array(arrays[k].tolist(), dtype=object) for k in ("outputs", "inputs")}
        return atomic(path, lambda part: savemat(part, arrays | cells, do_compression=True))
    raise LabelError(f"no state space as {kind!r}; .npz or .mat")
