"""The model of a case seen through its sensors: rows, responses, places of the test."""

from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from ..case import Case
from ..dynamics.coupled import coupled_receptance
from ..dynamics.frf import FRF, residual_flexibility
from ..errors import FileError
from ..fem.assemble import Structure
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled, node_points
from ..fem.solve import inertia_load

if TYPE_CHECKING:
    from ..view.scene import Marker

DAMPING = 0.01  # where neither case nor test says
REACH = 3.0  # times the band: the two-term residual is then right to (1/3)⁴ of itself


def model_frf(case: Case, model: Modelled, damping: float, test: FRF) -> FRF:
    """The model's responses on the lines, labels and quantity of a recording.

    Modes up to ``REACH`` times the highest line, the static rest of the others.
    """
    s, f = model.structure, test.frequency
    modal = model.modes.with_damping(damping)
    pick = case.outputs.rows(s).T.toarray()
    load, carried = _drives(case, s)
    rest = residual_flexibility(s.system, modal, pick, load, points=node_points(s))
    phi_o, phi_i = pick.T @ modal.shapes, load.T @ modal.shapes
    loss = sp.csr_array(s.hysteretic().K.imag)
    H = coupled_receptance(modal, phi_o, phi_i, f, V=s.system.V, loss=loss, residual=rest)
    if not case.inputs.base.any():
        return FRF(H, f, test.outputs, test.inputs).to(test.quantity)
    T = carried - (2 * np.pi * f)[:, None, None] ** 2 * H
    return FRF(T, f, test.outputs, test.inputs, "transmissibility")


def _drives(case: Case, s: Structure) -> tuple[np.ndarray, np.ndarray]:
    """Loads (n_free, n_in) and the motion each carries along rigidly (n_out, n_in)."""
    base = case.inputs.base
    if base.any() and not base.all():
        raise FileError(f"{case.path}: forces and a moving base cannot be inputs together")
    if not base.any():
        return case.inputs.rows(s).T.toarray(), np.zeros(1)
    axes = case.inputs.directions.T  # (3, n_in)
    load = s.T.T @ inertia_load(s.assembly, -axes)
    return np.asarray(load), case.outputs.directions @ axes


def markers(dofs: MeasuredDofs) -> list["Marker"]:
    """Sensors and shakers for a picture; the base has no place."""
    from ..view.scene import Marker

    return [
        Marker((x[0], x[1], x[2]), (n[0], n[1], n[2]), text)
        for x, n, text, base in zip(
            dofs.points.tolist(),
            dofs.directions.tolist(),
            dofs.labels,
            dofs.base,
            strict=True,
        )
        if not base
    ]
