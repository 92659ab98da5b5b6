"""A changed deck: the lines whose values changed are changed, all others stay as they are."""

import os
import re
from collections.abc import Sequence
from itertools import count
from pathlib import Path

from ....arguments import checked
from ....errors import FileError
from ....output import atomic
from ....own_folder import own_folder
from ..text.deck import Deck
from ..text.format import card
from ..text.source_files import Include, Source
from ..text.table import Cards
from .changes import Change, plan
from .rewrite_card import raw_lines, rewritten

Lines = dict[int, list[str]]  # new lines in place of a line (from 1)


@checked
def write_deck(
    deck: Deck, path: Path | str, changes: Sequence[Change], home: Path | str | None = None
) -> Path:
    """Write the deck with changes; included files that change are written beside it.

    An included file keeps its relative name where it can; INCLUDE statements are adapted where
    they would no longer find their file. The files that were read are never written to. More
    added lines than the deck has go to a file of their own, which the deck includes.

    Parameters
    ----------
    home : folder the files are moved to afterwards, where that is not the one of ``path``

    Raises
    ------
    FileError
        If ``path`` is one of the files the deck was read from, or a link stands where an included
        file has to go.
    LabelError
        If a change names a card or field that does not exist.
    """
    path = Path(path)
    final = Path(home or path.parent) / path.name
    if final.resolve() in {s.path.resolve() for s in deck.sources}:
        raise FileError(f"{final} is a file the deck was read from; choose another name")
    edits, footer = _edits(deck, changes), _footer(deck, changes)
    if len(footer) > sum(len(s.lines) for s in deck.sources):
        footer = _apart(deck, path, final, footer)
    places = _places(deck, final, {*edits, *([deck.begins] if footer else [])})
    path.parent.mkdir(parents=True, exist_ok=True)
    with own_folder(path.parent) as here:
        for k in sorted(places, reverse=True):
            source = deck.sources[k]
            new = {**edits.get(k, {}), **_includes(deck, source, places[k], places)}
            text = _text(source, new, footer if k == deck.begins else [])
            target = path.parent / places[k].relative_to(final.parent)
            atomic(target, lambda part, text=text: part.write_bytes(text), here)  # type: ignore[misc]
    return path


def changed_lines(deck: Deck, changes: Sequence[Change]) -> list[str]:
    """The changes of ``write_deck`` by line: "- " as it was, "+ " as it is, "@ " where."""
    out, last = [], (-1, 0)
    for k, edits in sorted(_edits(deck, changes).items()):
        source = deck.sources[k]
        for number, new in sorted(edits.items()):
            if last != (k, number - 1):
                out.append(f"@ {source.path.name}, line {number}")
            last = (k, number)
            out.append("- " + source.lines[number - 1].decode("latin-1").rstrip())
            out += [f"+ {line}" for line in new]
    added = [f"+ {line}" for line in _footer(deck, changes)]
    return [*out, *(["@ added", *added] if added else [])]


def _edits(deck: Deck, changes: Sequence[Change]) -> dict[int, Lines]:
    """New lines by file and line number."""
    wanted = plan(deck, changes)
    out: dict[int, Lines] = {}
    for (kind, i), fields in wanted.fields.items():
        if (kind, i) in wanted.whole:
            continue
        cards = deck.cards[kind]
        at, raw = _spelled_out(deck, cards, i)
        for number, new in zip(at, rewritten(kind, raw, cards.fields(i), fields), strict=True):
            if new != [raw[at.index(number)]]:
                out.setdefault(int(cards.file[i]), {})[number] = new
    for (kind, i), values in wanted.whole.items():
        cards = deck.cards[kind]
        at, _ = _spelled_out(deck, cards, i)
        edits = out.setdefault(int(cards.file[i]), {})
        edits.update({number: [] for number in at})
        edits[at[0]] = card(str(values[0]), values[1:]) if values else []
    return out


def _spelled_out(deck: Deck, cards: Cards, i: int) -> tuple[list[int], list[str]]:
    """Lines of a card (numbers, texts); one that stands there by replication has none."""
    at, raw = raw_lines(cards, i, deck.sources[cards.file[i]].lines)
    if "=" in [t.strip() for t in raw[0].replace("==", "=").split(",")] or raw[0][:1] == "=":
        raise cards.refuse(i, "it is replicated (=); write it out before it is changed")
    return at, raw


