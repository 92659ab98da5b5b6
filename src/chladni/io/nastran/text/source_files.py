"""The files of a deck as they stand: lines, sections, INCLUDE statements at any depth."""

import re
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import accumulate
from pathlib import Path

from ....arrays import OneScreen
from ....errors import FileError
from ...file_size import refuse_large, refuse_outside
from ...mesh_format import refuse_foreign

BOM = b"\xef\xbb\xbf"  # some editors begin a file with it
_UTF16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
_INCLUDE = re.compile(rb"^[ \t]*include(?=[ \t'\"]|$)", re.IGNORECASE | re.MULTILINE)
_BEGIN = re.compile(rb"^[ \t]*BEGIN\b[ \t,]*(BULK|SUPER|AUXMODEL)?[^\n$]*", re.I | re.M)
_CEND = re.compile(rb"^[ \t]*CEND\b", re.I | re.M)
_ENDDATA = re.compile(rb"^[ \t]*ENDDATA", re.I | re.M)
_PADDING = re.compile(rb"\0+(?=[\r\n]|\Z)")
_NO_TEXT = re.compile(rb"[\x01-\x08\x0e-\x19\x1b-\x1f]")  # 0x1a ends a file of DOS
_DEEPEST = 100  # files that include one another


@dataclass(frozen=True)
class Include:
    """One INCLUDE statement: lines [first, past), the name as written, the file it means."""

    first: int
    past: int
    name: str
    file: int  # position in DeckFiles.sources; -1: absent, as alters above CEND may be


@dataclass(frozen=True, eq=False, repr=False)
class Source(OneScreen):
    """One file of a deck; ``bulk`` are its bulk-data lines [first, past) (0-based)."""

    path: Path
    lines: tuple[bytes, ...]  # with their line ends
    bulk: tuple[int, int]
    includes: tuple[Include, ...]


@dataclass(frozen=True, eq=False)
class DeckFiles:
    """All files of a deck."""

    sources: tuple[Source, ...]  # the deck's own file first, then what it includes, depth first
    # (file:line, text) of executive and case control, includes in place
    control: tuple[tuple[str, str], ...]
    begins: int  # position of the file with BEGIN BULK; -1: all is bulk data


def sources(path: Path) -> DeckFiles:
    """Read the deck and all it includes."""
    deck = _DeckReading(Path(path))
    deck.load(deck.path, (), "")
    found = tuple(source for source in deck.found if source is not None)
    if deck.cend and deck.begins < 0:
        raise FileError(f"{deck.cend}: CEND without a BEGIN BULK after it")
    return DeckFiles(found, tuple(deck.control), deck.begins)


