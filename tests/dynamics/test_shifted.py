"""The factor of a shifted stiffness: right, and ordered by nodes."""

import numpy as np
from numpy.testing import assert_allclose

from chladni.dynamics.reduction import shifted
from chladni.fem.assemble import structure
from chladni_specimens.plates import plate


def test_it_solves_and_keeps_the_dofs_of_a_node_together():
    built = structure(plate(0.4, 0.3, 12, 9, 1.5e-3))
    system = built.system
    A = system.K + (2 * np.pi * 20.0) ** 2 * system.M
    b = np.cos(np.arange(len(system.dofs)))
    factor = shifted(system, 20.0)
    assert_allclose(A @ factor.solve(b), b, atol=1e-6)
    node = system.dofs[factor.fronts.order, 0]
    assert np.count_nonzero(np.diff(node)) == len(set(node.tolist())) - 1
