"""Sound files to injure: decks, recordings of a plate, tables, meshes, results, a finished run."""

import io
import json
import wave
from collections.abc import Mapping, Sequence
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
DECKS = {
    "chain.bdf": """SOL 103
CEND
SPC = 1
METHOD = 3
BEGIN BULK
EIGRL,3,,,4
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,2.,0.,0.
GRID,4,,2.,1.,0.
CELAS2,1,4000.,1,1,2,1
CBUSH,2,7,2,3,,,,0
PBUSH,7,K,1.+4,2.+4,3.+4,10.,20.,30.
CDAMP2,3,2.0,2,1,3,1
CONM2,4,2,,0.1,,,,,1.-4,,1.-4,,,1.-4
CONM2,5,3,,0.2,,,,,1.-4,,1.-4,,,1.-4
RBE2,6,3,123456,4
CONM2,7,4,,0.05
SPC1,1,123456,1
SPC1,1,23456,2
ENDDATA
""",
    "frame.bdf": """SOL 103
CEND
BEGIN BULK
MAT1*                  12.1000000000+11                             3.0E-1
*                  7850.
PBAR,1,1,1.-4,1.-9,2.-9,2.-9
PBEAML,2,1,,TUBE
,.012,.010
GRID    1               0.      0.      0.
GRID    2               .2      0.      0.
GRID    3               .4      0.      0.
GRID    4               .4      .2      0.
GRID    5               .4      .4      0.
CBAR    1       1       1       2       0.      0.      1.
CBAR    2       1       2       3       0.      0.      1.
CBEAM   3       2       3       4       0.      0.      1.
CBEAM   4       2       4       5       0.      0.      1.
CONROD  5       1       5       1-1-4
RBE3,7,,9,123456,1.,123,1,3
,5
GRID,9,,.2,.1,.1
CONM2,8,9,,.3
ENDDATA
""",
    "bricks.bdf": """BEGIN BULK
CORD2R,3,,0.,0.,0.,0.,0.,1.
,1.,0.,0.
MAT1,1,7.+10,,.33,2700.
PSOLID,1,1
GRID,1,3,0.,0.,0.
GRID,2,3,.1,0.,0.
GRID,3,3,.1,.1,0.
GRID,4,3,0.,.1,0.
GRID,5,3,0.,0.,.1
GRID,6,3,.1,0.,.1
GRID,7,3,.1,.1,.1
GRID,8,3,0.,.1,.1
GRID,9,3,.05,.05,.2
CHEXA,1,1,1,2,3,4,5,6
,7,8
CTETRA,2,1,5,6,7,9
CTETRA,3,1,5,7,8,9
SPC1,1,123,1,THRU,4
MPC,2,9,1,1.,8,1,-1.
ENDDATA
""",
    "sets.bdf": """SOL 103
CEND
TEMPERATURE(LOAD) = 4
SPC = 7
MPC = 8
METHOD = 3
BEGIN BULK
EIGRL,3,,,4
MAT1,1,7.+10,2.6316+10,.33,2700.
MATT1,1,5
TABLEM1,5
,20.,7.+10,100.,6.5+10,ENDT
TEMPD,4,80.
PBARL,1,1,,BOX
,.03,.02,.002,.003
PBEAML,2,1,,I
,.03,.02,.02,.002,.003,.003
PBAR,3,1,1.-4,1.-9,2.-9,2.-9
,,,,,,,,
,,,.5-9
GRID,1,,0.,0.,0.
GRID,2,,.2,0.,0.
GRID,3,,.4,0.,0.
GRID,4,,.4,.2,0.
CBAR,1,1,1,2,0.,0.,1.
CBEAM,2,2,2,3,0.,0.,1.
CBAR,3,3,3,4,0.,0.,1.
CONM2,4,4,,.3
,2.-4,.5-4,2.-4,,,3.-4
PSOLID,9,1
GRID,11,,0.,0.,.1
GRID,12,,.1,0.,.1
GRID,13,,0.,.1,.1
GRID,14,,0.,0.,.2
GRID,15,,.1,0.,.2
GRID,16,,0.,.1,.2
CPENTA,9,9,11,12,13,14,15,16
SPC1,1,123456,1
SPC1,2,123,11,12,13
SPCADD,6,2
SPCADD,7,1,6
MPC,3,4,3,1.,3,3,-1.
MPCADD,8,3
ENDDATA
""",
}
_SMALL = 60_000  # bytes of a deck of the user's that is taken
SENSORS = ("label", "grid", "x", "y", "z", "direction", "role", "mass", "position_sd")


CASE = """\
[model]
deck = "plate.bdf"
units = "mm-t-s"
damping = 0.01

[test]
recordings = ["frf.npz"]
quantity = "accelerance"
gain = "known"
sensors = "sensors.csv"
mass = 0.518
mass_sd = 0.001
hangers = [1, 49]

[[recording]]
file = "frf.uff"
article = "B"
level = 2.0

[band]
fit = [25.0, 170.0]
exclude = [[49.0, 51.0]]

[held_out]
sensors = 2
band = [150.0, 180.0]

[[parameter]]
name = "E of the sheet"
field = "E"
sd = 0.05
low = 0.8
high = 1.3
"""


@cache
def sound_files(more: Path | None) -> dict[str, bytes]:
    """Sound files by name; ``more``: a folder whose small decks are taken as well."""
    found = {name: text.encode() for name, text in DECKS.items()}
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
        found |= {p.name: p.read_bytes() for p in folder.iterdir()}
    found["poles.csv"] = b"mode,frequency_hz,frequency_sd_hz,damping\n" + b"".join(
        b"%d,%.4f,0.05,0.01\n" % (k + 1, hz) for k, hz in enumerate((58.1, 91.3, 130.2, 155.7))
    )
    found["time.csv"] = _time_table()
    found["run.wav"], found["run.channels.csv"] = _wav(), _WAV_TABLE.encode()
    found["sensors.csv"] = _sensor_table(ends).encode()
    found["case.toml"] = CASE.encode()
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


_WAV_TABLE = "channel,label,unit,role,scale\n1,1:+Z,N,input,100\n2,2:+Z,m/s^2,output,50\n"


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


def _sensor_table(ends: Sequence[str]) -> str:
    rows = [f"{e},{e.split(':')[0]},,,,+Z,output,0.001," for e in ends]
    return "\n".join([",".join(SENSORS), *rows, "2:+Z,2,,,,+Z,input,,", ""])


def _finished() -> DiagnosisResult:
    where = Location("at the corner", ("sheet",), (43,), (0.1, 0.2, 0.0), 0.02)
    mass = Estimate("M", 0.02, "kg", 0.018, 0.022)
    effect = NamedEffect("point-mass", "a lump", 12.0, where, (mass,))
    return DiagnosisResult(verdict="missing physics", effects=(effect,), notes=("one note",))
