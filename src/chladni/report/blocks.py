"""Building blocks of a page: titled sections of text, tables, facts and pictures."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import FileError
from .drawings import Drawings

_MIME = {".png": "image/png", ".gif": "image/gif", ".svg": "image/svg+xml", ".jpg": "image/jpeg"}


@dataclass(frozen=True)
class Text:
    """Paragraphs."""

    paragraphs: Sequence[str]
    kind: str = "text"


@dataclass(frozen=True)
class Items:
    """A list of sentences."""

    items: Sequence[str]
    kind: str = "items"


@dataclass(frozen=True)
class Facts:
    """Main numbers: (name, value)."""

    facts: Sequence[tuple[str, str]]
    kind: str = "facts"


@dataclass(frozen=True)
class Table:
    """Rows of ready-made text; columns named in ``words`` are words, the others numbers."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: Sequence[str] = ()
    caption: str = ""
    kind: str = "table"


@dataclass(frozen=True)
class Picture:
    """A PNG, GIF, SVG or JPEG that is embedded in the page."""

    path: Path
    caption: str = ""
    wide: bool = True
    kind: str = "picture"

    @property
    def uri(self) -> str:
        """The picture as a data URI."""
        mime = _MIME.get(self.path.suffix.lower())
        if mime is None:
            raise FileError(f"{self.path} is no picture a page can hold; use {', '.join(_MIME)}")
        try:
            data = self.path.read_bytes()
        except OSError as error:
            raise FileError(f"picture {self.path} cannot be read: {error.strerror}") from error
        return f"data:{mime};base64,{b64encode(data).decode('ascii')}"

    @property
    def width(self) -> int | None:
        """Width on a screen [px] at which its letters are about those of the text; PNG only."""
        head = self.path.read_bytes()[:24]
        if head[:8] != b"\x89PNG\r\n\x1a\n":
            return None
        return round(int.from_bytes(head[16:20], "big") / 1.9)


@dataclass(frozen=True)
class Live:
    """A drawing by the page; its pictures replace it on paper and without scripts.

    ``name`` is the one of its numbers, ``draw`` the function of ``page.js`` that draws them.
    """

    name: str
    draw: str
    pictures: Sequence[Picture] = ()
    caption: str = ""
    kind: str = "live"


@dataclass(frozen=True)
class Links:
    """Files in the folder of the page: (name, description)."""

    files: Sequence[tuple[str, str]]
    kind: str = "links"


@dataclass(frozen=True)
class Code:
    """Commands, word for word."""

    lines: Sequence[str]
    kind: str = "code"


Block = Text | Items | Facts | Table | Picture | Live | Links | Code


@dataclass(frozen=True)
class Section:
    """A heading with its blocks; a section without blocks is left out."""

    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class PageParts:
    """Contents of a result for the page of its command.

    Attributes
    ----------
    lead : the result in one sentence
    files : (name, description) of the files written with the page
    drawings : drawings by the page itself, by the names in its sections
    """

    lead: str
    sections: Sequence[Section] = ()
    notes: Sequence[str] = ()
    files: Sequence[tuple[str, str]] = ()
    drawings: Drawings = field(default_factory=Drawings)
