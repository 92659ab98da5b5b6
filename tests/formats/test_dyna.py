"""Formed thickness in and out: what is written is read, every dialect, one sentence a fault."""

import numpy as np
import pytest

from chladni.errors import FileError, ModelError, ShapeError
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
LONG = (
    "*KEYWORD LONG=Y\n*NODE\n"
    + "".join(
        f"{k:20d}{x:20.6f}{y:20.6f}{0:20.6f}\n"
        for k, x, y in ((1, 0, 0), (2, 10, 0), (3, 10, 10), (4, 0, 10))
    )
    + "*ELEMENT_SHELL_THICKNESS\n"
    + "".join(f"{v:20d}" for v in (1, 5, 1, 2, 3, 4))
    + "\n"
    + "".join(f"{v:20.4f}" for v in (0.61, 0.62, 0.63, 0.64))
    + "\n"
    + "".join(f"{v:20d}" for v in (2, 5, 1, 2, 3, 3))
    + "\n"
    + "".join(f"{v:20.4f}" for v in (0.70, 0.71, 0.72, 0.72))
    + "\n*END\nnot read any more\n"
)
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


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("            0.62", "            0.6b", "line 10: '0.6b' is not a number"),
        ("       3       4\n", "       3       8\n", "shell 1 names a node"),
        ("*ELEMENT_SHELL_THICKNESS", "*ELEMENT_SHELL", "is not a number in .ELEMENT_SHELL$"),
        ("            0.70            0.71            0.72            0.72\n", "", "2 per element"),
        ("*NODE", "*INCLUDE\nnowhere.k\n*NODE", "no file 'nowhere.k'"),
        ("*NODE", "*INCLUDE\nbad.k\n*NODE", "line 4: 'bad.k' includes itself"),
        ("            0.62", "             nan", "line 10: 'nan' is not a number"),
        (FIXED, "*KEYWORD\n*END\n", "both are needed"),
    ],
)
def test_one_sentence_a_fault(tmp_path, old, new, named):
    path = tmp_path / "bad.k"
    path.write_text(FIXED.replace(old, new))
    with pytest.raises(FileError, match=named) as caught:
        read_keyword(path)
    assert "bad.k" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_wrong_unit_is_noticed(tmp_path):
    """Thickness of 0.6 m: the file is in millimetres."""
    path = tmp_path / "a.k"
    path.write_text(FIXED)
    with pytest.raises(ModelError, match="unit system"):
        read_keyword(path, "SI")
    with pytest.raises(FileError, match=r"a\.k: .*unit system"):
        read_formed(path, "SI")
    with pytest.raises(FileError, match="cannot be read"):
        read_keyword(tmp_path / "none.k")


NODE_2 = "       2            10.0             0.0             0.0\n"
SHELL_2 = FIXED.partition("0.64             0.0\n")[2].partition("*END")[0]


@pytest.mark.parametrize(
    ("line", "other", "said"),
    [
        (NODE_2, NODE_2.replace("10.0", "11.0"), "line 6: node 2 occurs twice.* line 5 of a.k"),
        (SHELL_2, SHELL_2.replace("0.71", "0.91"), "line 13: shell 2 .* line 11 of a.k"),
        (SHELL_2, SHELL_2.replace("5", "6"), "line 13: shell 2 occurs twice"),
    ],
)
def test_a_line_may_be_repeated_but_not_contradicted(tmp_path, line, other, said):
    """Includes repeat nodes; one id for two things leaves open which of them is meant."""
    path = tmp_path / "a.k"
    assert FIXED.count(line) == 1
    path.write_text(FIXED)
    once = read_keyword(path)
    path.write_text(FIXED.replace(line, line + line))
    again = read_keyword(path)
    np.testing.assert_array_equal(again.points, once.points)
    np.testing.assert_array_equal(again.cells, once.cells)
    path.write_text(FIXED.replace(line, line + other))
    with pytest.raises(FileError, match=said):
        read_keyword(path)


@pytest.mark.parametrize("word", ["nan", "inf", "1e999"])
def test_a_word_that_is_no_finite_number_is_refused_with_its_line(tmp_path, word):
    path = tmp_path / "a.k"
    path.write_text(FIXED.replace(NODE_2, NODE_2.replace("10.0", f"{word:>4}"[-4:])))
    if word == "1e999":
        path.write_text(FREE.replace("0.0e+0", word))
    with pytest.raises(FileError, match=rf"a.k, line \d: '{word}' is not a number in \*NODE"):
        read_keyword(path)


