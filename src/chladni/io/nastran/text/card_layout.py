"""From the lines of a file to its cards: formats, continuations, columns, all lines at once."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ....errors import FileError
from .format import free_fields, is_free
from .numbers import bytes_matrix
from .replicated_cards import expanded
from .source_files import Source
from .table import Cards

_BLANK, _STAR, _PLUS, _COMMA, _DOLLAR, _NO_LETTER = b" *+,$?"
_ARITHMETIC = np.arange(80)


@dataclass(frozen=True, eq=False)
class _Lines:
    """The lines of a file that hold cards."""

    number: np.ndarray  # (m,) int; line numbers from 0
    text: np.ndarray  # (m, 80) uint8; upper case, comments blanked
    tokens: dict[int, list[bytes]]  # of the free-field lines: their fields, the name first
    # free, large, follows: (m,) bool; commas; 16-column fields; a continuation
    free: np.ndarray
    large: np.ndarray
    follows: np.ndarray
    size: np.ndarray  # (m,) int; fields, a multiple of 8, or 4 where large


def tables(source: Source, file: int, files: tuple[Path, ...]) -> dict[str, Cards]:
    """The cards of one file by name."""
    lines = _classified(source)
    if not len(lines.number):
        return {}
    order, card = _linked(lines, source.path)
    names, name_of_card = _named(lines, order, card, source.path)
    offset, card_size = _offsets(lines.size[order], lines.large[order], card)
    out = {}
    which = name_of_card[card]
    sorted_rows = np.split(np.argsort(which, kind="stable"), np.cumsum(np.bincount(which))[:-1])
    for name, mine in zip(names, sorted_rows, strict=True):
        out[name] = _table(name, lines, order[mine], card[mine], offset[mine], card_size, file)
    return {name: replace(cards, files=files) for name, cards in out.items()}


def _classified(source: Source) -> _Lines:
    """Blank out comments, drop empty lines, tell the formats apart."""
    first, past = source.bulk
    raw = [t.expandtabs(8) if b"\t" in t else t for t in source.lines[first:past]]
    origin: np.ndarray = np.arange(first, past)
    if any(b"=" in t and t[:1] != b"$" for t in raw):
        raw, at = expanded(raw, source.path, first)
        origin = np.array(at)
    text = np.zeros((len(raw), 80), np.uint8)
    if raw:
        text = bytes_matrix(np.array(raw, dtype="S80"))
    text = np.where(text < _BLANK, _BLANK, np.where(text > 126, _NO_LETTER, text)).astype(np.uint8)
    text -= 32 * ((text >= ord("a")) & (text <= ord("z"))).astype(np.uint8)
    keep = text != _BLANK
    dollar = np.flatnonzero((text == _DOLLAR).any(axis=1))
    at = (text[dollar] == _DOLLAR).argmax(axis=1)
    text[dollar] = np.where(_ARITHMETIC >= at[:, None], _BLANK, text[dollar])
    keep = (text != _BLANK).any(axis=1)
    names = np.ascontiguousarray(text[:, :8]).view("S8").ravel()
    names = np.strings.rstrip(names) if len(names) else names
    keep &= np.cumsum(names == b"SKIPON") <= np.cumsum(names == b"SKIPOFF")
    keep &= ~np.isin(names, (b"SKIPON", b"SKIPOFF"))
    for include in source.includes:
        keep &= (origin < include.first) | (origin >= include.past)
    number = np.flatnonzero(keep)
    text = text[number]
    commas = np.flatnonzero((text[:, :72] == _COMMA).any(axis=1))
    tokens = {int(i): free_fields(t) for i in commas if is_free(t := raw[number[i]])}
    return _formats(origin[number], text, tokens)


def _formats(number: np.ndarray, text: np.ndarray, tokens: dict[int, list[bytes]]) -> _Lines:
    head = text[:, :8]
    large = (head == _STAR).any(axis=1)
    follows = (head == _BLANK).all(axis=1) | (head[:, 0] == _PLUS) | (head[:, 0] == _STAR)
    free = np.zeros(len(text), bool)
    free[list(tokens)] = True
    size = np.zeros(len(text), int)
    for i, fields in tokens.items():
        large[i] = b"*" in fields[0]
        follows[i] = fields[0][:1] in (b"", b"+", b"*")
        size[i] = len(fields) - 1
    unit = np.where(large, 4, 8)
    size = np.maximum(-(-size // unit), 1) * unit
    return _Lines(number, text, tokens, free, large, follows, size)


def _linked(lines: _Lines, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """(order, card): lines put card after card, and the number of each one's card."""
    if lines.follows[0]:
        raise FileError(f"{path}:{lines.number[0] + 1}: a continuation line with no card before it")
    order = np.arange(len(lines.number))
    strays = _strays(lines)
    if strays:
        order = _chained(lines.follows, strays)
    return order, np.cumsum(~lines.follows[order]) - 1


