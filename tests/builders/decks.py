"""Cards of a sheet; a structure as a deck; the deck with other values, read again."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from chladni.fem.assemble import structure
from chladni.io.nastran import Deck, assembly, read_deck, write_assembly, write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.assembly import Assembly


class Rewritten(NamedTuple):
    """A changed deck as it is read again, and the lines that differ from the deck before."""

    found: Assembly
    gone: list[str]
    fresh: list[str]


def flat_sheet(nx: int, ny: int, a: float, b: float) -> list[str]:
    """Cards of nx by ny CQUAD4 of property 1 over a by b in z = 0; numbers go along y first."""
    n, cards = ny + 1, []
    for i, j in np.ndindex(nx + 1, n):
        cards.append(f"GRID,{1 + n * i + j},,{a * i / nx},{b * j / ny},0.")
    for k, (i, j) in enumerate(np.ndindex(nx, ny), start=1):
        g = 1 + n * i + j
        cards.append(f"CQUAD4,{k},1,{g},{g + n},{g + n + 1},{g + 1}")
    return cards


def opened(
    made: Assembly, folder: Path, units: str = "mm-t-s", more: str = ""
) -> tuple[Deck, Assembly, str]:
    """The structure written as a deck, with more cards: the deck, what is read from it, units."""
    path = write_assembly(made, folder / "deck.bdf", units)
    path.write_text(path.read_text().replace("BEGIN BULK\n", f"BEGIN BULK\n{more}"))
    deck = read_deck(path)
    return deck, assembly(deck, units), units


def rewritten(deck: Deck, before: Assembly, after: Assembly, units: str = "mm-t-s") -> Rewritten:
    """Write the changes of a structure into its deck and read the deck again.

    What is read is the structure after.
    """
    path = deck.path.with_name("updated.bdf")
    write_deck(deck, path, changes(deck, before, after, units))
    found = assembly(read_deck(path), units)
    alike(found, after)
    return Rewritten(found, *differing(deck.path, path))


def differing(before: Path, after: Path) -> tuple[list[str], list[str]]:
    """Lines that only the file before has, and those that only the file after has."""
    gone, fresh = before.read_text().splitlines(), []
    for line in after.read_text().splitlines():
        if line in gone:
            gone.remove(line)
        else:
            fresh.append(line)
    return gone, fresh


def alike(found: Assembly, wanted: Assembly, rounded: float = 5e-6) -> None:
    """Assert that two structures have the same dofs, masses, dashpots, stiffness and losses.

    Entries are compared on the scale of their diagonals, to what a card of eight columns holds.
    """
    one, two = structure(found), structure(wanted)
    assert np.array_equal(one.system.dofs, two.system.dofs)
    pairs = [(getattr(one.system, name), getattr(two.system, name)) for name in "MVK"]
    for A, B in (*pairs, (one.loss, two.loss)):
        d = np.sqrt(np.abs(B.diagonal()))
        d = np.maximum(d, 1e-6 * d.max())
        gap = sp.coo_array(A - B)
        row, column = gap.coords
        assert (np.abs(gap.data) <= rounded * d[row] * d[column]).all()