@dataclass
class _DeckReading:
    """The files of a deck while they are gone through in the solver's order."""

    path: Path
    found: list[Source | None] = field(default_factory=list)
    control: list[tuple[str, str]] = field(default_factory=list)
    cend: str = ""  # file:line of CEND
    begins: int = -1
    bulk: bool = False  # behind BEGIN BULK, or in a deck without it
    texts: dict[Path, bytes] = field(default_factory=dict)

    def load(self, path: Path, above: tuple[Path, ...], prefix: str) -> int:
        """Read one file and its includes into ``found``; its position there."""
        here = _entered(path, above, prefix)
        if len(self.found) > 5000:
            raise FileError(f"{prefix}more than 5000 included files")
        file = _File(path, self._text(path, prefix), len(self.found))
        if not above:
            self.bulk = not self._begins(file, (here,))
        self.found.append(None)
        bulk = self._read(file, (*above, here))
        self.found[file.position] = Source(path, file.lines, bulk, tuple(file.includes))
        return file.position

    def _text(self, path: Path, prefix: str) -> bytes:
        if path not in self.texts:
            self.texts[path] = _read(path, prefix)
        return self.texts[path]

    def _begins(self, file: "_File", above: tuple[Path, ...]) -> bool:
        """True where a file, or one that it includes, has an executive or case control."""
        if _BEGIN.search(file.searched) or _CEND.search(file.searched):
            return True
        for first in file.statements():
            name, _ = file.statement(first)
            target = _target(name, file.path, above)
            refuse_outside(target, f"{file.path}:{first + 1}: INCLUDE ")
            here = _entered(target, (), "") if target.is_file() else file.path
            if target.is_file() and here not in above and len(above) <= _DEEPEST:
                data = self._text(target, f"{file.path}:{first + 1}: INCLUDE ")
                if self._begins(_File(target, data, 0), (*above, here)):
                    return True
        return False

    def _read(self, file: "_File", above: tuple[Path, ...]) -> tuple[int, int]:
        """The bulk-data lines of a file, its includes read in passing."""
        first = done = 0
        begin = -1 if self.bulk else self._sections(file)
        past = file.end(max(begin, 0))
        for at in file.statements():
            if at >= past or at < done:
                continue
            if not self.bulk and 0 <= begin <= at:
                self._keep(file, done, begin)
                first = self._begin(file, begin)
            name, after = file.statement(at)
            was = self.bulk
            if not was:
                self._keep(file, done, at)
            self._include(file, at, after, name, above)
            done = after
            if self.bulk and not was:  # BEGIN BULK stood in the included file
                first = after
        if not self.bulk:
            self._keep(file, done, begin if begin >= 0 else len(file.lines))
            first = self._begin(file, begin) if begin >= 0 else len(file.lines)
            past = max(past, first)
        return first, past

    def _sections(self, file: "_File") -> int:
        """Line of BEGIN BULK below CEND, -1 where the file has none."""
        text = file.searched
        start = 0
        if not self.cend and (mark := _CEND.search(text)):
            start = mark.start()
            file.cend = file.line(start)
            self.cend = f"{file.path}:{file.cend + 1}"
        begin = list(_BEGIN.finditer(text, start))
        extra = [m for m in begin if re.search(rb"SUPER|AUXMODEL", m[0], re.I)]
        if extra or len(begin) > 1:
            at = file.line((extra or begin[1:])[0].start()) + 1
            raise FileError(
                f"{file.path}:{at}: superelement sections (BEGIN SUPER) are not supported"
            )
        return file.line(begin[0].start()) if begin else -1

    def _begin(self, file: "_File", line: int) -> int:
        """Enter the bulk data; its first line."""
        self.bulk, self.begins = True, file.position
        return line + 1

    def _keep(self, file: "_File", first: int, past: int) -> None:
        """Keep lines of executive and case control."""
        for k in range(first, past):
            self.control.append((f"{file.path}:{k + 1}", file.lines[k].decode("latin-1")))

    def _include(
        self, file: "_File", first: int, after: int, name: str, above: tuple[Path, ...]
    ) -> None:
        prefix = f"{file.path}:{first + 1}: INCLUDE "
        target = _target(name, file.path, above)
        refuse_outside(target, prefix)
        position = -1
        if self.bulk or target.is_file():
            position = self.load(target, above, prefix)
        elif self.cend and first > file.cend:  # above it alters may be absent
            raise FileError(f"{prefix}{target} does not exist")
        file.includes.append(Include(first, after, name, position))


