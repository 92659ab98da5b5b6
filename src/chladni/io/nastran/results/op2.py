"""OP2 and OP4 files, by way of pyYeti where it is installed."""

import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import numpy as np

from ....errors import FileError
from ...damage import DAMAGED
from ...file_size import refuse_large
from .punch import PunchModes

T = TypeVar("T")
_TABLES = ("OUGV1", "OUG1", "BOPHIG")  # in the deck's displacement frames
_WORD = 4  # bytes of a word of these tables
_OTHERWISE = (
    "give the modes as a punch file (DISPLACEMENT(PUNCH) = ALL) or a universal file (dataset 55)"
)


def read_op2_modes(path: Path | str) -> PunchModes:
    """Eigenvectors of an OP2 file (PARAM,POST,-1), in the deck's units and displacement frames.

    Raises
    ------
    FileError
        If pyYeti is absent, or the file holds no eigenvectors it can read.
    """
    modal = _read(path, "op2", _eigenvectors)
    if not modal:
        raise FileError(
            f"{path} has no real eigenvectors (tables {', '.join(_TABLES)}); {_OTHERWISE}"
        )
    dofs, phi = np.asarray(modal[0]["dof"], np.int64), np.asarray(modal[0]["ougv1"])
    ids, row = np.unique(dofs[:, 0], return_inverse=True)
    shapes = np.full((len(ids), 6, phi.shape[1]), np.nan)
    shapes[row, np.maximum(dofs[:, 1], 1) - 1] = phi
    return PunchModes(np.sqrt(np.maximum(modal[0]["lambda"], 0)) / (2 * np.pi), ids, shapes)


def read_op4(path: Path | str) -> dict[str, np.ndarray]:
    """Matrices of an OP4 file by name (lower case).

    Raises
    ------
    FileError
        If pyYeti is absent or cannot read the file.
    """
    held = _read(path, "op4", lambda module, at: module.read(str(at), sparse=False))
    return {str(name): np.asarray(matrix) for name, matrix in held.items()}


def _eigenvectors(module: ModuleType, path: Path | str) -> list[dict[str, Any]]:
    """Tables of real eigenvectors alone: tables that other programs write differently stay shut."""
    found = []
    with module.OP2(str(path)) as file:
        for name, blocks in file.directory(verbose=False).items():
            for block in blocks if name.startswith(_TABLES) else ():
                if file._ibytes != _WORD:
                    raise ValueError("its words have 64 bits")
                file._fileh.seek(block.start)
                file.rdop2nt()
                found.append(file._rdop2ougv1(name))
    return [table for table in found if table is not None]


def _read(path: Path | str, kind: str, read: Callable[[ModuleType, Path | str], T]) -> T:
    if found := Path(path).is_file():
        refuse_large(Path(path))
    try:
        if kind == "op2":
            from pyyeti.nastran import op2 as module
        else:
            from pyyeti.nastran import op4 as module
    except ImportError:
        raise FileError(
            f"reading {kind.upper()} files needs pyYeti: pip install 'chladni[nastran]'"
        ) from None
    if not found:
        raise FileError(f"{path} does not exist")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the library's own making
        try:
            return read(module, path)
        except (*DAMAGED, UnicodeDecodeError) as error:
            first = str(error).splitlines()[0] if str(error) else type(error).__name__
            way = f"; {_OTHERWISE}" if kind == "op2" else ""
            raise FileError(
                f"{path} cannot be read by pyYeti as {kind.upper()}: {first}{way}"
            ) from error
