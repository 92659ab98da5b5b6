"""Sound files to injure: decks, recordings of a plate, tables, meshes, results, a finished run."""

import io
import json
import wave
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from chladni.effects.estimate import Estimate, Location
from chladni.geometry.formed_mesh import FormedMesh
from chladni.inference.result import NamedEffect
from chladni.io.dyna import write_keyword
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_csv, write_npz
from chladni.io.uff.write_uff import write_uff
from chladni.io.vtu import write_vtu
from chladni.model.assembly import Assembly
from chladni.output import plain
from chladni.report.diagnosis_json import diagnosis_json
from chladni.units import units
from chladni.workflows.diagnosis_result import DiagnosisResult
from chladni.workflows.frf import frf as evaluated
from chladni.workflows.loaded_model import Model, load_model
from chladni_specimens import box, plate

Files = Mapping[str, bytes]
GIVEN = Path(__file__).parent / "sound"  # decks, a case, tables
_SMALL = 60_000  # bytes of a deck of the user's that is taken


@cache
def sound_files(more: Path | None) -> dict[str, bytes]:
    """Sound files by name; ``more``: a folder whose small decks are taken as well."""
    found = {p.name: p.read_bytes() for p in sorted(GIVEN.iterdir())}
    with TemporaryDirectory() as name:
        folder = Path(name)
        made = plate(0.3, 0.22, 6, 6, 1e-3)
        write_assembly(made, folder / "plate.bdf", units("mm-t-s"))
        write_assembly(box(h=0.05), folder / "box.bdf", units("SI"))
        ends = [f"{grid}:+Z" for grid in (2, 4, 7, 18, 30, 43)]
        model = load_model(folder / "plate.bdf", "mm-t-s")
        f = np.linspace(20.0, 180.0, 161)
        frf = evaluated(model, ends, ["2:+Z"], f).frfs[0].to("accelerance")
        places = dict(zip(made.ids.tolist(), made.points, strict=True))
        write_uff(folder / "frf.uff", frf, places)
        write_npz(folder / "frf.npz", frf)
        write_csv(folder / "frf.csv", frf)
        write_uff(folder / "frf.ufb", frf, places, binary=True)
        _write_meshes(folder, made)
        (folder / "modes.pch").write_text(_punched(model))
        found |= {p.name: p.read_bytes() for p in sorted(folder.iterdir())}
    found["time.csv"] = _time_table()
    found["run.wav"] = _wav()
    found["diagnosis.json"] = json.dumps(plain(diagnosis_json(_finished())), indent=1).encode()
    paths = sorted(more.rglob("*")) if more else []
    for path in (p for p in paths if p.suffix in (".bdf", ".dat", ".nas") and p.is_file()):
        if path.stat().st_size < _SMALL:
            found[f"{path.parent.name}_{path.stem}.bdf"] = path.read_bytes()
    return found


def _time_table() -> bytes:
    """A hammer test of one degree of freedom: force and acceleration, three blocks."""
    t = np.arange(256) / 512.0
    force = np.where(np.arange(256) == 8, 10.0, 0.0)
    h = np.exp(-6 * t) * np.sin(2 * np.pi * 40 * t)
    answer = np.convolve(force, h)[:256]
    rows = [b"time_s,block,1:+Z [N],2:+Z [m/s^2]\n"]
    for block in range(3):
        rows += [b"%.6f,%d,%.5g,%.5g\n" % (t[k], block, force[k], answer[k]) for k in range(256)]
    return b"".join(rows)


def _write_meshes(folder: Path, made: Assembly) -> None:
    """Forming results of the plate, and scans of it as a closed body [mm]: the files of `map`."""
    cells = made.shells.nodes
    t = np.linspace(0.9, 1.0, len(made.points))
    part = np.ones(len(cells), np.int64)
    formed = FormedMesh(made.ids, made.points, cells, part, 1e-3 * t[cells])
    write_keyword(folder / "formed.k", formed, "mm-t-s")
    thick = replace(made.shells, thickness=1e3 * made.shells.thickness)
    write_vtu(folder / "packed.vtu", replace(made, points=1e3 * made.points, shells=thick))
    (folder / "formed.vtu").write_text(_vtu(1e3 * made.points, cells, t))
    places = [(6 * i, 6 * j) for i in range(51) for j in range(37)]
    rows = (f"{k},{x},{y},0,{0.9 + 4e-4 * x:.4f}" for k, (x, y) in enumerate(places, start=1))
    (folder / "formed.csv").write_text("\n".join(["node,x,y,z,thickness", *rows, ""]))
    _write_scans(folder)


