"""MAT9: the stiffness of a solid in axes of its own."""

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.effects.calibration_parameters import with_scaled
from chladni.fem.assemble import structure
from chladni.fem.solid import elasticity
from chladni.io.nastran import assembly, read_deck, write_assembly
from chladni.io.nastran.edit.changed_deck import write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.properties import Isotropic
from chladni.units import UNITS

from .conftest import CUBE

MM = UNITS["mm-t-s"]
AXES = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
AXES[2] *= np.linalg.det(AXES)
S = np.zeros((6, 6))  # of wood: E 12000, 900, 500, G 700, 40, 800 N/mm²
S[:3, :3] = [[1 / 12000, -0.4 / 12000, -0.5 / 12000],
             [-0.4 / 12000, 1 / 900, -0.4 / 900],
             [-0.5 / 12000, -0.4 / 900, 1 / 500]]  # fmt: skip
S[3:, 3:] = np.diag([1 / 700, 1 / 40, 1 / 800])
WOOD = np.linalg.inv(S)


def mat9(C):
    upper = C[np.triu_indices(6)].tolist()
    return f"MAT9,5,{','.join(repr(x) for x in upper)},5.-10,,,,,,,,.02\n"


def cube(C, cordm=""):
    rows = AXES
    system = f"CORD2R,4,,0.,0.,0.,{','.join(map(repr, (rows[2]).tolist()))},"
    system += ",".join(map(repr, rows[0].tolist())) + "\nCORD2C,6,,0.,0.,0.,0.,0.,1.,1.,0.,0.\n"
    return CUBE.replace("MAT1,5,1.,,.3\n", mat9(C)).replace("PSOLID,1,5", f"PSOLID,1,5,{cordm}") + (
        system
    )


def test_an_isotropic_stiffness_is_that_of_mat1(bulk):
    C = elasticity(Isotropic(2.1e5, 0.3))
    one = structure(assembly(bulk(cube(C)), MM)).system.K
    text = CUBE.replace("MAT1,5,1.", "MAT1,5,2.1+5")
    assert abs(one - structure(assembly(bulk(text), MM)).system.K).max() < 1e-9 * abs(one).max()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_youngs_modulus_along_the_axes_of_cordm(bulk, axis):
    """ε = S σ in the material's axes: uniaxial stress along axis i stretches by 1/E_i."""
    C = assembly(bulk(cube(WOOD, "4")), MM).parts[0].section.material.C / 1e6
    e = AXES[axis]
    stress = np.outer(e, e)
    strain = np.linalg.solve(C, stress[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]])
    x, y, z, xy, yz, zx = strain
    tensor = np.array([[x, xy / 2, zx / 2], [xy / 2, y, yz / 2], [zx / 2, yz / 2, z]])
    assert e @ tensor @ e == pytest.approx(S[axis, axis])
    own = AXES @ tensor @ AXES.T
    np.testing.assert_allclose(np.diag(own), S[:3, axis], rtol=1e-9)
    assert np.abs(own - np.diag(np.diag(own))).max() < 1e-9 * S[2, 2]


def test_shear_of_each_plane_is_its_own(bulk):
    """The order of MAT9 is xx, yy, zz, xy, yz, zx."""
    C = assembly(bulk(cube(WOOD)), MM).parts[0].section.material.C / 1e6
    np.testing.assert_allclose(np.diag(C)[3:], [700, 40, 800])


def test_its_change_is_written_in_its_own_axes(bulk, tmp_path):
    deck = bulk(cube(WOOD, "4"))
    before = assembly(deck, MM)
    after = with_scaled(with_scaled(before, 1.2, "E", (0,)), 0.9, "rho", (0,))
    path = write_deck(deck, tmp_path / "new.bdf", changes(deck, before, after, MM))
    found = assembly(read_deck(path), MM).parts[0].section.material
    np.testing.assert_allclose(found.C, 1.2 * before.parts[0].section.material.C, atol=5e3)
    assert found.rho == pytest.approx(0.9 * 500, rel=1e-6)
    assert changes(deck, before, assembly(deck, MM), MM) == []


def test_it_comes_back_from_a_fresh_deck(bulk, tmp_path):
    made = assembly(bulk(cube(WOOD, "4")), MM)
    path = write_assembly(made, tmp_path / "fresh.bdf", MM)
    one, other = (a.parts[0].section.material for a in (made, assembly(read_deck(path), MM)))
    np.testing.assert_allclose(one.C, other.C, atol=1e-9 * one.C.max())
    assert (one.rho, one.damping) == pytest.approx((other.rho, other.damping))


@pytest.mark.parametrize(
    ("cordm", "said"),
    [("-1", "CORDM -1: the element's own axes, is not"), ("6", "CORDM 6: system 6, which is curv")],
)
def test_axes_that_are_not_understood(bulk, cordm, said):
    says(f"PSOLID 1: {said}", assembly, bulk(cube(WOOD, cordm)), MM)


def test_a_stiffness_that_is_not_positive(bulk):
    says("MAT9 5: its stiffness matrix is not pos", assembly, bulk(cube(np.diag([-1.0] * 6))), MM)
