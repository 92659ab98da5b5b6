"""Cards as text: eight columns a field, sixteen where eight would lose what matters."""

from collections.abc import Iterable, Iterator, Sequence

from . import numbers

Value = float | int | str | None
Card = list[Value]  # its name, then its fields


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