def _footer(deck: Deck, changes: Sequence[Change]) -> list[str]:
    """Lines of the added cards."""
    out = []
    for change in plan(deck, changes).added:
        out += [f"$ {line}" for line in change.comment.splitlines()]
        for values in change.cards:
            out += card(str(values[0]), values[1:])
    return out


def _apart(deck: Deck, path: Path, final: Path, footer: list[str]) -> list[str]:
    """Write the added lines to a file of their own; the lines that include it."""
    originals = {s.path.resolve() for s in deck.sources}
    stems = (f"{path.stem}_added{k or ''}.bdf" for k in count())
    name = next(n for n in stems if final.with_name(n).resolve() not in originals)
    atomic(path.with_name(name), lambda part: part.write_bytes(b"".join(_ended(footer, b"\n"))))
    said = f"$ {len(footer)} lines were added, more than this deck has; they are in {name}"
    comments = [line for line in footer if line.startswith("$")]
    return [*comments, said, *_statement(name)]


def _text(source: Source, new: Lines, footer: list[str]) -> bytes:
    """The file's bytes with lines replaced and others added at the end of its bulk data."""
    first = source.lines[0] if source.lines else b"\n"
    end = next((e for e in (b"\r\n", b"\r") if first.endswith(e)), b"\n")
    out: list[bytes] = []
    for number, line in enumerate(source.lines, start=1):
        if number == source.bulk[1] + 1:
            out += _ended(footer, end)
        out += _ended(new[number], end) if number in new else [line]
    if source.bulk[1] >= len(source.lines):
        if footer and out and not out[-1].endswith((b"\n", b"\r")):
            out.append(end)
        out += _ended(footer, end)
    return b"".join(out)


def _ended(lines: list[str], end: bytes) -> list[bytes]:
    return [line.encode("latin-1", "replace") + end for line in lines]


def _parents(deck: Deck) -> dict[int, tuple[int, Include]]:
    """{file: (file that includes it, statement)}."""
    return {
        include.file: (k, include)
        for k, source in enumerate(deck.sources)
        for include in source.includes
        if include.file >= 0
    }


def _places(deck: Deck, path: Path, changed: set[int]) -> dict[int, Path]:
    """Where each file that has to be written goes; an including file goes with its included."""
    parents = _parents(deck)
    needed = {0}
    for k in changed:
        while k:
            needed.add(k)
            k = parents[k][0]
    originals = {s.path.resolve() for s in deck.sources}
    out = {0: path}
    for k in sorted(needed - {0}):
        above, include = parents[k]
        name = Path(include.name.replace("\\", "/"))
        inside = not name.is_absolute() and ".." not in name.parts
        target = out[above].parent / (name if inside else name.name)
        if target.resolve() in originals or target in out.values():
            target = target.with_name(f"{target.stem}_{path.stem}_{k}{target.suffix}")
        out[k] = target
    return out


def _includes(deck: Deck, source: Source, place: Path, places: dict[int, Path]) -> Lines:
    """INCLUDE statements that have to say something else from the new place."""
    out: Lines = {}
    for include in source.includes:
        if include.file >= 0:
            wanted = places.get(include.file, deck.sources[include.file].path)
        else:
            wanted = source.path.parent / include.name.replace("\\", "/")
            if not wanted.is_file():
                continue
        now = place.parent / include.name.replace("\\", "/")
        if now.resolve() != wanted.resolve():
            out.update({n + 1: [] for n in range(include.first, include.past)})
            out[include.first + 1] = _statement(_relative(wanted, place.parent))
    return out


def _relative(target: Path, folder: Path) -> str:
    """The way from a folder to a file, absolute where there is none."""
    try:
        return Path(os.path.relpath(target.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return target.resolve().as_posix()


def _statement(name: str) -> list[str]:
    """INCLUDE 'name', over several lines where it is long."""
    pieces = [""]
    for part in re.findall(r"[^/]*/?", name):
        if pieces[-1] and len(pieces[-1]) + len(part) > 60:
            pieces.append("")
        pieces[-1] += part
    pieces[0] = f"INCLUDE '{pieces[0]}"
    pieces[-1] += "'"
    return pieces
