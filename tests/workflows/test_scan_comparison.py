"""A model against a scan that is its own face, displaced by known amounts."""

import numpy as np
import pytest
import trimesh
from tests.builders.commands import ran, refused

from chladni.errors import FileError
from chladni.geometry.facets import point_normals
from chladni.io.nastran import write_assembly
from chladni.io.scanned_surface import ScannedSurface, read_scan
from chladni.units import units
from chladni.workflows.scan_comparison import compare_with_scan
from chladni_specimens.plates import folded_panel, plate

PANEL = folded_panel()
CELLS = PANEL.shells.nodes
T = float(PANEL.thickness()[0])
NORMAL = point_normals(PANEL.points, CELLS)


def _scan(points):
    halves = np.vstack([CELLS[:, [0, 1, 2, 2]], CELLS[:, [0, 2, 3, 3]]])
    return ScannedSurface(points, halves, np.nan, ())


def _panel(found):
    return next(p for p in found.parts if p.part == "panel")


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_scan_of_either_face_is_no_distance_away(side):
    """The sheet's face is half its thickness from the middle that the shells stand for."""
    flat = plate(0.4, 0.3, 8, 6, 2e-3)
    halves = np.vstack([flat.shells.nodes[:, [0, 1, 2, 2]], flat.shells.nodes[:, [0, 2, 3, 3]]])
    scan = ScannedSurface(flat.points + side * np.array([0, 0, 1e-3]), halves, np.nan, ())
    (found,) = compare_with_scan(flat, scan).parts
    assert found.covered == pytest.approx(1)
    assert found.worst < 1e-12


def test_half_a_scan_covers_half_the_part():
    flat = plate(0.4, 0.3, 8, 6, 2e-3)
    left = flat.shells.nodes[flat.points[flat.shells.nodes, 0].max(axis=1) < 0.21]
    halves = np.vstack([left[:, [0, 1, 2, 2]], left[:, [0, 2, 3, 3]]])
    one = compare_with_scan(flat, ScannedSurface(flat.points, halves, np.nan, ()))
    assert one.parts[0].covered == pytest.approx(0.5)
    assert np.isnan(one.off).sum() == 24


def test_a_dent_is_found_where_and_as_deep_as_it_is():
    """On the flat of the panel 2 mm deep, wide against the mesh: the deepest shell is there."""
    flat = np.unique(CELLS[PANEL.shells.part == 0])
    flat = np.isin(np.arange(len(PANEL.points)), flat) & (np.abs(NORMAL[:, 2]) > 0.95)
    centre = PANEL.points[flat].mean(axis=0)
    away = np.linalg.norm(PANEL.points - centre, axis=1)
    dent = 2e-3 * np.exp(-(away**2) / (2 * 0.08**2)) * flat
    scan = _scan(PANEL.points + (T / 2 + dent)[:, None] * NORMAL)
    worst = _panel(compare_with_scan(PANEL, scan))
    assert worst.worst == pytest.approx(2e-3, rel=0.1)
    assert np.linalg.norm(worst.worst_point - centre) < 0.04


def test_a_scan_in_another_frame_is_brought_back():
    """Turned by 20 degrees and shifted; the motion found undoes the one put in."""
    R = trimesh.transformations.rotation_matrix(np.radians(20), [1, 2, 3])[:3, :3]
    points = (PANEL.points + T / 2 * NORMAL) @ R.T + [0.3, -0.1, 0.2]
    with pytest.raises(FileError, match="use --align"):
        compare_with_scan(PANEL, _scan(points + 1.0))
    found = compare_with_scan(PANEL, _scan(points), aligned=True)
    np.testing.assert_allclose(found.alignment.rotation @ R, np.eye(3), atol=1e-3)
    assert _panel(found).median < 0.1 * T


def test_render_shows_sections_and_the_scan(tmp_path):
    """Through files, in millimetres, as a user does it."""
    write_assembly(PANEL, tmp_path / "panel.bdf", units("mm-t-s"))
    faces = _scan(1e3 * (PANEL.points + T / 2 * NORMAL))
    trimesh.Trimesh(faces.points, faces.cells[:, :3], process=False).export(tmp_path / "panel.stl")
    at = f"x={PANEL.points[:, 0].mean():.3f}"
    words = ["render", str(tmp_path / "panel.bdf"), "--units", "mm-t-s", "--out"]
    shown = [*words, str(tmp_path / "out"), "--section", at, "--scan", str(tmp_path / "panel.stl")]
    ran(*shown)
    made = {p.name for p in (tmp_path / "out").iterdir()}
    assert {"scan.png", "scan.json", "report.html"} <= made
    assert any(name.startswith("section_x") for name in made)
    assert "free edges" in (tmp_path / "out" / "report.html").read_text()
    assert read_scan(tmp_path / "panel.stl", 1e-3).points.max() == pytest.approx(
        faces.points.max() * 1e-3, rel=1e-5
    )


@pytest.mark.parametrize(
    ("text", "sentence"), [("q=1", "not of the form x=0.3"), ("x=9", "extends from 0 to")]
)
def test_a_plane_that_means_nothing_is_refused(tmp_path, text, sentence):
    write_assembly(PANEL, tmp_path / "panel.bdf", units("SI"))
    words = ["render", str(tmp_path / "panel.bdf"), "--units", "SI", "--section", text]
    said = refused(*words, "--out", tmp_path / "out")
    assert sentence in " ".join(said.split())
