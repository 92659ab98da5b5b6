"""Thickness mapped by the command and by a case: fields known in closed form come through."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from tests.builders.cases import changed_case
from tests.builders.commands import call, ran, refused

import chladni
from chladni.case.mapped_thickness import formed_thickness
from chladni.errors import ChladniError
from chladni.geometry.formed_mesh import FormedMesh
from chladni.geometry.thickness_mapping import shell_mass
from chladni.io.dyna import write_keyword
from chladni.io.nastran import write_assembly
from chladni.units import UNITS
from chladni_specimens.plates import folded_panel, plate

SIZE, T = (0.3, 0.22), 1e-3


def field(points):
    """Thickness linear over the sheet, 0.8 to 1.02 mm."""
    return 0.8e-3 + 0.5e-3 * points[:, 0] + 0.3e-3 * points[:, 1]


def formed_of(assembly, t=field):
    """The assembly's own shells as a forming result."""
    nodes, parts = assembly.shells.nodes, assembly.parts
    number = np.array([parts[p].id for p in assembly.shells.part])
    names = {p.id: p.name for p in parts}
    points = assembly.points
    return FormedMesh(assembly.ids, points, nodes, number, t(points)[nodes], names)


@pytest.fixture
def deck(tmp_path):
    return write_assembly(plate(*SIZE, 6, 6, T), tmp_path / "plate.bdf", "mm-t-s")


@pytest.fixture
def formed(tmp_path):
    """A mesh of its own, 1.6 times as fine."""
    return write_keyword(tmp_path / "formed.k", formed_of(plate(*SIZE, 10, 9, T)), "mm-t-s")


def test_a_linear_field_comes_through(deck, formed, tmp_path):
    """Gauss points carry a linear field exactly: the mass is ρ ∫ t dA, whatever the meshes."""
    out = tmp_path / "out"
    ran("map", deck, formed, "--units", "mm-t-s", "--out", out)
    after = chladni.load(out / "mapped.bdf", "mm-t-s").assembly
    rho = after.parts[0].section.membrane.rho
    mean = field(np.array([[SIZE[0] / 2, SIZE[1] / 2, 0.0]]))[0]
    assert shell_mass(after).sum() == pytest.approx(rho * mean * SIZE[0] * SIZE[1], rel=1e-4)
    middle = after.points[after.shells.nodes].mean(axis=1)
    np.testing.assert_allclose(after.thickness(), field(middle), rtol=1e-3)
    assert np.ptp(after.shells.thickness, axis=1).min() > 0, "each corner has its own"
    (part,) = json.loads((out / "mapping.json").read_text())["parts"]
    assert part["coverage"] == pytest.approx(1)
    assert part["round_trip"] < 0.01


def test_a_file_that_lies_elsewhere_is_brought_or_refused(deck, tmp_path):
    made = formed_of(plate(*SIZE, 10, 9, T))
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    away = write_keyword(
        tmp_path / "away.k", replace(made, points=made.points @ turn.T + [1, 2, 3]), "mm-t-s"
    )
    assert "move it onto the deck" in refused(
        "map", deck, away, "--units", "mm-t-s", "--out", tmp_path / "out"
    )
    ran("map", deck, away, "--units", "mm-t-s", "--align", "--out", tmp_path / "out")
    (part,) = json.loads((tmp_path / "out" / "mapping.json").read_text())["parts"]
    assert part["coverage"] > 0.99


def points_of(path, points):
    """A table of points with thickness, without cells."""
    rows = [f"{x:.6g},{y:.6g},{z:.6g},{1e3 * T:g}" for x, y, z in 1e3 * points]
    path.write_text("\n".join(["x,y,z,thickness", *rows, ""]))
    return path


def test_points_without_cells_are_refused_with_the_reason(deck, tmp_path):
    """Too far apart, they leave the shells bare; elsewhere, they cannot be aligned."""
    words = ("--units", "mm-t-s", "--out", tmp_path / "out")
    coarse, fine = plate(*SIZE, 6, 6, T).points, plate(*SIZE, 60, 60, T).points
    said = refused("map", deck, points_of(tmp_path / "coarse.csv", coarse), *words)
    assert "have no cells and are 36.7 mm apart" in said
    assert "points at most 6 mm apart" in said
    said = refused(
        "map", deck, points_of(tmp_path / "away.csv", fine + np.array([0, 0, 1.0])), *words
    )
    assert "points without cells cannot be aligned" in said
    ran("map", deck, points_of(tmp_path / "fine.csv", fine), *words)


