"""Loss factors of parts follow from the damping of modes that they have a share in."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.identified_damping import SCATTER
from chladni.fem.energy import part_energies
from chladni.fem.modelled import modelled
from chladni.search.left_frequencies import damping_by_part, loss_factors
from chladni_specimens import folded_panel


def test_damping_of_one_material_is_its_loss_factor():
    share = np.random.default_rng(1).dirichlet(np.ones(3), size=8).T
    assert_allclose(loss_factors(share, np.full(8, 0.005))[0], 0.01)


def test_scatter_of_the_modes_is_the_stated_uncertainty():
    rng = np.random.default_rng(2)
    share, eta = rng.dirichlet(np.ones(2), size=12).T, np.array([0.02, 0.05])
    zeta = eta @ share / 2
    off = []
    for _ in range(400):
        found, sd = loss_factors(share, zeta * (1 + 0.2 * SCATTER * rng.normal(size=12)))
        off.append((found - eta) / sd)
    assert np.std(off, axis=0) == pytest.approx([0.2, 0.2], rel=0.15)


def test_a_part_never_has_negative_damping():
    share = np.array([[0.9, 0.5, 0.1], [0.1, 0.5, 0.9]])
    assert loss_factors(share, np.array([0.01, 0.002, 0.0001]))[0].min() == 0


def test_parts_of_a_panel_are_told_apart():
    model = modelled(folded_panel(h=0.05), 300.0)
    flexible = np.flatnonzero(model.modes.frequency > 1.0)
    share = part_energies(model.structure, model.modes.shapes[:, flexible])
    zeta = np.array([0.004, 0.04]) @ share / 2
    rows = [
        SimpleNamespace(after_hz=float(f), damping=float(z))
        for f, z in zip(model.modes.frequency[flexible], zeta, strict=True)
    ]
    found = {d.part: d for d in damping_by_part(rows, model)}
    assert found["panel"].loss_factor == pytest.approx(0.004, rel=1e-6)
    assert found["flanges"].loss_factor == pytest.approx(0.04, rel=1e-6)
    assert found["panel"].low <= 0.004 <= found["panel"].high
    assert damping_by_part(rows[:1], model) == ()  # one mode for two parts
    rows = [SimpleNamespace(after_hz=r.after_hz, damping=None) for r in rows]
    assert damping_by_part(rows, model) == ()
