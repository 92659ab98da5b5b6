"""Static displacements and subcases of a deck, as the results of other solvers list them."""

from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import spsolve

from chladni.fem.assemble import structure
from chladni.fem.solve import inertia_load


def static(built, load):
    """Displacements u = T K⁻¹ Tᵀ f (6n, k) [m, rad] under loads f (6n, k) [N, N m]."""
    q = spsolve(built.system.K.tocsc(), built.T.T @ load)
    return built.T @ q.reshape(-1, load.shape[1])


def subcase_statics(assembly, analysis, case):
    """Displacements (6n, 1) of one static subcase: its loads, weight and moved supports."""
    load = np.zeros((6 * len(assembly.ids), 1))
    if chosen := analysis.loads.get(case.load):
        np.add.at(load[:, 0], 6 * chosen.rows + chosen.components - 1, chosen.values)
        if np.any(chosen.gravity):
            load += inertia_load(assembly, chosen.gravity[:, None])
    moved = [analysis.prescribed[k] for k in {case.load, case.spc} if k in analysis.prescribed]
    if not moved:
        return static(structure(assembly), load)
    dofs = np.vstack([np.column_stack([m.rows, m.components]) for m in moved])
    held = assembly.supports[~(assembly.supports[:, None] == dofs).all(axis=2).any(axis=1)]
    built = structure(replace(assembly, supports=held))
    pick = built.rows(np.column_stack([assembly.ids[dofs[:, 0]], dofs[:, 1]]))
    q = pick.T @ np.concatenate([m.values for m in moved])[:, None]
    free = np.setdiff1d(np.arange(len(q)), pick.indices)
    K = built.system.K
    q[free, 0] = spsolve(K[free][:, free].tocsc(), (built.T.T @ load - K @ q)[free, 0])
    return built.T @ q


def motion_at(assembly, dofs, u):
    """Components of u (6n, k) at (point id, component 1-6) in displacement frames (n_out, k)."""
    at, component = assembly.rows(dofs[:, 0]), dofs[:, 1] - 1
    first = 6 * at + 3 * (component // 3)
    axes = np.eye(3)[component % 3]
    if assembly.axes is not None:
        axes = assembly.axes[at, component % 3]
    return np.einsum("oi,oik->ok", axes, u[first[:, None] + np.arange(3)])
