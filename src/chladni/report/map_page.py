"""A mapped thickness as a page: result for each part, its accuracy, places of change."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..view.surface import surface
from ..workflows.loaded_model import on_faces
from ..workflows.map import MappedDeck
from .blocks import Block, Facts, PageParts, Section, Table
from .mesh_drawings import field, mesh_of
from .words import counted, number, percent

_HEADS = ("part", "taken from", "covered [%]", "95 % within [mm]", "mean t [mm]", "mass [kg]",
          "was [kg]", "error of t [%]")  # fmt: skip
_CAPTION = (
    "Covered: share of the area with a matching sheet. 95 % within: distance of that sheet. "
    "Error of t: thickness mapped onto the deck and back, compared with the file, rms. Shells "
    "without a match keep the deck's thickness."
)
_DARK = "The thinnest is darkest."
_GUESS = (
    "Thinning estimated from curvature. Each part was left out and estimated from the others: "
    "the table gives the error of its thickness. The last column is the error of the unchanged "
    "sheet gauge. A part drawn deeper than all others thins more than this estimate."
)


def as_page(folder: Path, found: MappedDeck) -> PageParts:
    """Sections of the page."""
    from ..view import scene

    shown, t = mesh_of(surface(found.after), found.after), found.after.thickness()
    seen = shown.seen
    change = on_faces(seen, 100 * (t / found.before.thickness() - 1))
    mm = on_faces(seen, 1e3 * t)
    limits = [scene.usual_limits(seen, values) for values in (mm, change)]
    maps = [
        field(shown, mm, limits[0], "thickness", "thickness [mm]", _DARK),
        field(shown, change, limits[1], "change", "change of thickness [%]", _DARK),
    ]
    was, now = found.mass
    facts = [("Sheets before", f"{number(was)} kg"), ("after", f"{number(now)} kg")]
    blocks: list[Block] = [Facts(facts), *maps, _parts(found)]
    sections = [Section("Thickness", blocks)]
    if found.thinning is not None:
        sections.append(Section("Parts missing from the file", _guessed(found)))
    return PageParts(_lead(found), sections, found.notes)


def in_words(found: MappedDeck) -> PageParts:
    """The page without its pictures."""
    return PageParts(_lead(found), [Section("Thickness", [_parts(found)])], found.notes)


def _lead(found: MappedDeck) -> str:
    parts, (was, now) = found.found.mapped.parts, found.mass
    errors = [p.round_trip for p in parts if np.isfinite(p.round_trip)]
    known = f"; error of the mapping {100 * max(errors):.2g} % rms at most" if errors else ""
    onto = counted(len(parts), "part", "parts")
    return (
        f"{found.found.source.name} mapped onto {onto}: the sheets go from "
        f"{number(was)} to {number(now)} kg ({percent(now, was)}){known}."
    )


def _parts(found: MappedDeck) -> Table:
    rows = [
        (p.part, p.source, f"{100 * p.coverage:.1f}", f"{1e3 * p.distance_95:.2f}",
         f"{1e3 * p.mean:.3f}", number(p.mass_after), number(p.mass_before),
         f"{100 * p.round_trip:.2f}" if np.isfinite(p.round_trip) else "–")
        for p in found.found.mapped.parts
    ]  # fmt: skip
    return Table(_HEADS, rows, words=("part", "taken from"), caption=_CAPTION)


def _guessed(found: MappedDeck) -> list[Block]:
    model = found.thinning
    assert model is not None
    known = [
        (name, f"{100 * model.left_out[name]:.1f}", f"{100 * model.trivial[name]:.1f}")
        for name in model.left_out
    ]
    guessed = [(name, f"{100 * sd:.1f}") for name, sd in (found.guessed or {}).items()]
    out: list[Block] = []
    if guessed:
        out.append(Table(("guessed part", "standard deviation [%]"), guessed, ("guessed part",)))
    heads = ("part", "error of the estimate [%]", "error of the gauge [%]")
    return [*out, Table(heads, known, ("part",), caption=_GUESS)]


def as_json(found: MappedDeck) -> dict[str, Any]:
    """``mapping.json``."""
    fit, model = found.found.alignment, found.thinning
    return {
        "source": found.found.source.name,
        "parts": [asdict(p) for p in found.found.mapped.parts],
        "mass_before_kg": found.mass[0],
        "mass_after_kg": found.mass[1],
        "alignment": None
        if fit is None
        else {
            "rotation": fit.rotation,
            "shift_m": fit.shift,
            "residual_m": fit.residual,
            "mirrored": fit.mirrored,
            "start": fit.start,
        },
        "guessed": None
        if model is None
        else {
            "relative_sd": dict(found.guessed or {}),
            "left_out_rms": model.left_out,
            "gauge_rms": model.trivial,
        },
    }