def wedge(folder, name, off=0.0, open_=False):
    """A solid plate of thickness ``field`` as a scan of both faces, its middle ``off`` [m]."""
    made = plate(*SIZE, 12, 12, T)
    n, quads = len(made.points), made.shells.nodes
    up = np.array([0, 0, 1.0])
    half = field(made.points)[:, None] / 2
    points = np.vstack([made.points + (off + half) * up, made.points + (off - half) * up])
    both = quads if open_ else np.vstack([quads, n + quads[:, ::-1]])
    faces = np.vstack([both[:, [0, 1, 2]], both[:, [0, 2, 3]]])
    trimesh.Trimesh(1e3 * points, faces, process=False).export(folder / name)
    return folder / name


@pytest.mark.parametrize("suffix", ["stl", "ply"])
def test_a_scan_of_both_faces_is_a_thickness(tmp_path, suffix):
    """Whether the shells lie in the middle or 0.3 mm beside it."""
    made = plate(*SIZE, 6, 6, T)
    for off in (0.0, 0.3e-3):
        scan = wedge(tmp_path, f"scan.{suffix}", off)
        found = formed_thickness(made, scan, UNITS["mm-t-s"]).mapped
        middle = made.points[made.shells.nodes].mean(axis=1)
        np.testing.assert_allclose(found.assembly.thickness(), field(middle), rtol=2e-3)
        assert found.parts[0].coverage == pytest.approx(1)
        assert found.parts[0].distance_95 == pytest.approx(off, abs=1e-6)


def test_a_scan_of_one_face_has_no_thickness(tmp_path):
    with pytest.raises(ChladniError, match="scan both faces"):
        formed_thickness(
            plate(*SIZE, 6, 6, T), wedge(tmp_path, "scan.stl", open_=True), UNITS["mm-t-s"]
        )


def test_parts_the_file_lacks_are_guessed_or_named(tmp_path):
    """Sheets of two panels and flanges pressed alike; one flange is left out of the file."""
    made = folded_panel()
    deck = write_assembly(made, tmp_path / "panel.bdf", "mm-t-s")
    whole = formed_of(made, lambda x: np.full(len(x), 0.9e-3))
    first = whole.part == whole.part.min()
    some = replace(
        whole, cells=whole.cells[first], part=whole.part[first],
        thickness=whole.thickness[first], nodal=np.zeros(0),
    )  # fmt: skip
    path = write_keyword(tmp_path / "some.k", some, "mm-t-s")
    found = chladni.map_formed(chladni.load(deck, "mm-t-s"), path)
    assert any("keep that of the deck" in note for note in found.notes)
    with pytest.raises(ChladniError, match="three or more are needed to learn from"):
        chladni.map_formed(chladni.load(deck, "mm-t-s"), path, guess=True)


def curved(curvature):
    """Sheets side by side, bent to these curvatures [1/m], a part each."""
    single = plate(0.2, 0.15, 12, 9, T)
    n, m = len(single.points), len(single.shells)
    points, nodes = [], []
    for k, kappa in enumerate(curvature):
        x, y, _ = single.points.T
        angle = kappa * x
        points.append(np.column_stack([np.sin(angle) / kappa, y + k, (1 - np.cos(angle)) / kappa]))
        nodes.append(single.shells.nodes + k * n)
    count = len(curvature)
    shells = replace(
        single.shells,
        ids=np.arange(1, count * m + 1),
        nodes=np.vstack(nodes),
        part=np.repeat(np.arange(count), m),
        thickness=np.tile(single.shells.thickness, (count, 1)),
        axis=np.tile(single.shells.axis, (count, 1)),
        offset=np.tile(single.shells.offset, count),
    )
    parts = tuple(replace(single.parts[0], id=k + 1, name=f"sheet {k + 1}") for k in range(count))
    ids = np.arange(1, count * n + 1)
    held = np.array([(k * n, c) for k in range(count) for c in range(1, 7)])
    points = np.vstack(points)
    return replace(single, ids=ids, points=points, parts=parts, shells=shells, supports=held)


