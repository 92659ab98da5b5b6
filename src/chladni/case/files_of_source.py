"""The files a command reads: a deck with what it includes, a recording, all that a case names."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import ChladniError
from ..io.nastran.text.source_files import sources
from ..io.tables.read_tables import ENDINGS


def files_of(source: Path) -> tuple[Path, ...]:
    """As many of them as can be told; what is wrong with one is for its reader to say."""
    case = source / "case.toml" if source.is_dir() else source
    if case.suffix == ".toml":
        return (case, *(p for name in _named(case) for p in _deck(case.parent / name)))
    return _deck(source)


def _deck(path: Path) -> tuple[Path, ...]:
    if path.suffix.lower() in ENDINGS or not path.is_file():
        return (path,)
    try:
        return tuple(s.path for s in sources(path))
    except ChladniError:
        return (path,)


def _named(case: Path) -> Iterator[str]:
    """Every text of a case that may be a file's name."""
    try:
        values = tomllib.loads(case.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return
    model, test, more = (values.get(name) for name in ("model", "test", "recording"))
    tables: list[Any] = [model, test, *(more if isinstance(more, list) else [])]
    for table in tables:
        for key in ("deck", "sensors", "file", "recordings"):
            found = table.get(key) if isinstance(table, dict) else None
            texts = found if isinstance(found, list) else [found]
            yield from (text for text in texts if isinstance(text, str) and "\0" not in text)