def test_a_mesh_that_contradicts_itself_is_refused(tmp_path):
    """Corners that are not there, places and thicknesses that are no numbers; the file is named."""
    import meshio

    mesh = sheet()
    path = tmp_path / "a.vtu"
    for fault, said in (
        ("negative", "cell 3 .counted from 0. names point -1; there are 0 to 24"),
        ("beyond", "cell 3 .counted from 0. names point 25"),
        ("place", r"point 7 .counted from 0. is at \(nan, "),
        ("thickness", "is not a number"),
    ):
        points, cells, t = 1e3 * mesh.points, np.array(mesh.cells), scaled(mesh.nodal)
        if fault in ("negative", "beyond"):
            cells[3, 1] = -1 if fault == "negative" else len(points)
        elif fault == "place":
            points[7, 0] = np.nan
        else:
            t[5] = np.nan
        meshio.Mesh(points, [("quad", cells)], point_data={"thickness": t}).write(path)
        with pytest.raises(FileError, match=f"a.vtu.*{said}"):
            read_formed(path)


def test_vtu(tmp_path):
    """Nodal and elemental thickness of a mesh file."""
    import meshio

    mesh = sheet()
    cells = [("quad", np.asarray(mesh.cells))]
    for name, data in (("point_data", mesh.nodal), ("cell_data", [mesh.thickness.mean(axis=1)])):
        path = tmp_path / f"{name}.vtu"
        meshio.Mesh(1e3 * mesh.points, cells, **{name: {"Thickness": scaled(data)}}).write(path)
        back = read_formed(path)
        np.testing.assert_allclose(back.points, mesh.points, atol=1e-12)
        np.testing.assert_allclose(
            back.thickness.mean(axis=1), mesh.thickness.mean(axis=1), rtol=0.02
        )
    meshio.Mesh(1e3 * mesh.points, cells).write(tmp_path / "bare.vtu")
    with pytest.raises(FileError, match="no field called thickness"):
        read_formed(tmp_path / "bare.vtu")


def scaled(data):
    return [1e3 * d for d in data] if isinstance(data, list) else 1e3 * data


@pytest.mark.parametrize(
    "text",
    [
        "<VTKFile></VTKFile>",
        '<!DOCTYPE x [<!ENTITY a "1">]><VTKFile type="UnstructuredGrid">&a;</VTKFile>',
        '<VTKFile type="UnstructuredGrid"><UnstructuredGrid/></VTKFile>',
        "",
        '<VTKFile type="UnstructuredGrid" byte_order="LittleEndian"><UnstructuredGrid><Piece '
        'NumberOfPoints="1" NumberOfCells="0"><Points><DataArray type="Float64" Name="Points" '
        'NumberOfComponents="3" format="ascii">0 0</DataArray></Points></Piece>'
        "</UnstructuredGrid></VTKFile>",
    ],
)
def test_a_damaged_mesh_is_one_sentence(tmp_path, capsys, text):
    """The library that reads it prints and ends the process, or lets any exception pass."""
    path = tmp_path / "bad.vtu"
    path.write_text(text)
    with pytest.raises(FileError, match=r"bad\.vtu cannot be read as a mesh: "):
        read_formed(path)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("x", ["nan", "1e400"])
def test_places_are_numbers(tmp_path, x):
    path = tmp_path / "bad.csv"
    path.write_text(f"node,x,y,z,thickness\n1,0,0,0,1\n2,{x},0,0,1\n")
    with pytest.raises(FileError, match=rf"bad\.csv, line 3: x is '{x}', which is not a number"):
        read_formed(path)


def test_cells_have_nodes():
    with pytest.raises(ModelError, match="names point 3; there are 0 to 2"):
        FormedMesh(np.arange(3), np.eye(3), np.array([[0, 1, 3, 3]]), np.ones(1), np.ones((1, 4)))


def test_csv(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("node,x,y,z,thickness\n4,0,0,0,0.6\n5,10,0,0,0.7\n")
    mesh = read_formed(path)
    np.testing.assert_allclose(mesh.nodal, [0.6e-3, 0.7e-3])
    np.testing.assert_allclose(mesh.points[1], [0.01, 0, 0])
    assert mesh.ids.tolist() == [4, 5]
    path.write_text("# Node,x,y,z,Thickness,set\n4,0,0,0,0.6,A\n4,0,0,0,0.6,B\n")
    assert read_formed(path).ids.tolist() == [4, 4]
    for cell, said in (("abc", "line 3: thickness is 'abc'"), ("0.7", "line 3: node 4 occurs")):
        path.write_text(f"node,x,y,z,thickness\n4,0,0,0,0.6\n4,0,0,0,{cell}\n")
        with pytest.raises(FileError, match=rf"t\.csv, {said}"):
            read_formed(path)
    path.write_text("node,x,y,z\n4,0,0,0\n")
    with pytest.raises(FileError, match="thickness"):
        read_formed(path)


def test_shapes_must_fit():
    mesh = sheet()
    with pytest.raises(ShapeError, match="one row per cell"):
        FormedMesh(mesh.ids, mesh.points, mesh.cells, mesh.part, mesh.thickness[:-1])
    with pytest.raises(ModelError, match="no part 9"):
        mesh.of_part(9)
    assert len(mesh.of_part(7).cells) == 8
