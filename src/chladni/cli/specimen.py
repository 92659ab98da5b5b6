"""``chladni specimen``: a generated structure as a deck, with its formed thickness and sensors."""

import ast
import inspect
from collections.abc import Callable
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ..errors import ChladniError, FileError, LabelError, ModelError
from ..fem.energy import mass_properties
from ..model.assembly import Assembly
from ..model.plates import box, folded_panel, plate
from ..model.tailgate import sensor_grids, tailgate
from ..model.tailgate_design import TailgateDesign
from ..output import write_text
from ..report.blocks import Facts, Picture
from ..report.words import number
from ..units import units as unit_system
from .model import normals_at, on_faces
from .run import Out, Run, started

_CANDIDATES = 60


def run(
    name: Annotated[str, typer.Argument(help="tailgate, panel, box or plate.")],
    size: Annotated[float | None, typer.Option(help="Element size [mm].", min=0.1)] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE in SI (repeatable).")
    ] = None,
    units: Annotated[str, typer.Option(help="Unit system of the deck.")] = "mm-t-s",
    out: Out = None,
) -> None:
    """A generated structure: a deck, its thickness element by element, candidates for sensors."""
    from ..meshing.nastran import write_assembly

    system = unit_system(units)
    build = _builder(name)
    with started("specimen", Path(name), out) as job:
        job.progress("meshing", 0.0)
        values = dict(_setting(text) for text in settings or [])
        made = build(size, values)
        job.progress("writing", 0.5)
        write_assembly(made, job.keep("deck.bdf", f"the deck, {units}"), system)
        formed = _formed(name, size, values) if name == "tailgate" else made
        write_text(job.keep("thickness.csv", "shell thickness after forming"), _thickness(formed))
        grids = np.array(sensor_grids(made, min(_CANDIDATES, len(made.points))))
        write_text(job.keep("candidates.csv", "where sensors could sit"), _candidates(grids))
        _page(job, made, formed, grids)


def _page(job: Run, made: Assembly, formed: Assembly, grids: np.ndarray) -> None:
    from ..view import scene
    from ..view.surface import surface

    mass, pressed = mass_properties(made)[0], mass_properties(formed)[0]
    job.json(
        "specimen.json", {"mass_kg": mass, "mass_formed_kg": pressed, "shells": len(made.shells)}
    )
    seen, at, n = surface(made), made.rows(grids), normals_at(made, grids)
    markers = [
        scene.Marker(tuple(made.points[r].tolist()), tuple(d.tolist()), str(g))
        for r, d, g in zip(at, n, grids, strict=True)
    ]
    t = on_faces(seen, formed.thickness())
    pictures = [
        scene.sensors(job.keep("candidates.png", "candidates for sensors"), seen, markers),
        scene.thickness_map(job.keep("thickness.png", "shell thickness after forming"), seen, t),
    ]
    facts = [
        ("Shells", str(len(made.shells))),
        ("Grids", str(len(made.points))),
        ("Mass of the deck", f"{number(mass, 5)} kg"),
        ("Mass after forming", f"{number(pressed, 5)} kg"),
    ]
    job.section("The structure", [Facts(facts), *[Picture(p) for p in pictures]])
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


def _builder(name: str) -> Callable[[float | None, dict[str, Any]], Assembly]:
    known = {"tailgate": _tailgate, "panel": _panel, "box": _box, "plate": _plate}
    if name not in known:
        raise LabelError(f"no specimen {name!r}; there are {', '.join(known)}")
    return known[name]


def _tailgate(size: float | None, values: dict[str, Any]) -> Assembly:
    return tailgate(_made(TailgateDesign, _sized("size", size, values)))


def _formed(name: str, size: float | None, values: dict[str, Any]) -> Assembly:
    """The same design with the thickness that pressing leaves."""
    design = _made(TailgateDesign, _sized("size", size, values))
    return tailgate(replace(design, formed=True))


def _panel(size: float | None, values: dict[str, Any]) -> Assembly:
    return _made(folded_panel, _sized("h", size, values))


def _box(size: float | None, values: dict[str, Any]) -> Assembly:
    return _made(box, _sized("h", size, values))


def _plate(size: float | None, values: dict[str, Any]) -> Assembly:
    """500 x 400 x 1.2 mm unless told."""
    given = {"length": 0.5, "width": 0.4, "t": 1.2e-3, **values}
    h = 0.025 if size is None else 1e-3 * size
    counts = {
        n: max(1, round(_number(given, side) / h))
        for n, side in (("nx", "length"), ("ny", "width"))
    }
    return _made(plate, {**counts, **given})


def _number(values: dict[str, Any], key: str) -> float:
    if not isinstance(values[key], int | float):
        raise FileError(f"--set {key}={values[key]}: a number is needed")
    return float(values[key])


def _sized(key: str, size: float | None, values: dict[str, Any]) -> dict[str, Any]:
    return values if size is None else {key: 1e-3 * size, **values}


def _made(build: Callable[..., Any], values: dict[str, Any]) -> Any:
    """``build`` with these settings.

    Raises
    ------
    LabelError, ModelError
        If there is no such setting, or a value has the wrong kind.
    """
    known = [n for n in inspect.signature(build).parameters if n != "material"]
    if wrong := [key for key in values if key not in known]:
        near = get_close_matches(wrong[0], known, 3) or known
        raise LabelError(f"no setting {wrong[0]!r}; there are {', '.join(near[:12])} ...")
    try:
        return build(**values)
    except ChladniError:
        raise
    except (TypeError, ValueError, IndexError) as error:
        raise ModelError(f"a setting has the wrong kind of value: {error}") from error


def _thickness(formed: Assembly) -> str:
    rows = (
        f"{element},{','.join(f'{1e3 * x:.6g}' for x in t)}"
        for element, t in zip(formed.shells.ids, formed.shells.thickness, strict=True)
    )
    return "\n".join(["element,t1_mm,t2_mm,t3_mm,t4_mm", *rows, ""])


def _candidates(grids: np.ndarray) -> str:
    return "\n".join(["label,grid,direction,role", *(f"{g}:n,{g},n,output" for g in grids), ""])
