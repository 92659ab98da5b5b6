"""From a path to recordings, whether it is a file of a test or a case."""

from pathlib import Path

from ..ema.setup import Recording
from ..errors import FileError
from .loaded_model import is_case, similar_names


def load_recordings(source: str | Path, quantity: str | None = None) -> tuple[Recording, ...]:
    """The recordings of a file, or all of a case.

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
