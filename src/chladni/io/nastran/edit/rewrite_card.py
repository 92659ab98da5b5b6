"""One card with other values: only the lines that hold them change, as long as they fit."""

from collections.abc import Sequence

from ..text import numbers
from ..text.format import Value, free_fields, is_free, lines
from ..text.table import Cards

_TOLERANCE = 1e-6


def rewritten(
    name: str, raw: Sequence[str], texts: Sequence[str], changes: dict[int, Value]
) -> list[list[str]]:
    """New lines in place of each old one.

    Parameters
    ----------
    raw : the card's lines without their ends
    texts : the card's fields as read
    changes : new values by position, 1 being the first field after the name

    Where a value loses more than 1e-6 in the columns it has, the whole card takes wide fields.
    """
    out = [[line if _free(line) else line.expandtabs(8)] for line in raw]
    spans = _spans([line[0] for line in out])
    beyond: dict[int, str] = {}
    for position, value in sorted(changes.items()):
        k = next((i for i, (a, b, _) in enumerate(spans) if a < position <= b), -1)
        text = numbers.fitted(value, spans[k][2] if k >= 0 else 8, _TOLERANCE)
        if text is None:
            return [lines(name, _all(texts, changes), large=True), *[[] for _ in raw[1:]]]
        if k < 0:
            beyond[position] = text
        else:
            out[k][0] = _placed(out[k][0], position - spans[k][0], text)
    if beyond and not _appended(out, spans, beyond):
        return [lines(name, _all(texts, changes), large=True), *[[] for _ in raw[1:]]]
    return out


def _free(line: str) -> bool:
    return is_free(line.encode("latin-1"))


def _spans(raw: Sequence[str]) -> list[tuple[int, int, int]]:
    """(fields before a line, fields up to its end, columns a field) of every line."""
    out, done = [], 0
    for line in raw:
        head = line.split(",")[0] if _free(line) else line[:8]
        large = "*" in head
        if not large:
            done = -(-done // 8) * 8
        count = 4 if large else 8
        if _free(line):  # with fields of lines that it goes on for
            given = len(free_fields(line.encode("latin-1"))) - 1
            count *= max(-(-given // count), 1)
        out.append((done, done + count, 16 if large else 8))
        done += count
    return out


def _placed(line: str, k: int, text: str) -> str:
    """The line with its k-th field (from 1) changed."""
    if _free(line):
        body, dollar, rest = line.partition("$")
        tokens = body.split(",")
        tokens += [""] * (k + 1 - len(tokens))
        tokens[k] = text
        return ",".join(tokens) + dollar + rest
    width = 16 if "*" in line[:8] else 8
    first = 8 + (k - 1) * width
    body, dollar, rest = line.partition("$")
    if dollar and len(body) < 72:  # a comment inside the columns moves behind them
        body, rest = body.ljust(73), rest
    body = body.ljust(first + width)
    return (body[:first] + text.rjust(width) + body[first + width :] + dollar + rest).rstrip()


def _appended(
    out: list[list[str]], spans: list[tuple[int, int, int]], beyond: dict[int, str]
) -> bool:
    """Put fields behind the last line; False where that needs the card written anew."""
    last = out[-1][0]
    if spans[-1][2] != 8:
        return False
    done = spans[-1][1]
    row = 8 * ((max(beyond) - done - 1) // 8 + 1)
    texts = [beyond.get(done + k, "") for k in range(1, row + 1)]
    if _free(last):
        if "$" in last or last.rstrip(", ").count(",") > 8:
            return False
        out[-1][0] = last.rstrip(", ")
        out[-1] += ["," + ",".join(texts[k : k + 8]).rstrip(",") for k in range(0, row, 8)]
        return True
    mark = "+" + last[73:80].strip() if last[72:80].strip() else "+"
    for k in range(0, row, 8):
        body = "".join(t.rjust(8) for t in texts[k : k + 8])
        out[-1].append((mark.ljust(8) + body).rstrip())
        mark = "+"
    return True


def _all(texts: Sequence[str], changes: dict[int, Value]) -> list[str]:
    """Every field's text, wide where it changed."""
    new = list(texts) + [""] * (max(changes) - len(texts))
    for position, value in changes.items():
        new[position - 1] = numbers.field(value, 16)
    return new


def raw_lines(cards: Cards, i: int, source: Sequence[bytes]) -> tuple[list[int], list[str]]:
    """(line numbers from 1, texts without line ends) of card i."""
    at = cards.lines[cards.line_start[i] : cards.line_start[i + 1]].tolist()
    return at, [source[k - 1].rstrip(b"\r\n").decode("latin-1") for k in at]
