"""What a deck asks for: subcases, loads, frequencies, damping, excitation."""

from collections.abc import Iterable, Iterator

from ....model.analysis import Analysis, Subcase
from ....units import Units
from ..text.deck import Deck
from ..text.known_cards import FOLLOWS_TEMPERATURE
from . import excitation, response_frequencies
from .context import context, parameter
from .materials import lone_moduli, unlike_moduli
from .rigid_elements import partial_bars
from .shell_elements import second_axes
from .solid_elements import warped_solids
from .springs_and_masses import one_sided_inertia
from .static_loads import loads, motions
from .supports import selection_notes

LEFT_OUT = {
    "PLOAD1": "distributed loads on beams", "RFORCE": "centrifugal loads", "TEMP": "temperatures",
    "TEMPD": "temperatures",
    "TLOAD1": "loads in time", "TLOAD2": "loads in time", "ACCEL": "acceleration fields",
    "ACCEL1": "acceleration fields", "FORCE2": "forces along a cross product",
    "MOMENT2": "moments along a cross product", "DEFORM": "deformations", "SUPORT": "rigid motions",
    "SUPORT1": "rigid motions", "MDLPRM": "choices of element formulations",
    "OMIT": "static reduction", "OMIT1": "static reduction", "ASET": "static reduction",
    "ASET1": "static reduction", "TABLED4": "power-series tables",
    "PBUSHT": "stiffness and damping that follow the frequency",
    "PELAST": "stiffness that follows the frequency",
    "PDAMPT": "damping that follows the frequency",
    "SNORM": "normals of shells at grids",
    **dict.fromkeys(FOLLOWS_TEMPERATURE, "materials that follow temperature"),
}  # fmt: skip
_HEEDED = frozenset("WTMASS COUPMASS G AUTOSPC RESVEC K6ROT".split())
_OUTPUT = frozenset(  # what is printed, plotted or written
    """POST POSTEXT PATVER OUGCORD OMID GRDPNT PRTMAXIM PRGPST NOCOMPS NOELOF NOELOP NOGPF CURV
    CURVPLOT USETPRT USETSEL EXTOUT OGEOM OMACHPR DBDICT EST GEOM1 BGPDT EQEXIN CSTM COORID DDRMM
    LSTRN SRCOMPS S1 S1G S1M S1AM BIGER NUMOUT OG SERST PRTRESLT PRTCSTM PRTEQXIN PRTGPL PRTPG
    SPCGEN OUNIT1 OUNIT2 PDRMSG PDRG OIBULK""".split()
)
STRUCTURAL = (  # these change the modes: Guyan's reduction, what follows the frequency
    "OMIT", "OMIT1", "ASET", "ASET1", "PBUSHT", "PELAST", "PDAMPT", "MDLPRM", "SNORM",
    *FOLLOWS_TEMPERATURE,
)  # fmt: skip


def analysis(deck: Deck, units: Units | str | None = None) -> Analysis:
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
        notes=tuple(remarks(deck)),
    )


def _subcases(deck: Deck) -> Iterator[Subcase]:
    names = ("SPC", "MPC", "LOAD", "METHOD", "FREQ", "DLOAD", "SDAMP", "SUPORT")
    always = parameter(deck, "RESVEC") == "YES"
    for case in deck.case.subcases:
        chosen = (case.get(name) for name in names)
        wanted = case.residual or always
        yield Subcase(case.id, *chosen, outputs=case.outputs, residual=wanted)


def remarks(deck: Deck, names: Iterable[str] = LEFT_OUT) -> Iterator[str]:
    """Cards and parameters that are not heeded or contradict others, one sentence each."""
    for name in names:
        for cards in deck.present(name):
            yield f"{cards.where(0)}: {name} ({LEFT_OUT[name]}) is left out"
    yield from _unheeded(deck)
    yield from selection_notes(deck)
    yield from one_sided_inertia(deck)
    yield from unlike_moduli(deck)
    yield from lone_moduli(deck)
    yield from partial_bars(deck)
    places = context(deck, None)
    yield from second_axes(places)
    yield from warped_solids(places)


def _unheeded(deck: Deck) -> Iterator[str]:
    """Parameters that nothing here acts upon, but for those that choose output alone."""
    given = {w.decode("latin-1") for w in deck["PARAM"].words(1).tolist()}
    left = sorted((given | set(deck.case.parameters)) - _HEEDED - _OUTPUT)
    if left:
        yield f"{deck.path}: PARAM {', '.join(left)}: ignored"
    if parameter(deck, "K6ROT") and any(deck.present("CQUADR", "CTRIAR")):
        yield f"{deck.path}: PARAM K6ROT: ignored, because there are CQUADR or CTRIAR"
