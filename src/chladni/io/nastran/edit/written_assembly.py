"""The structure of a changed deck as a reader of its file will have it."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from ....model.assembly import Assembly
from ....units import Units
from .. import Deck, assembly, read_deck
from .changed_deck import write_deck
from .changes import Change


def written_assembly(
    deck: Deck, changes: Sequence[Change], units: Units | None, subcase: int | None = None
) -> Assembly:
    """The assembly of the deck with changes, its numbers rounded as its cards hold them.

    Raises
    ------
    FileError, LabelError
        If a change names a card or field that does not exist, or cannot be written.
    """
    with TemporaryDirectory(prefix="chladni-") as folder:
        path = write_deck(deck, Path(folder) / deck.path.name, changes)
        return assembly(read_deck(path, deck.allowed), units, subcase)
