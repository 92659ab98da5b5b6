"""The files a command reads: a deck with what it includes, a recording, all that a case names."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import ChladniError
from ..io.nastran.text.source_files import sources
from ..io.tables.read_tables import ENDINGS
from .schema import SCHEMA

_FILES = [(k.section, k.name) for k in SCHEMA if k.kind in ("file", "list of files")]


def files_of(source: Path) -> tuple[Path, ...]:
    """The files of a source that are known without reading them; readers report their errors."""
    case = source / "case.toml" if source.is_dir() else source
    if case.suffix == ".toml":
        return (case, *_of_case(case))
    return _deck(source)


def _deck(path: Path) -> tuple[Path, ...]:
    if path.suffix.lower() in ENDINGS or not path.is_file():
        return (path,)
    try:
        return tuple(s.path for s in sources(path).sources)
    except ChladniError:
        return (path,)


def _of_case(case: Path) -> Iterator[Path]:
    """Every file that a word of a case names."""
    try:
        values = tomllib.loads(case.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return
    for section, word in _FILES:
        for table in _listed(values.get(section)):
            found = table.get(word) if isinstance(table, dict) else None
            for name in _listed(found):
                if isinstance(name, str) and "\0" not in name:
                    path = case.parent / name
                    yield from _deck(path) if word == "deck" else (path,)


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]
