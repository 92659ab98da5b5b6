"""A picture in memory, which a notebook shows and a script saves."""

from dataclasses import dataclass
from pathlib import Path

from ..output import atomic


@dataclass(frozen=True)
class DrawnPicture:
    """A picture as PNG."""

    png: bytes

    def _repr_png_(self) -> bytes:
        """The PNG for a notebook (IPython's rich display protocol)."""
        return self.png

    def save(self, path: Path | str) -> Path:
        """Write the PNG."""
        return atomic(path, lambda part: part.write_bytes(self.png))
