"""Building blocks of a page: titled sections of text, tables, facts and pictures."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FileError
from ..view.chart import Chart

if TYPE_CHECKING:
    from .shown import Shown

Still = Callable[[Path], object]  # draws a picture at a path

_MIME = {".png": "image/png", ".gif": "image/gif", ".svg": "image/svg+xml", ".jpg": "image/jpeg"}


@dataclass(frozen=True)
class Text:
    """Paragraphs."""

    paragraphs: Sequence[str]


@dataclass(frozen=True)
class Items:
    """A list of sentences."""

    items: Sequence[str]


@dataclass(frozen=True)
class Facts:
    """Main numbers: (name, value)."""

    facts: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Table:
    """Rows of ready-made text; columns named in ``words`` are words, the others numbers."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: Sequence[str] = ()
    caption: str = ""
    opens: str = ""  # drawing that a click on a row opens
    at: Sequence[int | None] = ()  # part of it that belongs to each row: a mode, a channel
    links: Sequence[str] = ()  # page to which the first cell of each row leads

    def opened(self, row: int) -> int | None:
        """The part that a click on a row opens."""
        return self.at[row] if self.opens and row < len(self.at) else None


@dataclass(frozen=True)
class Picture:
    """A PNG, GIF, SVG or JPEG that is embedded in the page."""

    path: Path
    caption: str = ""
    wide: bool = True

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


@dataclass(frozen=True, eq=False)
class Spatial:
    """Numbers for the function of ``page.js`` that draws them on the mesh."""

    draw: str  # name of the function
    data: Mapping[str, Any]  # plain numbers and texts
    shown: Shown  # the structure, which all drawings of a page share


@dataclass(frozen=True, eq=False)
class Drawing:
    """A drawing by the page, and the pictures that stand for it on paper and without scripts.

    They are drawn where a user asks for pictures, or the page cannot draw.
    """

    name: str
    content: Chart | Spatial | Mapping[str, Any] | None  # a mapping: as a page held it; None: no
    caption: str = ""
    stills: Mapping[str, Still] | None = None  # by the name of the file; None: the chart's own
    what: str = ""  # the pictures are, in the list of files
    first: str = ""  # still of the first screen, which every page holds
    place: str = ""  # section of a diagnosis
    wide: bool = True  # False: next to another one, where there is room

    @property
    def pictures(self) -> Mapping[str, Still]:
        """Functions that draw the pictures, by name."""
        if self.stills is None and isinstance(self.content, Chart):
            return {self.name: still(self.content)}
        return self.stills or {}

    @property
    def draws(self) -> str:
        """The function of ``page.js``."""
        if isinstance(self.content, Mapping):
            return str(self.content["draw"])
        return self.content.draw if isinstance(self.content, Spatial) else "chart"


def still(chart: Chart) -> Still:
    """The chart as a picture."""

    def draw(path: Path) -> Path:
        from ..view.chart_png import png

        return png(chart, path)

    return draw


@dataclass(frozen=True)
class Links:
    """Files in the folder of the page: (name, description)."""

    files: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Code:
    """Commands, word for word."""

    lines: Sequence[str]


Block = Text | Items | Facts | Table | Picture | Drawing | Links | Code
_HELD = {
    Text: "paragraphs", Items: "items", Facts: "facts", Table: "rows", Links: "files", Code: "lines"
}  # fmt: skip


@dataclass(frozen=True)
class Section:
    """A heading with its blocks; empty blocks, and a section without blocks, are left out."""

    title: str
    blocks: Sequence[Block]
    folded: str = ""  # its summary, where a reader opens the section

    def __post_init__(self) -> None:
        held = [b for b in self.blocks if type(b) not in _HELD or getattr(b, _HELD[type(b)])]
        object.__setattr__(self, "blocks", held)


@dataclass(frozen=True)
class PageParts:
    """Contents of a result for the page of its command."""

    lead: str  # the result in one sentence
    sections: Sequence[Section] = ()
    notes: Sequence[str] = ()
    files: Sequence[tuple[str, str]] = ()  # (name, description) of the files written with the page


def drawings(sections: Sequence[Section]) -> Iterator[Drawing]:
    """The drawings of a page in its order."""
    yield from (b for s in sections for b in s.blocks if isinstance(b, Drawing))


def write_pictures(folder: Path, shown: Iterable[Drawing], every: bool) -> list[tuple[str, str]]:
    """Draw every picture, or those that a page needs; return (file, what it is) of each."""
    files = []
    for d in shown:
        for name, draw in d.pictures.items():
            if every or d.content is None or name == d.first:
                draw(folder / f"{name}.png")
                files.append((f"{name}.png", d.what or name.replace("_", " ")))
    return files
