"""A universal file made readable: complete, with end marks and exponents as pyuff wants them."""

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

from ...errors import FileError, named
from ..encoded_text import as_utf8
from ..file_size import refuse_large
from .uff_accumulator import dataset_name

_MARK = re.compile(rb"    -1(?=[\r\n]|\Z| {74})")
_LOOSE = re.compile(rb"(?m)^[ \t]*-1[ \t]*(?=\r?$)")
_FORTRAN = re.compile(rb"(?<=[\d.])[dD](?=[+-]\d)")
_THREE = re.compile(rb"(\d\.\d+)\d([+-]\d{3})(?![\d.])")  # 1.00000-105: no room for the E
_BINARY_FIELDS = ((3, 9), (9, 15), (15, 27), (27, 39))  # behind "58b"
_HEAD_LINES, _IEEE = 11, 2
_REALS = {1: "DEC VMS", 3: "IBM 370"}
_BINARY = re.compile(rb"(?m)^ *58[bB]")


@contextmanager
def readable(path: Path) -> Iterator[Path]:
    """The file itself, or a tidied copy of it that lives as long as it is needed.

    Its text becomes UTF-8, in the heads of binary records too. End marks of text files
    are put into columns 1 to 6, with no blanks behind them. Lines that end in a carriage return
    alone, Fortran's D exponents and those of three digits are mended. The numbers of binary records
    are never touched.
    """
    if not path.is_file():
        near = sorted(p.name for p in path.parent.glob("*.u*") if p.is_file())[:6]
        raise FileError(f"no file {path}; the folder has {named(near)}")
    refuse_large(path)
    data = path.read_bytes()
    tidy = _with_heads_in_utf8(data) if _BINARY.search(data) else as_utf8(_tidied(data))
    marks = len(_MARK.findall(tidy))
    if marks == 0:
        raise FileError(
            f"{path.name} is not a universal file: no line '    -1' in {len(data)} bytes"
        )
    if marks % 2:
        raise FileError(f"{path.name} is truncated: dataset {marks // 2 + 1} has no closing '-1'")
    for number, part in enumerate(_MARK.split(tidy)[1::2], start=1):
        if part.lstrip()[:3].lower() == b"58b":
            _refuse_other_binary(dataset_name(path, number, 58), part)
        else:
            _refuse_untyped(path, number, part)
    if tidy is data:
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_bytes(tidy)
        yield copy


def _with_heads_in_utf8(data: bytes) -> bytes:
    """A file of binary records with its text in UTF-8; the same object where it is."""
    marks = [0, *(m.start() for m in _MARK.finditer(data)), len(data)]
    parts = [data[a:b] for a, b in pairwise(marks)]
    made = [_head_in_utf8(part) for part in parts]
    return data if all(a is b for a, b in zip(parts, made, strict=True)) else b"".join(made)


def _head_in_utf8(part: bytes) -> bytes:
    """A part from its mark on: the whole text, or the head of a binary record."""
    if not _BINARY.search(part):
        return as_utf8(part)
    lines = part.split(b"\n", 2 + _HEAD_LINES)
    head = [as_utf8(line) for line in lines[: 2 + _HEAD_LINES]]
    same = all(a is b for a, b in zip(head, lines, strict=False))
    return part if same else b"\n".join([*head, *lines[2 + _HEAD_LINES :]])


def _refuse_untyped(path: Path, number: int, part: bytes) -> None:
    """Refuse a dataset whose first line is no type: a reader would pass over all of it."""
    first = part.strip().split(b"\n", 1)[0].strip()
    if not first.isdigit():
        said = first[:30].decode("latin-1")
        raise FileError(f"{path.name}: dataset {number} begins with {said!r}, not with its type")


def _refuse_other_binary(where: str, part: bytes) -> None:
    """Refuse a dataset 58b whose first line is not that of what follows it.

    Columns 8 to 43 of the line hold byte order, format of real numbers, lines of head and bytes of
    numbers (SDRC dataset 58b). A count of zero is not stated.
    """
    lines = part.lstrip(b"\r\n ").split(b"\n", 1 + _HEAD_LINES)
    try:
        order, form, head, count = (int(lines[0][a:b].strip() or 0) for a, b in _BINARY_FIELDS)
    except ValueError:
        said = lines[0].decode("latin-1").strip()[:60]
        raise FileError(f"{where}: its first line {said!r} does not hold four counts") from None
    if order not in (1, 2):
        raise FileError(f"{where}: byte order {order} is unknown; it is 1 (little) or 2 (big)")
    if form != _IEEE:
        name = _REALS.get(form, "unknown")
        raise FileError(
            f"{where}: its real numbers are of format {form} ({name}); format {_IEEE} (IEEE 754) "
            "is read: export the file in it, or as text (dataset 58)"
        )
    if head not in (0, _HEAD_LINES):
        raise FileError(f"{where}: it states {head} lines of its head; a head has {_HEAD_LINES}")
    held = b"".join(lines[1 + _HEAD_LINES :])  # one piece, or none
    extra = len(held) - count
    if count and not (0 <= extra <= 2 and not held[count:].strip(b"\r\n")):
        raise FileError(
            f"{where}: it states {count} bytes of numbers, but has {len(held)}; the file is "
            "damaged, or was transferred as text"
        )


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
