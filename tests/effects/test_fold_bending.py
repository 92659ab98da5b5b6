"""Folds are found by the angle of facets alone; a factor on their bending moves nothing else."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import Parameter
from chladni.effects.element_groups import element_groups
from chladni.effects.model_errors import FoldBending, fold_bending
from chladni.fem.assemble import structure
from chladni.geometry.folds import share_at_folds
from chladni.reduced.reduced_model import evaluate, reduce
from chladni_specimens.plates import box, folded_panel, grid, plate


def strip(angles):
    """A strip of four shells along x, then as many turned by each angle [degrees]."""
    slope = np.radians(np.repeat(np.cumsum([0.0, *angles]), 4))
    x = np.concatenate([[0.0], np.cumsum(np.cos(slope))])
    z = np.concatenate([[0.0], np.cumsum(np.sin(slope))])
    points, cells = grid(np.arange(len(x), dtype=float), np.array([0.0, 1.0]))
    along = points[:, 0].astype(int)
    return np.stack([x[along], points[:, 1], z[along]], axis=1), cells


@pytest.mark.parametrize(
    ("angle", "folds"), [(0, 0), (15, 0), (25, 1), (90, 1), (155, 1), (180, 0)]
)
def test_a_fold_is_where_facets_face_elsewhere(angle, folds):
    """Two shells beside it have two of their corners there, whichever side they show."""
    points, cells = strip([angle])
    share = share_at_folds(points, cells)
    assert share.sum() == pytest.approx(folds * 2 * 0.5)
    turned = cells.copy()
    turned[::3] = turned[::3, ::-1]
    assert_allclose(share_at_folds(points, turned), share)


def test_a_curved_sheet_has_none_once_its_mesh_is_fine_enough():
    assert share_at_folds(*strip([30.0] * 3)).max() > 0
    assert share_at_folds(*strip([10.0] * 9)).max() == 0


@pytest.mark.parametrize("angle", [22.5, 30.0, 45.0])
def test_a_coarse_cylinder_has_none_but_one_that_stands_out(angle):
    """A factor on its bending would be one on E of the part."""
    phi = np.radians(angle) * np.arange(9)
    points, cells = grid(phi, np.linspace(0.0, 1.0, 3))
    bent = np.column_stack([np.cos(points[:, 0]), points[:, 1], np.sin(points[:, 0])])
    assert share_at_folds(bent, cells).max() == 0
    dented = np.where((points[:, 0] == phi[4])[:, None], bent * [0.6, 1.0, 0.6], bent)
    assert share_at_folds(dented, cells).max() > 0


def test_flat_parts_have_no_factor_and_folded_ones_one_each():
    flat, bent, closed = (
        plate(0.4, 0.3, 8, 6, 1e-3), folded_panel(0.3, 0.2, 0.02, 0.004, 0.02, 1e-3), box(),
    )  # fmt: skip
    assert fold_bending(element_groups(structure(flat))) == []
    for made in (bent, closed):
        groups = element_groups(structure(made))
        found = fold_bending(groups)
        assert [f.text for f in found] == [f"bending at folds of {p.name}" for p in made.parts]
        for f in found:
            assert 0 < f.functions.max() <= 1
            assert np.ptp(groups.part[f.functions[:, 0] > 0]) == 0


def test_of_a_flat_plate_the_factor_goes_with_the_square_of_frequencies():
    """Bending alone carries them: as E does, and the mass is as it was."""
    groups = element_groups(structure(plate(0.4, 0.3, 10, 8, 1e-3)))
    model = reduce(groups, normal_modes(groups.structure.system, band=400.0).shapes)
    everywhere = np.ones((len(groups), 1))
    unknown = Parameter("k", "-", 0.0, 1.0)
    bent = FoldBending((unknown,), "all", quantity="bending", functions=everywhere)
    nominal, states = evaluate(model, [], np.zeros(0), False), []
    for effect in (bent, calibration_parameter(groups, "E", [0])):
        states.append(evaluate(model, [effect], np.array([0.2]), False))
    flexible = nominal.lam > 1.0
    ratio = states[0].lam[flexible] / nominal.lam[flexible]
    assert_allclose(ratio, np.exp(0.2), rtol=2e-3)  # transverse shear is not bending
    assert_allclose(states[0].lam[flexible], states[1].lam[flexible], rtol=2e-3)
    assert states[0].weight == nominal.weight