def test_a_missing_part_thins_as_its_curvature_lets_expect(tmp_path):
    """Thinning 0.4 κ/(κ + 25) on three sheets is found again on a fourth the file lacks."""
    curvature = (2.0, 4.0, 8.0, 6.0)
    made = curved(curvature)
    deck = write_assembly(made, tmp_path / "sheets.bdf", "mm-t-s")
    thin = T * (1 - 0.4 * np.array(curvature) / (np.array(curvature) + 25))
    whole = formed_of(made)
    known = whole.part < 4
    t = np.repeat(thin[whole.part - 1][:, None], 4, axis=1)
    some = replace(
        whole, cells=whole.cells[known], part=whole.part[known], thickness=t[known],
        nodal=np.zeros(0),
    )  # fmt: skip
    path = write_keyword(tmp_path / "three.k", some, "mm-t-s")
    ran("map", deck, path, "--units", "mm-t-s", "--guess", "--out", tmp_path / "out")
    after = chladni.load(tmp_path / "out" / "mapped.bdf", "mm-t-s").assembly
    inside = np.abs(after.points[after.shells.nodes].mean(axis=1)[:, 1] - 3.075) < 0.04
    guessed = after.thickness()[inside & (after.shells.part == 3)]
    np.testing.assert_allclose(guessed, thin[3], rtol=0.02)
    assert set(json.loads((tmp_path / "out" / "mapping.json").read_text())["guessed"]) == {
        "relative_sd", "left_out_rms", "gauge_rms"
    }  # fmt: skip


def test_a_case_carries_the_thickness_into_the_deck_it_writes(folder, tmp_path):
    """Modes of a case with ``thickness`` are those of the mapped deck, and so is calibrated.bdf."""
    own = chladni.load(folder / "plate.bdf", "SI").assembly
    words = ('units = "SI"', 'units = "SI"\nthickness = "formed.k"'), ("mass = ", "# mass = ")
    source = changed_case(folder, tmp_path / "case", *words)
    write_keyword(source / "formed.k", formed_of(own), "SI")
    case = chladni.load_case(source)
    middle = own.points[own.shells.nodes].mean(axis=1)
    np.testing.assert_allclose(case.assembly.thickness(), field(middle), rtol=1e-2)
    assert any("formed.k" in note for note in case.said("modes"))
    done = call("calibrate", source, "--out", tmp_path / "out")
    assert done.exit_code in (0, 3), done.output
    after = chladni.load(tmp_path / "out" / "calibrated.bdf", "SI").assembly
    ratio = after.thickness() / case.assembly.thickness()
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=1e-4)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ('thickness = "none.k"', "no file 'none.k'"),
        ('thickness = "plate.bdf"', "thickness: .* 0 nodes"),
        ('thickness_units = "SI"', "none is named"),
        ('thickness = "formed.k"\nthickness_place = "there"', "as it lies, aligned, mirrored"),
    ],
)
def test_words_about_thickness_are_refused_by_a_sentence(folder, tmp_path, line, told):
    own = chladni.load(folder / "plate.bdf", "SI").assembly
    words = ('units = "SI"', f'units = "SI"\n{line}')
    source = changed_case(folder, tmp_path / "case", words)
    write_keyword(source / "formed.k", formed_of(own), "SI")
    with pytest.raises(ChladniError, match=told):
        chladni.load_case(source)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["none.k", "--units", "mm-t-s"], "no file"),
        (["formed.k"], "--units"),
        (["formed.k", "--units", "mm-t-s", "--pair", "inner"], "PART=ID"),
        (["formed.k", "--units", "mm-t-s", "--pair", "nose=1"], "nose"),
        (["formed.k", "--units", "mm-t-s", "--formed-units", "SI"], "check the unit system"),
    ],
)
def test_what_cannot_be_mapped_is_told(deck, formed, tmp_path, words, told):
    assert told in refused("map", deck, tmp_path / words[0], *words[1:], "--out", tmp_path / "out")
