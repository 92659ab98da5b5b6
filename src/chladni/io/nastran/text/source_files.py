"""The files of a deck as they stand: lines, sections, INCLUDE statements."""

import re
from bisect import bisect_right
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

from ....errors import FileError
from ...file_size import refuse_large

_INCLUDE = re.compile(rb"^[ \t]*include(?=[ \t'\"]|$)", re.IGNORECASE | re.MULTILINE)
_BEGIN = re.compile(rb"^[ \t]*BEGIN\b[ \t,]*(BULK|SUPER|AUXMODEL)?[^\r\n$]*", re.I | re.M)
_CEND = re.compile(rb"^[ \t]*CEND\b", re.I | re.M)
_ENDDATA = re.compile(rb"^[ \t]*ENDDATA", re.I | re.M)
_DEEPEST = 100  # files that include one another


@dataclass(frozen=True)
class Include:
    """One INCLUDE statement: lines [first, past), the name as written, the file it means."""

    first: int
    past: int
    name: str
    file: int  # position in Deck.sources; -1: above BEGIN BULK, so no bulk data


@dataclass(frozen=True, eq=False)
class Source:
    """One file of a deck; ``bulk`` are its bulk-data lines [first, past) (0-based)."""

    path: Path
    lines: tuple[bytes, ...]  # with their line ends
    bulk: tuple[int, int]
    includes: tuple[Include, ...]
    cend: int = -1  # line of CEND, -1: none


def sources(path: Path) -> tuple[Source, ...]:
    """The deck's own file first, then what it includes, depth first."""
    found: list[Source | None] = []
    _load(Path(path), (), found, "")
    return tuple(source for source in found if source is not None)


def _read(path: Path, prefix: str) -> bytes:
    """The bytes of a text file, or one sentence about why not."""
    if path.is_dir():
        raise FileError(f"{prefix}{path} is a folder, not a deck")
    if path.exists() and not path.is_file():
        raise FileError(f"{prefix}{path} is a device or a pipe, not a file")
    try:
        refuse_large(path)
        data = path.read_bytes()
    except OSError as error:
        raise FileError(f"{prefix}{path} cannot be read: {error.strerror}") from None
    if data.count(b"\0", 0, 4096) > 8:
        raise FileError(f"{prefix}{path} is binary, not a Nastran deck")
    if re.match(rb"\s*-1\s*\n\s*\d+", data):
        raise FileError(f"{prefix}{path} is a universal file, not a Nastran deck")
    return data


def _load(path: Path, above: tuple[Path, ...], found: list[Source | None], prefix: str) -> int:
    """Read one file and its includes into ``found``; its position there."""
    try:
        here = path.resolve()
    except (OSError, RuntimeError):  # links that lead round in a circle
        raise FileError(f"{prefix}{path} cannot be read: too many links") from None
    if here in above:
        raise FileError(f"{prefix}{path} includes itself through {above[-1].name}")
    if len(found) > 5000:
        raise FileError(f"{prefix}more than 5000 included files")
    if len(above) > _DEEPEST:
        raise FileError(f"{prefix}includes are nested more than {_DEEPEST} deep")
    data = _read(path, prefix)
    lines = data.splitlines(keepends=True)
    starts = [0, *accumulate(map(len, lines))]
    position = len(found)
    found.append(None)
    bulk, cend = _sections(path, data, starts, main=not above)
    includes = _includes(path, data, lines, starts, (bulk, cend), (*above, here), found)
    found[position] = Source(path, tuple(lines), bulk, includes, cend)
    return position


def _line(starts: list[int], offset: int) -> int:
    return bisect_right(starts, offset) - 1


def _sections(
    path: Path, data: bytes, starts: list[int], main: bool
) -> tuple[tuple[int, int], int]:
    """(bulk lines [first, past), line of CEND); a file with neither is all bulk data."""
    first, cend = 0, -1
    n = len(starts) - 1
    begin = list(_BEGIN.finditer(data)) if main else []
    if main and (mark := _CEND.search(data)):
        cend = _line(starts, mark.start())
        if not begin:
            raise FileError(f"{path}:{cend + 1}: CEND without a BEGIN BULK after it")
    if begin:
        first = _line(starts, begin[0].start()) + 1
        extra = [m for m in begin if re.search(rb"SUPER|AUXMODEL", m[0], re.I)]
        if extra or len(begin) > 1:
            at = _line(starts, (extra or begin[1:])[0].start()) + 1
            raise FileError(f"{path}:{at}: superelement sections (BEGIN SUPER) are not supported")
    end = _ENDDATA.search(data, starts[min(first, n)])
    return (first, _line(starts, end.start()) if end else n), cend


def _includes(
    path: Path,
    data: bytes,
    lines: list[bytes],
    starts: list[int],
    sections: tuple[tuple[int, int], int],
    above: tuple[Path, ...],
    found: list[Source | None],
) -> tuple[Include, ...]:
    """Every INCLUDE before ENDDATA, its file read."""
    (bulk, past), cend = sections
    out: list[Include] = []
    for mark in _INCLUDE.finditer(data):
        first = _line(starts, mark.start())
        if first >= past or (out and first < out[-1].past):
            continue
        name, after = _statement(path, lines, first)
        prefix = f"{path}:{first + 1}: INCLUDE "
        target = _target(name, path, above)
        file = -1
        if first >= bulk:
            file = _load(target, above, found, prefix)
        elif 0 <= cend < first and not target.is_file():
            raise FileError(f"{prefix}{target} does not exist")
        out.append(Include(first, after, name, file))
    return tuple(out)


def _statement(path: Path, lines: list[bytes], first: int) -> tuple[str, int]:
    """(file name, line after the statement); a quoted name may run over several lines."""
    text = lines[first].decode("utf-8", "replace").strip()[len("include") :].strip()
    if not text or text[0] not in "'\"":
        name = text.split("$")[0].strip()
        if not name:
            raise FileError(f"{path}:{first + 1}: INCLUDE names no file")
        return name, first + 1
    quote, text, last = text[0], text[1:], first
    while quote not in text:
        last += 1
        if last >= len(lines) or last > first + 20:
            raise FileError(f"{path}:{first + 1}: the file name of INCLUDE has no closing {quote}")
        text = text.rstrip() + lines[last].decode("utf-8", "replace").strip()
    return text.split(quote)[0].strip(), last + 1


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
