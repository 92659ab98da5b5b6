"""Identified modes for other programs: shapes as a table, the state space as NPZ or MAT."""

import csv
from pathlib import Path

import numpy as np

from ...ema.identification import Identified
from ...ema.realisation import realised
from ...ema.shapes import shapes
from ...errors import LabelError
from ...output import atomic, write_npz


def write_shape_table(path: str | Path, modes: Identified) -> Path:
    """``label, mode, frequency_hz, real, imag`` for every channel and mode.

    Mass-normalised [1/√kg] where a point is both driven and measured, else of largest entry 1.
    """
    found = shapes(modes)

    def write(part: Path) -> None:
        with part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["label", "mode", "frequency_hz", "real", "imag"])
            for k, f in enumerate(modes.frequency):
                for label, value in zip(found.outputs, found.values[:, k], strict=True):
                    row = (float(f), float(value.real), float(value.imag))
                    writer.writerow([label, k + 1, *map(repr, row)])

    return atomic(path, write)


def write_state_space(path: str | Path, modes: Identified) -> Path:
    """A, B, C, D and the labels, as NPZ or MATLAB's MAT by the suffix.

    ``control.ss(A, B, C, D)`` of python-control and MATLAB's ``ss(A, B, C, D)`` take them as they
    are; outputs are in the recording's quantity, SI.

    Raises
    ------
    LabelError
        If the quantity has no state space, or the suffix is another.
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
