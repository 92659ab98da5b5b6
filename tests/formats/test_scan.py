"""Scans in STL, PLY and OBJ: what is read, what is said of them, what is refused."""

import re

import numpy as np
import pytest
import trimesh

from chladni.errors import FileError
from chladni.geometry.scan_alignment import as_sheet
from chladni.io.scanned_surface import read_scan

CORNERS = np.array([[0.0, 0, 0], [30, 0, 0], [30, 20, 0], [0, 20, 0]])
SHEET = np.array([[0, 1, 2], [0, 2, 3]])


def _saved(folder, points, faces, name="scan.stl"):
    trimesh.Trimesh(points, faces, process=False).export(folder / name)
    return folder / name


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_a_closed_body_has_a_volume_in_si(tmp_path, suffix):
    trimesh.creation.box((300, 200, 100)).export(tmp_path / f"box.{suffix}")
    scan = read_scan(tmp_path / f"box.{suffix}", 1e-3)
    assert scan.volume == pytest.approx(0.3 * 0.2 * 0.1)
    assert np.ptp(scan.points, axis=0) == pytest.approx([0.3, 0.2, 0.1])
    assert len(scan.cells) == 12
    assert scan.notes == ()


def test_an_open_sheet_is_said_to_be_open(tmp_path):
    scan = read_scan(_saved(tmp_path, CORNERS, SHEET), 1e-3)
    assert np.isnan(scan.volume)
    assert len(scan.notes) == 1
    assert "4 free edges (80 %), 0.1 m in total" in scan.notes[0]


def test_triangles_wound_against_each_other_are_named(tmp_path):
    scan = read_scan(_saved(tmp_path, CORNERS, np.array([[0, 1, 2], [0, 3, 2]])))
    assert any("both sides of 1 edges" in note for note in scan.notes)


def test_triangles_without_area_are_left_out_and_counted(tmp_path):
    points = np.vstack([CORNERS, [[15.0, 0, 0]]])
    path = _saved(tmp_path, points, np.vstack([SHEET, [[0, 4, 1]]]), "scan.ply")
    scan = read_scan(path)
    assert len(scan.cells) == 2
    assert "1 triangles of the scan have no area" in scan.notes[0]


MISPLACED = b"""ply
format ascii 1.0
element vertex 1
property float x
element face 1
end_header
0
property list uchar int vertex_indices
"""


@pytest.mark.parametrize(
    ("name", "data", "sentence"),
    [
        ("a.stl", b"", "holds no triangles"),
        ("a.stl", bytes(200), "holds no triangles"),
        ("a.ply", b"garbage", "cannot be read as a triangulated surface"),
        ("a.ply", b"ply\nformat ascii 1.0\nend_header\n", "holds no triangles"),
        ("a.ply", MISPLACED, "cannot be read as a triangulated surface"),
        ("a.step", b"ISO-10303-21;", "one of .stl, .ply, .obj"),
    ],
)
def test_what_is_no_scan_is_refused_in_a_sentence(tmp_path, name, data, sentence):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(FileError, match=sentence):
        read_scan(tmp_path / name)


def test_a_missing_scan_and_flat_triangles_are_refused(tmp_path):
    with pytest.raises(FileError, match="no file"):
        read_scan(tmp_path / "none.stl")
    with pytest.raises(FileError, match="none of its 1 triangles has an area"):
        read_scan(_saved(tmp_path, CORNERS[:2], np.array([[0, 1, 1]]), "line.ply"))


def _changed(folder, name, old, new):
    """A box in a file of text, with one of its lines another."""
    mesh = trimesh.creation.box((300, 200, 100))
    suffix = name.rpartition(".")[2]
    kinds = {"stl": {"file_type": "stl_ascii"}, "ply": {"encoding": "ascii"}}
    mesh.export(folder / name, **kinds.get(suffix, {}))
    lines = (folder / name).read_text().split("\n")
    k = [k for k, line in enumerate(lines) if re.match(old, line)][2]
    lines[k : k + 1] = [] if new is None else [new]
    (folder / name).write_text("\n".join(lines))
    return folder / name


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("a.stl", "vertex ", "vertex nan 0 0", r"point 2 .* is at \(nan, 0, 0\) m"),
        ("a.stl", "vertex ", "vertex 3e38 0 0", r"point 2 .* is at \(3e\+35, 0, 0\) m"),
        ("a.stl", "endsolid|endloop", "", None),  # a keyword that is not needed
        ("a.ply", "3 ", "3 0 -1 2", "cell 2 .* names point -1; there are 0 to 7"),
        ("a.ply", "3 ", None, "states 20 lines, but only 19 can be read"),
        ("a.ply", r"[-\d.]+ [-\d.]+ ", "0 inf 0", r"point 2 .*inf"),
        ("a.obj", "f ", "f 1 2 -3", r"a\.obj, line \d+: a face names vertex -3"),
        ("a.obj", "f ", "f 0/1 1/1 2/1", r"a\.obj, line \d+: a face names vertex 0"),
        ("a.obj", "v ", "v 1 nan 0", r"point 2 .*nan"),
    ],
)
def test_a_damaged_scan_is_refused_and_not_mended(tmp_path, name, old, new, said):
    """A reader that drops or turns round what it cannot use would leave a hole in the part."""
    path = _changed(tmp_path, name, old, new)
    if said is None:
        assert read_scan(path, 1e-3).volume == pytest.approx(6e-3)
        return
    with pytest.raises(FileError, match=said):
        read_scan(path, 1e-3)


@pytest.mark.parametrize("change", ["cut", "longer", "count"])
def test_a_binary_stl_is_as_long_as_it_says(tmp_path, change):
    path = tmp_path / "a.stl"
    trimesh.creation.box((300, 200, 100)).export(path)
    data = path.read_bytes()
    path.write_bytes({
        "cut": data[:-50], "longer": data + data[-50:], "count": data[:80] + b"\3\0\0\0" + data[84:]
    }[change])  # fmt: skip
    with pytest.raises(FileError, match=r"states \d+ triangles, but only \d+ can be read"):
        read_scan(path, 1e-3)


def test_a_scan_is_a_sheet_without_thickness(tmp_path):
    """It is brought onto the deck before its thickness is known."""
    scan = read_scan(_saved(tmp_path, CORNERS, np.array([[0, 1, 2], [0, 2, 3]]), "a.ply"))
    assert not np.isfinite(as_sheet(scan.points, scan.cells).thickness).any()
