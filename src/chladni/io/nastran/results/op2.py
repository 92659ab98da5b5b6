"""OP2 and OP4 files, by way of pyYeti where it is installed."""

import warnings
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ....errors import FileError
from ...file_size import refuse_large
from .punch import PunchModes


def read_op2_modes(path: Path | str) -> PunchModes:
    """Eigenvectors of an OP2 file (PARAM,POST,-1), in the deck's units and displacement frames.

    Raises
    ------
    FileError
        If pyYeti is absent, or the file holds no eigenvectors it can read.
    """
    tables = (_read(path, "op2").get("mats") or {}).get("ougv1") or []
    modal = [t for t in tables if t is not None and "lambda" in t]
    if not modal:
        raise FileError(f"{path} has no eigenvectors (OUGV1)")
    dofs, phi = np.asarray(modal[0]["dof"], np.int64), np.asarray(modal[0]["ougv1"])
    ids, row = np.unique(dofs[:, 0], return_inverse=True)
    shapes = np.full((len(ids), 6, phi.shape[1]), np.nan)
    shapes[row, np.maximum(dofs[:, 1], 1) - 1] = phi.real
    return PunchModes(np.sqrt(np.maximum(modal[0]["lambda"], 0)) / (2 * np.pi), ids, shapes)


def read_op4(path: Path | str) -> dict[str, np.ndarray]:
    """Matrices of an OP4 file by name (lower case).

    Raises
    ------
    FileError
        If pyYeti is absent or cannot read the file.
    """
    return {str(name): np.asarray(matrix) for name, matrix in _read(path, "op4").items()}


def _module(name: str) -> ModuleType:
    try:
        if name == "op2":
            from pyyeti.nastran import op2 as module
        else:
            from pyyeti.nastran import op4 as module
    except ImportError:
        raise FileError(
            f"reading {name.upper()} files needs pyYeti: pip install 'chladni[nastran]'"
        ) from None
    return module  # type: ignore[no-any-return]


def _read(path: Path | str, kind: str) -> dict[str, Any]:
    if found := Path(path).is_file():
        refuse_large(Path(path))
    module = _module(kind)
    if not found:
        raise FileError(f"{path} does not exist")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the library's own making
        try:
            if kind == "op2":
                return dict(module.rdpostop2(str(path), getougv1=True))
            return dict(module.read(str(path), sparse=False))
        except (ValueError, KeyError, IndexError, RuntimeError, OSError, TypeError) as error:
            first = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise FileError(
                f"{path} cannot be read by pyYeti as {kind.upper()}: {first}"
            ) from error
