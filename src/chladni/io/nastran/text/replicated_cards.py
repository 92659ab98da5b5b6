"""Replicated cards: "=" repeats a field of the card above, "*x" adds x, "==" repeats the rest.

MSC Nastran Quick Reference Guide, section 8, Replication. A line "=n" repeats the line above it
n times more.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from ....errors import FileError
from .format import is_free
from .numbers import parse_real

_COUNT = re.compile(rb"^=\s*\(?(\d+)\)?$")
_MOST = 1_000_000
_OF_TEXT = (b"DEQATN", b"DTI")  # cards in which = is a letter like any other


def expanded(lines: Sequence[bytes], path: Path, first: int) -> tuple[list[bytes], list[int]]:
    """(lines with every replicated card written out, the line (from 0) each one comes from)."""
    out: list[bytes] = []
    origin: list[int] = []
    above: list[bytes] = []
    pattern: list[bytes] = []
    name = b""
    for k, line in enumerate(lines, start=first):
        body = line.split(b"$")[0].rstrip()
        if body[:1].isalpha():
            name = body[:8].partition(b",")[0].strip().upper()
        if b"=" not in body or name in _OF_TEXT or not _repeats(body):
            out.append(line)
            origin.append(k)
            if body:
                above, pattern = fields(body), []
            continue
        where = f"{path}:{k + 1}"
        times, pattern = _order(body, pattern, where)
        if not above or above[0] in (b"", b"+", b"*") or len(above) > 9:
            raise FileError(f"{where}: there is no card of one line above this = to repeat")
        for _ in range(times):
            above = _next(above, pattern, where)
            out.append(b",".join(above))
            origin.append(k)
    return out, origin


def _repeats(body: bytes) -> bool:
    """True for a line with a field = or ==, or =n as its first."""
    found = fields(body.lstrip())
    return b"=" in found or b"==" in found or bool(_COUNT.match(found[0]))


def fields(body: bytes) -> list[bytes]:
    """Fields of a line, by commas or by columns of eight, trailing blanks dropped."""
    if is_free(body):
        found = [t.strip() for t in body.split(b",")]
    else:
        body = body.expandtabs(8)[:72]
        found = [body[k : k + 8].strip() for k in range(0, len(body), 8)]
    while found and not found[-1]:
        found.pop()
    return found


def _order(body: bytes, pattern: list[bytes], where: str) -> tuple[int, list[bytes]]:
    """(how often, what) a line that begins with = asks for."""
    found = fields(body.lstrip())
    count = _COUNT.match(found[0])
    if not count:
        return 1, found
    if not pattern or int(count[1]) > _MOST or len(found) > 1:
        raise FileError(f"{where}: {found[0].decode('latin-1')} has no replicated card above it")
    return int(count[1]), pattern


def _next(above: list[bytes], pattern: list[bytes], where: str) -> list[bytes]:
    """The card that follows another by a pattern."""
    new = [above[0] if pattern[0] == b"=" else pattern[0].upper()]
    for k, word in enumerate(pattern[1:], start=1):
        old = above[k] if k < len(above) else b""
        if word == b"==":
            return [*new, *above[k:]]
        if word == b"=":
            new.append(old)
        elif word.startswith(b"*"):
            new.append(_added(old, word[1:].strip(b"()"), where))
        else:
            new.append(word)
    return new


def _added(old: bytes, step: bytes, where: str) -> bytes:
    """Old + step: integers stay integers."""
    if old.lstrip(b"+-").isdigit() and step.lstrip(b"+-").isdigit():
        return str(int(old) + int(step)).encode()
    a, b = (parse_real(t.decode("latin-1")) for t in (old, step))
    if not abs(a + b) < 1e300:
        words = f"{old.decode('latin-1')!r} + {step.decode('latin-1')!r}"
        raise FileError(f"{where}: {words} cannot be added")
    return repr(round(a + b, 12)).encode()
