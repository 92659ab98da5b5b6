"""Nodes on the edges of elements: their order on the card, and those that are left out."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.fem import solid
from chladni.fem.assemble import structure
from chladni.io.nastran import SetField, assembly, read_deck, write_assembly, write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.io.vtu import write_vtu
from chladni.units import UNITS

# edges as the Quick Reference Guide draws them: of the bottom, upright, of the top
CORNERS = {
    "CHEXA": [
        (0, 0, 0),
        (2, 0, 0),
        (2, 3, 0),
        (0, 3, 0),
        (0, 0, 4),
        (2, 0, 4),
        (2, 3, 4),
        (0, 3, 4),
    ],
    "CPENTA": [(0, 0, 0), (2, 0, 0), (0, 3, 0), (0, 0, 4), (2, 0, 4), (0, 3, 4)],
    "CPYRAM": [(0, 0, 0), (2, 0, 0), (2, 3, 0), (0, 3, 0), (1, 1, 4)],
    "CTETRA": [(0, 0, 0), (2, 0, 0), (0, 3, 0), (0, 0, 4)],
}
EDGES = {
    "CHEXA": "12 23 34 41 15 26 37 48 56 67 78 85",
    "CPENTA": "12 23 31 14 25 36 45 56 64",
    "CPYRAM": "12 23 34 41 15 25 35 45",
    "CTETRA": "12 23 13 14 24 34",
}
VOLUME = {"CHEXA": 24.0, "CPENTA": 12.0, "CPYRAM": 8.0, "CTETRA": 4.0}


def card(name, lacking=(), blank=""):
    """One solid with nodes in the middle of its edges, some of which are left out."""
    corners = np.array(CORNERS[name], float)
    edges = [[int(c) - 1 for c in pair] for pair in EDGES[name].split()]
    places = [*corners, *(corners[pair].mean(axis=0) for pair in edges)]
    grids = "".join(f"GRID,{k},,{x},{y},{z}\n" for k, (x, y, z) in enumerate(places, 1))
    ids = [blank if k in lacking else str(k) for k in range(1, len(places) + 1)]
    return f"{grids}{name},9,1,{','.join(ids)}\nPSOLID,1,5\nMAT1,5,2.1+5,,.3,7.85-9\n"


@pytest.mark.parametrize("name", CORNERS)
def test_nodes_on_edges_stand_in_the_order_of_the_guide(bulk, name):
    """Rigid motions and the six constant strains are exact: in another order they would not be."""
    made = assembly(bulk(card(name)))
    (group,) = made.solids
    X = made.points[group.nodes]
    assert solid.volume(X)[0] == pytest.approx(VOLUME[name])
    C = solid.elasticity(made.parts[0].section.material)
    K = solid.stiffness(X, C[None])[0]
    H = np.random.default_rng(0).normal(size=(3, 3))
    S, u = H + H.T, (X[0] @ H.T).ravel()
    strain = np.array([*np.diag(H), S[0, 1], S[1, 2], S[2, 0]])
    assert u @ K @ u == pytest.approx(strain @ C @ strain * VOLUME[name])


@pytest.mark.parametrize("blank", ["", "0"])
@pytest.mark.parametrize("name", CORNERS)
def test_a_node_that_is_left_out_leaves_a_straight_edge(bulk, name, blank):
    """Grids that no element names have no stiffness; the volume and the rigid motions stay."""
    corners = len(CORNERS[name])
    lacking = (corners + 1, corners + 3)
    made = assembly(bulk(card(name, lacking, blank)), loose=True)
    (group,) = made.solids
    assert solid.volume(made.points[group.nodes])[0] == pytest.approx(VOLUME[name])
    built = structure(made)
    assert not np.isin(built.system.dofs[:, 0], lacking).any()
    values = np.linalg.eigvalsh(built.system.K.toarray())
    assert np.sum(np.abs(values) < 1e-9 * values[-1]) == 6


@pytest.mark.parametrize("name", CORNERS)
def test_solids_with_nodes_on_edges_are_written_and_changed(bulk, tmp_path, name):
    """A fresh deck has the same nodes; a deck whose material changes keeps the card as it is."""
    deck = bulk(card(name, (len(CORNERS[name]) + 2,)))
    made = assembly(deck, loose=True)
    again = assembly(read_deck(write_assembly(made, tmp_path / "fresh.bdf")), loose=True)
    assert again.solids[0].nodes.tolist() == made.solids[0].nodes.tolist()
    path = write_deck(deck, tmp_path / "changed.bdf", [SetField("MAT1", 5, "E", 7e4)])
    old, new = (x.read_text().splitlines() for x in (deck.path, path))
    assert [a.split(",")[0] for a, b in zip(old, new, strict=True) if a != b] == ["MAT1"]
    moved = write_deck(deck, tmp_path / "moved.bdf", [SetField(name, 9, "PID", 5)])
    cards = read_deck(moved)[name]
    assert cards.fields(0)[1] == "5"
    assert cards.fields(0)[2:] == deck[name].fields(0)[2:]


@pytest.mark.parametrize("name", CORNERS)
def test_a_mesh_of_vtk_has_their_corners(bulk, tmp_path, name):
    """Drawn by corners; the volume of the cell is the element's."""
    pv = pytest.importorskip("pyvista")
    made = assembly(bulk(card(name)))
    mesh = pv.read(write_vtu(tmp_path / "one.vtu", made))
    assert mesh.n_cells == 1
    assert abs(mesh.compute_cell_sizes()["Volume"][0]) == pytest.approx(VOLUME[name])


