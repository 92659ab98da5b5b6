"""Formed thickness in and out: what is written is read, in every dialect."""

import meshio
import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.geometry.formed_mesh import FormedMesh
from chladni.io.dyna import read_keyword, write_keyword
from chladni.io.formed_files import read_formed
from chladni_specimens.mesher.flat_regions import grid


def sheet(n=4, t=None):
    plan, quads = grid(np.linspace(0, 0.1, n + 1), np.linspace(0, 0.08, n + 1))
    points = np.column_stack([plan, 0.02 * plan[:, 0]])
    t = np.linspace(0.5e-3, 0.9e-3, len(points))[quads] if t is None else t
    part = np.where(np.arange(len(quads)) % 2, 7, 3)
    ids = 10 + 3 * np.arange(len(points))
    return FormedMesh(ids, points, quads, part, t, {3: "inner", 7: "outer upper"})


@pytest.mark.parametrize("unit", ["mm-t-s", "SI", "in-lb-s"])
def test_round_trip(tmp_path, unit):
    """To 0.1 µm in any unit system."""
    mesh = sheet()
    back = read_keyword(write_keyword(tmp_path / "a.k", mesh, unit), unit)
    np.testing.assert_allclose(back.points, mesh.points, atol=1e-7)
    np.testing.assert_allclose(back.thickness, mesh.thickness, atol=1e-7)
    np.testing.assert_array_equal(back.ids, mesh.ids)
    np.testing.assert_array_equal(back.cells, mesh.cells)
    np.testing.assert_array_equal(back.part, mesh.part)
    assert back.names == mesh.names


FIXED = """*KEYWORD
$ a comment
*NODE
       1             0.0             0.0             0.0       0       0
       2            10.0             0.0             0.0
       3            10.0            10.0             0.0
       4             0.0            10.0             0.0
*ELEMENT_SHELL_THICKNESS
       1       5       1       2       3       4
            0.61            0.62            0.63            0.64             0.0
       2       5       1       2       3       3
            0.70            0.71            0.72            0.72
*END
"""
FREE = FIXED.replace(
    "       1             0.0             0.0             0.0       0       0", "1,0.,0,0.0e+0,0"
)
I10 = """*KEYWORD I10=Y
*NODE
         1             0.0             0.0             0.0
         2            10.0             0.0             0.0
         3            10.0            10.0             0.0
         4             0.0            10.0             0.0
*ELEMENT_SHELL_THICKNESS
         1         5         1         2         3         4
            0.61            0.62            0.63            0.64
         2         5         1         2         3         0
            0.70            0.71            0.72            0.72
"""
LONG = "*KEYWORD LONG=Y\n*NODE\n" + "".join(
    f"{k:20d}{x:20.6f}{y:20.6f}{0:20.6f}\n"
    for k, x, y in ((1, 0, 0), (2, 10, 0), (3, 10, 10), (4, 0, 10))
)
LONG += "*ELEMENT_SHELL_THICKNESS\n" + "".join(
    "".join(f"{v:20d}" for v in ids) + "\n" + "".join(f"{v:20.4f}" for v in t) + "\n"
    for ids, t in (((1, 5, 1, 2, 3, 4), (0.61, 0.62, 0.63, 0.64)),
                   ((2, 5, 1, 2, 3, 3), (0.70, 0.71, 0.72, 0.72)))
)  # fmt: skip
LONG += "*END\nnot read any more\n"
SECTION = FIXED.replace(
    "            0.70            0.71            0.72            0.72",
    "             0.0             0.0             0.0             0.0",
).replace(
    "*END",
    "*PART\ninner\n         5         9         1\n*SECTION_SHELL_TITLE\nsheet\n"
    "         9        16\n      0.70      0.70      0.70      0.70\n*END",
)


@pytest.mark.parametrize("text", [FIXED, FREE, I10, LONG], ids=["fixed", "free", "i10", "long"])
def test_dialects(tmp_path, text):
    path = tmp_path / "a.key"
    path.write_text(text)
    mesh = read_keyword(path)
    np.testing.assert_allclose(mesh.points[2], [0.01, 0.01, 0])
    np.testing.assert_allclose(mesh.thickness[0], [0.61e-3, 0.62e-3, 0.63e-3, 0.64e-3])
    np.testing.assert_array_equal(mesh.cells[1], [0, 1, 2, 2])
    assert mesh.part.tolist() == [5, 5]


def test_section_holds_where_the_element_has_none(tmp_path):
    path = tmp_path / "a.k"
    path.write_text(SECTION)
    mesh = read_keyword(path)
    np.testing.assert_allclose(mesh.thickness[1], 0.70e-3)
    np.testing.assert_allclose(mesh.thickness[0, 0], 0.61e-3)
    assert mesh.names == {5: "inner"}


