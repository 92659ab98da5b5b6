"""Nastran decks, read whole and without loss: small, large and free fields, includes, comments."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from ....errors import FileError
from .card_layout import BOM, tables
from .cards import carries
from .case_control import CaseControl, case_control
from .part_names import part_names
from .source_files import Source, sources
from .table import Cards, empty, joined


@dataclass(frozen=True, eq=False)
class Deck:
    """A deck: its files as they stand, its cards by name, its case control, its part names."""

    path: Path
    sources: tuple[Source, ...]
    cards: dict[str, Cards]
    case: CaseControl
    names: dict[int, str]
    allowed: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Cards:
        """The cards of this name; an empty table where there are none."""
        return self.cards.get(name) or empty(name, tuple(s.path for s in self.sources))

    def present(self, *names: str) -> Iterator[Cards]:
        """The tables of these names that hold anything."""
        return (self.cards[name] for name in names if name in self.cards)

    def __len__(self) -> int:
        return sum(map(len, self.cards.values()))


def read_deck(path: Path | str, allow: Sequence[str] = ()) -> Deck:
    """Read a deck and all it includes.

    Parameters
    ----------
    path : the deck, or a file of bulk data alone
    allow : names of cards to pass over although they carry stiffness or mass ("CWELD", ...)

    Raises
    ------
    FileError
        Naming file, line and offender: missing files, broken continuations, cards that carry
        stiffness or mass and are not understood.
    """
    path = Path(path)
    files = sources(path)
    cards = _cards(files)
    if not cards:
        raise FileError(f"{path} holds no bulk data")
    deck = Deck(path, files, cards, _case(files), _names(files), tuple(a.upper() for a in allow))
    _refuse_unknown(deck)
    return deck


def _cards(files: tuple[Source, ...]) -> dict[str, Cards]:
    paths = tuple(s.path for s in files)
    found: dict[str, list[Cards]] = {}
    for k, source in enumerate(files):
        try:
            part = tables(source, k, paths)
        except FileError as error:
            where = "" if str(error).startswith(str(source.path)) else f"{source.path}: "
            raise FileError(f"{where}{error}") from None
        for name, table in part.items():
            found.setdefault(name, []).append(table)
    return {name: joined(parts) for name, parts in found.items()}


def _case(files: tuple[Source, ...]) -> CaseControl:
    """Case control of the main file, its own includes read in place."""
    main = files[0]
    first, _ = main.bulk
    text = [line.removeprefix(BOM).decode("latin-1") for line in main.lines[: max(first, 0)]]
    for include in reversed(main.includes):
        target = main.path.parent / include.name
        if include.past <= first and target.is_file():
            text[include.first : include.past] = target.read_text("latin-1").splitlines()
    return case_control(text, sections=first > 0)


def _names(files: tuple[Source, ...]) -> dict[int, str]:
    found: dict[int, str] = {}
    for source in files:
        lines = islice(source.lines, *source.bulk)
        wanted = (t for t in lines if t[:1] in (b"$", b"P", b"p"))
        found.update(part_names(t.decode("utf-8", "replace").rstrip() for t in wanted))
    return found


def _refuse_unknown(deck: Deck) -> None:
    """Refuse what would be left out of stiffness, mass or ties without anybody noticing."""
    for name, table in deck.cards.items():
        if carries(name) and name not in deck.allowed:
            raise FileError(
                f"{table.where(0)}: {name} (of which there are {len(table)}) carries stiffness, "
                f"mass or a tie and is not understood; take it out or allow it: --allow {name}"
            )
    chosen = {m for case in deck.case.subcases for m in case.matrices.items()}
    if chosen and "DMIG" not in deck.allowed:
        name, matrix = sorted(chosen)[0]
        raise FileError(
            f"{deck.path}: the case control selects {name} = {matrix}; direct input "
            "matrices (DMIG) are not understood; allow it: --allow DMIG"
        )
