"""Files of a run: written under a temporary name and moved, so that nobody sees half a run."""

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from .errors import FileError


def plain(value: Any) -> Any:
    """A value as JSON knows it: arrays become lists, not-a-number becomes null.

    >>> plain({"f": np.array([1.0, np.nan]), "n": np.int64(2), 3: Path("a")})
    {'f': [1.0, None], 'n': 2, '3': 'a'}
    """
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)


def atomic(path: Path | str, write: Callable[[Path], object]) -> Path:
    """Let ``write`` fill a temporary file beside ``path``, of the same suffix, then move it."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(suffix=path.suffix, prefix=".part-", dir=path.parent)
    os.close(handle)
    part = Path(name)
    try:
        write(part)
        part.chmod(0o666 & ~_umask())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return path


def write_text(path: Path | str, text: str) -> Path:
    """Write UTF-8 text."""
    return atomic(path, lambda part: part.write_text(text, encoding="utf-8"))


def write_json(path: Path | str, data: Any) -> Path:
    """Write JSON, numpy values included."""
    return write_text(path, json.dumps(plain(data), indent=1, ensure_ascii=False) + "\n")


def write_npz(path: Path | str, **arrays: np.ndarray) -> Path:
    """Write compressed arrays; texts become fixed-width unicode, so no pickle is needed."""
    held = {name: np.asarray(array) for name, array in arrays.items()}
    if objects := [name for name, array in held.items() if array.dtype.hasobject]:
        raise FileError(f"{path}: {objects} hold Python objects, which would need a pickle")
    return atomic(path, lambda part: np.savez_compressed(part, **held))  # type: ignore[arg-type]


@contextmanager
def run_folder(out: Path | str) -> Iterator[Path]:
    """A scratch folder beside ``out``; its files are moved into ``out`` only if the body succeeds.

    Raises
    ------
    FileError
        If ``out`` is a file, or the place cannot be written to.
    """
    out = Path(out)
    if out.exists() and not out.is_dir():
        raise FileError(f"{out} is a file, --out needs a folder")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=f".{out.name}.part-", dir=out.parent))
    except OSError as error:
        raise FileError(f"{out.parent}: no folder can be made there ({error.strerror})") from error
    try:
        yield part
        _move(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _move(part: Path, out: Path) -> None:
    out.mkdir(exist_ok=True)
    for source in sorted(p for p in part.rglob("*") if p.is_file()):
        target = out / source.relative_to(part)
        target.parent.mkdir(parents=True, exist_ok=True)
        source.replace(target)


def own_version() -> str:
    """Version of this package, where it is installed."""
    try:
        return version("chladni")
    except PackageNotFoundError:
        return "(not installed)"


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
