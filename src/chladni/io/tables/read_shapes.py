"""Modal models in: shapes in CSV, NPZ and MAT, and in OP2 and punch files (SI)."""

from collections import Counter
from pathlib import Path

import numpy as np

from ...arrays import measurable
from ...dofs import label
from ...ema.setup import Recording, Shapes
from ...errors import FileError, named
from .array_fields import numbers_of, words_of
from .csv_table import distinct_texts, read_table

_COLUMNS = ("label", "mode", "frequency_hz", "real")
_OPTIONAL = ("imag", "real_sd", "imag_sd", "damping", "frequency_sd_hz")
MODAL = ("frequency_hz", "shapes", "outputs")
MODAL_OPTIONAL = ("damping", "frequency_sd_hz", "shapes_sd")


def read_shape_table(path: str | Path) -> Recording:
    """Modal model from CSV: label, mode, frequency_hz, real; optional imag, sd, damping.

    ``chladni identify`` writes it as shapes.csv.
    """
    table = read_table(Path(path), _COLUMNS, _OPTIONAL)
    labels, i = distinct_texts(table.columns["label"])
    mode, j = np.unique(table.numbers("mode"), return_inverse=True)
    count = np.zeros((len(labels), len(mode)), int)
    np.add.at(count, (i, j), 1)
    if (count != 1).any():
        at, k = (int(v[0]) for v in np.nonzero(count != 1))
        raise FileError(
            f"{table.path.name}: {labels[at]} has {count[at, k]} lines of mode {mode[k]:g}; every "
            "label needs one of every mode"
        )

    def column(name: str, of_mode: bool = False) -> np.ndarray:
        out = np.full(count.shape, np.nan)
        if name in table:
            out[i, j] = table.numbers(name)
        return out[0] if of_mode else out

    values, sd = column("real"), column("real_sd")
    if "imag" in table:
        values = values + 1j * column("imag")
    if "imag_sd" in table:
        sd = np.hypot(sd, column("imag_sd"))
    shapes = Shapes(
        column("frequency_hz", True), column("damping", True), values, labels,
        sd if "real_sd" in table else None, column("frequency_sd_hz", True),
    )  # fmt: skip
    return _modal(table.path, shapes)


def modal_of_arrays(path: Path, arrays: dict[str, np.ndarray]) -> Recording:
    """Modal model of named arrays: shapes (n_out, r)."""
    if missing := [name for name in MODAL if name not in arrays]:
        raise FileError(f"{path.name}: no array {', '.join(missing)}; there are {named(arrays)}")
    each = {n: numbers_of(path, arrays, n).astype(float).ravel()
            for n in ("frequency_hz", "damping", "frequency_sd_hz") if n in arrays}  # fmt: skip
    f, labels = each["frequency_hz"], words_of(path, arrays, "outputs")
    due = (len(labels), len(f))
    both = {n: numbers_of(path, arrays, n, "biufc") for n in ("shapes", "shapes_sd") if n in arrays}
    for name, held in (*both.items(), *each.items()):
        if held.size != (due[0] * due[1] if name in both else due[1]):
            raise FileError(f"{path.name}: {name} is {held.shape}, outputs and modes are {due}")
    damping = each.get("damping", np.full(len(f), np.nan))
    sd = both["shapes_sd"].real.reshape(due) if "shapes_sd" in both else None
    shapes = both["shapes"].reshape(due)
    return _modal(path, Shapes(f, damping, shapes, tuple(labels), sd, each.get("frequency_sd_hz")))


def read_result_modes(path: Path) -> Recording:
    """Normal modes of another program at the translations of its grids."""
    from ..nastran import read_op2_modes, read_punch_modes

    read = (read_op2_modes if path.suffix.lower() == ".op2" else read_punch_modes)(path)
    values = read.shapes[:, :3].reshape(-1, len(read.frequency))
    moves = np.isfinite(values).all(axis=1) & values.any(axis=1)
    dofs = [label(int(n), c) for n in read.ids for c in (1, 2, 3)]
    unknown = np.full(len(read.frequency), np.nan)
    kept = tuple(d for d, m in zip(dofs, moves, strict=True) if m)
    return _modal(path, Shapes(read.frequency, unknown, values[moves], kept))


def _modal(path: Path, shapes: Shapes) -> Recording:
    """A modal model as a recording; its complaints name the file."""
    if twice := [d for d, n in Counter(shapes.dofs).items() if n > 1]:
        raise FileError(f"{path.name}: label {twice[0]} occurs twice")
    if not (np.isfinite(shapes.frequency).all() and (shapes.frequency > 0).any()):
        raise FileError(f"{path.name}: its frequencies are no natural frequencies in Hz")
    if not (measurable(shapes.values).all() and shapes.values.any(axis=0).all()):
        raise FileError(f"{path.name}: a shape is zero or not a number")
    return Recording(path.name, poles=shapes.poles(), shapes=shapes)
