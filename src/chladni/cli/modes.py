"""``chladni modes``: normal modes of a deck or case."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ..dynamics.modes import ModalModel, rigid_modes
from ..report.blocks import Facts, Picture, Table
from ..report.words import number
from ..workflows.loaded_model import Model, load_model
from .run import Allow, Out, Run, Units, started


def run(
    source: Annotated[Path, typer.Argument(metavar="DECK_or_CASE")],
    count: Annotated[int, typer.Option(help="How many modes.", min=1)] = 20,
    units: Units = None,
    allow: Allow = None,
    subcase: Annotated[
        int | None, typer.Option(help="Whose supports hold; the first that seeks modes.", min=0)
    ] = None,
    out: Out = None,
) -> None:
    """Normal modes: frequencies, shapes, mass, energy of each part, a VTU file and pictures."""
    with started("modes", source, out) as job:
        job.progress("reading the model", 0.0)
        model = load_model(source, units, allow or (), subcase)
        job.notes.extend(model.notes)
        job.progress("matrices", 0.1)
        modal = _solved(job, model, count)
        job.progress("energies", 0.6)
        result = summary(model, modal)
        if not model.unit:
            job.notes.append(
                "No unit system was given (--units), so mass and lengths are in the deck's own "
                "units; frequencies are Hz in any consistent system."
            )
        job.json("modes.json", result)
        job.progress("pictures", 0.7)
        _pictures(job, model, modal)
        _page(job, result, *(("kg", "m") if model.unit else ("deck units", "deck units")))


def _solved(job: Run, model: Model, count: int) -> ModalModel:
    size = len(model.structure.system.dofs)
    job.progress(f"modes of {size} degrees of freedom", 0.2)
    modal = model.modes(count)
    if len(modal) < count:
        job.notes.append(f"The model has {len(modal)} modes, {count} were asked for.")
    rigid = int(rigid_modes(modal).sum())
    job.notes.append(f"{size} degrees of freedom are free; {rigid} modes are rigid motions.")
    return modal


def summary(model: Model, modal: ModalModel) -> dict[str, Any]:
    """What ``modes.json`` holds (DESIGN: frequency_hz, generalized_mass, mass_kg, ...)."""
    from ..fem.energy import mass_properties, part_energies

    phi, system = modal.shapes, model.structure.system
    mass, centre = mass_properties(model.assembly)
    energy = np.where(rigid_modes(modal), np.nan, part_energies(model.structure, phi))
    return {
        "frequency_hz": modal.frequency,
        "generalized_mass": np.einsum("nr,nr->r", phi, system.M @ phi),
        "mass_kg": mass,
        "centre_of_gravity_m": centre,
        "rigid": rigid_modes(modal),
        "parts": {
            part.name: {"id": part.id, "strain_energy": energy[k]}
            for k, part in enumerate(model.assembly.parts)
        },
    }


def _pictures(job: Run, model: Model, modal: ModalModel) -> None:
    from ..io.vtu import write_vtu
    from ..view.scene import montage

    motion = model.motion(modal.shapes)
    write_vtu(job.keep("modes.vtu", "shapes for ParaView"), model.assembly, motion, modal.frequency)
    elastic = np.flatnonzero(~rigid_modes(modal))
    shown = elastic[:12] if len(elastic) else np.arange(min(12, len(modal)))
    picture = montage(
        job.keep("modes.png", "the first elastic modes"),
        model.seen,
        motion[:, :, shown],
        modal.frequency[shown],
        numbers=[int(k) + 1 for k in shown],
    )
    job.section("Mode shapes", [Picture(picture, "Colour: displacement, 0 to its largest.")])


def _page(job: Run, result: dict[str, Any], kg: str, m: str) -> None:
    f, parts = result["frequency_hz"], result["parts"]
    job.lead = (
        f"{len(f)} modes from {number(f[0])} to {number(f[-1])} Hz; "
        f"its mass is {number(result['mass_kg'])} {kg}."
    )
    centre = ", ".join(number(x) for x in result["centre_of_gravity_m"])
    mass = f"{number(result['mass_kg'], 6)} {kg}"
    facts = [("Mass", mass), ("Centre of gravity", f"({centre}) {m}")]
    rows = [
        (str(k + 1), number(f[k], 6), *(_share(p["strain_energy"][k]) for p in parts.values()))
        for k in range(len(f))
    ]
    table = Table(("mode", "Hz", *parts), rows, caption="Share of each part in the strain energy.")
    job.section("Modes", [Facts(facts), table])
    job.say(job.lead)


def _share(value: float) -> str:
    return "–" if not np.isfinite(value) else f"{100 * value:.1f} %"
