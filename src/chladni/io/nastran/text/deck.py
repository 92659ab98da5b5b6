"""Nastran decks, read whole and without loss: small, large and free fields, includes, comments."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from ....arguments import checked
from ....arrays import OneScreen
from ....errors import FileError, named, nearest
from .card_layout import tables
from .cards import FIELDS
from .case_control import CaseControl, case_control
from .known_cards import FOLLOWS_TEMPERATURE, SELECTED, counted, known, refusal
from .known_commands import MEANINGS, SELECTS, harmless, selects_one, sets_material_temperature
from .numbers import parse_real
from .part_names import part_names
from .source_files import Source, sources, text_of
from .table import Cards, empty, joined

SCALED = frozenset("CB1 CB2 CK1 CK2 CK3 CM1 CM2".split())  # PARAM that scale whole matrices


@dataclass(frozen=True, eq=False, repr=False)
class Deck(OneScreen):
    """A deck: its files as they stand, its cards by name, its case control, its part names."""

    path: Path
    sources: tuple[Source, ...]
    cards: dict[str, Cards]
    case: CaseControl
    names: dict[int, str]
    begins: int = 0  # position of the file in which the bulk data begin
    allowed: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Cards:
        """The cards of this name; an empty table where there are none."""
        return self.cards.get(name) or empty(name, tuple(s.path for s in self.sources))

    def present(self, *names: str) -> Iterator[Cards]:
        """The tables of these names that hold anything."""
        return (self.cards[name] for name in names if name in self.cards)

    def __len__(self) -> int:
        return sum(map(len, self.cards.values()))


@checked
def read_deck(path: Path | str, allow: Sequence[str] = ()) -> Deck:
    """Read a deck and all it includes.

    Parameters
    ----------
    path : the deck, or a file of bulk data alone
    allow : names of cards and commands to pass over whatever they carry ("CWELD", ...)

    Raises
    ------
    FileError
        Naming file, line and offender: missing files, broken continuations, cards and commands of
        the case control that are not known to leave the structure as it is.
    """
    deck = parsed_deck(path, allow)
    refuse_unknown(deck, unknown(deck))
    return deck


def parsed_deck(path: Path | str, allow: Sequence[str] = ()) -> Deck:
    """A deck with all that stands in it, whether it is understood or not."""
    path = Path(path)
    files = sources(path)
    paths = tuple(s.path for s in files.sources)
    found: dict[str, list[Cards]] = {}
    for k, source in enumerate(files.sources):
        try:
            part = tables(source, k, paths)
        except FileError as error:
            where = "" if str(error).startswith(str(source.path)) else f"{source.path}: "
            raise FileError(f"{where}{error}") from None
        for name, table in part.items():
            found.setdefault(name, []).append(table)
    cards = {name: joined(parts) for name, parts in found.items()}
    if not cards:
        raise FileError(f"{path} has no bulk data")
    case = case_control(files.control, sections=files.begins >= 0)
    names, allowed = _names(files.sources), tuple(a.upper() for a in allow)
    return Deck(path, files.sources, cards, case, names, max(files.begins, 0), allowed)


def _names(files: tuple[Source, ...]) -> dict[int, str]:
    found: dict[int, str] = {}
    for source in files:
        lines = islice(source.lines, *source.bulk)
        wanted = (t for t in lines if t[:1] in (b"$", b"P", b"p"))
        found.update(part_names(text_of(t).rstrip() for t in wanted))
    count = Counter(found.values())
    return {id: name if count[name] == 1 else f"{name} ({id})" for id, name in found.items()}


@dataclass(frozen=True)
class Unknown:
    """Something that would be left out of stiffness, mass or ties without anybody noticing."""

    name: str  # with which it may be allowed
    where: str  # file:line
    why: str


def unknown(deck: Deck) -> tuple[Unknown, ...]:
    """All that is not understood of a deck, cards first."""
    every = (*_cards_unknown(deck), *_scaled(deck), *_matrices(deck), *_commands_unknown(deck))
    return tuple(one for one in every if one.name not in deck.allowed)


def refuse_unknown(deck: Deck, found: Sequence[Unknown]) -> None:
    """Refuse everything that is not understood in one sentence."""
    if not found:
        return
    names = list(dict.fromkeys(one.name for one in found))
    if len(found) == 1:
        one = found[0]
        raise FileError(f"{one.where}: {one.why}{_allowing(one.name)}")
    said = [_subject(one, deck) for one in found]
    listed = ", ".join(f'"{name}"' for name in names[:_MOST])
    options = " ".join(f"--allow {name}" for name in names[:_MOST])
    raise FileError(
        f"{deck.path}: {len(found)} kinds of cards and commands are not understood: "
        f"{named(said, _MOST)}; take them out or allow them: [model] allow = [{listed}] of a case, "
        f"{options}"
    )


_MOST = 40  # names in one sentence


def _subject(one: Unknown, deck: Deck) -> str:
    """Its name, count and meaning, and where it stands: the line alone in the deck's own file."""
    path, _, line = one.where.rpartition(":")
    place = f"line {line}" if path == str(deck.path) and line.isdecimal() else one.where
    said = one.why.partition(" is not understood")[0].removesuffix(" of the case control")
    return f"{said[:-1]}, {place})" if said.endswith(")") else f"{said} ({place})"


