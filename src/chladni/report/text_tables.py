"""Tables and facts of a page as plain text, for a terminal or a summary."""

import textwrap
from collections.abc import Iterator, Sequence
from itertools import zip_longest

from .blocks import Facts, Section, Table

ROWS = 24  # of a table; the page has them all
_CELL, _LAST = 56, 110  # characters of a cell's line, and of a sentence's at the end of a row


def section_lines(sections: Sequence[Section]) -> list[str]:
    """The facts and tables of sections, each under its title.

    >>> section_lines([Section("Sheet", [Facts([("Mass", "2 kg")])])])
    ['', 'Sheet', 'Mass: 2 kg']
    """
    out: list[str] = []
    for section in sections:
        for block in section.blocks:
            if isinstance(block, Facts) and block.facts:
                out += ["", section.title, *(f"{name}: {value}" for name, value in block.facts)]
            if isinstance(block, Table) and block.rows:
                caption = f": {block.caption}" if block.caption else ""
                out += ["", f"{section.title}{caption}", *table_lines(block)]
    return out


def table_lines(table: Table, most: int = ROWS) -> list[str]:
    """The lines of a table: words to the left, numbers to the right, long words over several lines.

    >>> table_lines(Table(("mode", "Hz"), [("1", "5.2"), ("2", "11.4")]))
    ['mode    Hz', '   1   5.2', '   2  11.4']
    """
    shown = [tuple(table.columns), *(tuple(row) for row in table.rows[:most])]
    cells = [[*map(_cell, row[:-1]), *(_cell(text, _LAST) for text in row[-1:])] for row in shown]
    width = [
        max(len(line) for cell in column for line in cell) for column in zip(*cells, strict=True)
    ]
    left = [name in table.words for name in table.columns]
    lines = [
        "  ".join(_aligned(line, width, left)).rstrip()
        for row in cells
        for line in zip_longest(*row, fillvalue="")
    ]
    if (more := len(table.rows) - most) > 0:
        lines.append(f"report.html has {more} more rows")
    return lines


def _cell(text: object, most: int = _CELL) -> list[str]:
    """The lines of a cell; a word is never cut."""
    return textwrap.wrap(str(text), most, break_long_words=False, break_on_hyphens=False) or [""]


def _aligned(row: Sequence[str], width: Sequence[int], left: Sequence[bool]) -> Iterator[str]:
    for text, n, is_word in zip(row, width, left, strict=True):
        yield text.ljust(n) if is_word else text.rjust(n)