def _marks(lines: _Lines, columns: slice) -> np.ndarray:
    """(m,) S8 continuation names without their first character, blank on free-field lines."""
    text = np.ascontiguousarray(lines.text[:, columns])
    names = np.strings.strip(text.view(f"S{text.shape[1]}").ravel())
    names[lines.free] = b""
    return names


def _strays(lines: _Lines) -> dict[int, int]:
    """Continuations that name another line than the one above them: {line: line it follows}."""
    asks, names = _marks(lines, slice(73, 80)), _marks(lines, slice(1, 8))
    names = np.where(lines.follows, names, b"")
    differ = np.flatnonzero((names[1:] != b"") & (names[1:] != asks[:-1])) + 1
    if not len(differ):
        return {}
    owner: dict[bytes, int] = {}
    for i in np.flatnonzero(asks != b""):
        owner.setdefault(asks[i], int(i))
    return {int(i): owner[names[i]] for i in differ if names[i] in owner and owner[names[i]] != i}


def _chained(follows: np.ndarray, strays: dict[int, int]) -> np.ndarray:
    """Order of lines in which every continuation comes after the line it belongs to."""
    after: dict[int, list[int]] = {}
    for i in range(1, len(follows)):
        if follows[i]:
            after.setdefault(strays.get(i, i - 1), []).append(i)
    order: list[int] = []
    for card in np.flatnonzero(~follows):
        stack = [int(card)]
        while stack:
            order.append(i := stack.pop())
            stack.extend(sorted(after.get(i, []), key=lambda j: j not in strays))
    return np.array(order)


def _named(
    lines: _Lines, order: np.ndarray, card: np.ndarray, path: Path
) -> tuple[list[str], np.ndarray]:
    """The names present, and which of them each card has."""
    heads = order[~lines.follows[order]]
    text = lines.text[heads, :8]
    text = np.ascontiguousarray(np.where(text == _STAR, _BLANK, text)).astype(np.uint8)
    words = np.strings.strip(text.view("S8").ravel())
    for k in np.flatnonzero(lines.free[heads]):
        words[k] = lines.tokens[int(heads[k])][0].replace(b"*", b"").strip()
    padded = np.ascontiguousarray(words.astype("S8"))
    _, first, inverse = np.unique(padded.view(np.uint64), return_index=True, return_inverse=True)
    names = [_checked(padded[i], path, int(lines.number[heads[i]])) for i in first]
    return names, inverse


def _checked(word: bytes, path: Path, number: int) -> str:
    """The card's name, if it can be one."""
    name = word.decode("latin-1")
    if name.startswith("BEGIN "):
        raise FileError(f"{path}:{number + 1}: superelement sections are not supported")
    if " " in name or not name[:1].isalpha():
        raise FileError(
            f"{path}:{number + 1}: {name!r} is not a card name; fields have columns of 8 or 16, "
            "or are separated by commas"
        )
    return name


def _offsets(
    size: np.ndarray, large: np.ndarray, card: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(first field of each line within its card, fields of each card, a multiple of 8)."""
    total = np.cumsum(size) - size
    head = np.flatnonzero(np.append(True, np.diff(card) > 0))
    offset = total - np.repeat(total[head], np.diff(np.append(head, len(card))))
    for i in np.flatnonzero(~large & (offset % 8 == 4)):
        offset[i:][card[i:] == card[i]] += 4  # a small line begins a new row of eight
    count = np.maximum.reduceat(offset + size, head)
    return offset, -(-count // 8) * 8


def _table(
    name: str,
    lines: _Lines,
    rows: np.ndarray,
    card: np.ndarray,
    offset: np.ndarray,
    card_size: np.ndarray,
    file: int,
) -> Cards:
    """The cards of one name: columns copied in bulk, free-field lines one by one."""
    heads = np.flatnonzero(np.append(True, np.diff(card) > 0))
    start = np.concatenate([[0], np.cumsum(card_size[card[heads]])]).astype(np.int64)
    base = start[np.cumsum(np.append(False, np.diff(card) > 0))] + offset
    free = lines.free[rows]
    long = [len(t) for i in rows[free] for t in lines.tokens[int(i)]]
    width = max(16 if np.any(lines.large[rows]) else 8, *long, 8)
    text = np.zeros(start[-1], f"S{min(width, 80)}")
    for large, columns in ((False, 8), (True, 4)):
        which = (lines.large[rows] == large) & ~free
        body = np.ascontiguousarray(lines.text[rows[which], 8:72]).view(f"S{64 // columns}")
        text[base[which, None] + np.arange(columns)] = body
    for i in np.flatnonzero(free):
        fields = lines.tokens[int(rows[i])][1:]
        text[base[i] : base[i] + len(fields)] = fields
    line_start = np.append(heads, len(rows)).astype(np.int64)
    number = lines.number[rows] + 1
    files = np.full(len(heads), file)
    return Cards(name, np.strings.strip(text), start, files, number, line_start)
