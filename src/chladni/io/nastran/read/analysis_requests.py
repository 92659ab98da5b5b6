"""What a deck asks for: subcases, loads, frequencies, damping, excitation."""

from collections.abc import Iterable, Iterator

from ....model.analysis import Analysis, Subcase
from ....units import Units
from ..text.deck import Deck
from . import excitation, response_frequencies
from .context import context, parameter
from .static_loads import loads, motions

_LEFT_OUT = {
    "PLOAD1": "distributed loads on beams", "RFORCE": "centrifugal loads", "TEMP": "temperatures",
    "TEMPD": "temperatures",
    "TLOAD1": "loads in time", "TLOAD2": "loads in time", "ACCEL": "acceleration fields",
    "ACCEL1": "acceleration fields", "FORCE2": "forces along a cross product",
    "OMIT": "static reduction", "OMIT1": "static reduction", "ASET": "static reduction",
    "ASET1": "static reduction", "TABLED4": "power-series tables",
    "PBUSHT": "stiffness and damping that follow the frequency",
    "PELAST": "stiffness that follows the frequency",
    "PDAMPT": "damping that follows the frequency",
}  # fmt: skip
STRUCTURAL = (  # these change the modes: Guyan's reduction, what follows the frequency
    "OMIT", "OMIT1", "ASET", "ASET1", "PBUSHT", "PELAST", "PDAMPT",
)  # fmt: skip


def analysis(deck: Deck, units: Units | None = None) -> Analysis:
    """Everything in the deck beside the structure, in SI (or its own numbers, without units)."""
    ctx = context(deck, units)
    static, moved = loads(ctx), motions(ctx)
    return Analysis(
        solution=deck.case.sol,
        subcases=tuple(_subcases(deck)),
        loads=static,
        prescribed=moved,
        frequency=response_frequencies.listed(ctx),
        following=response_frequencies.following(ctx),
        damping=excitation.damping(ctx),
        eigen=excitation.eigenvalues(ctx),
        dynamic=excitation.dynamic(ctx, static, moved),
        notes=tuple(left_out(deck)),
    )


def _subcases(deck: Deck) -> Iterator[Subcase]:
    names = ("SPC", "MPC", "LOAD", "METHOD", "FREQ", "DLOAD", "SDAMP", "SUPORT")
    always = parameter(deck, "RESVEC") == "YES"
    for case in deck.case.subcases:
        chosen = (case.get(name) for name in names)
        wanted = case.residual or always
        yield Subcase(case.id, *chosen, outputs=case.outputs, residual=wanted)


def left_out(deck: Deck, names: Iterable[str] = _LEFT_OUT) -> Iterator[str]:
    """Cards that are read but not acted upon, one sentence each."""
    for name in names:
        for cards in deck.present(name):
            yield f"{cards.where(0)}: {name} ({_LEFT_OUT[name]}) is left out"
