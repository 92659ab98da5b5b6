"""How large a file may be: more is refused before it is opened, unless the user raises it."""

import os
from pathlib import Path

from ..arrays import real_number
from ..errors import FileError

LARGEST = 1.0  # GB; a deck of a million grids has 0.3, an hour of 16 channels at 5 kHz 2.3
OVERRIDE = "CHLADNI_LARGEST_GB"  # of the environment


def most_gigabytes() -> float:
    """The limit, which the environment may raise.

    Raises
    ------
    FileError
        If what the environment says is no number.
    """
    text = os.environ.get(OVERRIDE, "")
    try:
        return real_number(text) if text else LARGEST
    except ValueError:
        raise FileError(f"{OVERRIDE} = {text[:20]!r} is not a number of gigabytes") from None


def refuse_large(path: Path, size: int | None = None, what: str = "holds") -> None:
    """Refuse a file, or what an archive says it unpacks to, above the limit.

    Parameters
    ----------
    size : in bytes, where it is not the file's own

    Raises
    ------
    FileError
        With the variable that lets the file in.
    """
    limit = most_gigabytes()
    gigabytes = (path.stat().st_size if size is None else size) / 1e9
    if gigabytes > limit:
        raise FileError(
            f"{path.name} {what} {gigabytes:.3g} GB, more than the limit of {limit:g} GB; "
            f"{OVERRIDE}={int(gigabytes) + 1} in the environment allows it"
        )
