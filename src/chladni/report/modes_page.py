"""Normal modes as a page: frequencies, mass, energy of each part, shapes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .blocks import Facts, PageParts, Section, Table
from .mesh_drawings import mesh_of, mode_shapes
from .words import counted, hertz, number

if TYPE_CHECKING:
    from ..workflows.loaded_model import Model
    from ..workflows.modes import NormalModes

_SHOWN = 12  # modes in the picture; rigid ones on the page where there are no others
LEFT = 1e-3  # of the strain energy; more of it that is in no part has a column
_MASS = (
    "Effective modal mass along X, Y and Z, of the mass; it is what a motion of the base excites. "
    "Then the share of each part in the kinetic energy; the rest is in point masses."
)
_NODES = 20_000  # in the universal file, a text of a hundred bytes per node and mode


def as_page(folder: Path, found: NormalModes) -> PageParts:
    """Sections of the page; the shapes for other programs are written into the folder."""
    from ..io.vtu import write_vtu

    model, modal = found.origin, found.modal
    motion, f = model.motion(modal.shapes), modal.frequency
    write_vtu(folder / "modes.vtu", model.assembly, motion, f)
    other, notes = _universal(folder, model, motion, f)
    elastic = np.flatnonzero(~found.rigid)
    every = elastic if len(elastic) else np.arange(min(_SHOWN, len(modal)))
    numbers = [int(k) + 1 for k in every]
    whole = mesh_of(model.seen, model.assembly)
    shapes = mode_shapes(whole, motion[:, :, every], f[every], numbers, _SHOWN,
                         "the first elastic modes", "modes")  # fmt: skip
    said = in_words(found)
    files = [("modes.vtu", "shapes for ParaView"), *other]
    sections = [Section("Mode shapes", list(shapes)), *said.sections]
    return PageParts(said.lead, sections, (*said.notes, *notes), files)


def in_words(found: NormalModes) -> PageParts:
    """The page without its pictures."""
    f, kg = found.modal.frequency, "kg" if found.in_si else "deck units"
    elastic, rigid = f[~found.rigid], int(found.rigid.sum())
    modes = [counted(rigid, "rigid motion", "rigid motions")] * (rigid > 0)
    if len(elastic):
        modes.insert(0, f"{counted(len(elastic), 'elastic mode', 'elastic modes')} from "
                        f"{number(elastic[0])} to {number(elastic[-1])} Hz")  # fmt: skip
    lead = f"{' and '.join(modes)}; the mass is {number(found.mass)} {kg}."
    return PageParts(lead, [Section("Modes", _tables(found, kg))], found.notes)


def _universal(
    folder: Path, model: Model, motion: np.ndarray, f: np.ndarray
) -> tuple[list[tuple[str, str]], list[str]]:
    """``modes.unv`` as (file, what it is), and notes; none of a deck whose units are not known."""
    from ..io.uff.write_shapes import write_shapes

    if not model.unit:
        return [], ["A universal file of the shapes needs the unit system (--units)."]
    made = model.assembly
    step = -(-len(made.ids) // _NODES)
    at = slice(None, None, step)
    name = model.source.name
    write_shapes(folder / "modes.unv", f, motion[at], made.ids[at], made.points[at], title=name)
    notes = [f"modes.unv holds every {step}th grid of {len(made.ids)}."] if step > 1 else []
    return [("modes.unv", "shapes as a universal file (dataset 55)")], notes


def _tables(found: NormalModes, kg: str) -> list[Facts | Table]:
    m, f = "m" if found.in_si else "deck units", found.modal.frequency
    centre = ", ".join(number(x) for x in found.centre_of_gravity)
    facts = [("Mass", f"{number(found.mass, 6)} {kg}"), ("Centre of gravity", f"({centre}) {m}")]
    share = found.strain_energy
    names = [name for name, _ in found.parts]
    rest = 1 - share.sum(axis=0)
    if np.nanmax(rest, initial=0.0) > LEFT:
        share, names = np.vstack([share, rest]), [*names, "springs, bushes"]
    rows = [(str(k + 1), hertz(f[k]), *(_share(e) for e in share[:, k])) for k in range(len(f))]
    heads = ("mode", "Hz", *names)
    out: list[Facts | Table] = [
        Facts(facts), Table(heads, rows, caption="Share of each part in the strain energy.")
    ]  # fmt: skip
    moving = [[_share(e) for e in found.kinetic_energy[:, k]] for k in range(len(f))]
    effective = found.effective_mass[:3] / max(found.mass, 1e-300)
    rows = [
        (str(k + 1), hertz(f[k]), *(_share(e) for e in effective[:, k]), *moving[k])
        for k in range(len(f))
    ]
    total = ("sum", "", *(_share(e) for e in effective.sum(axis=1)), *([""] * len(found.parts)))
    heads = ("mode", "Hz", "X", "Y", "Z", *(name for name, _ in found.parts))
    return [*out, Table(heads, [*rows, total], caption=_MASS)]


def _share(value: float) -> str:
    return "–" if not np.isfinite(value) else f"{100 * value:.1f} %"


def as_json(result: NormalModes) -> dict[str, Any]:
    """``modes.json``; without a unit system mass and centre are under names that claim none."""
    mass, centre = (
        ("mass_kg", "centre_of_gravity_m") if result.in_si else ("mass", "centre_of_gravity")
    )
    return {
        "frequency_hz": result.modal.frequency,
        "generalized_mass": result.generalized_mass,
        mass: result.mass,
        centre: result.centre_of_gravity,
        "rigid": result.rigid,
        "parts": {
            name: {"id": id, "strain_energy": strain, "kinetic_energy": kinetic}
            for (name, id), strain, kinetic in zip(
                result.parts, result.strain_energy, result.kinetic_energy, strict=True
            )
        },
        "effective_mass": dict(
            zip(("X", "Y", "Z", "RX", "RY", "RZ"), result.effective_mass, strict=True)
        ),
    }
