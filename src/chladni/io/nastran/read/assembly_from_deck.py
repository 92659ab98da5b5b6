"""A deck as an :class:`~chladni.model.assembly.Assembly`: all that stiffens, weighs and holds."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ....errors import FileError
from ....model.assembly import Assembly, concatenated
from ....units import Units
from ..export.whole_deck import is_written_here
from ..text.deck import Deck
from . import springs_and_masses
from .beam_elements import beams
from .connected import refuse_loose
from .connectors import CONNECTORS, with_connectors
from .context import Context, context, parameter, real_parameter
from .curved_beams import curved_beams
from .direct_matrices import direct
from .general_elements import general_elements
from .nonstructural_mass import with_nonstructural
from .rigid_bushes import tied
from .rigid_elements import ties
from .sections import Parts
from .shear_panels import shear_panels
from .shell_elements import SHEETS, filled_thickness, shells
from .solid_elements import SOLIDS, solids
from .strain_springs import with_springs
from .supports import selected, supports

_STIFF = (
    "CBAR CBEAM CROD CTUBE CONROD CELAS1 CELAS2 CELAS3 CELAS4 CBUSH CBUSH1D CGAP "
    "CSHEAR CBEND GENEL".split()
)
_ELEMENTS = (  # those of one kind have no id in common
    (*SHEETS, *SOLIDS, *_STIFF, *CONNECTORS),
    "CDAMP1 CDAMP2 CDAMP3 CDAMP4 CVISC".split(),
    "CMASS1 CMASS2 CMASS3 CMASS4".split(),
    ["CONM1", "CONM2"],
)
_K6ROT = 100.0


def assembly(
    deck: Deck, units: Units | str | None = None, subcase: int | None = None, loose: bool = False
) -> Assembly:
    """The structure a deck describes.

    Parameters
    ----------
    units : the deck's unit system or its name; None keeps its numbers as they are
    subcase : whose SPC and MPC sets hold; the first that selects any unless given
    loose : accept parts that hang on nothing

    Raises
    ------
    FileError, ModelError
        One sentence naming file, line, card and the alternatives.
    """
    ctx = context(deck, units)
    if not len(ctx.ids):
        raise FileError(f"{deck.path}: there is no GRID, so there is no model")
    for names in _ELEMENTS:
        _unique_elements(deck, names)
    made = _made(ctx, subcase)
    if not loose:
        refuse_loose(made, str(deck.path))
    return made


def _made(ctx: Context, subcase: int | None) -> Assembly:
    deck, parts = ctx.deck, Parts(ctx)
    made_shells, made_solids = shells(ctx, parts), solids(ctx, parts)
    made_beams = beams(ctx, parts)
    filled_thickness(parts, made_shells)
    order = parts.order()
    at = np.argsort(order)
    made = Assembly(
        ids=ctx.ids,
        points=ctx.places * ctx.scale.length,
        parts=tuple(parts.made[k] for k in order),
        shells=replace(made_shells, part=at[made_shells.part]),
        solids=tuple(replace(s, part=at[s.part]) for s in made_solids),
        beams=replace(made_beams, part=at[made_beams.part]),
        springs=concatenated(springs_and_masses.springs(ctx), direct(ctx, "K2GG")),
        dampers=concatenated(springs_and_masses.dampers(ctx), direct(ctx, "B2GG")),
        scalar_masses=concatenated(springs_and_masses.scalar_masses(ctx), direct(ctx, "M2GG")),
        bushes=springs_and_masses.bushes(ctx),
        masses=springs_and_masses.masses(ctx),
        rigid=ties(ctx, selected(deck, "MPC", subcase)),
        supports=supports(ctx, selected(deck, "SPC", subcase)),
        axes=ctx.axes,
        scalar_points=ctx.scalar if np.any(ctx.scalar) else None,
        coupled_mass=real_parameter(deck, "COUPMASS", -1) > 0,
        structural_damping=real_parameter(deck, "G", 0.0),
        auto_spc=parameter(deck, "AUTOSPC") != "NO",
        k6rot=_k6rot(deck),
    )
    made = with_nonstructural(ctx, tied(made), selected(deck, "NSM", subcase))
    if "CSHEAR" not in deck.allowed:
        made = with_springs(made, *shear_panels(ctx))
    if "CBEND" not in deck.allowed:
        made = with_springs(made, *curved_beams(ctx))
    if "GENEL" not in deck.allowed:
        made = with_springs(made, general_elements(ctx))
    return with_connectors(ctx, made)


def _k6rot(deck: Deck) -> float | None:
    """PARAM,K6ROT, 100 where a deck is silent (MSC Nastran's default since 2004).

    None, the drilling field, stands for AUTO, for CQUADR and CTRIAR, which do not heed the
    parameter, and for decks that were written here without it.
    """
    text = parameter(deck, "K6ROT")
    if text == "AUTO" or any(deck.present("CQUADR", "CTRIAR")):
        return None
    if not text and is_written_here(deck):
        return None
    value = real_parameter(deck, "K6ROT", _K6ROT)
    if value < 0:
        raise FileError(f"{deck.path}: PARAM,K6ROT is {value:g}; a stiffness cannot be negative")
    return value


def _unique_elements(deck: Deck, names: Sequence[str]) -> None:
    """An element's id is its own among those of its kind; solvers run decks with no more."""
    tables = list(deck.present(*names))
    if not tables:
        return
    ids = np.concatenate([t.integers(1) for t in tables])
    at = np.concatenate([np.full(len(t), k) for k, t in enumerate(tables)])
    card = np.concatenate([np.arange(len(t)) for t in tables])
    order = np.argsort(ids, kind="stable")
    same = np.flatnonzero(np.diff(ids[order]) == 0)
    if len(same):
        a, b = order[same[0]], order[same[0] + 1]
        first, again = tables[at[a]], tables[at[b]]
        where = f"{first.name} at {first.where(int(card[a]))}"
        raise again.refuse(int(card[b]), f"the id is already taken by {where}")
