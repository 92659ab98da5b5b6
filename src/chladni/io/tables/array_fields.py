"""Named arrays of a file as numbers and words, or a sentence that names the file."""

from pathlib import Path

import numpy as np

from ...errors import FileError


def numbers_of(
    path: Path, arrays: dict[str, np.ndarray], name: str, kinds: str = "biuf"
) -> np.ndarray:
    """An array of numbers of these kinds."""
    if arrays[name].dtype.kind not in kinds:
        kind = "records" if arrays[name].dtype.names else str(arrays[name].dtype)
        raise FileError(f"{path.name}: {name} has {kind}, not numbers")
    return arrays[name]


def words_of(path: Path, arrays: dict[str, np.ndarray], name: str) -> list[str]:
    """An array of texts in a row; bytes are read as UTF-8, numbers as they are written."""
    found = np.atleast_1d(arrays[name])
    if found.ndim != 1 or found.dtype.names:
        kind = "records" if found.dtype.names else f"an array of {found.ndim} dimensions"
        raise FileError(f"{path.name}: {name} has {kind}, not a row of texts")
    if found.dtype.kind == "S":
        found = np.char.decode(found, "utf-8", "replace")
    return [str(text) for text in found]


def word_of(path: Path, arrays: dict[str, np.ndarray], name: str) -> str:
    """A single text, alone or as the only one of a row."""
    found = words_of(path, arrays, name)
    if len(found) != 1:
        raise FileError(f"{path.name}: {name} has {len(found)} texts; it must be one")
    return found[0]
