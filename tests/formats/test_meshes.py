"""Meshes of other programs: each file holds the same plate, and becomes the plate."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
from tests.builders.elements import CUBE
from tests.builders.refusals import says

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.errors import FileError
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.geometry.mesh_cells import MIRRORED, VTK_EDGES, ForeignCells, elements
from chladni.geometry.solid_shapes import EDGES
from chladni.io.mesh_format import foreign_format
from chladni.io.vtu import write_vtu
from chladni_specimens.plates import plate

pyvista = pytest.importorskip("pyvista")
T = 1e-3
MADE = plate(0.3, 0.2, 6, 4, T)
QUADS, POINTS = MADE.shells.nodes, MADE.points
PART = np.where(np.arange(len(QUADS)) < 12, 1, 2)
STEEL = ["t=1 mm, steel"]


def gmsh(path, mm=1.0):
    edge = np.array([[0, 1], [1, 2]])
    data = {"gmsh:physical": [PART, np.full(2, 3)], "gmsh:geometrical": [PART, np.full(2, 3)]}
    names = {"panel": np.array([1, 2]), "frame": np.array([2, 2]), "edge": np.array([3, 1])}
    cells = [("quad", QUADS), ("line", edge)]
    mesh = meshio.Mesh(mm * POINTS, cells, cell_data=data, field_data=names)
    mesh.write(path, file_format="gmsh22")


def row(*numbers, width=10):
    return "".join(f"{v:{width}d}" for v in numbers)


def universal(path):
    lines = ["    -1", "  2411"]
    for k, x in enumerate(POINTS, 1):
        lines += [row(k, 1, 1, 11), "".join(f"{v:25.16E}".replace("E", "D") for v in x)]
    lines += ["    -1", "    -1", "  2412"]
    for k, (nodes, part) in enumerate(zip(QUADS + 1, PART, strict=True), 1):
        lines += [row(k, 94, part, 1, 7, 4), row(*nodes)]
    lines += ["    -1", "    -1", "  2467", row(1, 0, 0, 0, 0, 0, 0, 3), "rim"]
    lines += [row(8, 1, 0, 0, 8, 2, 0, 0), row(8, 3, 0, 0), "    -1"]
    path.write_text("\n".join(lines) + "\n")


def archive(path):
    lines = [
        "/COM,ANSYS RELEASE 2021 R2", "/PREP7", "ET, 1,181", "ET, 2,21", "KEYOP, 2, 3, 2",
        "RLBLOCK,       1,       2,       6,       7", "(2i8,6g16.9)", "(7g16.9)",
        "       2       1 0.500000000E+00",
        f"NBLOCK,6,SOLID,{len(POINTS):10d},{len(POINTS):10d}", "(3i9,6e21.13)",
    ]  # fmt: skip
    for k, x in enumerate(POINTS, 1):
        lines.append(row(k, 0, 0, width=9) + "".join(f"{v:21.13E}" for v in x))
    lines += ["N,R5.3,LOC,       -1,", f"EBLOCK,19,SOLID,{25:10d},{25:10d}", "(19i9)"]
    for k, nodes in enumerate(QUADS + 1, 1):
        lines.append(row(1, 1, 1, 1, 0, 0, 0, 0, 4, 0, k, *nodes, width=9))
    lines.append(row(1, 2, 2, 1, 0, 0, 0, 0, 1, 0, 99, 18, width=9))
    lines += [
        "       -1", "MPDATA,R5.0, 1,EX  , 1, 1, 2.1E+11,", "MPDATA,R5.0, 1,NUXY, 1, 1, 0.3,",
        "MPDATA,R5.0, 1,DENS, 1, 1, 7850.0,", "SECTYPE, 1,SHELL, ,door", "SECOFFSET, MID",
        "SECBLOCK, 1", "  0.001, 1, 0.0, 3", "CE,R5.0,DEFI, 2, 1", "D, 1,UX , 0.0, 0.0",
        "D, 1,ROTZ , 0.0, 0.0", "FINISH",
    ]  # fmt: skip
    path.write_text("\n".join(lines) + "\n")


def dyna(path):
    lines = ["*KEYWORD", "*PART", "door", "         7         3         5", "*SECTION_SHELL",
             "         3         2", f"{T:10.4f}" * 4, "*MAT_ELASTIC",
             "         5    7850.0    2.1E11       0.3", "*NODE"]  # fmt: skip
    lines += [f"{k:8d}" + "".join(f"{v:16.9E}" for v in x) for k, x in enumerate(POINTS, 1)]
    lines += ["*ELEMENT_SHELL"]
    lines += [row(k, 7, *nodes, width=8) for k, nodes in enumerate(QUADS + 1, 1)]
    lines += ["*ELEMENT_MASS", f"{1:8d}{18:8d}{0.5:16.3f}", "*BOUNDARY_SPC_NODE", "1", "*END"]
    path.write_text("\n".join(lines) + "\n")


def vtk(path):
    grid = pyvista.UnstructuredGrid({9: QUADS}, POINTS)
    grid.cell_data["thickness"] = np.full(len(QUADS), T)
    grid.save(path)


def polydata(path):
    """Normals, which meshio refuses."""
    faces = np.column_stack([np.full(len(QUADS), 4), QUADS]).ravel()
    pyvista.PolyData(POINTS, faces).compute_normals(split_vertices=False).save(path)


FILES = {  # name: what writes it, and the statements of its parts
    "panel.msh": (gmsh, STEEL),
    "panel.vtk": (vtk, ["steel"]),
    "panel.vtu": (vtk, ["steel"]),
    "poly.vtk": (polydata, STEEL),
    "poly.vtp": (polydata, STEEL),
    "panel.unv": (universal, STEEL),
    "panel.cdb": (archive, []),
    "panel.k": (dyna, []),
    "ours.vtu": (lambda path: write_vtu(path, MADE), ["steel"]),
}


def modes(assembly, count=12):
    return normal_modes(structure(assembly).system, count).frequency


@pytest.mark.parametrize("name", FILES)
def test_every_file_is_the_plate(tmp_path, name):
    """Counts, mass and frequencies to rounding of the file; a lump where it has one."""
    writer, parts = FILES[name]
    path = tmp_path / name
    writer(path)
    assert foreign_format(path)
    made = chladni.load(path, "SI", parts=parts).assembly
    due = MADE
    lump = {"panel.cdb": 0.5, "panel.k": 0.5}.get(name, 0.0)
    assert (len(made.points), len(made.shells)) == (35, 24)
    total = mass_properties(due)[0] + lump
    assert mass_properties(made)[0] == pytest.approx(total, rel=1e-6)
    if lump:
        assert made.ids[made.masses.node].tolist() == [18]
        assert [p.name for p in made.parts] == ["door"]
    else:
        np.testing.assert_allclose(modes(made)[6:], modes(due)[6:], rtol=1e-6)


def test_supports_of_an_archive_and_what_is_left_out(tmp_path):
    archive(tmp_path / "a.cdb")
    model = chladni.load(tmp_path / "a.cdb", "SI")
    made = model.assembly
    assert made.ids[made.supports[:, 0]].tolist() == [1, 1]
    assert made.supports[:, 1].tolist() == [1, 6]
    assert "CE (1; not understood)" in model.notes[0]
    dyna(tmp_path / "a.k")
    assert "*BOUNDARY_SPC_NODE (1" in chladni.load(tmp_path / "a.k", "SI").notes[0]


def test_parts_have_the_names_of_the_mesh(tmp_path):
    """Physical groups and groups of elements; lines around surfaces need a statement by name."""
    gmsh(tmp_path / "a.msh")
    words = {"panel": "t=0.8 mm, steel", "2": "t=2 mm, aluminium"}
    model = chladni.load(tmp_path / "a.msh", "SI", parts=words)
    assert [p.name for p in model.assembly.parts] == ["panel", "frame"]
    assert [p.section.thickness for p in model.assembly.parts] == pytest.approx([8e-4, 2e-3])
    assert "lines of part edge (2; no --part names it)" in model.notes[0]
    model = chladni.load(
        tmp_path / "a.msh", "SI", parts={**words, "edge": "d=10 mm, t=1 mm, steel"}
    )
    beam = model.assembly.parts[2].section
    assert (len(model.assembly.beams), beam.kind) == (2, "bar")
    assert beam.area == pytest.approx(np.pi * (0.005**2 - 0.004**2))
    universal(tmp_path / "a.unv")
    names = chladni.load(tmp_path / "a.unv", "SI", parts=STEEL).assembly.parts
    assert [p.name for p in names] == ["rim", "1", "2"]


def test_a_table_states_the_parts(tmp_path):
    gmsh(tmp_path / "a.msh", mm=1e3)
    rows = "part,material,t,rho\npanel,steel,0.8,\nframe,steel,2 mm,8 g/cm3\n"
    (tmp_path / "parts.csv").write_text(rows)
    made = chladni.load(tmp_path / "a.msh", "mm-t-s", parts=tmp_path / "parts.csv").assembly
    assert [p.section.thickness for p in made.parts] == pytest.approx([8e-4, 2e-3])
    assert [p.section.membrane.rho for p in made.parts] == pytest.approx([7850, 8000])
    assert made.points.max() == pytest.approx(0.3)


REFUSED = [
    ((), r"part panel lacks a material and a thickness t, frame lacks .*; give --part"),
    (["steel"], "part panel lacks a thickness t, frame lacks a thickness t"),
    ({"door": "t=1, steel"}, "has no part door; there are panel, frame, edge"),
    (["t=1 mm, stel"], r"names the material 'stel'; did you mean 'steel'\? there are steel"),
    (["t=1 km, steel"], "t has the unit 'km'; there are m, mm"),
    (["t=thin, steel"], "t is 'thin', which is not a number with a unit"),
    (["thick=1"], r"states 'thick'; .*there are t, d, b, h"),
    (["panel:"], "states no property"),
    (
        {"panel": "t=1 mm, steel", "frame": "t=1 mm, steel", "edge": "steel"},
        "edge lacks a diameter d",
    ),
]


@pytest.mark.parametrize(("parts", "said"), REFUSED)
def test_a_statement_that_does_not_do_is_one_sentence(tmp_path, parts, said):
    gmsh(tmp_path / "a.msh")
    says(said, chladni.load, tmp_path / "a.msh", "SI", parts=parts)


def test_words_need_the_unit_system(tmp_path):
    gmsh(tmp_path / "a.msh")
    says("needs the unit system of the mesh; give it by --units", chladni.load, tmp_path / "a.msh",
         parts=STEEL)  # fmt: skip
    model = chladni.load(tmp_path / "a.msh", parts=["t=0.001, E=2.1e11, nu=.3, rho=7850"])
    np.testing.assert_allclose(model.modes(12).frequency[6:], modes(MADE)[6:], rtol=1e-6)


def test_a_deck_takes_no_parts(tmp_path):
    deck = chladni.load(MADE).write(tmp_path / "a.bdf")
    says("no mesh of another program", chladni.load, deck, "SI", parts=STEEL)


@pytest.mark.parametrize("kind", ["grid", "polydata", "meshio"])
def test_meshes_in_memory_with_arrays(kind):
    """Part, thickness and material of the cells; the thickness of each is its own."""
    t = np.linspace(1e-3, 2e-3, len(QUADS))
    stuff = np.where(PART == 1, "steel", "aluminium")
    arrays = {"part": PART, "thickness": t, "material": stuff}
    if kind == "meshio":
        given = meshio.Mesh(
            POINTS, [("quad", QUADS)], cell_data={k: [v] for k, v in arrays.items()}
        )
    else:
        faces = np.column_stack([np.full(len(QUADS), 4), QUADS]).ravel()
        flat = pyvista.PolyData(POINTS, faces)
        given = flat if kind == "polydata" else flat.cast_to_unstructured_grid()
        for name, values in arrays.items():
            given.cell_data[name] = values
    model = chladni.load(given, "SI")
    made = model.assembly
    assert [p.name for p in made.parts] == ["1 steel", "2 aluminium"]
    np.testing.assert_allclose(np.sort(made.thickness()), t, rtol=1e-6)
    assert model.variant(t={"1 steel": 2e-3}).modes(7).frequency[6] > 0


def test_thickness_at_the_points_is_at_the_corners():
    at = 1e-3 * (1 + POINTS[:, 0])
    mesh = meshio.Mesh(POINTS, [("quad", QUADS)], point_data={"thickness": at})
    made = chladni.load(mesh, "SI", parts=["steel"]).assembly
    np.testing.assert_allclose(made.shells.thickness, at[QUADS], rtol=1e-6)


def test_our_mesh_goes_out_and_comes_back():
    """model.mesh has the ids, parts and thickness that load takes."""
    uneven = replace(MADE, ids=MADE.ids * 10)
    model = chladni.load(uneven)
    again = chladni.load(model.mesh, "SI", parts=["steel"]).assembly
    np.testing.assert_array_equal(again.ids, uneven.ids)
    np.testing.assert_array_equal(np.sort(again.shells.ids), np.sort(uneven.shells.ids))
    np.testing.assert_allclose(again.thickness(), uneven.thickness())


TAKE = {  # hexahedra with repeated corners, as Ansys and LS-DYNA write them: the volume
    (0, 1, 2, 2, 4, 5, 6, 6): 0.5,
    (0, 1, 2, 2, 4, 4, 4, 4): 1 / 6,
    (0, 1, 3, 4, 4, 4, 4, 4): 1 / 6,
    (0, 1, 2, 3, 4, 4, 4, 4): 1 / 3,
    (0, 1, 2, 3, 4, 4, 7, 7): 0.5,
}  # fmt: skip


@pytest.mark.parametrize("quadratic", [False, True], ids=["linear", "quadratic"])
@pytest.mark.parametrize("corners", TAKE)
def test_a_collapsed_brick_is_the_solid_that_it_is(corners, quadratic):
    """Its volume, and nodes on edges in the middle of the edges that are left."""
    places, nodes = CUBE, list(corners)
    if quadratic:
        ends = [(corners[a], corners[b]) for a, b in VTK_EDGES[8]]
        places = np.vstack([CUBE, [(CUBE[a] + CUBE[b]) / 2 for a, b in ends]])
        nodes += range(8, 20)
    kind = "hexahedron20" if quadratic else "hexahedron"
    _, (group,), _ = elements([ForeignCells(kind, np.array([1]), np.array([nodes]), 0)], places)
    x = places[group.nodes[0]]
    n = {4: 4, 10: 4, 5: 5, 13: 5, 6: 6, 15: 6}[len(x)]
    for k, (a, b) in enumerate(EDGES[n] if quadratic else ()):
        there = group.nodes[0, n + k] not in group.nodes[0, :n]
        np.testing.assert_allclose(x[n + k], (x[a] + x[b]) / 2 if there else x[a])
    cut = {4: [(0, 1, 2, 3)], 5: [(0, 1, 2, 4), (0, 2, 3, 4)],
           6: [(0, 1, 2, 3), (1, 2, 3, 4), (2, 3, 4, 5)]}[n]  # fmt: skip
    volume = sum(abs(np.linalg.det(np.diff(x[list(t)], axis=0))) / 6 for t in cut)
    assert volume == pytest.approx(TAKE[corners])


@pytest.mark.parametrize("n", MIRRORED)
def test_a_solid_that_is_inside_out_is_wound_the_other_way(n):
    """VTK's own wedges are."""
    x = {8: CUBE, 6: CUBE[[0, 1, 3, 4, 5, 7]], 5: CUBE[[0, 1, 2, 3, 4]], 4: CUBE[[0, 1, 3, 4]]}[n]
    kind = {8: "hexahedron", 6: "wedge", 5: "pyramid", 4: "tetra"}[n]
    ids = np.array([1, 2])
    rows = np.array([range(n), MIRRORED[n]])
    _, (group,), _ = elements([ForeignCells(kind, ids, rows, 0)], x)
    np.testing.assert_array_equal(group.nodes, [range(n)] * 2)


DAMAGED = {
    "a.msh": "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n",
    "a.vtk": "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 9 float\n",
    "a.cdb": "/COM,ANSYS\n/PREP7\n",
    "a.unv": "    -1\n  2411\n         1         1\n    -1\n",
    "b.unv": "    -1\n   151\nname\n    -1\n",
    "a.k": "*KEYWORD\n*NODE\n*END\n",
    "a.stl": "solid a\nfacet normal 0 0 1\n",
}


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_file_is_one_sentence(tmp_path, name, capsys):
    (tmp_path / name).write_text(DAMAGED[name])
    assert name in says("a|b", chladni.load, tmp_path / name, "SI", parts=STEEL, error=FileError)
    assert capsys.readouterr() == ("", "")
