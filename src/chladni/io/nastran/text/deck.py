"""Nastran decks, read whole and without loss: small, large and free fields, includes, comments."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from ....arguments import checked
from ....errors import FileError, nearest
from .card_layout import BOM, tables
from .case_control import SELECTS, CaseControl, case_control, selects_one
from .known_cards import FOLLOWS_TEMPERATURE, refusal
from .known_commands import commands, harmless, sets_material_temperature
from .numbers import parse_real
from .part_names import part_names
from .source_files import Source, sources
from .table import Cards, empty, joined

SCALED = frozenset("CB1 CB2 CK1 CK2 CK3 CM1 CM2".split())  # PARAM that scale whole matrices


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
    path = Path(path)
    files = sources(path)
    cards = _cards(files)
    if not cards:
        raise FileError(f"{path} has no bulk data")
    deck = Deck(path, files, cards, _case(files), _names(files), tuple(a.upper() for a in allow))
    _refuse_unknown(deck)
    _refuse_commands(deck)
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
    return case_control((text for _, text in _control(files[0])), sections=files[0].bulk[0] > 0)


def _control(main: Source) -> list[tuple[str, str]]:
    """(file:line, text) of executive and case control, includes in place."""
    first = max(main.bulk[0], 0)
    lines = [t.removeprefix(BOM).decode("latin-1") for t in main.lines[:first]]
    out = [(f"{main.path}:{k}", text) for k, text in enumerate(lines, 1)]
    for include in reversed(main.includes):
        target = main.path.parent / include.name
        if include.past <= first and target.is_file():
            texts = target.read_text("latin-1").splitlines()
            inside = [(f"{target}:{k}", text) for k, text in enumerate(texts, 1)]
            out[include.first : include.past] = inside
    return out


def _names(files: tuple[Source, ...]) -> dict[int, str]:
    found: dict[int, str] = {}
    for source in files:
        lines = islice(source.lines, *source.bulk)
        wanted = (t for t in lines if t[:1] in (b"$", b"P", b"p"))
        found.update(part_names(t.decode("utf-8", "replace").rstrip() for t in wanted))
    count = Counter(found.values())
    return {id: name if count[name] == 1 else f"{name} ({id})" for id, name in found.items()}


def _refuse_unknown(deck: Deck) -> None:
    """Refuse what would be left out of stiffness, mass or ties without anybody noticing."""
    for name, table in deck.cards.items():
        if name not in deck.allowed and (why := refusal(name, len(table))):
            raise FileError(f"{table.where(0)}: {why}{_allowing(name)}")
    parameters = deck["PARAM"]
    for i, word in enumerate(parameters.words(1).tolist()):
        name, value = word.decode("latin-1"), parse_real(parameters.word(i, 2))
        if name in SCALED and value != 1.0 and name not in deck.allowed:
            raise parameters.refuse(i, f"{name} scales a matrix{_allowing(name)}")
    for name in sorted(SCALED & deck.case.parameters.keys() - {*deck.allowed}):
        if parse_real(deck.case.parameters[name]) != 1.0:
            raise FileError(f"{deck.path}: PARAM,{name} scales a matrix{_allowing(name)}")
    chosen = {m for case in deck.case.subcases for m in case.matrices.items()}
    if chosen and "DMIG" not in deck.allowed:
        name, matrix = sorted(chosen)[0]
        raise FileError(
            f"{deck.path}: the case control selects {name} = {matrix}; direct input "
            "matrices (DMIG) are not understood; allow it: --allow DMIG"
        )


def _refuse_commands(deck: Deck) -> None:
    """Refuse what of the case control might choose other supports, masses or joints."""
    control = _control(deck.sources[0])
    if not deck.case.present:
        for cards in deck.present("TEMP", "TEMPD"):
            where = cards.where(0)
            _refuse_followers(deck, f"{where}: the case control does not select {cards.name} sets")
    for k, name, text in commands(text.split("$")[0] for _, text in control):
        where = control[k][0]
        if name in SELECTS:
            if not selects_one(name, text):
                raise FileError(f"{where}: {_no_set(deck, name, text)}")
        elif sets_material_temperature(text):
            _refuse_followers(deck, f"{where}: {text.strip()!r} chooses")
        elif not harmless(name) and name not in deck.allowed:
            near = nearest(name, sorted(SELECTS), 0.6)
            meant = f"; did you mean {near}?" if near else ""
            raise FileError(
                f"{where}: the command {name} of the case control is not understood "
                f"and may change the structure{meant}{_allowing(name)}"
            )


def _refuse_followers(deck: Deck, why: str) -> None:
    """Refuse the first material that follows temperature, unless it is allowed."""
    for cards in deck.present(*FOLLOWS_TEMPERATURE):
        if cards.name not in deck.allowed:
            said = f"{why} the temperatures that {cards.name} at {cards.where(0)} follows"
            raise FileError(f"{said}, which is not understood{_allowing(cards.name)}")


def _no_set(deck: Deck, name: str, text: str) -> str:
    """That a command selects no set, and the sets it may select."""
    cards = deck.present(*_SETS.get(name, ()))
    there = sorted({w for table in cards for w in table.words(1).tolist() if w.isdigit()}, key=int)
    known = f"; there are {b', '.join(there).decode()}" if there else ""
    several = f", of which {name}ADD joins several" if name in ("SPC", "MPC") else ""
    return (
        f"{text.strip()!r} selects no set; write {name} = n, the number of one set{several}{known}"
    )


_SETS = {"SPC": ("SPC", "SPC1", "SPCADD"), "MPC": ("MPC", "MPCADD"), "METHOD": ("EIGRL", "EIGR")}


def _allowing(name: str) -> str:
    return f'; take it out or allow it: [model] allow = ["{name}"] of a case, --allow {name}'
