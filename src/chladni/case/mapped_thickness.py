"""Thickness from a file: of a forming simulation, or of a scan of both faces."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import FileError
from ..geometry.formed_mesh import FormedMesh
from ..geometry.nearest import ShellSurface
from ..geometry.scan_alignment import align_scan, as_sheet
from ..geometry.thickness_alignment import Alignment, align, moved
from ..geometry.thickness_mapping import Mapped, default_reach, map_thickness, shell_area
from ..geometry.thickness_of_scan import thickness_of_scan
from ..io.formed_files import read_formed
from ..io.scanned_surface import SUFFIXES, read_scan
from ..model.assembly import Assembly
from ..units import Units

LEAST_COVERED = 0.2  # of the area of the parts: below it the file lies elsewhere
HALF_COVERED = 0.5  # of a part: below it the part is named
PLACES = ("as it lies", "aligned", "mirrored")  # where the file's sheets are, on the deck's


@dataclass(frozen=True, eq=False)
class FormedThickness:
    """An assembly with the thickness of a file, how it was brought there, and remarks."""

    source: Path
    mapped: Mapped
    alignment: Alignment | None
    notes: tuple[str, ...] = ()

    def said(self) -> list[str]:
        """Sentences on the mapped thickness."""
        parts, fit = self.mapped.parts, self.alignment
        worst = min(parts, key=lambda p: p.coverage)
        out = [
            f"Thickness from {self.source.name}, onto {len(parts)} of the deck's "
            f"{_parts_with_shells(self.mapped.assembly)} parts with shells (least covered: "
            f"{worst.part}, {100 * worst.coverage:.0f} %); their mass goes from "
            f"{self.mapped.mass_before:.4g} to {self.mapped.mass_after:.4g} kg."
        ]
        if fit is not None:
            out.append(
                f"{self.source.name} was moved onto the deck from {fit.start}; its closest 80 % "
                f"have a distance of {1e3 * fit.residual:.3g} mm rms."
            )
        if half := [p.part for p in parts if p.coverage < HALF_COVERED]:
            out.append(f"Less than half of {', '.join(half)} has a matching sheet in the file.")
        return [*out, *self.notes]


def _parts_with_shells(assembly: Assembly) -> int:
    return len(set(assembly.shells.part.tolist()))


def formed_thickness(
    made: Assembly,
    path: Path,
    units: Units,
    place: str = "as it lies",
    pairs: Mapping[str, int] | None = None,
) -> FormedThickness:
    """The assembly with the thickness a file holds: a forming result, or a scan (STL, PLY, OBJ).

    Parameters
    ----------
    units : of the file; a scan's unit of length
    place : one of ``PLACES``
    pairs : part -> part id of the forming result, where names do not tell

    Raises
    ------
    FileError, ModelError, AccuracyError
        If the file cannot be read, lies elsewhere, or fits nothing.
    """
    if not len(made.shells):
        raise FileError("the deck has no shells, so there is no thickness to map onto")
    if not path.is_file():
        raise FileError(f"no file {path}")
    if path.suffix.lower() in SUFFIXES and not _holds_thickness(path):
        if pairs:
            raise FileError(f"{path} is a scan; it has no numbered parts to pair")
        return _of_scan(made, path, units, place)
    formed = read_formed(path, units)
    fit = _fitted(made, formed, place)
    there = formed if fit is None else moved(formed, fit)
    mapped = map_thickness(made, there, pairs=pairs)
    if (covered := _covered(mapped)) < LEAST_COVERED:
        why = "" if len(formed.cells) else _too_sparse(made, there, covered)
        raise FileError(f"{path}: {why or _elsewhere(mapped, covered, place, formed)}")
    return FormedThickness(path, mapped, fit)


def _too_sparse(made: Assembly, formed: FormedMesh, covered: float) -> str:
    """Why points without cells on the deck cover little: their spacing; "" if it is not that."""
    from scipy.spatial import cKDTree

    if len(formed.points) < 2:
        return ""
    reach = default_reach(made)
    spacing = float(np.median(cKDTree(formed.points).query(formed.points, k=2)[0][:, 1]))
    shells = ShellSurface.over("the shells", made.points, made.shells.nodes)
    off = shells.closest_points(formed.points).distance
    if spacing <= reach or float(np.median(off)) > reach:
        return ""
    return (
        f"its points have no cells and are {1e3 * spacing:.3g} mm apart; a corner of a "
        f"shell takes the thickness of points within {1e3 * reach:.2g} mm, so only "
        f"{100 * covered:.2g} % of the area has one; give the cells as well (VTU, PLY or an "
        f"LS-DYNA keyword file), or points at most {1e3 * reach:.2g} mm apart"
    )


def _covered(mapped: Mapped) -> float:
    """Share of the area of the mapped parts that has a thickness of the file."""
    area, part = shell_area(mapped.assembly), mapped.assembly.shells.part
    size = [float(area[part == mapped.assembly.part(p.part)].sum()) for p in mapped.parts]
    return sum(s * p.coverage for s, p in zip(size, mapped.parts, strict=True)) / sum(size)


def _elsewhere(mapped: Mapped, covered: float, place: str, formed: FormedMesh) -> str:
    """Why a file covers little: its sheets or points hardly lie on those of the deck."""
    if not len(formed.cells):
        advice = "points without cells cannot be aligned, so give them in the deck's frame and unit"
    elif place == PLACES[0]:
        advice = "move it onto the deck (aligned)"
    else:
        advice = "it may belong to another part"
    return (
        f"{100 * covered:.2g} % of the area of {len(mapped.parts)} parts has a matching "
        f"sheet in it; {advice}"
    )


def _holds_thickness(path: Path) -> bool:
    """True if a PLY has a thickness, so it is not a plain scan."""
    with path.open("rb") as file:
        head = file.read(4096).split(b"end_header")[0].lower()
    return path.suffix.lower() == ".ply" and any(
        line.split()[-1:] in ([b"thickness"], [b"t"], [b"thk"]) for line in head.splitlines()
    )


def _fitted(made: Assembly, formed: FormedMesh, place: str) -> Alignment | None:
    """The motion onto the parts the file names, or onto all."""
    if place == PLACES[0]:
        return None
    names = {name.strip().lower() for name in formed.names.values()}
    shared = [p.name for p in made.parts if p.name.strip().lower() in names]
    present = {made.parts[k].name for k in set(made.shells.part.tolist())}
    parts = [name for name in shared if name in present]
    return align(made, formed, parts=parts, allow_mirror=place == "mirrored")


def _of_scan(made: Assembly, path: Path, units: Units, place: str) -> FormedThickness:
    scan = read_scan(path, units.length)
    points, fit = scan.points, None
    if place != PLACES[0]:
        sheet = as_sheet(scan.points, scan.cells)
        fit = align_scan(made, sheet, allow_mirror=place == "mirrored")
        points = moved(sheet, fit).points
    return FormedThickness(path, thickness_of_scan(made, points, scan.cells), fit, scan.notes)
