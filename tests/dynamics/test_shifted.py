"""The factor of a shifted stiffness: right, and ordered by nodes."""

import numpy as np
from numpy.testing import assert_allclose

from chladni.dynamics.reduction import shifted
from chladni.fem.assemble import structure
from chladni_specimens.plates import plate


def test_it_solves_and_keeps_the_coupled_dofs_of_a_node_together():
    """In a flat sheet along the axes motion in its plane and across it are two problems."""
    built = structure(plate(0.4, 0.3, 12, 9, 1.5e-3))
    system = built.system
    A = system.K + (2 * np.pi * 20.0) ** 2 * system.M
    b = np.cos(np.arange(len(system.dofs)))
    factor = shifted(system, 20.0)
    assert_allclose(A @ factor.solve(b), b, atol=1e-6)
    dofs = system.dofs[factor.fronts.order]
    for field in ((1, 2, 6), (3, 4, 5)):
        at = np.flatnonzero(np.isin(dofs[:, 1], field))
        vertex = 1000 * dofs[at, 0] + np.cumsum(np.diff(at, prepend=-1) != 1)
        assert len(set(vertex.tolist())) == len(set(dofs[:, 0].tolist()))
