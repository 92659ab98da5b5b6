"""A universal file made readable: complete, with end marks and exponents as pyuff wants them."""

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...errors import FileError, named
from ..file_size import refuse_large

_MARK = re.compile(rb"    -1(?=[\r\n]|\Z| {74})")
_LOOSE = re.compile(rb"(?m)^[ \t]*-1[ \t]*(?=\r?$)")
_FORTRAN = re.compile(rb"(?<=[\d.])[dD](?=[+-]\d)")
_THREE = re.compile(rb"(\d\.\d+)\d([+-]\d{3})(?![\d.])")  # 1.00000-105: no room for the E
_BINARY = re.compile(rb"(?m)^ *58[bB]")


@contextmanager
def readable(path: Path) -> Iterator[Path]:
    """The file itself, or a tidied copy of it that lives as long as it is needed.

    Text files with end marks that are not in columns 1 to 6, or followed by some blanks, with lines
    that end in a carriage return alone, and with Fortran's D exponents or those of three digits are
    tidied; binary records are never touched.

    Raises
    ------
    FileError
        If there is no such file, it is no universal file, or its last dataset has no end.
    """
    if not path.is_file():
        near = sorted(p.name for p in path.parent.glob("*.u*") if p.is_file())[:6]
        raise FileError(f"no file {path}; beside it there are {named(near)}")
    refuse_large(path)
    data = path.read_bytes()
    tidy = data if _BINARY.search(data) else _tidied(data)
    marks = len(_MARK.findall(tidy))
    if marks == 0:
        raise FileError(f"{path.name} is no universal file: no line '    -1' in {len(data)} bytes")
    if marks % 2:
        raise FileError(f"{path.name} is truncated: dataset {marks // 2 + 1} has no closing '-1'")
    if not _BINARY.search(data):
        _refuse_untyped(path, tidy)
    if tidy is data:
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_bytes(tidy)
        yield copy


def _refuse_untyped(path: Path, data: bytes) -> None:
    """Refuse a dataset whose first line is no type: a reader would pass over all of it."""
    for k, part in enumerate(_MARK.split(data)[1::2], start=1):
        first = part.strip().split(b"\n", 1)[0].strip()
        if not first.isdigit():
            said = first[:30].decode("latin-1")
            raise FileError(f"{path.name}: dataset {k} begins with {said!r}, not with its type")


def _tidied(data: bytes) -> bytes:
    """The same object where nothing is to be done."""
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    strict, loose = len(_MARK.findall(data)), len(_LOOSE.findall(data))
    if (strict == 0 or strict % 2) and loose % 2 == 0:
        data = _LOOSE.sub(b"    -1", data)
    if _FORTRAN.search(data):
        data = _FORTRAN.sub(b"E", data)
    if _THREE.search(data):
        data = _THREE.sub(rb"\1E\2", data)  # as wide as before, for columns are fixed
    return data
