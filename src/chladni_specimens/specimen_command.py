"""``chladni specimen``: a generated structure as a deck, with its formed thickness and sensors."""

import ast
import inspect
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chladni.cli.run import Out, Run, started
from chladni.errors import ChladniError, FileError, LabelError, ModelError, did_you_mean
from chladni.fem.energy import mass_properties
from chladni.geometry.formed_mesh import FormedMesh
from chladni.geometry.thickness_mapping import Mapped
from chladni.io.tables.csv_table import csv_text
from chladni.model.assembly import Assembly
from chladni.output import write_text
from chladni.report.blocks import Facts, Picture
from chladni.report.words import number
from chladni.units import units as unit_system
from chladni.workflows.loaded_model import on_faces

from .formed_panel import formed_panel
from .plates import box, folded_panel, plate
from .tailgate.design import TailgateDesign
from .tailgate.formed_thickness import forming_mesh
from .tailgate.skin import Skin
from .tailgate.tailgate import FormedSpecimen, tailgate_specimen

if TYPE_CHECKING:
    from chladni_planning import SensorCandidates


def settings_of(build: Callable[..., Any]) -> list[str]:
    """Keywords that --set may give a builder."""
    return [n for n in inspect.signature(build).parameters if n != "material"]


_BUILT: dict[str, Callable[..., Any]] = {
    "panel": folded_panel,
    "box": box,
    "plate": plate,
    "tailgate": TailgateDesign,
}
SETTINGS = "; ".join(f"{name}: {', '.join(settings_of(build))}" for name, build in _BUILT.items())
MOST_SHELLS = 200_000  # that a specimen may have: beyond, hours pass before a mode is known


def run(
    name: Annotated[
        str, typer.Argument(help="Specimen: tailgate, panel, box or plate.", metavar="NAME")
    ],
    size: Annotated[float | None, typer.Option(help="Element size [mm].", min=0.1)] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help=f"Setting KEY=VALUE in SI units (repeatable): {SETTINGS}",
            metavar="KEY=VALUE",
        ),
    ] = None,
    units: Annotated[str, typer.Option(help="Unit system of the deck.")] = "mm-t-s",
    out: Out = None,
) -> None:
    """Generate a structure: its deck, candidates for sensors, thickness after forming.

    The thickness (LS-DYNA keyword file) is that of the tailgate and the panel; the sheets of box
    and plate are flat and keep their gauge.
    """
    from chladni.geometry.thickness_mapping import map_thickness
    from chladni.io.dyna import write_keyword
    from chladni.io.nastran import write_assembly

    system = unit_system(units)
    known = {"tailgate": _tailgate, "panel": _panel, "box": _box, "plate": _plate}
    if name not in known:
        raise LabelError(f"no specimen {name!r}; there are {', '.join(known)}")
    build = known[name]
    with started("specimen", Path(name), out, adds=True) as job:
        job.progress("meshing", 0.0)
        values = dict(_setting(text) for text in settings or [])
        specimen = build(size, values)
        made = specimen.assembly
        job.progress("writing", 0.3)
        write_assembly(made, job.keep(f"{name}.bdf", f"the deck, {units}"), system)
        mapped = None
        if name in _FORMED:
            job.progress("forming", 0.4)
            formed = _FORMED[name](values)
            write_keyword(job.keep("formed_thickness.k", "thickness after forming"), formed, system)
            mapped = map_thickness(made, formed)
        job.progress("candidates for sensors", 0.7)
        _page(job, specimen, mapped)


def _page(job: Run, specimen: FormedSpecimen, mapped: Mapped | None) -> None:
    from chladni.geometry.mesh_quality import check_mesh
    from chladni.view import annotations, scene
    from chladni.view.surface import surface
    from chladni_planning import find_sensor_candidates

    made = specimen.assembly
    places, check = find_sensor_candidates(made), check_mesh(made)
    joints = Counter(j.kind for j in specimen.joints)
    write_text(job.keep("candidates.csv", "candidates for sensors"), _candidates(places))
    after = mapped.assembly if mapped else made
    mass, pressed = mass_properties(made)[0], mass_properties(after)[0]
    facts: dict[str, Any] = {
        "mass_kg": mass,
        "mass_formed_kg": pressed,
        "shells": len(made.shells),
        "candidates": len(places.ids),
        "joints": joints,
        "mesh": {"bad": check.bad, "loose": check.loose, "parts": [asdict(p) for p in check.parts]},
        "mapping": [asdict(p) for p in mapped.parts] if mapped else [],
    }
    job.json("specimen.json", facts)
    seen = surface(made)
    markers = [
        annotations.Marker(tuple(x), tuple(n), "")
        for x, n in zip(places.points.tolist(), places.outward.tolist(), strict=True)
    ]
    t = on_faces(seen, after.thickness())
    pictures = [
        scene.sensors(job.keep("candidates.png", "candidates for sensors"), seen, markers),
        scene.thickness_map(job.keep("thickness.png", "shell thickness after forming"), seen, t),
    ]
    shown = [
        ("Shells", str(len(made.shells))),
        ("Grids", str(len(made.points))),
        ("Shells of poor shape", str(len(check.bad))),
        *((f"Joints: {kind}", str(count)) for kind, count in joints.items()),
        ("Mass of the deck", f"{number(mass, 5)} kg"),
        ("Mass after forming", f"{number(pressed, 5)} kg"),
        ("Candidates for sensors", str(len(places.ids))),
    ]
    job.section("The structure", [Facts(shown), *[Picture(p) for p in pictures]])
    job.lead = f"{job.source.name}: {len(made.shells)} shells, {number(mass, 4)} kg."
    job.say(job.lead)


