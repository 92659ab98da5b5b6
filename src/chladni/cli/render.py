"""``chladni render``: pictures of a deck or case, its modes and its fields."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ..dynamics.modes import ModalModel
from ..errors import FileError
from ..report.blocks import Picture
from ..report.words import number
from .model import Model, load_model, on_faces
from .run import Out, Run, Units, started


def run(
    source: Annotated[Path, typer.Argument(metavar="DECK_or_CASE")],
    modes: Annotated[str, typer.Option(help="Modes in one picture, as 1-12 or 7,9.")] = "",
    gif: Annotated[list[int] | None, typer.Option(help="A mode to animate (repeatable).")] = None,
    energy: Annotated[
        list[int] | None, typer.Option(help="A mode whose strain energy is shown (repeatable).")
    ] = None,
    thickness: Annotated[bool, typer.Option("--thickness", help="Map of shell thickness.")] = False,
    units: Units = None,
    out: Out = None,
) -> None:
    """Pictures: modes, an animation, thickness, strain energy; without options the structure."""
    chosen = numbers(modes)
    with started("render", source, out) as job:
        job.progress("reading the model", 0.0)
        model = load_model(source, units)
        count = max([0, *chosen, *(gif or []), *(energy or [])])
        modal = _modal(job, model, count)
        job.progress("pictures", 0.6)
        _still(job, model, thickness)
        if modal is not None:
            _moving(job, model, modal, chosen, gif or [])
            _energies(job, model, modal, energy or [])
        job.lead = f"{len(job.files)} pictures of {source.name}."
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
            found += range(int(first), int(last or first) + 1)
    except ValueError:
        raise FileError(f"--modes {text!r} is not of the form 1-12 or 7,9") from None
    if found and min(found) < 1:
        raise FileError(f"--modes {text!r}: modes are counted from 1")
    return found


def _modal(job: Run, model: Model, count: int) -> ModalModel | None:
    if not count:
        return None
    job.progress(f"modes of {len(model.structure.system.dofs)} degrees of freedom", 0.2)
    modal = model.modes(count)
    if len(modal) < count:
        raise FileError(f"{job.source} has {len(modal)} modes, number {count} was asked for")
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
    density = e / np.linalg.norm(model.seen.areas()[: len(e)], axis=1)[:, None]
    pictures = []
    for column, k in zip(density.T, chosen, strict=True):
        values = on_faces(model.seen, column / column.max())
        path = job.keep(f"energy_{k}.png", f"strain energy of mode {k}")
        name = f"strain energy per area, mode {k} ({number(modal.frequency[k - 1])} Hz), relative"
        pictures.append(scene.scalar_map(path, model.seen, values, name, cmap="magma"))
    job.section("Strain energy", [Picture(p) for p in pictures])
