"""From a path to recordings, whether it is a file of a test or a case."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, cast

from ..arguments import checked
from ..dynamics.frf import FRF
from ..ema.setup import Recording
from ..errors import FileError
from .loaded_model import is_case, similar_names

if TYPE_CHECKING:
    from ..case import Case


def read_source(
    source: "Case | str | Path | FRF | Recording | Sequence[FRF | Recording]",
    quantity: str | None = None,
) -> "Case | Sequence[Recording]":
    """Read a case or recordings where a path is given; return what is in memory as it is."""
    if isinstance(source, str | Path):
        from ..case import load_case

        path = Path(source)
        at_case = path.exists() and is_case(path)
        return load_case(path) if at_case else load_recordings(path, quantity)
    if isinstance(source, FRF | Recording):
        source = (source,)
    if not isinstance(source, Sequence):
        return source
    each = cast("Sequence[FRF | Recording]", source)
    names = ["recording", *(f"recording {k + 1}" for k in range(1, len(each)))]
    return [
        Recording(name, frf=one) if isinstance(one, FRF) else one
        for name, one in zip(names, each, strict=False)
    ]


@checked
def load_recordings(source: str | Path, quantity: str | None = None) -> tuple[Recording, ...]:
    """Read the recordings of a file, or all of a case.

    Parameters
    ----------
    source : universal file, NPZ, CSV, MAT or WAV, or a case
    quantity : receptance, mobility, accelerance or transmissibility, where the file does not say it

    Raises
    ------
    FileError
        If there is no such file, or it is no recording.
    """
    from ..io.tables.read_tables import read_recordings

    source = Path(source)
    if not source.exists():
        raise FileError(f"no file or folder {source}{similar_names(source)}")
    if is_case(source):
        from ..case import load_case

        return tuple(load_case(source).recordings)
    return read_recordings(source, quantity)
