"""Pictures of shape for ``render``: cuts through the structure, distance from a scan."""

from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..arrays import real_number
from ..errors import FileError
from ..geometry.cross_section import cross_section, thick_lines
from ..io.scanned_surface import read_scan
from ..report.blocks import Drawing, Picture, Table, write_pictures
from ..report.words import number
from ..view import charts
from ..workflows.loaded_model import Model, on_faces
from ..workflows.scan_comparison import ScanComparison, compare_with_scan
from .run import Run


def plane(text: str) -> tuple[int, float]:
    """Axis and place of a plane.

    >>> plane("x=0.3")
    (0, 0.3)
    """
    name, _, value = text.replace(" ", "").partition("=")
    try:
        return "xyz".index(name.lower() or "?"), real_number(value)
    except ValueError:
        raise FileError(f"--section {text!r} is not of the form x=0.3, y=-0.1 or z=1.2") from None


def cuts(job: Run, model: Model, texts: list[str]) -> None:
    """One drawing for each plane."""
    drawn = [_cut(model, text) for text in texts]
    job.files += write_pictures(job.folder, drawn, True)
    job.section("Sections", drawn)


def _cut(model: Model, text: str) -> Drawing:
    axis, at = plane(text)
    seen, shells = model.seen, len(model.assembly.shells)
    section = cross_section(seen.points, seen.faces, axis, at)
    if not len(section.face):
        along = seen.points[seen.used][:, axis]
        raise FileError(
            f"--section {text} does not cut the structure, which extends from {along.min():.4g} "
            f"to {along.max():.4g} {model.unit} along {'xyz'[axis]}"
        )
    thickness = np.zeros(len(seen.faces))
    thickness[:shells] = model.assembly.thickness()
    walls, sheet = thick_lines(section, seen.points, seen.faces, thickness), section.face < shells
    scale, unit = (1e3, "mm") if model.unit == "m" else (1.0, model.unit)
    title = f"{'xyz'[axis]} = {at:g} {model.unit}".rstrip()
    parts, of_wall = model.assembly.parts, np.asarray(seen.part)[section.face[sheet]]
    chart = charts.section(
        [(parts[k].name, scale * walls[sheet][of_wall == k]) for k in np.unique(of_wall).tolist()],
        scale * section.lines[~sheet],
        [f"{a} [{unit}]" if unit else a for a in "xyz".replace("xyz"[axis], "")],
        title,
    )
    return Drawing(f"section_{'xyz'[axis]}_{at:g}", chart, what=f"section at {title}")


def against_scan(job: Run, model: Model, path: Path, aligned: bool) -> None:
    """Map and table of the distance of the sheets' faces from a scan."""
    from ..view import scene

    scan = read_scan(path, model.length)
    found = compare_with_scan(model.assembly, scan, aligned)
    scale, unit = (1e3, "mm") if model.unit == "m" else (1.0, model.unit)
    limits = (0.0, scale * found.parts[0].most)
    picture = scene.scalar_map(
        job.keep("scan.png", "distance between sheets and scan"),
        model.seen,
        on_faces(model.seen, scale * found.off),
        "distance from the scan",
        unit,
        "YlOrRd",
        limits,
    )
    job.json("scan.json", _plain(found, scan.volume), "distance from the scan")
    job.notes += scan.notes
    if found.alignment is not None:
        rest = number(scale * found.alignment.residual)
        job.notes.append(
            f"The scan was moved onto the model from {found.alignment.start}; its closest 80 % "
            f"have a distance of {rest} {unit} rms."
        )
    if np.isfinite(scan.volume):
        job.notes.append(
            f"The scan is closed and encloses {number(scan.volume * scale**3)} {unit}³."
        )
    job.section("Scan", [Picture(picture, "Grey: not scanned."), _parts(found, scale, unit)])


def _parts(found: ScanComparison, scale: float, unit: str) -> Table:
    rows = [
        (
            p.part,
            f"{100 * p.covered:.0f}",
            *(number(scale * x, 3) for x in (p.median, p.most, p.worst)),
            ", ".join(number(scale * x, 4) for x in p.worst_point),
        )
        for p in found.parts
    ]
    head = ("part", "scanned [%]", "half within", "95 % within", "farthest", "at x, y, z")
    caption = (
        f"Distance between the sheets' faces and the scan [{unit}], where the part was scanned."
    )
    return Table(head, rows, words=("part", "at x, y, z"), caption=caption)


def _plain(found: ScanComparison, volume: float) -> dict[str, object]:
    fit = found.alignment
    return {
        "parts": [asdict(p) for p in found.parts],
        "volume": volume if np.isfinite(volume) else None,
        "rotation": None if fit is None else fit.rotation,
        "shift": None if fit is None else fit.shift,
    }
