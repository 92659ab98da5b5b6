"""Cards as text: eight columns a field, sixteen where eight would lose what matters, or commas."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from . import numbers

Value = float | int | str | None
Card = list[Value]  # its name, then its fields


def is_free(line: bytes) -> bool:
    """True where commas separate the fields: one stands behind the name, or behind nothing.

    >>> is_free(b"GRID,1"), is_free(b",2.5"), is_free(b"DEQATN  7       F(A,B)=A+B")
    (True, True, False)
    """
    head, comma, _ = line.partition(b"$")[0][:72].partition(b",")
    return bool(comma) and len(head.split()) < 2 and (not head.strip() or not head[:8].isspace())


def free_fields(line: bytes) -> list[bytes]:
    """Name and fields of a free-field line; those beyond field 9 belong to the next line.

    A continuation mark in field 10 is no field.

    >>> free_fields(b"SPC1, 1, 3, 11, 12, 13, 14, 15, 16, +A $ edge")
    [b'SPC1', b'1', b'3', b'11', b'12', b'13', b'14', b'15', b'16']
    """
    found = [t.strip() for t in line.split(b"$")[0].upper().split(b",")]
    last = 5 if b"*" in found[0] else 9
    while len(found) > last and not found[-1]:
        found.pop()
    if len(found) == last + 1 and found[last][:1] in (b"+", b"*"):
        word = found[last].decode("latin-1")
        real = "." in word and not np.isnan(numbers.parse_real(word))
        return found if real else found[:last]
    return found


def card(name: str, values: Sequence[Value], tolerance: float = 1e-6) -> list[str]:
    """Lines of one card, small fields unless a value would lose more than ``tolerance``.

    >>> card("PSHELL", [101, 7, 0.8, 7, None, 7])
    ['PSHELL       101       7      .8       7               7']
    >>> card("PSHELL", [101, 7, -0.008123456789])
    ['PSHELL*              101               7  -.008123456789', '*']
    """
    texts = [numbers.fitted(v, 8, tolerance) for v in values]
    if None in texts:
        return lines(name, [numbers.field(v, 16) for v in values], large=True)
    return lines(name, [t for t in texts if t is not None], large=False)


def texts(cards: Iterable[Sequence[Value]], tolerance: float = 1e-6) -> Iterator[str]:
    """Lines of some cards, each with its name first."""
    for name, *values in cards:
        yield from card(str(name), values, tolerance)


def lines(name: str, texts: Sequence[str], large: bool) -> list[str]:
    """The lines of a card from its fields' texts; trailing blanks are dropped."""
    texts = list(texts)
    while texts and not texts[-1]:
        texts.pop()
    width, count = (16, 4) if large else (8, 8)
    rows = [texts[k : k + count] for k in range(0, len(texts), count)] or [[]]
    if large and len(rows) % 2:
        rows.append([])
    out = []
    for k, row in enumerate(rows):
        head = (name + "*" if large else name) if k == 0 else ("*" if large else "+")
        body = "".join(t.rjust(width) for t in row)
        out.append((head.ljust(8) + body).rstrip())
    return out
