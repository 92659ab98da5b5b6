"""Check a bare deck: the use that each of its cards and commands is of, and what refuses it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..errors import FileError
from ..units import units as unit_system
from .case_check import contents
from .unit_guess import doubt_of_units


@dataclass(frozen=True)
class CardUse:
    """Cards of one name, or a command of the case control."""

    name: str
    count: int
    use: str  # read, left out, passed over, not understood
    meaning: str


@dataclass(frozen=True)
class DeckCheck:
    """The table of a deck's cards and the sentence that refuses some, "" where all are known."""

    cards: tuple[CardUse, ...]
    refused: str
    facts: tuple[tuple[str, str], ...] = ()  # what of the structure, in words; needs its units
    doubt: str = ""  # against these units


def check_deck(path: Path, allow: Sequence[str] = (), units: str | None = None) -> DeckCheck:
    """List the cards of a deck, those not understood first, and try to make a structure of it.

    Raises
    ------
    FileError, ModelError
        If the text is no deck, its cards are understood and make no structure, or its materials
        are known only in another unit system than ``units``.
    """
    from ..io.nastran import assembly
    from ..io.nastran.read.analysis_requests import LEFT_OUT
    from ..io.nastran.text.deck import parsed_deck, refuse_unknown, unknown
    from ..io.nastran.text.known_cards import meaning
    from ..io.nastran.text.known_commands import MEANINGS

    deck = parsed_deck(path, allow)
    found = unknown(deck)
    strange = {one.name: one for one in found}
    out = []
    for name, cards in deck.cards.items():
        use = "left out" if name in LEFT_OUT else meaning(name)[0]
        if name in strange:
            use = "not understood"
        elif name in deck.allowed:
            use = "allowed"
        out.append(CardUse(name, len(cards), use, LEFT_OUT.get(name) or meaning(name)[1]))
    command = "a command of the case control"
    out += [
        CardUse(name, 1, "not understood", MEANINGS.get(name, command))
        for name in strange
        if name not in deck.cards
    ]
    order = ("not understood", "allowed", "left out", "read", "passed over")
    out.sort(key=lambda row: (order.index(row.use), row.name))
    try:
        refuse_unknown(deck, found)
    except FileError as error:
        return DeckCheck(tuple(out), str(error))
    made = assembly(deck, units)
    if units is None:
        return DeckCheck(tuple(out), "")
    doubt = doubt_of_units(made, str(path), unit_system(units))
    return DeckCheck(tuple(out), "", contents(made), doubt)
