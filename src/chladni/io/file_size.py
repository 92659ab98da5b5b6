"""Which files may be opened: none above a limit of size, for a case none outside of its folder."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from ..arrays import real_number
from ..errors import FileError

LARGEST = 1.0  # GB; a deck of a million grids has 0.3, an hour of 16 channels at 5 kHz 2.3
OVERRIDE = "CHLADNI_LARGEST_GB"  # of the environment
_within: ContextVar[Path | None] = ContextVar("folder of the files", default=None)


@contextmanager
def files_within(folder: Path | None) -> Iterator[None]:
    """Let readers open no file outside of this folder, their links followed; None: any file."""
    before = _within.set(folder)
    try:
        yield
    finally:
        _within.reset(before)


def lies_within(path: Path, folder: Path) -> bool:
    """True where a file, all links followed, lies in the folder or below it."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # links that lead round in a circle
        return False


def refuse_outside(path: Path, prefix: str = "") -> None:
    """Refuse a file that lies outside of the folder of the case that is read."""
    folder = _within.get()
    if folder is not None and not lies_within(path, folder):
        raise FileError(f"{prefix}{path} {LEADS_OUT}")


LEADS_OUT = (
    "leads out of the folder of the case; copy the file into it, or write outside = true under "
    "[model]"
)


def most_gigabytes() -> float:
    """The limit, which the environment may raise."""
    text = os.environ.get(OVERRIDE, "")
    try:
        return real_number(text) if text else LARGEST
    except ValueError:
        raise FileError(f"{OVERRIDE} = {text[:20]!r} is not a number of gigabytes") from None


def refuse_large(path: Path, size: int | None = None, what: str = "holds") -> None:
    """Refuse a file, or what an archive says it unpacks to, above the limit, and files outside.

    Parameters
    ----------
    size : in bytes, where it is not the file's own
    """
    refuse_outside(path)
    limit = most_gigabytes()
    gigabytes = (path.stat().st_size if size is None else size) / 1e9
    if gigabytes > limit:
        raise FileError(
            f"{path.name} {what} {gigabytes:.3g} GB, more than the limit of {limit:g} GB; "
            f"{OVERRIDE}={int(gigabytes) + 1} in the environment allows it"
        )
