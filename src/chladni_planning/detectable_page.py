"""The smallest findings of a layout: a table, a map, JSON."""

from typing import Any

import numpy as np

from chladni.report.blocks import Block, Section, Table
from chladni.report.mesh_drawings import field, mesh_of
from chladni.report.words import number, quantity, rounded
from chladni.workflows.loaded_model import Model, on_faces

from .detectable import Detectable

_HEADS = ("what", "at the best place", "at half of the places", "at the worst", "nowhere found")
_CAPTION = (
    "Predicted from the model alone. Smallest mass at one place that a diagnosis would name. "
    "Smallest softening (share of E) and thinning (share of t) over a tenth of the sheet's size. "
    "E, rho and t of the parts are free, the form error is 1 % and the noise {noise:.2g} % of "
    "|H|. A finding must lower -2 ln p by {due:.0f}: the threshold of a diagnosis and the places "
    "tried. Nowhere found: share of the places where 30 % of the mass, or 90 % of E or t, would "
    "not be enough."
)


def detectable_section(model: Model, found: Detectable, noise: float) -> Section:
    """The section of the page."""
    from chladni.view import scene

    rows = [
        ("mass", *_row(found.mass, lambda x: quantity(rounded(x), "kg", np.nanmin(found.mass)))),
        ("softening", *_row(found.softer, _percent)),
        ("thinning", *_row(found.thinner, _percent)),
    ]
    caption = _CAPTION.format(noise=100 * noise, due=found.due)
    blocks: list[Block] = [Table(_HEADS, rows, ("what",), caption=caption)]
    grams = on_faces(model.seen, 1e3 * _of_shells(model, found))
    name = "smallest mass that a diagnosis finds"
    limits = scene.usual_limits(model.seen, grams)
    shown = mesh_of(model.seen, model.assembly)
    drawn = field(shown, grams, limits, "smallest_mass", f"{name} [g]", colours="YlOrRd")
    return Section("Smallest effects this layout can find", [*blocks, drawn])


def detectable_json(found: Detectable) -> dict[str, Any]:
    """``smallest.json``: place by place."""
    return {
        "due": found.due,
        "mass": [
            {"grid": g, "point_m": x, "mass_kg": m}
            for g, x, m in zip(found.grids, found.points, found.mass, strict=True)
        ],
        "softening": found.softer,
        "thinning": found.thinner,
    }


def _row(values: np.ndarray, said: Any) -> tuple[str, ...]:
    known = values[np.isfinite(values)]
    share = f"{100 * (1 - len(known) / max(len(values), 1)):.0f} %"
    if not len(known):
        return "–", "–", "–", share
    return (*(said(float(np.quantile(known, q))) for q in (0, 0.5, 1)), share)


def _percent(x: float) -> str:
    return f"{number(100 * x, 2)} %"


def _of_shells(model: Model, found: Detectable) -> np.ndarray:
    """Smallest mass of the place nearest to each shell (m,) [kg]."""
    from scipy.spatial import cKDTree

    middle = model.assembly.points[model.assembly.shells.nodes].mean(axis=1)
    near = cKDTree(found.points).query(middle, min(3, len(found.points)))[1]
    return found.mass[near].reshape(len(middle), -1).mean(axis=1)
