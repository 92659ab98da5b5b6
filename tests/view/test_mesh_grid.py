"""Meshes for scripts: ids, parts and shapes stand where they belong; densities add up."""

import numpy as np
import pytest
from tests.builders.refusals import says
from tests.fem.test_energy import block_with_a_mast

import chladni
from chladni.fem.assemble import structure
from chladni.fem.energy import element_energies, element_volumes
from chladni.geometry.formed_mesh import FormedMesh
from chladni.io.dyna import write_keyword
from chladni.io.vtu import write_vtu
from chladni_specimens.plates import folded_panel, plate

pyvista = pytest.importorskip("pyvista")


def test_a_model_has_its_mesh():
    model = chladni.load(folded_panel(h=0.1))
    mesh, made = model.mesh, model.assembly
    assert isinstance(mesh, pyvista.UnstructuredGrid)
    np.testing.assert_array_equal(mesh["grid"], made.ids)
    np.testing.assert_array_equal(mesh.points, made.points)
    assert set(mesh["part"]) == {p.id for p in made.parts}
    order = np.argsort(mesh["element"])
    np.testing.assert_array_equal(mesh["element"][order], np.sort(made.shells.ids))
    np.testing.assert_allclose(mesh["thickness"], 1e-3)
    area = mesh.compute_cell_sizes()["Area"].sum()
    assert area == pytest.approx(element_volumes(made).sum() / 1e-3, rel=1e-3)


def test_a_file_for_paraview_has_the_same_arrays(tmp_path):
    model = chladni.load(folded_panel(h=0.1))
    theirs, ours = pyvista.read(write_vtu(tmp_path / "a.vtu", model.assembly)), model.mesh
    for name in ours.array_names:
        np.testing.assert_array_equal(theirs[name], ours[name], err_msg=name)


@pytest.mark.parametrize("make", [lambda: folded_panel(h=0.1), block_with_a_mast])
def test_a_mode_has_its_energy(make):
    """Σ_e ½ φᵀ K_e φ = ½ ω² of shells, solids and beams; the density times volume adds up to it."""
    model = chladni.load(make())
    found = model.modes(9)
    k = int(np.flatnonzero(~found.rigid)[0]) + 1
    mesh = found.mesh(k)
    assert mesh["frequency"] == pytest.approx([found.frequency[k - 1]])
    whole = (2 * np.pi * found.frequency[k - 1]) ** 2 / 2
    volume = element_volumes(model.assembly)
    phi = found.shapes[:, [k - 1]]
    assert element_energies(structure(model.assembly), phi).sum() == pytest.approx(whole, rel=1e-6)
    row = np.concatenate([c.row for c in _cells(model.assembly)])
    assert mesh["strain_energy_density"] @ volume[row] == pytest.approx(whole, rel=1e-6)
    np.testing.assert_allclose(mesh["shape"], model.motion(phi)[:, :, 0])


def _cells(assembly):
    from chladni.geometry.mesh_cells import mesh_cells

    return mesh_cells(assembly)


def test_rigid_modes_have_no_energy_and_others_do_not_exist():
    found = chladni.load(plate(0.3, 0.2, 3, 2, 1e-3)).modes(8)
    assert not found.mesh(1)["strain_energy_density"].any()
    says("no mode 9; there are 1 to 8", found.mesh, 9)


def test_mapped_thickness_is_on_the_mesh(tmp_path):
    made = plate(0.3, 0.2, 3, 2, 1e-3)
    t = np.full(made.shells.nodes.shape, 0.9e-3)
    part = np.ones(len(made.shells), int)
    formed = FormedMesh(made.ids, made.points, made.shells.nodes, part, t, {1: made.parts[0].name})
    write_keyword(tmp_path / "a.k", formed)
    mesh = chladni.map_formed(made, tmp_path / "a.k", "mm-t-s").mesh
    np.testing.assert_allclose(mesh["thickness"], 0.9e-3, rtol=1e-3)
    np.testing.assert_allclose(mesh["thickness_before"], 1e-3)
