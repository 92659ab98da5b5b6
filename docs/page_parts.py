"""Pieces of Markdown that the written pages share."""

import inspect
import re
from collections.abc import Iterable, Sequence
from textwrap import dedent

BY = "*This page is written by the program itself, from {}.*\n"
_LITERAL = re.compile(r"(^ *)?::\n\n((?: {4}.*(?:\n|$)|\n(?= {4}))+)", re.MULTILINE)


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; a bar in a cell is escaped, a line break becomes a space."""
    lines = [heads, ["---"] * len(heads), *rows]
    cells = ([re.sub(r"\s+", " ", str(c)).replace("|", r"\|") for c in row] for row in lines)
    return "\n".join(f"| {' | '.join(row)} |" for row in cells) + "\n"


def plain(text: str | None) -> str:
    """A docstring as Markdown: its literal blocks, its code and its roles."""
    text = inspect.cleandoc((text or "").replace("\b", ""))  # a mark of the command line
    text = _LITERAL.sub(_fenced, text).replace("``", "`")
    return re.sub(r":(?:class|func|meth|mod):`~?([^`]+)`", r"`\1`", text)


def _fenced(found: re.Match[str]) -> str:
    """An indented block after a double colon."""
    colon = ":" if found[1] is None else ""
    return f"{colon}\n\n~~~python\n{dedent(found[2]).rstrip()}\n~~~\n"


def summary(text: str | None) -> str:
    """First paragraph of a docstring."""
    return plain(text).split("\n\n")[0]
