"""Map thickness of a forming simulation or a scan onto a deck, and rate the mapping."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..arguments import checked
from ..case.mapped_thickness import FormedThickness, formed_thickness
from ..errors import FileError
from ..geometry.thickness_mapping import shell_mass
from ..geometry.thickness_prior import ThinningModel, learn, predict
from ..io.nastran.edit.changes import Change
from ..io.nastran.edit.model_changes import changes
from ..model.assembly import Assembly
from ..progress import Progress, silent
from ..results import Result
from ..units import Units
from ..units import units as unit_system
from .given_case import Source
from .loaded_model import as_model, exported_deck

if TYPE_CHECKING:
    from ..view.mesh_grid import UnstructuredGrid


@dataclass(frozen=True, eq=False, repr=False)
class MappedDeck(Result):
    """A deck with mapped thickness.

    Attributes
    ----------
    before, after : Assembly
    found : FormedThickness       part by part
    changes : of the deck's cards
    thinning : the law learned from curvature where parts were guessed, else None
    guessed : parts whose thickness is a guess -> its standard deviation over t
    """

    before: Assembly
    after: Assembly
    found: FormedThickness
    changes: tuple[Change, ...]
    thinning: ThinningModel | None = None
    guessed: Mapping[str, float] | None = None
    notes: tuple[str, ...] = ()

    @property
    def mass(self) -> tuple[float, float]:
        """Mass of all shells, before and after [kg]."""
        before, after = (float(shell_mass(a).sum()) for a in (self.before, self.after))
        return before, after

    @property
    def mesh(self) -> "UnstructuredGrid":
        """The mesh with the mapped ``thickness`` [m] and the ``thickness_before``."""
        from ..view.mesh_grid import mesh_grid

        none = np.zeros(len(self.after.beams) + sum(map(len, self.after.solids)))
        before = np.concatenate([self.before.thickness(), none])
        return mesh_grid(self.after, of_elements={"thickness_before": before})


@checked
def map_formed(
    source: Source,
    formed: Path | str,
    formed_units: str | Units | None = None,
    place: str = "as it lies",
    pairs: Mapping[str, int] | None = None,
    guess: bool = False,
    *,
    units: str | Units | None = None,
    progress: Progress = silent,
) -> MappedDeck:
    """Map thickness onto a deck's shells, corner by corner.

    Parameters
    ----------
    source : a model or case with units, an Assembly, or the path of a deck or case
    formed : LS-DYNA keyword file, VTU, CSV, or a scan of both faces (STL, PLY, OBJ)
    formed_units : of the formed file, the deck's unless given
    place : "as it lies", "aligned" or "mirrored"
    pairs : part of the deck -> part id of the formed mesh
    guess : parts missing in the file get the thinning expected from their curvature, as learned
        from the parts in the file
    units : of a deck given by its path

    Raises
    ------
    FileError, ModelError, AccuracyError
        If the deck has no units, or the file lies elsewhere or fits no part.
    """
    model = as_model(source, "map", units)
    own = model.units
    if own is None:
        raise FileError(f"{model.source}: a thickness needs the deck's unit system (--units)")
    deck = model.deck or exported_deck(model.assembly)
    model = replace(model, deck=deck)
    before = model.assembly
    progress("mapping", 0.2)
    of_file = own if formed_units is None else unit_system(formed_units)
    found = formed_thickness(before, Path(formed), of_file, place, pairs)
    after, thinning, guessed = found.mapped.assembly, None, None
    if guess:
        progress("thinning by curvature", 0.6)
        after, thinning, guessed = _with_guess(after, {p.part for p in found.mapped.parts})
    progress("cards", 0.8)
    edits = tuple(changes(deck, before, after, model.units))
    known = {p.part for p in found.mapped.parts} | set(guessed or {})
    present = [after.parts[k].name for k in np.unique(after.shells.part).tolist()]
    notes = [*model.notes, *found.said()]
    if left := [name for name in present if name not in known]:
        notes.append(f"{', '.join(left)} received no thickness and keep that of the deck.")
    if guessed is not None and not guessed:
        notes.append("The file has every part, so no thickness was estimated.")
    return MappedDeck(before, after, found, edits, thinning, guessed, tuple(notes), origin=model)


def _with_guess(
    made: Assembly, mapped: set[str]
) -> tuple[Assembly, ThinningModel, dict[str, float]]:
    """Give shells of the other parts the thickness expected from their curvature."""
    thinning = learn(made, tuple(sorted(mapped)))
    mean, sd = predict(made, thinning)
    part = made.shells.part
    others = [k for k in np.unique(part).tolist() if made.parts[k].name not in mapped]
    rows = np.isin(part, others) & np.isfinite(mean)
    t = np.where(rows[:, None], mean[:, None], made.shells.thickness)
    spread = {
        made.parts[k].name: float(np.median(sd[part == k] / mean[part == k]))
        for k in others
        if rows[part == k].any()
    }
    return replace(made, shells=replace(made.shells, thickness=t)), thinning, spread
