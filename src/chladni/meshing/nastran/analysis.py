"""What a deck asks for: subcases, loads, frequencies, damping, excitation."""

from collections.abc import Iterator

from ...model.analysis import Analysis, Subcase
from ...units import Units
from . import excitation
from .context import context
from .deck import Deck
from .loads import loads, motions

_LEFT_OUT = {
    "PLOAD1": "distributed loads on beams", "RFORCE": "centrifugal loads", "TEMP": "temperatures",
    "TEMPD": "temperatures", "FREQ3": "frequencies that follow the modes",
    "FREQ4": "frequencies that follow the modes", "FREQ5": "frequencies that follow the modes",
    "TLOAD1": "loads in time", "TLOAD2": "loads in time", "ACCEL": "acceleration fields",
    "ACCEL1": "acceleration fields", "FORCE2": "forces along a cross product",
    "OMIT": "static reduction", "OMIT1": "static reduction", "ASET": "static reduction",
    "ASET1": "static reduction", "TABLED4": "power-series tables",
}  # fmt: skip


def analysis(deck: Deck, units: Units | None = None) -> Analysis:
    """Everything in the deck beside the structure, in SI (or its own numbers, without units)."""
    ctx = context(deck, units)
    static, moved = loads(ctx), motions(ctx)
    return Analysis(
        solution=deck.case.sol,
        subcases=tuple(_subcases(deck)),
        loads=static,
        prescribed=moved,
        frequency=excitation.frequencies(ctx),
        damping=excitation.damping(ctx),
        eigen=excitation.eigenvalues(ctx),
        dynamic=excitation.dynamic(ctx, static, moved),
        notes=tuple(_notes(deck)),
    )


def _subcases(deck: Deck) -> Iterator[Subcase]:
    names = ("SPC", "MPC", "LOAD", "METHOD", "FREQ", "DLOAD", "SDAMP", "SUPORT")
    for case in deck.case.subcases:
        yield Subcase(case.id, *(case.get(name) for name in names))


def _notes(deck: Deck) -> Iterator[str]:
    """Cards that are read but not acted upon, one sentence each."""
    for name, what in _LEFT_OUT.items():
        for cards in deck.present(name):
            yield f"{cards.where(0)}: {name} ({what}) is left out"
