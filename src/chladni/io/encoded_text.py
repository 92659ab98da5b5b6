"""Encodings of text files: UTF-8, UTF-16 with its mark, else the CP1252 of Windows programs."""

import codecs
from pathlib import Path

from ..errors import FileError, not_text

WINDOWS = "cp1252"
_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_PIECE = 1 << 20  # characters read at a time


def encoding_of(path: Path) -> str:
    """Encoding in which a whole file can be read."""
    with path.open("rb") as file:
        if file.read(2) in _MARKS:
            return "utf-16"
    for encoding in ("utf-8-sig", WINDOWS):
        try:
            with path.open(encoding=encoding) as text:
                while text.read(_PIECE):
                    pass
        except UnicodeDecodeError:
            continue
        return encoding
    try:
        path.read_bytes().decode()
    except UnicodeDecodeError as error:
        raise FileError(f"{path.name} is {not_text(error)}") from error
    raise FileError(f"{path.name} is not text")


def as_utf8(data: bytes) -> bytes:
    r"""Bytes of text in UTF-8; what is not UTF-8 is read as CP1252, the same object where it is.

    >>> as_utf8(b"m/s\xb2").decode(), as_utf8("µm".encode()).decode()
    ('m/s²', 'µm')
    """
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode(WINDOWS, "replace").encode()
    return data