def test_include(tmp_path):
    nodes, _, shells = FIXED.partition("*ELEMENT")
    (tmp_path / "nodes.k").write_text(nodes)
    (tmp_path / "all.k").write_text("*INCLUDE\nnodes.k\n*ELEMENT" + shells)
    assert len(read_keyword(tmp_path / "all.k").cells) == 2


def test_wrong_unit_is_noticed(tmp_path):
    """Thickness of 0.6 m: the file is in millimetres."""
    path = tmp_path / "a.k"
    path.write_text(FIXED)
    says("unit system", read_keyword, path, "SI")
    says(r"a\.k: .*unit system", read_formed, path, "SI")
    says("cannot be read", read_keyword, tmp_path / "none.k")


@pytest.mark.parametrize("line", ["2            10.0", "2       5       1"])
def test_a_line_may_be_repeated(tmp_path, line):
    """Includes repeat nodes; what is refused is one id for two things."""
    at = FIXED.index(f"       {line}")
    past = FIXED.index("\n", at + (70 if "5" in line else 0)) + 1
    path = tmp_path / "a.k"
    path.write_text(FIXED)
    once = read_keyword(path)
    path.write_text(FIXED[:past] + FIXED[at:past] + FIXED[past:])
    again = read_keyword(path)
    np.testing.assert_array_equal(again.points, once.points)
    np.testing.assert_array_equal(again.cells, once.cells)


@pytest.mark.parametrize(
    ("points", "cells", "t", "said"),
    [
        ({}, {(3, 1): -1}, {}, "cell 3 .counted from 0. names point -1; there are 0 to 24"),
        ({}, {(3, 1): 25}, {}, "cell 3 .counted from 0. names point 25"),
        ({(7, 0): np.nan}, {}, {}, r"point 7 .counted from 0. is at \(nan, "),
        ({}, {}, {5: np.nan}, "is not a number"),
    ],
)
def test_a_mesh_that_contradicts_itself_is_refused(tmp_path, points, cells, t, said):
    """Corners that are not there, places and thicknesses that are no numbers; the file is named."""
    mesh = sheet()
    parts = 1e3 * mesh.points, np.array(mesh.cells), 1e3 * mesh.nodal
    for part, wrong in zip(parts, (points, cells, t), strict=True):
        for at, value in wrong.items():
            part[at] = value
    made = meshio.Mesh(parts[0], [("quad", parts[1])], point_data={"thickness": parts[2]})
    made.write(tmp_path / "a.vtu")
    says(f"a.vtu.*{said}", read_formed, tmp_path / "a.vtu")


def test_vtu(tmp_path):
    """Nodal and elemental thickness of a mesh file."""
    mesh, path = sheet(), tmp_path / "a.vtu"
    cells, mean = [("quad", np.asarray(mesh.cells))], mesh.thickness.mean(axis=1)
    for kind, data in (("point_data", 1e3 * mesh.nodal), ("cell_data", [1e3 * mean])):
        meshio.Mesh(1e3 * mesh.points, cells, **{kind: {"Thickness": data}}).write(path)
        back = read_formed(path)
        np.testing.assert_allclose(back.points, mesh.points, atol=1e-12)
        np.testing.assert_allclose(back.thickness.mean(axis=1), mean, rtol=0.02)
    meshio.Mesh(1e3 * mesh.points, cells).write(path)
    says("no field called thickness", read_formed, path)


def test_csv(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("node,x,y,z,thickness\n4,0,0,0,0.6\n5,10,0,0,0.7\n")
    mesh = read_formed(path)
    np.testing.assert_allclose(mesh.nodal, [0.6e-3, 0.7e-3])
    np.testing.assert_allclose(mesh.points[1], [0.01, 0, 0])
    assert mesh.ids.tolist() == [4, 5]
    path.write_text("# Node,x,y,z,Thickness,set\n4,0,0,0,0.6,A\n4,0,0,0,0.6,B\n")
    assert read_formed(path).ids.tolist() == [4, 4]


def test_shapes_must_fit():
    mesh = sheet()
    row = mesh.ids, mesh.points, mesh.cells, mesh.part
    says("one row per cell", FormedMesh, *row, mesh.thickness[:-1])
    says("no part 9", mesh.of_part, 9)
    assert len(mesh.of_part(7).cells) == 8
    three = np.arange(3), np.eye(3), np.array([[0, 1, 3, 3]])
    says("names point 3; there are 0 to 2", FormedMesh, *three, np.ones(1), np.ones((1, 4)))