def _vtu(points: np.ndarray, cells: np.ndarray, t: np.ndarray) -> str:
    """Quads with a thickness at their points, as text."""

    def array(name: str, kind: str, values: np.ndarray, size: int = 1) -> str:
        head = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{size}" format="ascii">'
        return "\n".join([head, *(f"{x:.6g}" for x in values.ravel()), "</DataArray>"])

    n = len(cells)
    return "\n".join(
        [
            *('<?xml version="1.0"?>', '<VTKFile type="UnstructuredGrid" version="0.1">'),
            *("<UnstructuredGrid>", f'<Piece NumberOfPoints="{len(t)}" NumberOfCells="{n}">'),
            *("<Points>", array("Points", "Float64", points, 3), "</Points>", "<Cells>"),
            array("connectivity", "Int64", cells),
            array("offsets", "Int64", 4 * np.arange(1, n + 1)),
            array("types", "Int64", np.full(n, 9)),
            *("</Cells>", "<PointData>", array("thickness", "Float64", t), "</PointData>"),
            *("</Piece>", "</UnstructuredGrid>", "</VTKFile>", ""),
        ]
    )


def _write_scans(folder: Path) -> None:
    """A plate of 300 by 220 by 1 mm as 12 triangles: STL and PLY as text and packed, OBJ."""
    corners = np.array([(x, y, z) for x in (0, 300) for y in (0, 220) for z in (-0.5, 0.5)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])
    vertices = [f"{x:g} {y:g} {z:g}" for x, y, z in corners]
    lines = ["solid plate"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {vertices[k]}" for k in face)]
        lines += ["endloop", "endfacet"]
    (folder / "scan.stl").write_text("\n".join([*lines, "endsolid plate", ""]))
    packed = np.zeros(12, np.dtype([("normal", "<f4", 3), ("at", "<f4", (3, 3)), ("of", "<u2")]))
    packed["at"] = corners[faces]
    head = b"plate".ljust(80) + (12).to_bytes(4, "little")
    (folder / "packed.stl").write_bytes(head + packed.tobytes())
    header = [*("element vertex 8", "property float x", "property float y", "property float z")]
    header += ["element face 12", "property list uchar int vertex_indices", "end_header", ""]
    rows = [*vertices, *(f"3 {a} {b} {c}" for a, b, c in faces), ""]
    plain = "\n".join(["ply", "format ascii 1.0", *header]) + "\n".join(rows)
    (folder / "scan.ply").write_text(plain)
    counted = np.zeros(12, np.dtype([("n", "u1"), ("face", "<i4", 3)]))
    counted["n"], counted["face"] = 3, faces
    raw = corners.astype("<f4").tobytes() + counted.tobytes()
    header = ["ply", "format binary_little_endian 1.0", *header]
    (folder / "packed.ply").write_bytes("\n".join(header).encode() + raw)
    named = [f"v {v}" for v in vertices] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    (folder / "scan.obj").write_text("\n".join([*named, ""]))


def _punched(model: Model) -> str:
    """Eight modes as Nastran punches them, components 1 to 3."""
    modal = model.normal_modes(8)
    motion = model.motion(modal.shapes)
    lines = []
    for k, f in enumerate(modal.frequency):
        lines += ["$TITLE   = PLATE", "$SUBTITLE=", "$LABEL   =", "$EIGENVECTOR", "$REAL OUTPUT"]
        lines += ["$SUBCASE ID =           1"]
        lines += [f"$EIGENVALUE = {(2 * np.pi * f) ** 2:14.7E}  MODE = {k + 1:5d}"]
        for point, u in zip(model.assembly.ids, motion[:, :, k], strict=True):
            lines += [f"{point:10d}       G" + "".join(f"{x:18.6E}" for x in u)]
            lines += ["-CONT-            " + 3 * f"{0.0:18.6E}"]
    return "".join(f"{line:<72}{k + 1:8d}\n" for k, line in enumerate(lines))


def _wav() -> bytes:
    """A hammer blow and its answer in 16 bits, two channels."""
    t = np.arange(2048) / 2048.0
    answer = np.exp(-6 * t) * np.sin(2 * np.pi * 40 * t)
    stereo = np.column_stack([np.where(np.arange(2048) == 8, 0.5, 0.0), 0.5 * answer])
    with io.BytesIO() as out:
        with wave.open(out, "wb") as file:
            file.setnchannels(2)
            file.setsampwidth(2)
            file.setframerate(2048)
            file.writeframes((32767 * stereo).astype("<i2").tobytes())
        return out.getvalue()


def _finished() -> DiagnosisResult:
    where = Location("at the corner", ("sheet",), (43,), (0.1, 0.2, 0.0), 0.02)
    mass = Estimate("M", 0.02, "kg", 0.018, 0.022)
    effect = NamedEffect("point-mass", "a lump", 12.0, where, (mass,))
    return DiagnosisResult(verdict="missing physics", effects=(effect,), notes=("one note",))