def _cards_unknown(deck: Deck) -> Iterator[Unknown]:
    shown = 0
    for name, table in deck.cards.items():
        if known(name) or (name in SELECTED and deck.case.present):
            continue
        shown += 1  # what is meant is looked for where it will be said
        why = refusal(name, len(table)) if shown <= _MOST else name
        unsaid = ", and no case control says whether it acts" if name in SELECTED else ""
        yield Unknown(name, table.where(0), f"{why}{unsaid}")


def _scaled(deck: Deck) -> Iterator[Unknown]:
    """PARAM that scale whole matrices."""
    parameters = deck["PARAM"]
    for i, word in enumerate(parameters.words(1).tolist()):
        name = word.decode("latin-1")
        if name in SCALED and parse_real(parameters.word(i, 2)) != 1.0:
            yield Unknown(name, parameters.where(i), f"PARAM {name}: {name} scales a matrix")
    for name in sorted(SCALED & deck.case.parameters.keys()):
        if parse_real(deck.case.parameters[name]) != 1.0:
            yield Unknown(name, str(deck.path), f"PARAM,{name} scales a matrix")


def _matrices(deck: Deck) -> Iterator[Unknown]:
    chosen = {m for case in deck.case.subcases for m in case.matrices.items()}
    for name, matrix in sorted(chosen)[:1]:
        why = f"the case control selects {name} = {matrix}; direct input matrices (DMIG) are not"
        yield Unknown("DMIG", str(deck.path), f"{why} understood")


def _commands_unknown(deck: Deck) -> Iterator[Unknown]:
    """Commands that might choose other supports, masses or joints."""
    if not deck.case.present:
        for cards in deck.present("TEMP", "TEMPD"):
            why = f"the case control does not select {cards.name} sets"
            yield from _followers(deck, cards.where(0), why)
    seen: set[str] = set()
    for command in deck.case.commands:
        name, where = command.name, command.where
        if name in seen or command.plots:
            continue
        if name in SELECTS:
            if not selects_one(command):
                raise FileError(f"{where}: {_no_set(deck, name, command.text)}")
        elif sets_material_temperature(command):
            yield from _followers(deck, where, f"{command.text.strip()!r} chooses")
        elif not harmless(name):
            seen.add(name)
            yield Unknown(name, where, _misunderstood(deck, name))


def _misunderstood(deck: Deck, name: str) -> str:
    """That a command is not understood, and what it would change."""
    if what := MEANINGS.get(name):
        selected = deck.present(*(card for card, meaning in SELECTED.items() if meaning == what))
        cards = "".join(f"; {c.name}: {counted(len(c))}" for c in selected)
        return f"the command {name} ({what}{cards}) of the case control is not understood"
    near = nearest(name, sorted(SELECTS), 0.6)
    meant = f"; did you mean {near}?" if near else ""
    return (
        f"the command {name} of the case control is not understood and may change the "
        f"structure{meant}"
    )


def _followers(deck: Deck, where: str, why: str) -> Iterator[Unknown]:
    """The first material that follows temperature."""
    for cards in deck.present(*FOLLOWS_TEMPERATURE):
        said = f"{why} the temperatures that {cards.name} at {cards.where(0)} follows"
        yield Unknown(cards.name, where, f"{said}, which is not understood")


def _no_set(deck: Deck, name: str, text: str) -> str:
    """That a command selects no set, and the sets it may select."""
    cards = deck.present(*_SETS.get(name, ()))
    there = sorted({w for table in cards for w in table.words(1).tolist() if w.isdigit()}, key=int)
    known = f"; there are {b', '.join(there).decode()}" if there else ""
    several = f", of which {name}ADD joins several" if f"{name}ADD" in FIELDS else ""
    return (
        f"{text.strip()!r} selects no set; write {name} = n, the number of one set{several}{known}"
    )


_SETS = {
    "SPC": ("SPC", "SPC1", "SPCADD"), "MPC": ("MPC", "MPCADD"), "METHOD": ("EIGRL", "EIGR"),
    "NSM": ("NSM", "NSM1", "NSML", "NSML1", "NSMADD"),
}  # fmt: skip


def _allowing(name: str) -> str:
    return f'; take it out or allow it: [model] allow = ["{name}"] of a case, --allow {name}'