def _setting(text: str) -> tuple[str, Any]:
    """KEY=VALUE; the value as Python writes it, else as text."""
    key, sign, value = text.partition("=")
    if not sign:
        raise FileError(f"--set {text!r} is not of the form KEY=VALUE")
    try:
        return key.strip(), ast.literal_eval(value.strip())
    except (ValueError, SyntaxError):
        return key.strip(), value.strip()


def _tailgate(size: float | None, values: dict[str, Any]) -> FormedSpecimen:
    return tailgate_specimen(_made(TailgateDesign, _sized("size", size, values)))


_FORMED: dict[str, Callable[[dict[str, Any]], FormedMesh]] = {
    "tailgate": lambda values: forming_mesh(Skin.of(_made(TailgateDesign, values))),
    "panel": lambda values: _made(formed_panel, {k: v for k, v in values.items() if k != "h"}),
}


def _bare(assembly: Assembly) -> FormedSpecimen:
    return FormedSpecimen(assembly, {}, {}, ())


def _panel(size: float | None, values: dict[str, Any]) -> FormedSpecimen:
    given = _sized("h", size, values)
    full = {"length": 0.6, "width": 0.3, "depth": 0.03, "h": 0.02, **given}
    _affordable(_number(full, "length") * (_number(full, "width") + 2 * _number(full, "depth")),
                _number(full, "h"))  # fmt: skip
    return _bare(_made(folded_panel, given))


def _box(size: float | None, values: dict[str, Any]) -> FormedSpecimen:
    given = _sized("h", size, values)
    full = {"length": 0.3, "width": 0.2, "height": 0.1, "h": 0.02, **given}
    a, b, c = (_number(full, edge) for edge in ("length", "width", "height"))
    _affordable(2 * (a * b + b * c + c * a), _number(full, "h"))
    return _bare(_made(box, given))


def _affordable(area: float, h: float) -> None:
    """Refuse elements so small that nobody waits for the mesh, let alone for its modes."""
    if not h > 0 or area / h**2 > MOST_SHELLS:
        least = 1e3 * (abs(area) / MOST_SHELLS) ** 0.5
        raise ModelError(
            f"elements of {1e3 * h:g} mm need {area / max(h, 1e-12) ** 2:.3g} shells, more than "
            f"{MOST_SHELLS}; --size is in mm and must be at least {least:.2g} mm here"
        )


def _plate(size: float | None, values: dict[str, Any]) -> FormedSpecimen:
    """Plate of 500 x 400 x 1.2 mm by default."""
    given = {"length": 0.5, "width": 0.4, "t": 1.2e-3, **values}
    h = 0.025 if size is None else 1e-3 * size
    if size is not None:
        _affordable(_number(given, "length") * _number(given, "width"), h)
    counts = {
        n: max(1, round(_number(given, side) / h))
        for n, side in (("nx", "length"), ("ny", "width"))
    }
    return _bare(_made(plate, {**counts, **given}))


def _number(values: dict[str, Any], key: str) -> float:
    if not isinstance(values[key], int | float):
        raise FileError(f"--set {key}={values[key]}: a number is needed")
    return float(values[key])


def _sized(key: str, size: float | None, values: dict[str, Any]) -> dict[str, Any]:
    return values if size is None else {key: 1e-3 * size, **values}


def _made(build: Callable[..., Any], values: dict[str, Any]) -> Any:
    """``build`` with these settings."""
    known = settings_of(build)
    if wrong := [key for key in values if key not in known]:
        hint = did_you_mean(wrong[0], known)
        raise LabelError(f"no setting {wrong[0]!r}; {hint}there are {', '.join(known)}")
    try:
        return build(**values)
    except ChladniError:
        raise
    except (TypeError, ValueError, IndexError) as error:
        raise ModelError(f"a setting has the wrong kind of value: {error}") from error


def _candidates(places: "SensorCandidates") -> str:
    rows = (
        [
            f"{g}:n",
            *([g, "", "", ""] if is_grid else ["", *(f"{c:.7g}" for c in x)]),
            *(f"{c:.6f}" for c in n),
            "output",
        ]
        for g, is_grid, x, n in zip(
            places.ids.tolist(),
            places.is_grid.tolist(),
            places.points.tolist(),
            places.outward.tolist(),
            strict=True,
        )
    )
    return csv_text([["label", "grid", "x", "y", "z", "nx", "ny", "nz", "role"], *rows])
