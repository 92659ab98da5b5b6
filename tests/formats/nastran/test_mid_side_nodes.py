"""Nodes on the edges of elements: their order on the card, and those that are left out."""

import numpy as np
import pytest

from chladni.fem import solid
from chladni.fem.assemble import structure
from chladni.io.nastran import SetField, assembly, read_deck, write_assembly, write_deck
from chladni.io.vtu import write_vtu

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
