"""Scans in STL, PLY and OBJ: what is read, what is said of them, what is refused."""

import re

import numpy as np
import pytest
import trimesh
from tests.builders.refusals import says

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


def test_a_missing_scan_and_flat_triangles_are_refused(tmp_path):
    says("no file", read_scan, tmp_path / "none.stl")
    flat = _saved(tmp_path, CORNERS[:2], np.array([[0, 1, 1]]), "line.ply")
    says("none of its 1 triangles has an area", read_scan, flat)


def _changed(path, old, new):
    """A box in a file of text, with one of its lines another."""
    kinds = {".stl": {"file_type": "stl_ascii"}, ".ply": {"encoding": "ascii"}}
    trimesh.creation.box((300, 200, 100)).export(path, **kinds.get(path.suffix, {}))
    lines = path.read_text().split("\n")
    k = [k for k, line in enumerate(lines) if re.match(old, line)][2]
    lines[k : k + 1] = [] if new is None else [new]
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("a.stl", "vertex ", "vertex nan 0 0", r"point 2 .* is at \(nan, 0, 0\) m"),
        ("a.stl", "vertex ", "vertex 3e38 0 0", r"point 2 .* is at \(3e\+35, 0, 0\) m"),
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
    says(said, read_scan, _changed(tmp_path / name, old, new), 1e-3)


def test_a_keyword_that_is_not_needed_may_be_missing(tmp_path):
    path = _changed(tmp_path / "a.stl", "endsolid|endloop", "")
    assert read_scan(path, 1e-3).volume == pytest.approx(6e-3)


def test_a_binary_stl_is_as_long_as_it_says(tmp_path):
    path = tmp_path / "a.stl"
    trimesh.creation.box((300, 200, 100)).export(path)
    data = path.read_bytes()
    for other in (data[:-50], data + data[-50:], data[:80] + b"\3\0\0\0" + data[84:]):
        path.write_bytes(other)
        says(r"states \d+ triangles, but only \d+ can be read", read_scan, path, 1e-3)


def test_a_scan_is_a_sheet_without_thickness(tmp_path):
    """It is brought onto the deck before its thickness is known."""
    scan = read_scan(_saved(tmp_path, CORNERS, SHEET, "a.ply"))
    assert not np.isfinite(as_sheet(scan.points, scan.cells).thickness).any()
