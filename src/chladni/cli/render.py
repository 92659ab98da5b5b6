"""``chladni render``: pictures of a deck or case, its modes and its fields."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ..arrays import whole_number
from ..dynamics.modes import ModalModel, rigid_modes
from ..errors import FileError
from ..geometry.clearance import Gaps, PairClearance, all_gaps, nearest, summary
from ..report.blocks import Block, Picture, Table
from ..report.words import counted, number
from ..workflows.loaded_model import LEAST_MODES, Model, load_model, on_faces
from .run import Allow, DeckOrCase, Out, Run, Units, started
from .shape_pictures import against_scan, cuts


def run(
    source: DeckOrCase,
    modes: Annotated[str, typer.Option(help="Modes in one picture, for example 1-12 or 7,9.")] = "",
    gif: Annotated[list[int] | None, typer.Option(help="Mode to animate (repeatable).")] = None,
    energy: Annotated[
        list[int] | None, typer.Option(help="Mode whose strain energy is shown (repeatable).")
    ] = None,
    thickness: Annotated[bool, typer.Option("--thickness", help="Map of shell thickness.")] = False,
    clearance: Annotated[
        bool, typer.Option("--clearance", help="Map and table of the clearance between sheets.")
    ] = False,
    section: Annotated[
        list[str] | None,
        typer.Option(help="Section plane, for example x=0.3 [m, or the deck's unit] (repeatable)."),
    ] = None,
    scan: Annotated[
        Path | None,
        typer.Option(help="STL, PLY or OBJ of the real part, in the deck's unit of length."),
    ] = None,
    align: Annotated[
        bool, typer.Option("--align", help="Move the scan onto the model first.")
    ] = False,
    units: Units = None,
    allow: Allow = None,
    out: Out = None,
) -> None:
    """Draw pictures: modes, animations, thickness, strain energy, clearance, sections, a scan.

    Mode numbers are those of ``chladni modes``: from 1, with the rigid motions. A scan without
    --align must already lie on the model.
    """
    chosen = numbers(modes)
    with started("render", source, out) as job:
        job.progress("reading the model", 0.0)
        model = load_model(source, units, allow or (), command="render")
        job.note(model.notes)
        count = max([0, *chosen, *(gif or []), *(energy or [])])
        shown = sorted({*chosen, *(gif or []), *(energy or [])})
        modal = _modal(job, model, count, energy or [])
        job.progress("pictures", 0.6)
        _still(job, model, thickness)
        if modal is not None:
            _moving(job, model, modal, chosen, gif or [])
            _energies(job, model, modal, energy or [])
        if section:
            cuts(job, model, section)
        if scan is not None:
            against_scan(job, model, scan, align)
        if clearance:
            _clearance(job, model, modal, shown)
        job.lead = f"{counted(len(job.files), 'picture', 'pictures')} of {source.name}."
        job.say(job.lead)


def numbers(text: str) -> list[int]:
    """Mode numbers of a list of numbers and ranges.

    >>> numbers("1-3,7")
    [1, 2, 3, 7]
    """
    found: list[int] = []
    try:
        for piece in filter(None, text.replace(" ", "").split(",")):
            first, _, last = piece.partition("-")
            found += range(whole_number(first), whole_number(last or first) + 1)
    except ValueError:
        raise FileError(f"--modes {text!r} is not of the form 1-12 or 7,9") from None
    if found and min(found) < 1:
        raise FileError(f"--modes {text!r}: modes are counted from 1")
    return found


def _modal(job: Run, model: Model, count: int, deforming: Sequence[int]) -> ModalModel | None:
    """The modes; refuses rigid ones among those that must deform."""
    if not count:
        return None
    job.progress(f"modes of {len(model.structure.system.dofs)} degrees of freedom", 0.2)
    modal = model.normal_modes(max(count, LEAST_MODES))
    if len(modal) < count:
        raise FileError(f"{job.source} has {len(modal)} modes, not {count}")
    rigid = int(rigid_modes(modal).sum())
    if still := [k for k in deforming if k <= rigid]:
        raise FileError(
            f"{job.source}: mode {still[0]} is a rigid motion without strain; the first elastic "
            f"mode is {rigid + 1}"
        )
    if rigid:
        job.notes.append(f"Modes 1 to {rigid} are rigid motions; the first elastic is {rigid + 1}.")
    return modal


def _still(job: Run, model: Model, thickness: bool) -> None:
    from ..view import scene

    seen, pictures = model.seen, []
    pictures.append(scene.sensors(job.keep("structure.png", "the structure"), seen, []))
    if thickness:
        if not len(model.assembly.shells):
            raise FileError(f"{job.source} has no shells, so there is no thickness to show")
        t = on_faces(seen, model.assembly.thickness())
        pictures.append(scene.thickness_map(job.keep("thickness.png", "shell thickness"), seen, t))
    job.section("Structure", [Picture(p) for p in pictures])


def _moving(
    job: Run, model: Model, modal: ModalModel, chosen: list[int], moving: list[int]
) -> None:
    from ..view import scene

    motion, f = model.motion(modal.shapes), modal.frequency
    pictures = []
    if chosen:
        at = np.array(chosen) - 1
        path = job.keep("modes.png", "mode shapes")
        pictures.append(scene.montage(path, model.seen, motion[:, :, at], f[at], numbers=chosen))
    for k in moving:
        path = job.keep(f"mode_{k}.gif", f"mode {k}, animated")
        shape = motion[:, :, k - 1]
        pictures.append(scene.mode_gif(path, model.seen, shape, f[k - 1], f"mode {k}"))
    job.section("Modes", [Picture(p) for p in pictures])


def _energies(job: Run, model: Model, modal: ModalModel, chosen: list[int]) -> None:
    from ..fem.energy import shell_energies
    from ..view import scene

    if not chosen:
        return
    if not len(model.assembly.shells):
        raise FileError(f"{job.source} has no shells, so there is no strain energy map")
    e = shell_energies(model.structure, modal.shapes[:, np.array(chosen) - 1])
    area = np.linalg.norm(model.seen.areas()[: len(e)], axis=1)
    relative = e / e.sum(axis=0) * (area.sum() / area)[:, None]
    pictures = []
    for column, k in zip(relative.T, chosen, strict=True):
        values = on_faces(model.seen, column)
        path = job.keep(f"energy_{k}.png", f"strain energy of mode {k}")
        name = f"strain energy per area / mean, mode {k} ({scene.hertz(modal.frequency[k - 1])})"
        limits = (0.0, scene.usual_limits(model.seen, values)[1])
        pictures.append(
            scene.scalar_map(path, model.seen, values, name, cmap="YlOrRd", limits=limits)
        )
    job.section("Strain energy", [Picture(p) for p in pictures])


def _clearance(job: Run, model: Model, modal: ModalModel | None, chosen: list[int]) -> None:
    from ..view import scene

    found = all_gaps(model.assembly, both_ways=True)
    if not any(g.free.any() for g in found):
        raise FileError(
            f"{job.source} has no two parts of shells within {1e3 * _NEAR:g} mm of each other "
            "away from joints; leave out --clearance"
        )
    pairs = sorted(
        (summary(model.assembly, g) for g in found if g.parts[0] < g.parts[1]),
        key=lambda pair: pair.least_free,
    )
    gap = np.maximum(1e3 * nearest(model.assembly, found), 0.0)
    gap = np.fmin.reduce(gap[model.seen.faces], axis=1)
    name = "clearance away from joints"
    path = job.keep("clearance.png", "clearance between sheets")
    scene.scalar_map(path, model.seen, gap, name, "mm", "YlOrRd_r", (0.0, 5.0))
    job.json("clearance.json", [asdict(p) for p in pairs], "clearance of each pair of parts")
    blocks: list[Block] = [Picture(path, _GREY), _pairs(pairs)]
    if modal is not None:
        rigid = int(rigid_modes(modal).sum())
        if elastic := [k for k in chosen if k > rigid]:
            blocks.append(_rattle(model, modal, elastic, found))
        if len(elastic) < len(chosen):
            job.notes.append(
                "A rigid motion closes no gap, so the table of contacts leaves it out."
            )
    job.section("Clearance", blocks)


_NEAR, _DAMPING = 0.010, 0.01
_GREY = "Grey: no other sheet within 10 mm, or a joint within 18 mm."


def _pairs(pairs: Sequence[PairClearance]) -> Table:
    rows = [
        (
            *p.parts,
            *(_mm(x) for x in (p.least, p.least_free, p.uncertainty)),
            str(p.close),
            "yes" if p.touching else "",
        )
        for p in pairs
    ]
    head = (
        "part",
        "other",
        "least",
        "away from joints",
        "uncertainty ±",
        "below 0.5 mm",
        "touching",
    )
    return Table(head, rows, words=("part", "other", "touching"), caption=_PAIRS)


_PAIRS = (
    "Clearance [mm] between the sheets' faces at the nodes of the first part. Uncertainty: from "
    "flat shells, h² κ/8 of both. Below 0.5 mm: number of nodes away from joints."
)


def _mm(x: float) -> str:
    return f"{1e3 * x:.1f}" if np.isfinite(x) else "–"


def _rattle(model: Model, modal: ModalModel, chosen: list[int], found: Sequence[Gaps]) -> Table:
    """Where each mode closes a gap first, and the force at its liveliest point that does it."""
    at = np.array(chosen, int) - 1
    motion, f = model.motion(modal.shapes[:, at]), modal.frequency[at]
    drive = np.linalg.norm(motion, axis=1).max(axis=0)
    force = [g.first_contact(motion, f, _DAMPING, drive) for g in found]
    for g, value in zip(found, force, strict=True):
        value[~g.free | g.touching] = np.inf
    rows = []
    for k, mode in enumerate(chosen):
        least = [float(value[:, k].min()) for value in force]
        worst = int(np.argmin(least))
        g, row = found[worst], int(force[worst][:, k].argmin())
        place = ", ".join(f"{1e3 * x:.0f}" for x in model.assembly.points[g.rows[row]])
        pair = " – ".join(g.parts)
        size = (_mm(g.clearance[row]), number(least[worst], 2))
        rows.append((str(mode), number(f[k]), pair, place, *size))
    head = ("mode", "Hz", "first contact", "at x, y, z [mm]", "gap [mm]", "force [N]")
    return Table(head, rows, words=("first contact", "at x, y, z [mm]"), caption=_RATTLE)


_RATTLE = (
    "Force amplitude at resonance at which two separate sheets touch. The force acts at the "
    "point that moves most, damping is 1 %. Places within 18 mm of a joint are left out."
)