class _File:
    """One file being read: its lines, and a copy of its bytes in which every line ends in LF."""

    def __init__(self, path: Path, data: bytes, position: int) -> None:
        self.path, self.position = path, position
        self.searched = data.replace(b"\r", b"\n")
        self.lines = tuple(data.splitlines(keepends=True))
        self.starts = [0, *accumulate(map(len, self.lines))]
        self.includes: list[Include] = []
        self.cend = -1

    def line(self, offset: int) -> int:
        """Line (from 0) of a byte."""
        return bisect_right(self.starts, offset) - 1

    def end(self, first: int) -> int:
        """Line of ENDDATA from a line on, else the number of lines."""
        n = len(self.lines)
        end = _ENDDATA.search(self.searched, self.starts[min(first, n)])
        return self.line(end.start()) if end else n

    def statements(self) -> list[int]:
        """Lines on which an INCLUDE begins."""
        return [self.line(mark.start()) for mark in _INCLUDE.finditer(self.searched)]

    def statement(self, first: int) -> tuple[str, int]:
        """(file name, line after the statement); a quoted name may run over several lines."""
        text = text_of(self.lines[first]).strip()[len("include") :].strip()
        if not text or text[0] not in "'\"":
            name = text.split("$")[0].strip()
            if not name:
                raise FileError(f"{self.path}:{first + 1}: INCLUDE names no file")
            return name, first + 1
        quote, text, last = text[0], text[1:], first
        while quote not in text:
            last += 1
            if last >= len(self.lines) or last > first + 20:
                why = f"the file name of INCLUDE has no closing {quote}"
                raise FileError(f"{self.path}:{first + 1}: {why}")
            text = text.rstrip() + text_of(self.lines[last]).strip()
        return text.split(quote)[0].strip(), last + 1


def _entered(path: Path, above: tuple[Path, ...], prefix: str) -> Path:
    """The file in full, if it does not include itself and is not nested too deep."""
    try:
        here = path.resolve()
    except (OSError, RuntimeError):  # links that lead round in a circle
        raise FileError(f"{prefix}{path} cannot be read: too many links") from None
    if here in above:
        raise FileError(f"{prefix}{path} includes itself through {above[-1].name}")
    if len(above) > _DEEPEST:
        raise FileError(f"{prefix}includes are nested more than {_DEEPEST} deep")
    return here


def _read(path: Path, prefix: str) -> bytes:
    """The bytes of a text file, or one sentence about why not."""
    if path.is_dir():
        raise FileError(f"{prefix}{path} is a folder, not a deck")
    if path.exists() and not path.is_file():
        raise FileError(f"{prefix}{path} is a device or a pipe, not a file")
    try:
        refuse_large(path)
        refuse_foreign(path, prefix)
        data = path.read_bytes()
        if code := _UTF16.get(data[:2]) or _utf16_unmarked(data[:400]):
            data = data.decode(code, "replace").lstrip("\ufeff").encode("utf-8")
        data = data.replace(BOM, b"")
        if b"\0" in data:  # it pads lines or the end of a file
            data = _PADDING.sub(b"", data).replace(b"\0", b" ")
    except OSError as error:
        raise FileError(f"{prefix}{path} cannot be read: {error.strerror}") from None
    if len(_NO_TEXT.findall(data, 0, 4096)) > 8:
        raise FileError(f"{prefix}{path} is binary, not a Nastran deck")
    return data


def _utf16_unmarked(head: bytes) -> str:
    """The code of plain text of which every other byte is zero, else nothing."""
    even, odd = (head[k::2].count(0) / max(len(head), 1) for k in (0, 1))
    return "utf-16-le" if even < 0.2 < 0.4 < odd else "utf-16-be" if odd < 0.2 < 0.4 < even else ""


def text_of(line: bytes) -> str:
    """A line as UTF-8, else as Latin-1."""
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")


def _target(name: str, path: Path, above: tuple[Path, ...]) -> Path:
    """The file meant: relative to the including file, else to the deck itself."""
    if "\0" in name or not name:
        raise FileError(f"{path}: INCLUDE names no file")
    wanted = Path(name.replace("\\", "/"))
    places = [folder / wanted for folder in (path.parent, above[0].parent)]
    try:
        found = next((p for p in places if p.is_file()), None)
        return found or _spelled_otherwise(places[0]) or places[0]
    except OSError:
        raise FileError(f"{path}: INCLUDE {name[:80]!r} is not a file name") from None


def _spelled_otherwise(path: Path) -> Path | None:
    """The only file of this name in other capitals; decks come from systems that ignore them."""
    if not path.parent.is_dir():
        return None
    alike = [p for p in path.parent.iterdir() if p.name.lower() == path.name.lower()]
    return alike[0] if len(alike) == 1 and alike[0].is_file() else None
