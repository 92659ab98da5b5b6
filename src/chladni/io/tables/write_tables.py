"""Recordings as tables out: what `tables` reads, every digit kept."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from ...arguments import checked
from ...dynamics.frf import FRF
from ...ema.level_table import LevelTable
from ...ema.setup import PoleTable
from ...output import atomic
from .csv_table import write_rows


@checked
def write_npz(path: str | Path, frf: FRF) -> None:
    """Write responses as NPZ, every digit kept.

    Parameters
    ----------
    path : file, replaced if there
    frf : its arrays as ``frequency_hz`` (n_f,) [Hz], ``values`` (n_f, n_out, n_in), ``outputs``,
        ``inputs``, ``quantity``, ``coherence``, ``variance``
    """
    arrays: dict[str, Any] = dict(
        frequency_hz=frf.frequency,
        values=frf.values,
        outputs=np.array(frf.outputs),
        inputs=np.array(frf.inputs),
        quantity=np.array(frf.quantity),
    )
    for name in ("coherence", "variance"):
        if getattr(frf, name) is not None:
            arrays[name] = getattr(frf, name)
    _replace(path, "wb", lambda file: np.savez_compressed(file, **arrays))


@checked
def write_csv(path: str | Path, frf: FRF) -> None:
    """Write responses as CSV, one row per line and channel, every digit kept.

    Parameters
    ----------
    path : file, replaced if there
    frf : in columns ``frequency_hz``, ``output``, ``input``, ``real``, ``imag``, and ``coherence``
        and ``variance`` where it has them
    """
    extra = [name for name in ("coherence", "variance") if getattr(frf, name) is not None]

    def rows(file: IO) -> None:
        write_rows(file, [["frequency_hz", "output", "input", "real", "imag", *extra]])
        for j, input in enumerate(frf.inputs):
            for i, output in enumerate(frf.outputs):
                columns = [frf.values[:, i, j].real, frf.values[:, i, j].imag]
                columns += [getattr(frf, name)[:, i, j] for name in extra]
                each = zip(frf.frequency.tolist(), *(c.tolist() for c in columns), strict=True)
                write_rows(file, ([f, output, input, *row] for f, *row in each))

    _replace(path, "w", rows)


def write_poles(path: str | Path, poles: PoleTable) -> None:
    """Poles as CSV; what is unknown stays an empty cell."""

    def rows(file: IO) -> None:
        write_rows(file, [["mode", "frequency_hz", "frequency_sd_hz", "damping", "state"]])
        known = lambda v: "" if np.isnan(v) else float(v)  # noqa: E731
        table = (poles.mode, poles.frequency, poles.frequency_sd, poles.damping, poles.state)
        for mode, f, sd, zeta, state in zip(*table, strict=True):
            write_rows(file, [[int(mode), float(f), known(sd), known(zeta), state]])

    _replace(path, "w", rows)


def write_levels(path: str | Path, tables: Sequence[LevelTable]) -> None:
    """Modes over levels as CSV, one row per mode and level at which it was found."""
    columns = (
        "level", "amplitude_m", "frequency_hz", "frequency_sd_hz", "frequency_low_hz",
        "frequency_high_hz", "damping", "damping_sd", "damping_low", "damping_high",
    )  # fmt: skip

    def rows(file: IO) -> None:
        write_rows(file, [["mode", "output", *columns, "signature"]])
        for k, table in enumerate(tables, 1):
            for row in table.rows:
                values = (repr(getattr(row, name)) for name in columns)
                write_rows(file, [[k, table.output, *values, table.signature]])

    _replace(path, "w", rows)


def _replace(path: str | Path, mode: str, write: Callable[[IO], object]) -> None:
    """Write through an open file, whole or not at all."""
    text: dict[str, Any] = {} if "b" in mode else {"encoding": "utf-8", "newline": ""}

    def opened(part: Path) -> None:
        with part.open(mode, **text) as file:
            write(file)

    atomic(path, opened)
