"""Modes of an assembly by CalculiX, an independent code; solutions are kept on disk."""

import hashlib
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from chladni.errors import AccuracyError, FileError
from chladni.model.assembly import Assembly
from chladni.output import write_npz

from .calculix_deck import deck

_NUMBER = r"[-+.\dE]+"
_TABLE = re.compile(rf"^\s+\d+\s+{_NUMBER}\s+{_NUMBER}\s+({_NUMBER})\s+{_NUMBER}\s*$", re.MULTILINE)
_SECONDS = 7200  # a frequency step that takes longer hangs


def installed() -> bool:
    """True where ``ccx`` can be called."""
    return shutil.which("ccx") is not None


def calculix_modes(
    assembly: Assembly, count: int, rows: np.ndarray, cache: Path | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (r,) [Hz] and mass-normalised shapes (k, 3, r) [1/√kg] at rows of points.

    Parameters
    ----------
    cache : folder kept between runs; a deck with the same text is not solved again

    Raises
    ------
    FileError
        If ``ccx`` is not installed.
    AccuracyError
        If CalculiX found no modes; the message quotes the end of its output.
    """
    text = deck(assembly, count, rows)
    kept = (
        None if cache is None else cache / f"{hashlib.sha256(text.encode()).hexdigest()[:24]}.npz"
    )
    if kept is not None and kept.exists():
        with np.load(kept, allow_pickle=False) as held:
            return held["frequency"], held["shapes"]
    with tempfile.TemporaryDirectory() as folder:
        frequency, shapes = _read(_run(text, Path(folder)), count, rows)
    if kept is not None:
        write_npz(kept, frequency=frequency, shapes=shapes)
    return frequency, shapes


def _run(text: str, folder: Path) -> str:
    """Results that ``ccx`` prints for this deck, on one thread."""
    if not installed():
        raise FileError("CalculiX (ccx) is not installed")
    (folder / "job.inp").write_text(text, encoding="ascii")
    run = subprocess.run(
        ["ccx", "job"], cwd=folder, capture_output=True, text=True, timeout=_SECONDS, check=False,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    answer = folder / "job.dat"
    said = answer.read_text(encoding="ascii") if answer.exists() else ""
    if not _TABLE.search(said):
        last = " ".join(run.stdout.split()[-60:])
        raise AccuracyError(f"CalculiX found no modes: {last}")
    return said


def _read(text: str, count: int, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and shapes of a .dat file."""
    frequency = np.array(_TABLE.findall(text)[:count], dtype=float)
    order, shapes = np.unique(rows), []
    for block in text.split("displacements (vx,vy,vz)")[1 : len(frequency) + 1]:
        lines = [line.split() for line in block.splitlines()[1:]]
        table = np.array([line[:4] for line in lines if line and line[0].isdigit()][: len(order)])
        place = np.argsort(table[:, 0].astype(int))
        shapes.append(table[place, 1:].astype(float))
    at = np.searchsorted(order, rows)
    return frequency, np.stack(shapes, axis=-1)[at]
