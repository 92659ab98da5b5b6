"""A picture in hand: a notebook shows it, a script writes it."""

from dataclasses import dataclass
from pathlib import Path

from ..output import atomic


@dataclass(frozen=True)
class DrawnPicture:
    """A picture as PNG."""

    png: bytes

    def _repr_png_(self) -> bytes:
        """What a notebook shows (IPython's rich display protocol)."""
        return self.png

    def save(self, path: Path | str) -> Path:
        """Write the PNG."""
        return atomic(path, lambda part: part.write_bytes(self.png))