SHELLS = (
    "GRID,1,,0.,0.,0.\nGRID,2,,2.,0.,0.\nGRID,3,,2.,2.,0.\nGRID,4,,0.,2.,0.\nGRID,5,,1.,0.,.1\n"
    "GRID,6,,2.,1.,0.\nGRID,7,,1.,2.,.1\nGRID,9,,4.,1.,0.\nGRID,10,,3.,.5,0.\n"
    "CQUAD8,11,7,1,2,3,4,5,6,7,,.2,.3,,.4,30.,.05,0\nCTRIA6,12,7,2,9,3,10,,6,30.,-.05,.2,,.3,0\n"
    "PSHELL,7,5,.1,5,,5\nMAT1,5,2.1+5,,.3,7.85-9\n"
)


def test_fields_of_shells_with_nodes_on_edges(bulk, tmp_path):
    """Nodes, corner thickness, angle and offset stand where the guide puts them, and come back."""
    made = assembly(bulk(SHELLS))
    s = made.shells
    assert made.ids[s.nodes].tolist() == [[1, 2, 3, 4], [2, 9, 3, 3]]
    middle = np.where(s.middle < 0, 0, made.ids[s.middle])
    assert middle.tolist() == [[5, 6, 7, 0], [10, 0, 6, 0]]
    assert s.thickness.tolist() == [[0.2, 0.3, 0.1, 0.4], [0.2, 0.1, 0.3, 0.3]]
    assert s.offset.tolist() == [0.05, -0.05]
    assert s.axis[0] == pytest.approx([np.cos(np.pi / 6), 0.5, 0])
    assert s.curved.all()
    again = assembly(read_deck(write_assembly(made, tmp_path / "fresh.bdf"))).shells
    for name, column in vars(s).items():
        np.testing.assert_allclose(getattr(again, name), column, atol=1e-9, err_msg=name)


def test_thickness_of_shells_with_nodes_on_edges_is_changed_in_their_cards(bulk, tmp_path):
    """Corner thicknesses that a change gives stand in T1 to T4 of CQUAD8 and CTRIA6."""
    deck = bulk(SHELLS)
    before = assembly(deck, "SI")
    t = before.shells.thickness * np.array([[0.9, 1, 1, 0.8], [0.7, 1, 1, 1]])
    after = replace(before, shells=replace(before.shells, thickness=t))
    path = write_deck(deck, tmp_path / "new.bdf", changes(deck, before, after, UNITS["SI"]))
    found = assembly(read_deck(path), "SI").shells
    np.testing.assert_allclose(found.thickness, t, rtol=1e-6)
    assert found.middle.tolist() == before.shells.middle.tolist()
