"""The files a command reads: a deck with what it includes, a recording, all that a case names."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import ChladniError
from ..io.file_size import files_within, lies_within
from ..io.nastran.text.source_files import sources
from ..io.tables.read_tables import ENDINGS
from .schema import SCHEMA

_FILES = [(k.section, k.name) for k in SCHEMA if k.in_words.startswith(("file", "list of files"))]


def files_of(source: Path) -> tuple[Path, ...]:
    """The files of a source that are known without reading them; readers report their errors."""
    case = source / "case.toml" if source.is_dir() else source
    if case.suffix == ".toml":
        return (case, *_of_case(case))
    return _deck(source)


def _deck(path: Path) -> tuple[Path, ...]:
    try:
        if path.suffix.lower() in ENDINGS or not path.is_file():
            return (path,)
        return tuple(s.path for s in sources(path).sources)
    except (ChladniError, OSError):
        return (path,)


def _of_case(case: Path) -> Iterator[Path]:
    """Every file that a word of a case names."""
    try:
        values = tomllib.loads(case.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return
    model = values.get("model")
    outside = isinstance(model, dict) and model.get("outside") is True
    with files_within(None if outside else case.parent):
        yield from _named_by(case, values, outside)


def _named_by(case: Path, values: dict[str, Any], outside: bool) -> Iterator[Path]:
    for section, word in _FILES:
        for table in _listed(values.get(section)):
            found = table.get(word) if isinstance(table, dict) else None
            for name in _listed(found):
                if isinstance(name, str) and "\0" not in name:
                    path = case.parent / name
                    opened = word == "deck" and (outside or lies_within(path, case.parent))
                    yield from _deck(path) if opened else (path,)


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]
